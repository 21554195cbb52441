"""Faults of time: channels that are late, filtered or held, clocks, rows that are lost, doubled, shuffled or frozen.

Functions as in sensor_faults. What is read at another moment is the clean signal there; the noise stays that of its row.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt, sosfilt_zi

from hexload.faults.recording import (
    TICK_S,
    Recording,
    channels_of,
    in_channel,
    noise_of,
    with_channel,
    with_log,
)
from hexload.faults.sensor_faults import event_rows, sign
from hexload.io.log_file import CHANNEL_KEYS
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]
Random = np.random.Generator


def late(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    """All legs of the channel are `size` s older than their rows say."""
    return with_channel(recording, channel, _read_at(recording, channel, recording.t_s - size))


def late_leg(recording: Recording, size: float, random: Random, channel: str) -> Recording:
    values, leg = in_channel(recording, channel), random.integers(LEGS)
    values[:, leg] = _read_at(recording, channel, recording.t_s - size)[:, leg]
    return with_channel(recording, channel, values)


def low_pass(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    """A second-order Butterworth filter of `size` Hz, noise and all."""
    values = in_channel(recording, channel)
    sections = butter(2, size, fs=1.0 / TICK_S, output="sos")
    start = sosfilt_zi(sections)[:, :, None] * values[0]
    return with_channel(recording, channel, sosfilt(sections, values, axis=0, zi=start)[0])


def jitter(recording: Recording, size: float, random: Random) -> Recording:
    """Each row is read `size` s (one sigma) off the time that it tells."""
    read_s = recording.t_s + size * random.normal(size=len(recording.t_s))
    return _with_all_read_at(recording, read_s)


def clock(recording: Recording, size: float, random: Random) -> Recording:
    """The log's clock is fast or slow by a share `size`."""
    return _told(recording, recording.t_s * (1.0 + size * sign(random)))


def clock_jump(recording: Recording, size: float, random: Random) -> Recording:
    """In mid-run the clock jumps ahead by `size` s, and nothing happens meanwhile."""
    t_s = recording.t_s.copy()
    t_s[event_rows(recording, 0.0, random).start :] += size
    return _told(recording, t_s)


def held(recording: Recording, size: float, _: Random) -> Recording:
    """New values every `size` ticks only, in between the old ones."""
    kept = np.arange(len(recording.t_s)) // int(size) * int(size)
    return with_log(recording, recording.t_s, [part[kept] for part in channels_of(recording.log)])


def held_channel(recording: Recording, size: float, _: Random, channel: str) -> Recording:
    kept = np.arange(len(recording.t_s)) // int(size) * int(size)
    return with_channel(recording, channel, in_channel(recording, channel)[kept])


def slow_sampling(recording: Recording, size: float, _: Random) -> Recording:
    """A row every `size` ticks, with its true time."""
    return _rows(recording, np.arange(0, len(recording.t_s), int(size)))


def lost(recording: Recording, size: float, random: Random) -> Recording:
    """A share `size` of the rows is not there."""
    return _rows(recording, np.flatnonzero(random.uniform(size=len(recording.t_s)) >= size))


def lost_stretch(recording: Recording, size: float, random: Random) -> Recording:
    """`size` s without rows."""
    return _rows(recording, np.delete(np.arange(len(recording.t_s)), event_rows(recording, size, random)))


def lost_bursts(recording: Recording, size: float, random: Random) -> Recording:
    """Rows are lost in bursts of `size` s, two a second."""
    is_lost = np.zeros(len(recording.t_s), bool)
    for start in np.flatnonzero(random.uniform(size=len(is_lost)) < 2.0 * TICK_S):
        is_lost[start + 1 : start + 1 + round(size / TICK_S)] = True  # the first row is spared
    return _rows(recording, np.flatnonzero(~is_lost))


def differentiated(recording: Recording, size: float, _: Random) -> Recording:
    """There are no velocity sensors: the log's velocities are differences of the displacements, through a low-pass of `size` Hz."""
    shown = in_channel(recording, "displacement")
    steps = np.diff(shown, axis=0, prepend=shown[:1]) / TICK_S
    sections = butter(2, size, fs=1.0 / TICK_S, output="sos")
    start = sosfilt_zi(sections)[:, :, None] * steps[1]
    return with_channel(recording, "velocity", sosfilt(sections, steps, axis=0, zi=start)[0])


def doubled(recording: Recording, size: float, random: Random) -> Recording:
    """A share `size` of the rows comes twice, with the same time."""
    times = 1 + (random.uniform(size=len(recording.t_s)) < size)
    return _rows(recording, np.repeat(np.arange(len(recording.t_s)), times))


def repeated(recording: Recording, size: float, random: Random) -> Recording:
    """A share `size` of the rows has the values of the row before, under its own time."""
    rows = np.arange(len(recording.t_s))
    rows[1:] -= random.uniform(size=len(rows) - 1) < size
    return with_log(recording, recording.t_s, [part[rows] for part in channels_of(recording.log)])


def shuffled(recording: Recording, size: float, random: Random) -> Recording:
    """A share `size` of the rows changes places with the next one, time and all."""
    return _rows(recording, _swapped_neighbours(len(recording.t_s), size, random))


def shuffled_values(recording: Recording, size: float, random: Random) -> Recording:
    """The same, but the times stay in order."""
    order = _swapped_neighbours(len(recording.t_s), size, random)
    return with_log(recording, recording.t_s, [part[order] for part in channels_of(recording.log)])


def frozen(recording: Recording, size: float, random: Random) -> Recording:
    """For `size` s all channels show the same row under times that go on."""
    rows = np.arange(len(recording.t_s))
    event = event_rows(recording, size, random)
    rows[event] = event.start
    return with_log(recording, recording.t_s, [part[rows] for part in channels_of(recording.log)])


def _read_at(recording: Recording, channel: str, read_s: Array) -> Array:
    clean = getattr(recording.clean, CHANNEL_KEYS[channel])
    values = np.stack([np.interp(read_s, recording.t_s, clean[:, leg]) for leg in range(LEGS)], axis=1)
    return values + noise_of(recording, channel)


def _with_all_read_at(recording: Recording, read_s: Array) -> Recording:
    return with_log(recording, recording.t_s, [_read_at(recording, channel, read_s) for channel in CHANNEL_KEYS])


def _told(recording: Recording, t_s: Array) -> Recording:
    """Rows and changes of the load at the times that another clock tells."""
    changes_s = tuple(tuple(np.interp(change, recording.t_s, t_s).tolist()) for change in recording.changes_s)
    return replace(with_log(recording, t_s, channels_of(recording.log)), changes_s=changes_s)


def _rows(recording: Recording, rows: NDArray[np.intp]) -> Recording:
    return with_log(recording, recording.log.t_s[rows], [part[rows] for part in channels_of(recording.log)])


def _swapped_neighbours(count: int, share: float, random: Random) -> NDArray[np.intp]:
    order = np.arange(count)
    first = np.arange(1, count - 1, 2)
    first = first[random.uniform(size=len(first)) < 2.0 * share]
    order[first], order[first + 1] = first + 1, first
    return order
