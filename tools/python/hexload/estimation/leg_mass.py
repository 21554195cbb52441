"""Mass of the legs: what of it is no constant offset of theta, found in a run of the empty platform, taken off a log.

A leg is a cylinder that turns about its base hinge and a rod that slides in it, both slender. With the leg vector L,
its length l, e = L / l, the velocity u of the upper hinge and its part across the leg, u_a = u - e (e u), energies are

    T = m_r |u|^2 / 2 + nu |u_a|^2 / 2    nu = B / l^2 - C / l        V = g (m_r L_z + D e_z)

m_r: mass of the rod; B: moments of inertia of cylinder and rod about the hinge of each, added; C = 2 m_r d, d from the
upper hinge to the rod's centre of mass; D = s_c - m_r d, s_c the cylinder's first moment about the base hinge. The mass
m_r at the hinge goes with the platform, so it is a part of theta. Lagrange's equation for L gives the rest of the force
that the platform supplies, linear in B, C and D:

    F = nu a_a + nu' (e u) u_a - (nu / l + nu' / 2) |u_a|^2 e + D g / l (z - e e_z)

a_a the hinge's acceleration across the leg, z upwards. All six legs count as alike.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload.estimation import rig_model
from hexload.estimation.rig_model import Geometry, LegMotion
from hexload.io.log_file import LegLog
from hexload.theory import chi_square
from hexload.theory.bound import THETA_NAMES, Platform, Trajectory
from hexload.theory.leg_regression import EDGE_S, inner, leg_equations, smoothed

Array = NDArray[np.float64]

OFFSETS = len(THETA_NAMES)
PARAMETERS = 3  # B, C, D
# A machine whose legs have no mass is taken for one that has some once in a thousand runs.
SIGNIFICANT = chi_square.quantile(0.999, PARAMETERS)
PACES = (1.0, 0.5)  # of the run itself: motions on which the offset's error is looked at
SHORTEST_S = 4.0 * EDGE_S
MOST_ROWS = 60_000  # of a run that are looked at
PART_ROWS = 50_000  # of a log at once: some 200 MB
WORST_CONDITION = 1e10  # of the normal equations: worse ones are of a motion that tells too little
TINY = 1e-300  # instead of 0, by which nothing is divided
LARGEST_STROKE = 0.5  # of a leg's length at home: beyond, a displacement is that of no leg
ACCELERATION_S = 5e-3  # an acceleration is the change of the speed over that time
JITTER_S = 0.2e-3  # of the times of a log


@dataclass(frozen=True)
class LegMass:
    value: Array  # (3,), B, C, D: kg m^2, kg m, kg m
    offset_variance: Array  # (10,) what its own errors do to the offset of another motion than its run's


def find_leg_mass(log: LegLog, platform: Platform, largest_kg: float) -> LegMass | None:
    """With theta, on a run of the empty platform; None: nothing that stands out of the noise.

    By instrumental variables, displacements' speeds for those of the sensors: noise of speeds in the equations would
    weaken inertia beside weight, and that difference is what tells of legs. `largest_kg`: of what counts at the hinge
    of one leg; more is something else than a leg.
    """
    geometry = _geometry(platform)
    log = _take(log, slice(MOST_ROWS))
    log = _take(log, _has_pose(geometry, log.displacement_m))
    if len(log.t_s) < 2 or log.t_s[-1] - log.t_s[0] < SHORTEST_S or _is_full_of_gaps(log.t_s):
        return None
    log = _without_gaps(log)
    smooth, rows = smoothed(log, "zero_phase"), inner(log.t_s)
    dt_s = float(np.median(np.diff(log.t_s)))
    motion, by_displacement = (
        rig_model.motion_of_legs(geometry, smooth.displacement_m, speed, np.gradient(speed, dt_s, axis=0))
        for speed in (smooth.velocity_m_s, np.gradient(smooth.displacement_m, dt_s, axis=0))
    )
    matrix, instruments = (
        _columns(platform, each, dt_s)[rows].reshape(-1, OFFSETS + PARAMETERS) for each in (motion, by_displacement)
    )
    scale = np.linalg.norm(matrix, axis=0)
    product = (instruments / np.maximum(scale, TINY)).T @ (matrix / np.maximum(scale, TINY))
    if np.linalg.cond(product) > WORST_CONDITION:
        return None
    inverse = np.linalg.inv(product) / scale[:, None] / scale
    value = (inverse @ (instruments.T @ smooth.force_n[rows].ravel()))[OFFSETS:]
    noise_n = np.std((log.force_n - smooth.force_n)[rows])
    covariance = noise_n**2 * (inverse @ (instruments.T @ instruments) @ inverse.T)[OFFSETS:, OFFSETS:]
    if value @ np.linalg.solve(covariance, value) < SIGNIFICANT or _at_hinge_kg(value, geometry).max() > largest_kg:
        return None
    return LegMass(value, _offset_variance(platform, motion, dt_s, rows, covariance))


def without_leg_mass(log: LegLog, platform: Platform, value: ArrayLike) -> LegLog:
    """The log of a run with legs of which only the rod's mass at the hinge is left.

    Each row needs none but rows before it, so that a controller can do the same. A row of no pose is left as it is.
    """
    before = _rows_before(log.t_s)
    force_n = log.force_n.copy()
    for start in range(0, len(force_n), PART_ROWS):
        rows = slice(max(0, before[start]), start + PART_ROWS)
        legs_n = _present_leg_forces(platform, log.t_s[rows], log.displacement_m[rows], log.velocity_m_s[rows])
        force_n[start : rows.stop] -= (legs_n @ np.asarray(value, float))[start - rows.start :]
    return replace(log, force_n=force_n)


def _rows_before(t_s: Array) -> NDArray[np.intp]:
    """Of each row, (n,): the last one that is ACCELERATION_S older, -1 where there is none."""
    return np.searchsorted(t_s, t_s - ACCELERATION_S + JITTER_S, side="right") - 1


def _present_leg_forces(platform: Platform, t_s: Array, displacement_m: Array, velocity_m_s: Array) -> Array:
    """Per unit of B, C and D, (n, 6, 3), from each row and those before it; 0 of rows without a pose."""
    geometry = _geometry(platform)
    has_pose = _has_pose(geometry, displacement_m)[:, None]
    displacement_m, still = np.where(has_pose, displacement_m, 0.0), np.zeros_like(velocity_m_s)
    motion = rig_model.motion_of_legs(geometry, displacement_m, velocity_m_s, still)
    speed = rig_model.hinge_speeds(motion, geometry)
    before = _rows_before(t_s)
    rows = np.flatnonzero(before >= 0)
    before = before[rows]
    acceleration = np.zeros_like(speed)
    acceleration[rows] = (speed[rows] - speed[before]) / (t_s[rows] - t_s[before])[:, None, None]
    legs = rig_model.leg_mass_forces(motion, geometry, _gravity(platform), acceleration)
    return np.where(has_pose[:, :, None], legs, 0.0)


def _geometry(platform: Platform) -> Geometry:
    home_m = np.linalg.norm(platform.platform_hinges_m - platform.base_from_home_m, axis=1)
    return Geometry(platform.base_hinges_m, platform.platform_hinges_m, home_m)


def _gravity(platform: Platform) -> Array:
    """(3,), base axes."""
    return np.array([0.0, 0.0, -platform.gravity_m_s2])


def _columns(platform: Platform, motion: LegMotion, dt_s: float) -> Array:
    """Leg forces per unit of theta, B, C and D, (n, 6, 13), of a motion with dt_s from row to row."""
    of_body = leg_equations(platform, _trajectory(platform, motion), dt_s)
    of_legs = rig_model.leg_mass_forces(motion, _geometry(platform), _gravity(platform))
    return np.concatenate([of_body, of_legs], axis=2)


def _trajectory(platform: Platform, motion: LegMotion) -> Trajectory:
    """The same motion from home, in base axes."""
    linear, angular = (
        np.einsum("nj,nji->ni", part, motion.to_platform) for part in (motion.twist[:, :3], motion.twist[:, 3:])
    )
    place_m = motion.place_m - [0.0, 0.0, platform.home_height_m]
    return Trajectory(place_m, np.swapaxes(motion.to_platform, 1, 2), linear, angular)


def _take(log: LegLog, rows: slice | NDArray[np.bool_]) -> LegLog:
    parts = (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(*(part[rows] for part in parts))


def _has_pose(geometry: Geometry, displacement_m: Array) -> NDArray[np.bool_]:
    """(n,)"""
    is_leg = (np.abs(displacement_m) < LARGEST_STROKE * geometry.home_leg_length_m).all(axis=1)
    return is_leg & rig_model.has_pose(geometry, np.where(is_leg[:, None], displacement_m, 0.0))


def _is_full_of_gaps(t_s: Array) -> bool:
    """Half of the rows and more are missing, or the clock has jumped."""
    return float(t_s[-1] - t_s[0]) > 2.0 * len(t_s) * float(np.median(np.diff(t_s)))


def _without_gaps(log: LegLog) -> LegLog:
    dt_s = float(np.median(np.diff(log.t_s)))
    t_s = log.t_s[0] + dt_s * np.arange(round((log.t_s[-1] - log.t_s[0]) / dt_s) + 1)
    parts = (log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(t_s, *(np.stack([np.interp(t_s, log.t_s, leg) for leg in part.T], axis=1) for part in parts))


def _at_hinge_kg(value: Array, geometry: Geometry) -> Array:
    """What the legs' inertia and their weight count at a hinge, at home."""
    length_m = geometry.home_leg_length_m.mean()
    return np.abs([value[0] / length_m**2 - value[1] / length_m, value[2] / length_m])


def _offset_variance(platform: Platform, motion: LegMotion, dt_s: float, rows: slice, covariance: Array) -> Array:
    """Errors of B, C and D are a part of theta on the run, T_run, and on another motion, T: what is left is their
    difference. The other motions are the run's halves, at its own pace and slower."""
    middle = len(motion.twist) // 2
    of_run = _as_offset(_columns(platform, motion, dt_s)[rows])
    differences = []
    for pace in PACES:
        slower = replace(motion, twist=pace * motion.twist, acceleration=pace**2 * motion.acceleration)
        columns = _columns(platform, slower, dt_s / pace)
        for half in (slice(rows.start, middle), slice(middle, rows.stop)):
            differences.append(_as_offset(columns[half]) - of_run)
    return np.mean([np.diagonal(one @ covariance @ one.T) for one in differences], axis=0)


def _as_offset(columns: Array) -> Array:
    """T, (10, 3): the theta that a motion makes of B, C and D. `columns`: of _columns()."""
    rows = columns.reshape(-1, OFFSETS + PARAMETERS)
    return np.linalg.lstsq(rows[:, :OFFSETS], rows[:, OFFSETS:], rcond=None)[0]
