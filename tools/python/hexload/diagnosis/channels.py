"""What each sensor's own samples tell: rows held, frozen, missing; values stuck, cut off, in steps, with spikes, hum, noise.

Third differences leave of a smooth signal next to nothing and of white noise twenty times its variance; their median
gives the noise, whatever few values do.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.cause import CHANNELS, Cause, Channel, Defect
from hexload.diagnosis.dynamics import Machine
from hexload.diagnosis.finding import SIGMAS, Finding, legs_in_words, plain
from hexload.diagnosis.record import LONG_GAP, Record
from hexload.io.log_file import CHANNEL_KEYS, LegLog
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

THIRD = np.sqrt(20.0)  # of the noise, in third differences
MAD = 1.4826  # standard deviations per median absolute value
SLOW_S, HARMFUL_S = 2.5e-3, 10e-3
MISSING_SHARE = 5e-4
CLOCK_ROWS = 12  # on either side of a gap, of which a line is made
CLOCK_NOISE = 3.0  # times what the lines leave, by which they may miss each other between the rows
STUCK_S, FROZEN_S = 0.05, 0.03
LOOSE, LOOSE_TICKS = 3, 3  # how often a loose plug has shown zero, and for how long at least
LOOSE_STEPS, LOOSE_USUAL = 3.0, 0.99  # from how far: of the change from row to row that the channel's own seldom exceed
HELD_SHARE = 0.4  # of rows in which all legs repeat a channel's last value
REPEATED_SHARE = 0.003
STEPS_IN_SIGMAS = 0.9
SPIKE_SIGMAS, SPIKES = 9.0, 3
LIMIT_HITS = 12
LIMIT_NEXT = 6.0  # times the next level's, where values come in steps: where a motion turns it is 2.4
BURST_ROWS = 24
BURST_RATIO = 3.0  # of the usual size
BURSTS, BURST_SHARE = 3, 0.25  # how often at least, and in which share of the windows at most
LEAST_NOISE = 0.4
NOISE_RATIO = (0.6, 1.6)
QUIET = 0.28  # forces with less of the stated noise, all of it white, may be of another unit (EQUATIONS.md, P1)
WHITE = 0.85
JITTER_RATIO = 1.15
ALIKE_SQUARES = 2.31  # 1 + 2 sum of rho^2 of third differences of white noise: rho = -15/20, 6/20, -1/20
HUM_HZ = 25.0
HUM_POWER = 60.0  # of a line over the noise beside it
MOVING_LEGS = 35.0  # squares of six amplitudes in those of noise, Gamma(6, 1): chance is beyond once in 1e9 times
HUM_SIGMAS = 0.5  # of a sample: less does no harm
DERIVED = Cause(Defect.DERIVED, Channel.VELOCITY)
NOISE_BAND = (0.1, 0.4)  # of the rate of the rows: a displacement's differences are noise there
NOISE_ROWS, LEAST_SEGMENTS = 256, 4
LEAST_COMMON = 0.8  # coherence of velocities that are made of displacements; sensors have 0.01
TINY = 1e-300
STEADY = 0.6  # of the smaller half's amplitude to the larger one's


def look_at(record: Record, machine: Machine) -> Iterator[Finding]:
    log = record.raw
    yield from _rows(log)
    for name in CHANNELS:
        if name != Channel.VELOCITY or record.velocity_m_s is not None:
            yield from _missing(name, _values(log, name))
    frozen = list(_repeats(log))
    yield from frozen
    if frozen:
        return
    of_channels: list[Finding] = []
    noise: dict[Channel, float] = {}
    is_white: dict[Channel, bool] = {}
    for name in CHANNELS:
        values = _values(log, name)
        if not np.isfinite(values).any(axis=0).all():  # a leg without any is missing
            continue
        stated = sigma_of(machine, name)
        clean = np.stack(
            [np.interp(log.t_s, log.t_s[np.isfinite(leg)], leg[np.isfinite(leg)]) for leg in values.T], axis=1
        )
        steps = list(_steps(name, clean, stated))
        step = steps[0].size if steps else 0.0
        of_channels += [*(list(_loose(name, clean)) or _stops(name, log.t_s, clean, step / stated)), *steps]
        if not steps and not _is_held(clean) and record.dt_s < SLOW_S:
            # the largest values of bursts are no spikes
            of_channels += [*(list(_bursts(name, clean, stated)) or _spikes(name, clean, stated))]
            of_channels += _hum(name, clean, stated, record.dt_s)
            noise[name] = float(np.median(noise_of(clean))) / stated
            is_white[name] = _is_white(clean)
    of_channels = [each for each in of_channels if not _is_of_a_servo(each, record, machine)]
    is_in_order = not any(each.is_input for each in of_channels)  # else values are not of their times either
    if record.dt_s < SLOW_S and is_in_order:
        yield from _jitter(record, machine)
    yield from _made_of_displacements(record, machine)
    yield from of_channels
    yield from _noise(noise, is_white)


def sigma_of(machine: Machine, channel: Channel) -> float:
    return {
        Channel.DISPLACEMENT: machine.displacement_sigma_m,
        Channel.VELOCITY: machine.velocity_sigma_m_s,
        Channel.FORCE: machine.force_sigma_n,
    }[channel]


def with_own_noise(record: Record, machine: Machine) -> Machine:
    """Sigmas as the samples show them; a filter or coarse steps may hide them, so not much less than is stated."""
    if record.dt_s >= SLOW_S:  # the motion would be taken for noise
        return machine
    own = {}
    for channel, key in zip(CHANNELS, ("displacement_sigma_m", "velocity_sigma_m_s", "force_sigma_n"), strict=True):
        values, stated = getattr(record, CHANNEL_KEYS[channel]), sigma_of(machine, channel)
        if values is not None:
            own[key] = max(float(np.median(noise_of(values))), LEAST_NOISE * stated)
    return replace(machine, **own)


def noise_of(values: Array) -> Array:
    """(6,) standard deviations of white noise."""
    return MAD * np.median(np.abs(np.diff(values, 3, axis=0)), axis=0) / THIRD


def _is_white(values: Array) -> bool:
    """Whether neighbouring third differences oppose each other as those of white noise, -15 of 20: a filter's do less."""
    third = np.diff(values, 3, axis=0)
    return bool(-np.sum(third[1:] * third[:-1]) > WHITE * 15 / 20 * np.sum(third**2))


def _values(log: LegLog, channel: Channel) -> Array:
    return getattr(log, CHANNEL_KEYS[channel])


def _unit(channel: Channel) -> str:
    return {Channel.DISPLACEMENT: "m", Channel.VELOCITY: "m/s", Channel.FORCE: "N"}[channel]


def _in_words(size: float, channel: Channel) -> str:
    """Two digits, in units of which there are neither millions nor millionths."""
    factor, unit = {
        Channel.DISPLACEMENT: (1e3, "mm"),
        Channel.VELOCITY: (1e3, "mm/s"),
        Channel.FORCE: (1.0, "N"),
    }[channel]
    return f"{plain(factor * size)} {unit}"


def _rows(log: LegLog) -> Iterator[Finding]:
    periods = np.diff(log.t_s)
    dt_s = float(np.median(periods))
    gaps = np.flatnonzero(periods > LONG_GAP * dt_s)
    lost = int(np.sum(np.round(periods[periods > 1.5 * dt_s] / dt_s) - 1))
    if len(gaps) and (jump := _clock_jump(log, gaps[np.argmax(periods[gaps])], dt_s)) is not None:
        yield jump
    elif lost > MISSING_SHARE * len(log.t_s):
        longest = float(periods.max())
        yield Finding(
            Cause(Defect.MISSING, Channel.SAMPLES),
            f"{lost} samples are missing, {longest:.3f} s at most in a row",
            "look at the link",
            size=lost / len(log.t_s),
        )
    if dt_s > SLOW_S:
        words = f"rows come every {plain(1e3 * dt_s, 3)} ms only"
        mend = "log at the controller's period: shocks and changes of the load are over before they are seen"
        yield Finding(Cause(Defect.SAMPLING), words, mend, size=dt_s, unit="s", is_harmless=dt_s < HARMFUL_S)


def _clock_jump(log: LegLog, row: int, dt_s: float) -> Finding | None:
    """Whether the legs have gone on as if no time had passed: lines through the rows before and after meet in between, and
    differ by what noise and the curve of the motion make of them."""
    parts = log.displacement_m[max(0, row + 1 - CLOCK_ROWS) : row + 1], log.displacement_m[row + 1 :][:CLOCK_ROWS]
    if min(map(len, parts)) < CLOCK_ROWS or not np.isfinite(np.concatenate(parts)).all():
        return None
    rows = np.arange(CLOCK_ROWS)
    (before, after), left = zip(*(np.polyfit(rows, part, 1, full=True)[:2] for part in parts), strict=True)
    noise_m = float(np.sqrt(np.sum(left) / (2 * LEGS * (CLOCK_ROWS - 2))))
    apart = np.polyval(after, -0.5) - np.polyval(before, CLOCK_ROWS - 0.5)
    gap_s = float(log.t_s[row + 1] - log.t_s[row])
    slope = 0.5 * (before[0] + after[0])
    lost = (min(gap_s / dt_s, CLOCK_ROWS) - 1.0) * slope  # later the motion may have turned
    limit_m = CLOCK_NOISE * noise_m
    if np.sqrt(np.mean(apart**2)) > limit_m or np.sqrt(np.mean(lost**2)) < 2.0 * limit_m:
        return None
    return Finding(
        Cause(Defect.CLOCK_JUMPED),
        f"at {log.t_s[row]:.3f} s the time goes on by {gap_s:.3f} s and the legs do not: the clock has jumped",
        "look at the source of the times",
        size=gap_s,
        unit="s",
    )


def _missing(name: Channel, values: Array) -> Iterator[Finding]:
    share = np.isnan(values).mean(axis=0)
    legs = tuple(np.flatnonzero(share > MISSING_SHARE).tolist())
    if legs:
        yield Finding(
            Cause(Defect.MISSING, name),
            f"{legs_in_words(legs)}: {plain(100.0 * share.max())} % of the {name} values are missing",
            "look at the sensor and its cable",
            legs,
            float(share.max()),
        )


def _repeats(log: LegLog) -> Iterator[Finding]:
    """Rows that are those before; of all channels, or of one."""
    same = {name: (np.diff(_values(log, name), axis=0) == 0.0).all(axis=1) for name in CHANNELS}
    if not np.isfinite(log.velocity_m_s).any():
        del same[Channel.VELOCITY]
    every = np.logical_and.reduce(list(same.values()))
    dt_s = float(np.median(np.diff(log.t_s)))
    longest, at = _longest_run(every)
    if every.mean() > HELD_SHARE and longest * dt_s < FROZEN_S:
        yield _held(Channel.SAMPLES, every)
    elif longest * dt_s > FROZEN_S and _has_moved_on(log.displacement_m, at + longest):
        yield Finding(
            Cause(Defect.FROZEN, Channel.SAMPLES),
            f"from {log.t_s[at]:.3f} s on all channels stand still for {longest * dt_s:.3f} s",
            "look at the source of the samples",
            size=longest * dt_s,
            unit="s",
        )
    elif every.mean() > REPEATED_SHARE:
        yield Finding(
            Cause(Defect.REPEATED, Channel.SAMPLES),
            f"{plain(100.0 * every.mean())} % of the samples repeat the one before under a new time",
            "look at the source: it holds its rows, or is slower than the sampling period",
            size=float(every.mean()),
        )
    else:
        for name, rows in same.items():
            if rows.mean() > HELD_SHARE and not np.unique(_values(log, name)[:, 0]).size < 0.01 * len(rows):
                yield _held(name, rows)


def _held(name: Channel, rows: NDArray[np.bool_]) -> Finding:
    ticks = 1.0 / max(1.0 - rows.mean(), 1e-3)
    what = "samples" if name == Channel.SAMPLES else f"{name} channels"
    return Finding(
        Cause(Defect.HELD, name),
        f"{what} are held: new values every {plain(ticks)} rows only",
        "send them at the sampling period, or log them with their true times",
        size=float(ticks),
        unit="rows",
    )


def _is_held(values: Array) -> bool:
    return bool((np.diff(values, axis=0) == 0.0).all(axis=1).mean() > HELD_SHARE)


def _longest_run(marks: NDArray[np.bool_]) -> tuple[int, int]:
    """Length and first index."""
    edges = np.diff(np.concatenate([[0], marks.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if len(starts) == 0:
        return 0, 0
    longest = int((ends - starts).argmax())
    return int(ends[longest] - starts[longest]), int(starts[longest])


def _stops(name: Channel, t_s: Array, values: Array, step: float) -> Iterator[Finding]:
    """One leg's values stand still, at a limit or elsewhere, while those of others change. `step`: in which they come, in
    sigmas of the noise: coarse ones stand as long, and at the ends of the way more often."""
    dt_s = float(np.median(np.diff(t_s)))
    still = np.diff(values, axis=0) == 0.0
    for leg in range(LEGS):
        others = np.delete(still, leg, axis=1).sum(axis=1) < 3
        longest, at = _longest_run(still[:, leg] & others)
        at_limits = [int((values[:, leg] == limit).sum()) for limit in _limits(values[:, leg])]
        low, high = at_limits
        most = LIMIT_HITS if step == 0.0 else LIMIT_NEXT * _next_to_limits(values[:, leg])
        is_limit = max(at_limits) > most and (step > 0.0 or len(np.unique(values[:, leg])) > 0.2 * len(values))
        stands = values[at, leg]
        stuck_s = STUCK_S * max(1.0, step)
        is_stop = longest * dt_s > stuck_s and (
            stands not in _limits(values[:, leg]) or _jumps_off(values[:, leg], at + longest)
        )
        if is_limit and stands != 0.0 and not is_stop:
            limit = values[:, leg].max() if high >= low else values[:, leg].min()
            yield Finding(
                Cause(Defect.SATURATED, name),
                f"leg {leg + 1}: {name} is cut off at {limit:.4g} {_unit(name)}",
                f"look at the range of its {name} sensor",
                (leg,),
                float(limit),
                _unit(name),
                is_input=True,
            )
        elif longest * dt_s > stuck_s:
            dead = stands == 0.0
            what = "shows nothing but zero" if dead else f"stands still at {stands:.4g} {_unit(name)}"
            yield Finding(
                Cause(Defect.DEAD if dead else Defect.STUCK, name),
                f"leg {leg + 1}: {name} {what} for {longest * dt_s:.3f} s from {t_s[at]:.3f} s on",
                f"look at its {name} sensor and the cable",
                (leg,),
                longest * dt_s,
                "s",
                is_input=True,
            )


def _loose(name: Channel, values: Array) -> Iterator[Finding]:
    """One leg shows zero now and then, from one row to the next and for a few, and comes back as suddenly."""
    for leg in range(LEGS):
        is_zero = np.concatenate([[False], values[:, leg] == 0.0, [False]])
        starts, ends = (
            np.flatnonzero(np.diff(is_zero.astype(np.int8)) == 1),
            np.flatnonzero(np.diff(is_zero.astype(np.int8)) == -1),
        )
        before = np.abs(values[np.maximum(starts - 1, 0), leg])
        is_sudden = before > LOOSE_STEPS * np.quantile(np.abs(np.diff(values[:, leg])), LOOSE_USUAL)
        is_long = (ends - starts >= LOOSE_TICKS) & is_sudden
        if is_long.sum() >= LOOSE and not (values == 0.0).all(axis=1)[starts[is_long]].any():
            lasting = int(np.median((ends - starts)[is_long]))
            yield Finding(
                Cause(Defect.LOOSE, name),
                f"leg {leg + 1}: {name} shows zero {int(is_long.sum())} times, for {lasting} rows in the middle",
                f"look at the plug and the cable of its {name} sensor",
                (leg,),
                float(is_long.sum()),
                is_input=True,
            )


def _next_to_limits(values: Array) -> int:
    """How often the levels next to the lowest and the highest are taken, the larger number."""
    _, counts = np.unique(values, return_counts=True)
    return int(max(counts[1], counts[-2])) if len(counts) > 3 else len(values)


def _limits(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _has_moved_on(displacement_m: Array, last: int) -> bool:
    """Whether the machine has moved while its samples stood still: coarse steps stand still at rest as well."""
    return any(_jumps_off(leg, last) for leg in displacement_m.T)


def _jumps_off(values: Array, last: int) -> bool:
    """What is cut off goes on where it stood; a sensor that has stood still, where the machine is by then."""
    if last + 1 >= len(values):
        return True
    usual = np.quantile(np.abs(np.diff(values)), 0.999)
    return bool(abs(values[last + 1] - values[last]) > 3.0 * usual)


def _steps(name: Channel, values: Array, stated: float) -> Iterator[Finding]:
    """The same grid on all legs, coarser than the noise."""
    grids = []
    for leg in values.T:
        levels = np.unique(leg)
        gaps = np.diff(levels)
        step = float(np.median(gaps)) if len(gaps) else 0.0
        is_grid = (
            step > STEPS_IN_SIGMAS * stated and np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.02) > 0.999
        )
        grids.append(step if is_grid else 0.0)
    if min(grids) > 0.0:
        step = float(np.median(grids))
        yield Finding(
            Cause(Defect.STEPS, name),
            f"{name} channels come in steps of {_in_words(step, name)}, {plain(step / stated)} of the stated sigmas",
            f"log more digits, or state a {name} sigma of {plain(step / np.sqrt(12.0))} {_unit(name)}",
            size=step,
            unit=_unit(name),
        )


def _spikes(name: Channel, values: Array, stated: float) -> Iterator[Finding]:
    """Single values far off both neighbours, which agree, beside the slope of the next ones."""
    change = np.diff(values, axis=0)
    sigma = np.maximum(noise_of(values), stated / 2.0)
    slope = 0.5 * (change[:-3] + change[3:])
    up, down = change[1:-2] - slope, slope - change[2:-1]
    limit = SPIKE_SIGMAS * sigma
    is_spike = (np.minimum(np.abs(up), np.abs(down)) > limit) & (up * down > 0.0)
    is_spike &= np.abs(up - down) < 0.7 * np.abs(up + down)
    is_spike &= np.abs(change[3:] - change[:-3]) < 0.25 * np.abs(up + down)  # else it rings
    counts = is_spike.sum(axis=0)
    legs = tuple(np.flatnonzero(counts >= SPIKES).tolist())
    if 0 < len(legs) < LEGS:
        size = max(float(np.median(np.abs(up[is_spike[:, leg], leg]))) for leg in legs)
        share = float(counts.max()) / len(values)
        yield Finding(
            Cause(Defect.SPIKES, name),
            f"{legs_in_words(legs)}: {name} has spikes of about {_in_words(size, name)} in {plain(100.0 * share)} % of the samples",
            f"look at cable and shielding of its {name} sensor",
            legs,
            size,
            _unit(name),
        )


def _bursts(name: Channel, values: Array, stated: float) -> Iterator[Finding]:
    """Noise that is several times as large for a while, and again. The median of a window's third differences is what single
    values and steps hardly change."""
    windows = np.lib.stride_tricks.sliding_window_view(np.abs(np.diff(values, 3, axis=0)), BURST_ROWS, axis=0)
    size = np.median(windows[:: BURST_ROWS // 2], axis=2)
    usual = np.maximum(np.median(size, axis=0), LEAST_NOISE * stated * THIRD / MAD)
    is_loud = size > BURST_RATIO * usual
    starts = np.diff(is_loud.astype(np.int8), axis=0, prepend=np.zeros((1, LEGS), np.int8)) == 1
    legs = tuple(np.flatnonzero((starts.sum(axis=0) >= BURSTS) & (is_loud.mean(axis=0) < BURST_SHARE)).tolist())
    if legs:
        ratio = max(float(np.median(size[is_loud[:, leg], leg]) / usual[leg]) for leg in legs)
        who = f"{name} channels have" if len(legs) == LEGS else f"{legs_in_words(legs)}: {name} has"
        count = int(starts.sum(axis=0)[list(legs)].max())
        yield Finding(
            Cause(Defect.BURSTS, name),
            f"{who} {count} bursts of noise, of about {plain(ratio)} times the rest",
            "look at cables and shielding, and at what is switched near by",
            () if len(legs) == LEGS else legs,
            ratio,
        )


def _hum(name: Channel, values: Array, stated: float, dt_s: float) -> Iterator[Finding]:
    rows = len(values)
    frequency = np.fft.rfftfreq(rows, dt_s)
    window = np.hanning(rows)[:, None]
    power = np.abs(np.fft.rfft(window * np.diff(values, 2, axis=0, prepend=values[:2]), axis=0)) ** 2
    power = (power / np.maximum(frequency, 1.0)[:, None] ** 4).sum(axis=1)
    fast = np.flatnonzero(frequency > HUM_HZ)
    if len(fast) < 200:
        return
    level = np.array([np.median(part) for part in np.array_split(power[fast], 50)])
    floor = np.concatenate([np.full(len(part), value) for part, value in zip(np.array_split(fast, 50), level)])
    best = int((power[fast] / floor).argmax())
    if power[fast][best] < HUM_POWER * floor[best] / np.log(2.0):
        return
    hz = float(frequency[fast][best])
    half = rows // 2
    sizes = [_line(part, hz, dt_s) for part in (values[:half], values[half : 2 * half])]
    if min(sizes) < max(STEADY * max(sizes), HUM_SIGMAS * stated):
        return  # a shock that rings, or a machine
    size = float(np.mean(sizes))
    yield Finding(
        Cause(Defect.HUM, name),
        f"{name} channels hum at {hz:.2f} Hz with {_in_words(size, name)}",
        "look at grounding and shielding",
        size=hz,
        unit="Hz",
    )


def _is_of_a_servo(hum: Finding, record: Record, machine: Machine) -> bool:
    """A force that moves the legs is there: a servo that goes on oscillating, no hum."""
    if hum.cause != Cause(Defect.HUM, Channel.FORCE) or record.velocity_m_s is None:
        return False
    window = np.hanning(len(record.velocity_m_s))
    noise_m_s = 2.0 * machine.velocity_sigma_m_s * float(np.linalg.norm(window) / window.sum())
    return float(np.sum((_amplitudes(record.velocity_m_s, hum.size, record.dt_s) / noise_m_s) ** 2)) > MOVING_LEGS


def _line(values: Array, hz: float, dt_s: float) -> float:
    """Amplitude, the legs' median."""
    return float(np.median(_amplitudes(values, hz, dt_s)))


def _amplitudes(values: Array, hz: float, dt_s: float) -> Array:
    """(6,)"""
    window = np.hanning(len(values))[:, None]
    wave = np.exp(-2j * np.pi * hz * dt_s * np.arange(len(values)))[:, None]
    return 2.0 * np.abs(((values - values.mean(axis=0)) * window * wave).sum(axis=0)) / window.sum()


def _noise(ratios: dict[Channel, float], is_white: dict[Channel, bool]) -> Iterator[Finding]:
    """Noise that is not the stated one; alike on all channels it is the statement, and quiet in forces alone their unit."""
    off = {name: ratio for name, ratio in ratios.items() if not NOISE_RATIO[0] < ratio < NOISE_RATIO[1]}
    if len(off) == len(ratios) > 1 and max(off.values()) < 1.3 * min(off.values()):
        ratio = float(np.mean(list(off.values())))
        yield Finding(
            Cause(Defect.STATED_NOISE),
            f"all channels have {plain(ratio)} times the noise that the platform file states",
            "correct its [sensors]",
            size=ratio,
            is_harmless=ratio < 1.0,
        )
        return
    for name, ratio in off.items():
        is_unit = name == Channel.FORCE and ratio < QUIET and is_white[name]
        if is_unit:
            mend = "check their unit (N), or correct its [sensors]"
        else:
            mend = "correct its [sensors]" if ratio < 1.0 else "correct its [sensors], or look at the sensors"
        yield Finding(
            Cause(Defect.NOISE, name),
            f"{name} channels have {plain(ratio)} times the noise that the platform file states",
            mend,
            size=ratio,
            is_harmless=ratio < 1.0 and not is_unit,
        )


def common_noise(displacement_m: Array, velocity_m_s: Array, sigma_m: float) -> Array:
    """(6,) coherence of velocities with the noise of their displacements, 0 to 1; 0 of displacements with less than LEAST_NOISE
    of the stated noise, and of too few rows to say."""
    if len(displacement_m) < LEAST_SEGMENTS * NOISE_ROWS:
        return np.zeros(LEGS)
    rates, speeds = (_spectra(values) for values in (np.gradient(displacement_m, axis=0), velocity_m_s))
    of_rates, of_speeds = (np.mean(np.abs(spectra) ** 2, axis=0) for spectra in (rates, speeds))
    common = np.abs(np.mean(rates * speeds.conj(), axis=0)) ** 2 / np.maximum(of_rates * of_speeds, TINY)
    share = np.fft.rfftfreq(NOISE_ROWS)
    is_noise = (share >= NOISE_BAND[0]) & (share <= NOISE_BAND[1])
    has_noise = noise_of(displacement_m) > LEAST_NOISE * sigma_m
    return np.where(has_noise, common[is_noise].mean(axis=0), 0.0)


def _spectra(values: Array) -> Array:
    """(segments, lines, 6) of NOISE_ROWS rows each under a Hann window, half of them the next one's (Welch)."""
    segments = np.lib.stride_tricks.sliding_window_view(values, NOISE_ROWS, axis=0)[:: NOISE_ROWS // 2]
    level = segments - segments.mean(axis=2, keepdims=True)
    return np.swapaxes(np.fft.rfft(level * np.hanning(NOISE_ROWS), axis=2), 1, 2)


def _made_of_displacements(record: Record, machine: Machine) -> Iterator[Finding]:
    """Velocities that differences of the displacements have been taken for, through a filter."""
    if record.velocity_m_s is None:
        return
    common = common_noise(record.displacement_m, record.velocity_m_s, machine.displacement_sigma_m)
    legs = tuple(np.flatnonzero(common > LEAST_COMMON).tolist())
    if legs:
        yield Finding(
            DERIVED,
            f"velocities of {legs_in_words(legs)} have their displacements' noise: they are made of these",
            "leave vl1 to vl6 out of the log, and speeds are made of the displacements without delay",
            legs=legs,
            size=float(common.max()),
        )


def _jitter(record: Record, machine: Machine) -> Iterator[Finding]:
    """Rows read at another time than they tell: displacements are off together, in proportion to their speeds."""
    if record.velocity_m_s is None or not record.is_known.all():
        return
    noise = np.diff(record.displacement_m, 3, axis=0)
    speed = record.velocity_m_s[1:-2]
    size = np.sqrt((speed**2).sum(axis=1))
    moving = size > np.median(size)
    if np.median(size) < 10.0 * machine.velocity_sigma_m_s:
        return
    along = (noise * speed).sum(axis=1)[moving] / size[moving]
    all_of_it = (noise[moving] ** 2).sum(axis=1)
    across = (all_of_it - along**2).mean() / (LEGS - 1)
    across = max(float(across), (LEAST_NOISE * THIRD * machine.displacement_sigma_m) ** 2)
    ratio = float((along**2).mean() / across)
    by_chance = SIGMAS * np.sqrt(2.0 * ALIKE_SQUARES * (1.0 + 1.0 / (LEGS - 1)) / moving.sum())
    if ratio > max(JITTER_RATIO, 1.0 + by_chance):
        jitter_s = np.sqrt(((along**2).mean() - across) / (20.0 * (size[moving] ** 2).mean()))
        yield Finding(
            Cause(Defect.JITTER),
            f"samples are read {plain(1e3 * jitter_s)} ms off the times that they tell",
            "look at the sampling: all channels at the same instant, once per period",
            size=float(jitter_s),
            unit="s",
        )
