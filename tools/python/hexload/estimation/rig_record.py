"""A commissioning run as its regression sees it.

Displacements, forces and every column pass the same zero-phase low-pass filters, so that none of them lags; the motion is
the displacements', as a regression on a velocity sensor would see its noise on both sides. Speeds in the friction terms
pass fewer of them: a filter hides when a leg turns round.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from hexload.estimation import rig_model
from hexload.estimation.rig_model import FrictionLaw
from hexload.io.log_file import LegLog

Array = NDArray[np.float64]

MOTION_HZ = 40.0
ROW_HZ = 15.0
SPEED_HZ = 25.0
MOTION_STEP_S = 0.008  # at which the motion is worked out, and the columns filtered
ROW_STEP_S = 0.016
EDGE_S = 0.3  # there the filters still feel the ends of the record
NOISE_SEED = 1
THIN = 20  # one row of so many tells what a motion identifies


@dataclass(frozen=True)
class Record:
    """What does not depend on the unknowns."""

    displacement: Array  # (n, 6), filtered, MOTION_STEP_S apart
    speed: Array
    acceleration: Array
    force: Array  # (rows, 6), filtered as rows
    force_rate: Array
    friction_speed: Array  # (N, 6), at the log's own period
    dt_s: float  # the log's own period
    step: int  # of the log's periods in a MOTION_STEP_S
    rows: slice  # of n
    speeds_at_rows: Array
    t_s: Array  # (rows,)

    def below_motion_hz(self, values: Array) -> Array:
        """(N, ..) at the log's period as (n, ..)."""
        return low_pass(values, MOTION_HZ, self.dt_s, self.step)

    def below_row_hz(self, values: Array) -> Array:
        """(n, ..)"""
        return low_pass(values, ROW_HZ, self.step * self.dt_s)

    def as_rows(self, values: Array) -> Array:
        """(n, ..) as (rows, ..)."""
        return self.below_row_hz(values)[self.rows]


def prepare(log: LegLog) -> Record:
    """Of a log without gaps. Raises ValueError."""
    dt_s = float(np.median(np.diff(log.t_s)))
    if 2.0 * MOTION_HZ * dt_s >= 1.0:
        raise ValueError(f"rows {dt_s:g} s apart, which show nothing of {MOTION_HZ:g} Hz")
    step = max(1, round(MOTION_STEP_S / dt_s))
    force = low_pass(log.force_n, MOTION_HZ, dt_s)
    force_rate = np.gradient(force, dt_s, axis=0)
    friction_speed = np.gradient(low_pass(log.displacement_m, SPEED_HZ, dt_s), dt_s, axis=0)
    coarse_s = step * dt_s
    edge, stride = round(EDGE_S / coarse_s), max(1, round(ROW_STEP_S / coarse_s))
    rows = slice(edge, -edge, stride)
    return Record(
        *_motion(log.displacement_m, dt_s, step),
        low_pass(force[::step], ROW_HZ, coarse_s)[rows],
        low_pass(force_rate[::step], ROW_HZ, coarse_s)[rows],
        friction_speed,
        dt_s,
        step,
        rows,
        friction_speed[::step][rows],
        log.t_s[::step][rows],
    )


def _motion(displacement_m: Array, dt_s: float, step: int) -> tuple[Array, Array, Array]:
    displacement = low_pass(displacement_m, MOTION_HZ, dt_s)
    speed = np.gradient(displacement, dt_s, axis=0)
    acceleration = np.gradient(speed, dt_s, axis=0)
    return displacement[::step], speed[::step], acceleration[::step]


def low_pass(values: Array, hz: float, period_s: float, step: int = 1) -> Array:
    """Butterworth's filter of fourth order, there and back, of a record that stands still before and after; every `step`-th
    row, and then nothing of what such rows cannot show."""
    edge, count = round(EDGE_S / period_s / step), -(-len(values) // step)
    size = fft.next_fast_len(count + 2 * edge, real=True)
    around = [(step * edge, step * (size - edge) - len(values)), *[(0, 0)] * (values.ndim - 1)]
    spectrum = fft.rfft(np.pad(values, around, mode="edge"), axis=0)[: size // 2 + 1]
    phase = np.pi * np.arange(len(spectrum)).reshape(-1, *[1] * (values.ndim - 1)) / (size * step)
    passed = 1.0 / step / (1.0 + (np.tan(phase) / np.tan(np.pi * hz * period_s)) ** 8)
    return fft.irfft(passed.astype(values.dtype) * spectrum, size, axis=0)[edge : edge + count]


def with_noise(record: Record, log: LegLog) -> Record:
    """As if the log's displacements had as much noise again: third differences show it, as a motion does not pass them."""
    sigma_m = np.sqrt(np.mean(np.diff(log.displacement_m, 3, axis=0) ** 2, axis=0) / 20.0)
    noise_m = sigma_m * np.random.default_rng(NOISE_SEED).standard_normal(log.displacement_m.shape)
    displacement, speed, acceleration = _motion(noise_m, record.dt_s, record.step)
    return replace(
        record,
        displacement=record.displacement + displacement,
        speed=record.speed + speed,
        acceleration=record.acceleration + acceleration,
    )


def thinned(record: Record) -> Record:
    rows = slice(record.rows.start, record.rows.stop, THIN)
    parts = (record.displacement, record.speed, record.acceleration)
    displacement, speed, acceleration = (part[rows] for part in parts)
    friction_speed = record.friction_speed[:: record.step][rows]
    return replace(
        record, displacement=displacement, speed=speed, acceleration=acceleration, friction_speed=friction_speed, step=1
    )


@dataclass(frozen=True)
class Shapes:
    """Of a friction law."""

    direction: Array  # (n, 6): Coulomb's, and with the leg's force that which grows with it
    rows: Array  # (rows, 6, 3): Coulomb's, the Stribeck extra's, the viscous one's


class Friction:
    """Shapes of a record's friction, law by law: what has been worked out is kept, as scans come back to it."""

    def __init__(self, record: Record) -> None:
        self.shapes = functools.cache(self._shapes)
        self._record = record
        self._speed = record.friction_speed.astype(np.float32)  # shapes are within 1, and the law an approximation
        self._slides = functools.lru_cache(1)(self._slides_of)
        self._direction = functools.cache(self._direction_of)
        self._viscous = self._as_rows(self._speed)

    def _shapes(self, law: FrictionLaw) -> Shapes:
        turn = law.reversal_speed_m_s, law.presliding_m
        direction, rows = self._direction(*turn)
        extra = self._as_rows(rig_model.stribeck_share(self._speed, law) * self._slides(*turn))
        return Shapes(direction, np.stack([rows, extra, self._viscous], axis=-1))

    def _direction_of(self, reversal_speed_m_s: float, presliding_m: float) -> tuple[Array, Array]:
        direction = self._record.below_motion_hz(self._slides(reversal_speed_m_s, presliding_m))
        return direction, self._record.as_rows(direction)

    def _slides_of(self, reversal_speed_m_s: float, presliding_m: float) -> Array:
        law = FrictionLaw(np.inf, reversal_speed_m_s, presliding_m)
        return rig_model.slides(self._speed, law, self._record.dt_s)

    def _as_rows(self, values: Array) -> Array:
        return self._record.as_rows(self._record.below_motion_hz(values))


class Seen:
    """A run, ready for any number of regressions."""

    def __init__(self, log: LegLog) -> None:
        self.record = prepare(log)
        self.noisy = with_noise(self.record, log)
        self.friction = Friction(self.record)
