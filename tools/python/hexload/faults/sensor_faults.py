"""Faults of sensors and wiring: what one leg, or all, show instead of what is.

Each function takes a recording, a size and a generator, from which leg, sign and moment are drawn, and returns another
recording. `channel` is displacement, velocity or force.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hexload.campaign.cases import with_noise
from hexload.faults.recording import (
    TICK_S,
    Recording,
    in_channel,
    noise_of,
    with_channel,
    with_order,
)
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]
Random = np.random.Generator

SPIKES = 0.002  # share of ticks
LOOSE = 0.001  # share of ticks in which a loose plug loses contact
HYSTERESIS_N = 20.0  # change of a force after which its sensor's hysteresis has turned round
MAINS_HZ = 50.0
PULSE_S = 0.5  # for which a zero is off
BURST_S, BURSTS_1_S = 0.05, 1.0  # of noise
PITCH_M = 5e-3  # of a screw or a scale
REST_S = 1e3  # a duration that lasts to the end of every log
MIRRORED = (5, 4, 3, 2, 1, 0)


def stuck(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg shows its last value for `size` s."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    rows = event_rows(recording, size, random)
    values[rows, leg] = values[rows.start, leg]
    return with_channel(recording, channel, values)


def dead(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg shows zero for `size` s."""
    values = in_channel(recording, channel)
    values[event_rows(recording, size, random), random.integers(LEGS)] = 0.0
    return with_channel(recording, channel, values)


def drift(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's zero moves by `size` units a second, up or down."""
    values = in_channel(recording, channel)
    values[:, random.integers(LEGS)] += size * sign(random) * recording.t_s
    return with_channel(recording, channel, values)


def spikes(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg is off by `size` in single ticks, up and down."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    hit = random.uniform(size=len(values)) < SPIKES
    values[hit, leg] += size * random.choice([-1.0, 1.0], int(hit.sum()))
    return with_channel(recording, channel, values)


def saturated(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's converter ends `size` of the way from the mean to the extremes of what it should show."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    middle = values[:, leg].mean()
    reach = size * np.abs(values[:, leg] - middle).max()
    values[:, leg] = np.clip(values[:, leg], middle - reach, middle + reach)
    return with_channel(recording, channel, values)


def quantised(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    """All legs show multiples of `size`."""
    return with_channel(recording, channel, size * np.round(in_channel(recording, channel) / size))


def negated(recording: Recording, _size: float, random: Random, channel: str) -> Recording:
    """One leg's sign is wrong."""
    values = in_channel(recording, channel)
    values[:, random.integers(LEGS)] *= -1.0
    return with_channel(recording, channel, values)


def swapped(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """Two legs' plugs of one channel are exchanged; `size` legs apart in number."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    pair = [leg, (leg + int(size)) % LEGS]
    values[:, pair] = values[:, pair[::-1]]
    return with_channel(recording, channel, values)


def renumbered(recording: Recording, size: float, _: Random) -> Recording:
    """In all channels the legs are counted from another one, `size` further."""
    return with_order(recording, np.roll(np.arange(LEGS), int(size)).tolist())


def mirrored(recording: Recording, _size: float, _random: Random) -> Recording:
    """In all channels the legs are counted the other way round."""
    return with_order(recording, MIRRORED)


def exchanged_legs(recording: Recording, size: float, random: Random) -> Recording:
    """Two legs are exchanged in all channels; `size` legs apart in number."""
    leg = random.integers(LEGS)
    pair = [leg, (leg + int(size)) % LEGS]
    order = np.arange(LEGS)
    order[pair] = pair[::-1]
    return with_order(recording, order.tolist())


def loose(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's plug is loose: now and then it shows zero for `size` s."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    for start in np.flatnonzero(random.uniform(size=len(values)) < LOOSE):
        values[start : start + round(size / TICK_S), leg] = 0.0
    return with_channel(recording, channel, values)


def zero_step(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's zero jumps by `size` in mid-run."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    values[event_rows(recording, REST_S, random), leg] += size * sign(random)
    return with_channel(recording, channel, values)


def zero_pulse(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's zero is off by `size` for half a second in mid-run."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    values[event_rows(recording, PULSE_S, random), leg] += size * sign(random)
    return with_channel(recording, channel, values)


def gain_step(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's gain becomes 1 + or - `size` in mid-run."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    values[event_rows(recording, REST_S, random), leg] *= 1.0 + size * sign(random)
    return with_channel(recording, channel, values)


def wander(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """All zeros wander, each by itself: after a second by `size`, after four by twice that (one sigma)."""
    values = in_channel(recording, channel)
    steps = size * np.sqrt(TICK_S) * random.normal(size=values.shape)
    return with_channel(recording, channel, values + np.cumsum(steps, axis=0))


def bent(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg's characteristic is a parabola: off by `size` of the reading at its largest one."""
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    largest = np.abs(values[:, leg]).max()
    values[:, leg] += size * sign(random) * values[:, leg] ** 2 / largest
    return with_channel(recording, channel, values)


def crosstalk(recording: Recording, size: float, _: Random) -> Recording:
    """Each force shows a share `size` of the next leg's too."""
    values = in_channel(recording, "force")
    return with_channel(recording, "force", values + size * np.roll(values, -1, axis=1))


def hysteresis(recording: Recording, size: float, _: Random) -> Recording:
    """All forces lag behind themselves by `size` of the largest: upwards they show less, downwards more."""
    true = recording.clean.force_n
    behind = _play(true, HYSTERESIS_N) - true  # within +-HYSTERESIS_N
    largest = np.abs(true).max()
    return with_channel(recording, "force", in_channel(recording, "force") + size * largest / HYSTERESIS_N * behind)


def periodic(recording: Recording, size: float, random: Random) -> Recording:
    """Displacements are off by a sine of amplitude `size` that repeats with each turn of a screw, or mark of a scale."""
    phase = random.uniform(0.0, 2.0 * np.pi, LEGS)
    wave = np.sin(2.0 * np.pi * recording.clean.displacement_m / PITCH_M + phase)
    return with_channel(recording, "displacement", in_channel(recording, "displacement") + size * wave)


def backlash(recording: Recording, size: float, _: Random) -> Recording:
    """All displacement sensors have a play of `size` m: half of it behind, either way."""
    shown = _play(recording.clean.displacement_m, 0.5 * size)
    return with_channel(recording, "displacement", shown + noise_of(recording, "displacement"))


def _play(values: Array, half: float) -> Array:
    """What is dragged along within +-half (n, 6)."""
    dragged = np.empty_like(values)
    now = values[0]
    for k, value in enumerate(values):
        dragged[k] = now = np.clip(now, value - half, value + half)
    return dragged


def bias_one(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    values = in_channel(recording, channel)
    values[:, random.integers(LEGS)] += size * sign(random)
    return with_channel(recording, channel, values)


def bias_all(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """The same on all legs."""
    return with_channel(recording, channel, in_channel(recording, channel) + size * sign(random))


def gain_one(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg shows 1 + or - `size` times what it should."""
    values = in_channel(recording, channel)
    values[:, random.integers(LEGS)] *= 1.0 + size * sign(random)
    return with_channel(recording, channel, values)


def gain_all(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    return with_channel(recording, channel, in_channel(recording, channel) * (1.0 + size * sign(random)))


def unit(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    """Another unit than SI: all legs show `size` times what they should."""
    return with_channel(recording, channel, in_channel(recording, channel) * size)


def noise(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    """All legs' noise is `size` times the stated one."""
    values = in_channel(recording, channel) + (size - 1.0) * noise_of(recording, channel)
    return with_channel(recording, channel, values)


def bursts(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """All legs' noise is `size` times the stated one for 50 ms at a time, once in a second."""
    is_burst = np.zeros(len(recording.t_s), bool)
    for start in np.flatnonzero(random.uniform(size=len(is_burst)) < BURSTS_1_S * TICK_S):
        is_burst[start : start + round(BURST_S / TICK_S)] = True
    more = (size - 1.0) * noise_of(recording, channel) * is_burst[:, None]
    return with_channel(recording, channel, in_channel(recording, channel) + more)


def hum(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """Mains on all legs, of amplitude `size`, each with its own phase."""
    phase = random.uniform(0.0, 2.0 * np.pi, LEGS)
    wave = np.sin(2.0 * np.pi * MAINS_HZ * recording.t_s[:, None] + phase)
    return with_channel(recording, channel, in_channel(recording, channel) + size * wave)


def not_numbers(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    """One leg shows NaN in a share of the ticks; the first is spared, as a log without velocities looks like that."""
    values = in_channel(recording, channel)
    hit = random.uniform(size=len(values)) < size
    hit[0] = False
    values[hit, random.integers(LEGS)] = np.nan
    return with_channel(recording, channel, values)


def stated_noise(recording: Recording, size: float, _: Random) -> Recording:
    """The platform file states `size` times the noise that the sensors have."""
    return replace(
        recording, platform=recording.platform | {"sensors": with_noise(recording.platform["sensors"], size)}
    )


def sign(random: Random) -> float:
    return float(random.choice([-1.0, 1.0]))


def event_rows(recording: Recording, duration_s: float, random: Random) -> slice:
    """From somewhere in the middle of the run."""
    rows = len(recording.t_s)
    start = int(random.uniform(0.35, 0.6) * rows)
    return slice(start, min(rows, start + max(1, round(duration_s / TICK_S))))
