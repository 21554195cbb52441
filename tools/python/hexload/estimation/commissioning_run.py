"""The run of `hexload commission`, and what it is refused for: gaps, sensors that stop, legs that stand still, channels that
contradict each other.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from hexload.diagnosis.channels import HELD_SHARE, LEAST_COMMON, common_noise
from hexload.errors import InputError
from hexload.estimation.rig_model import LEGS
from hexload.estimation.rig_record import ROW_HZ, Seen
from hexload.estimation.rig_regression import Found
from hexload.io.log_file import LegLog
from hexload.theory.tolerances import GRANTED_SIGMAS

Array = NDArray[np.float64]

SHORTEST_S = 4.0
LONGEST_GAP_S = 0.02
LARGEST_END_SHARE = 0.02  # of rows at the largest or smallest force
STUCK_S, STUCK_WAY_M = 0.25, 1e-3
LEAST_SPEED_M_S = 5e-3  # below VELOCITY_HZ, where 20 um of noise are 0.8 mm/s at 1 ms
VELOCITY_HZ = 40.0
LARGEST_GAIN = 0.01  # of a velocity over the displacement's change
LARGEST_BEND = 5e-3  # of that gain at the ends of the leg's stroke, from the one in the middle
LARGEST_LAG_S = 0.5e-3  # of a leg behind the others
DOUBT = 1e-3  # that what is as it should be is taken not to be
ROUNDING = 1e-6  # of the largest step: rows have been brought to even times
MIXED_SHARE = 0.05  # of rows in which some legs do: steps of a converter make many such


@dataclass(frozen=True)
class Run:
    name: str
    log: LegLog

    @property
    def dt_s(self) -> float:
        return float(self.log.t_s[1] - self.log.t_s[0])

    @functools.cached_property
    def seen(self) -> Seen:
        return Seen(self.log)


def run_of(log: LegLog, path: Path) -> Run:
    """A log without gaps: short ones are bridged by lines. Raises InputError."""
    dt_s = float(np.median(np.diff(log.t_s)))
    duration_s = log.t_s[-1] - log.t_s[0]
    if duration_s < SHORTEST_S:
        raise InputError(f"{path}: found {duration_s:.3f} s, expected {SHORTEST_S:g} s of motion at least")
    longest = int(np.argmax(np.diff(log.t_s)))
    if (gap_s := np.diff(log.t_s)[longest]) > LONGEST_GAP_S:
        raise InputError(
            f"{path}: found no rows for {gap_s:.3f} s after t = {log.t_s[longest]:.3f} s, expected gaps of "
            f"{LONGEST_GAP_S:g} s at most"
        )
    t_s = log.t_s[0] + dt_s * np.arange(round(duration_s / dt_s) + 1)
    _refuse_stuck(path, log)
    parts = (log.displacement_m, log.velocity_m_s, log.force_n)
    return Run(
        str(path), LegLog(t_s, *(np.stack([np.interp(t_s, log.t_s, leg) for leg in p.T], axis=1) for p in parts))
    )


def _refuse_stuck(path: Path, log: LegLog) -> None:
    """Load cells that reach the end of their range, or stop."""
    for leg in range(LEGS):
        force_n, way_m = log.force_n[:, leg], log.displacement_m[:, leg]
        for end_n in (force_n.min(), force_n.max()):
            share = np.mean(force_n == end_n)
            if share > LARGEST_END_SHARE:
                raise InputError(
                    f"{path}: found leg {leg + 1}'s force at {end_n:.5g} N in {100.0 * share:.0f} % of all rows and never "
                    "beyond, expected forces within the load cell's range"
                )
        changes = np.flatnonzero(np.diff(force_n)) + 1
        starts, ends = np.append(0, changes), np.append(changes, len(force_n)) - 1
        long = log.t_s[ends] - log.t_s[starts] > STUCK_S
        for first, last in zip(starts[long], ends[long], strict=True):
            if np.ptp(way_m[first : last + 1]) > STUCK_WAY_M:
                raise InputError(
                    f"{path}: found leg {leg + 1}'s force at {force_n[first]:.5g} N from {log.t_s[first]:.3f} to "
                    f"{log.t_s[last]:.3f} s while the leg moves, expected a load cell that does not stop"
                )


def refuse_still(run: Run) -> None:
    """Raises InputError of a run in which a leg hardly moves."""
    _, speeds, _, _ = slow_motion(run)  # the noise of displacements is faster
    slowest = int(np.argmin(speeds.std(axis=0)))
    if speeds[:, slowest].std() < LEAST_SPEED_M_S:
        raise InputError(
            f"{run.name}: found leg {slowest + 1} at {speeds[:, slowest].std():.2g} m/s (rms), expected "
            f"{LEAST_SPEED_M_S:g} m/s at least: a livelier motion of all six axes"
        )


def refuse_held(run: Run) -> None:
    """A channel that comes at a lower rate and is held has another age in each row, which is no delay. Raises InputError."""
    for name, values in (
        ("displacements", run.log.displacement_m),
        ("velocities", run.log.velocity_m_s),
        ("forces", run.log.force_n),
    ):
        steps = np.abs(np.diff(values, axis=0))
        repeats = (steps <= ROUNDING * steps.max()).sum(axis=1)
        is_held = repeats == LEGS
        is_mixed = (repeats > 0) & ~is_held
        if is_held.mean() > HELD_SHARE and is_mixed.mean() < MIXED_SHARE:
            every = 1.0 / (1.0 - is_held.mean())
            raise InputError(
                f"{run.name}: found new {name} in one of {every:.2g} rows only and the old ones between, expected them in "
                f"each: log rows at the rate of the slowest sensor, every {1e3 * every * run.dt_s:.2g} ms (--unchecked: go "
                "on as it is)"
            )


def refuse_derived(run: Run, displacement_sigma_m: float) -> None:
    """Velocities with the displacements' own noise are made of them, by a filter that leaves out what is fast, and no second
    source of anything. Raises InputError."""
    if not run.log.has_velocity:
        return
    found = common_noise(run.log.displacement_m, run.log.velocity_m_s, displacement_sigma_m)
    leg = int(np.argmax(found))
    if found[leg] > LEAST_COMMON:
        raise InputError(
            f"{run.name}: found velocities of leg {leg + 1} with the noise of its displacement (coherence {found[leg]:.2f}), "
            "expected a sensor of their own: leave vl1 to vl6 out of the log, and speeds are made of the displacements "
            "without delay (--unchecked: go on as it is)"
        )


def refuse_velocities(run: Run) -> None:
    """v shown = (k + b x) d' - lag d'' of each leg, with x from -1 to 1 along its stroke. A k that is not 1, a b that is
    not 0 or a lag that other legs have not goes by unseen on a load's slower motion, into its inertia. Raises
    InputError."""
    if not run.log.has_velocity:
        return
    place, speed, rate, shown = slow_motion(run)
    along = 2.0 * (place - place.min(axis=0)) / np.ptp(place, axis=0) - 1.0
    columns = (speed, along * speed, -rate)
    (gain, bend, lag_s), (of_gain, of_bend, of_lag_s) = _regressed(shown, columns, VELOCITY_HZ * run.dt_s)
    _refuse_gain(run, gain, of_gain)
    _refuse_bend(run, bend, of_bend)
    _refuse_late_leg(run, "velocities", lag_s, of_lag_s)


def _refuse_gain(run: Run, gain: Array, sigma: Array) -> None:
    is_beyond, leg = _beyond(gain - 1.0, sigma, LARGEST_GAIN)
    if is_beyond[leg]:
        are_alike = is_beyond.all() and np.ptp(gain) < LARGEST_GAIN
        suspects = "the scale of both sensors and the log's clock" if are_alike else "scale and wiring of both sensors"
        raise InputError(
            f"{run.name}: found velocities of leg {leg + 1} at {gain[leg]:.3f} times the change of its displacement, "
            f"expected {1.0 - LARGEST_GAIN:g} to {1.0 + LARGEST_GAIN:g}: check {suspects} (--unchecked: go on as it is)"
        )


def _refuse_bend(run: Run, bend: Array, sigma: Array) -> None:
    """A scale that is no line: hinges elsewhere would explain most of what it does to forces."""
    is_beyond, leg = _beyond(bend, sigma, LARGEST_BEND)
    if is_beyond[leg]:
        raise InputError(
            f"{run.name}: found velocities of leg {leg + 1} that differ from the change of its displacement by "
            f"{100.0 * abs(bend[leg]):.2g} % more at the ends of its stroke than in the middle, expected "
            f"{100.0 * LARGEST_BEND:g} % at most: check the linearity of both sensors (--unchecked: go on as it is)"
        )


def refuse_late_forces(run: Run, found: Found) -> None:
    """The regression has one delay for all legs: a leg's own is in its residuals. Raises InputError."""
    row_s = found.t_s[1] - found.t_s[0]
    lag_s, sigma_s = _regressed(found.residuals_n, (-run.seen.record.force_rate,), ROW_HZ * row_s)
    _refuse_late_leg(run, "forces", lag_s[0], sigma_s[0])


def _regressed(values: Array, columns: Sequence[Array], share: float) -> tuple[Array, Array]:
    """Least squares of each leg, (columns, 6), with the sigmas that residuals leave which are white below that share of
    the rate of the rows."""
    found, sigma = np.empty((2, len(columns), LEGS))
    for leg in range(LEGS):
        design = np.stack([column[:, leg] for column in columns], axis=1)
        inverse = np.linalg.inv(design.T @ design)
        found[:, leg] = inverse @ (design.T @ values[:, leg])
        variance = np.mean((values[:, leg] - design @ found[:, leg]) ** 2) / (2.0 * share)
        sigma[:, leg] = np.sqrt(variance * np.diag(inverse))
    return found, sigma


def _beyond(off: Array, sigma: Array, limit: float) -> tuple[NDArray[np.bool_], int]:
    """Which legs are off by more than the limit, whatever the noise, (6,), and the one that is off most."""
    excess = np.abs(off) - GRANTED_SIGMAS * sigma - limit
    return excess > 0.0, int(np.argmax(excess))


def _refuse_late_leg(run: Run, channel: str, lag_s: Array, sigma_s: Array) -> None:
    """Legs have one delay: that of the others is the median."""
    late_s = lag_s - np.median(lag_s)
    is_beyond, leg = _beyond(late_s, sigma_s, LARGEST_LAG_S)
    if is_beyond[leg]:
        raise InputError(
            f"{run.name}: found {channel} of leg {leg + 1} {1e3 * abs(late_s[leg]):.2g} ms "
            f"{'later' if late_s[leg] > 0.0 else 'earlier'} than other legs', expected "
            f"{1e3 * LARGEST_LAG_S:g} ms at most: check how its sensors are sampled (--unchecked: go on as it is)"
        )


def slow_motion(run: Run) -> tuple[Array, Array, Array, Array]:
    """d, d', d'' and v shown, each below VELOCITY_HZ, (rows, 6)."""
    dt_s = run.dt_s
    low_pass = butter(4, VELOCITY_HZ, fs=1.0 / dt_s, output="sos")
    inner = slice(round(0.3 / dt_s), -round(0.3 / dt_s))
    place = sosfiltfilt(low_pass, run.log.displacement_m, axis=0)
    speed = np.gradient(place, dt_s, axis=0)
    shown = sosfiltfilt(low_pass, run.log.velocity_m_s, axis=0)
    return place[inner], speed[inner], np.gradient(speed, dt_s, axis=0)[inner], shown[inner]
