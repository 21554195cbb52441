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

from hexload.io.log_file import LegLog
from hexload.theory import chi_square
from hexload.theory.bound import THETA_NAMES, Platform, Trajectory, leg_jacobian
from hexload.theory.leg_regression import (
    EDGE_S,
    Regression,
    Speeds,
    inner,
    leg_equations,
    motion_of_legs,
    regression,
)

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
POSE_FITS_M = 1e-6
ACCELERATION_ROWS = 5  # an acceleration is the change of the speed since as many rows ago


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
    log = _take(log, slice(MOST_ROWS))
    log = _take(log, _are_legs(log.displacement_m, platform))
    if len(log.t_s) < 2 or log.t_s[-1] - log.t_s[0] < SHORTEST_S:
        return None
    log = _without_gaps(log)
    rows = inner(log.t_s)
    dt_s = float(np.median(np.diff(log.t_s)))
    smooth, matrix = _equations(log, platform, dt_s, "sensor")
    _, instruments = _equations(log, platform, dt_s, "displacement")
    scale = np.linalg.norm(matrix, axis=0)
    product = (instruments / np.maximum(scale, TINY)).T @ (matrix / np.maximum(scale, TINY))
    if np.linalg.cond(product) > WORST_CONDITION:
        return None
    inverse = np.linalg.inv(product) / scale[:, None] / scale
    value = (inverse @ (instruments.T @ smooth.force_n[rows].ravel()))[OFFSETS:]
    noise_n = np.std((log.force_n - smooth.force_n - smooth.matrix @ platform.theta)[rows])
    covariance = noise_n**2 * (inverse @ (instruments.T @ instruments) @ inverse.T)[OFFSETS:, OFFSETS:]
    if value @ np.linalg.solve(covariance, value) < SIGNIFICANT or _at_hinge_kg(value, platform).max() > largest_kg:
        return None
    return LegMass(value, _offset_variance(platform, smooth.motion, dt_s, rows, covariance))


def _equations(log: LegLog, platform: Platform, dt_s: float, speeds: Speeds) -> tuple[Regression, Array]:
    """Those of the body, and their matrix with B, C and D as more unknowns, one row per leg and tick."""
    smooth = regression(log, platform, "zero_phase", speeds)
    of_legs, rows = _smooth_leg_forces(platform, smooth.motion, dt_s), inner(log.t_s)
    matrix = np.concatenate([smooth.matrix[rows], of_legs[rows]], axis=2)
    return smooth, matrix.reshape(-1, OFFSETS + PARAMETERS)


def without_leg_mass(log: LegLog, platform: Platform, value: ArrayLike) -> LegLog:
    """The log of a run with legs of which only the rod's mass at the hinge is left.

    Each row needs none but rows before it, so that a controller can do the same. A row of no pose is left as it is.
    """
    force_n = log.force_n.copy()
    for start in range(0, len(force_n), PART_ROWS):
        rows = slice(max(0, start - ACCELERATION_ROWS), start + PART_ROWS)
        legs_n = _present_leg_forces(platform, log.t_s[rows], log.displacement_m[rows], log.velocity_m_s[rows])
        force_n[start : rows.stop] -= (legs_n @ np.asarray(value, float))[start - rows.start :]
    return replace(log, force_n=force_n)


def _present_leg_forces(platform: Platform, t_s: Array, displacement_m: Array, velocity_m_s: Array) -> Array:
    """As _leg_forces(), from each row and those before it."""
    is_leg = _are_legs(displacement_m, platform)
    motion = motion_of_legs(platform, np.where(is_leg[:, None], displacement_m, 0.0), velocity_m_s)
    excess_m = _leg_lengths(platform, motion.p_m, motion.rotation) - _home_m(platform) - displacement_m
    has_pose = (np.abs(excess_m) < POSE_FITS_M).all(axis=1)
    speed = _hinge_speeds(platform, motion)
    acceleration = np.zeros_like(speed)
    since = ACCELERATION_ROWS
    acceleration[since:] = (speed[since:] - speed[:-since]) / (t_s[since:] - t_s[:-since])[:, None, None]
    return has_pose[:, None, None] * _leg_forces(platform, motion, acceleration)


def _take(log: LegLog, rows: slice | NDArray[np.bool_]) -> LegLog:
    parts = (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(*(part[rows] for part in parts))


def _are_legs(displacement_m: Array, platform: Platform) -> NDArray[np.bool_]:
    return (np.abs(displacement_m) < LARGEST_STROKE * _home_m(platform)).all(axis=1)


def _home_m(platform: Platform) -> Array:
    """Lengths of the legs, (1, 6)."""
    return _leg_lengths(platform, np.zeros((1, 3)), np.eye(3)[None])


def _without_gaps(log: LegLog) -> LegLog:
    dt_s = float(np.median(np.diff(log.t_s)))
    t_s = log.t_s[0] + dt_s * np.arange(round((log.t_s[-1] - log.t_s[0]) / dt_s) + 1)
    parts = (log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(t_s, *(np.stack([np.interp(t_s, log.t_s, leg) for leg in part.T], axis=1) for part in parts))


def _at_hinge_kg(value: Array, platform: Platform) -> Array:
    """What the legs' inertia and their weight count at a hinge, at home."""
    length_m = _home_m(platform).mean()
    return np.abs([value[0] / length_m**2 - value[1] / length_m, value[2] / length_m])


def _leg_vectors(platform: Platform, p_m: Array, rotation: Array) -> Array:
    """L, (n, 6, 3), base axes."""
    arms_m = np.einsum("nij,lj->nli", rotation, platform.platform_hinges_m)
    return p_m[:, None] + arms_m - platform.base_hinges_m + [0.0, 0.0, platform.home_height_m]


def _leg_lengths(platform: Platform, p_m: Array, rotation: Array) -> Array:
    """l, (n, 6)."""
    return np.linalg.norm(_leg_vectors(platform, p_m, rotation), axis=2)


def _hinge_speeds(platform: Platform, motion: Trajectory) -> Array:
    """u, (n, 6, 3), base axes."""
    arms_m = np.einsum("nij,lj->nli", motion.rotation, platform.platform_hinges_m)
    return motion.velocity_m_s[:, None] + np.cross(motion.angular_velocity_rad_s[:, None], arms_m)


def _leg_forces(platform: Platform, motion: Trajectory, acceleration_m_s2: Array) -> Array:
    """What F needs of the legs, (n, 6, 3), per unit of B, C and D; the accelerations are the hinges', (n, 6, 3)."""
    leg_m = _leg_vectors(platform, motion.p_m, motion.rotation)
    length = np.linalg.norm(leg_m, axis=2, keepdims=True)
    e = leg_m / length
    speed = _hinge_speeds(platform, motion)
    along = np.sum(e * speed, axis=2, keepdims=True)
    across = speed - along * e
    square = np.sum(across**2, axis=2, keepdims=True)
    turning = acceleration_m_s2 - e * np.sum(e * acceleration_m_s2, axis=2, keepdims=True)

    def inertial(nu: Array, slope: Array) -> Array:
        return nu * turning + slope * along * across - (nu / length + slope / 2.0) * square * e

    up = np.array([0.0, 0.0, platform.gravity_m_s2])
    tilting = (up - e * (e @ up)[:, :, None]) / length
    parts = [inertial(length**-2, -2.0 * length**-3), inertial(-1.0 / length, length**-2), tilting]
    arms_m = leg_m + platform.base_hinges_m - [0.0, 0.0, platform.home_height_m] - motion.p_m[:, None]
    wrenches = [np.concatenate([part.sum(axis=1), np.cross(arms_m, part).sum(axis=1)], axis=1) for part in parts]
    jacobian = leg_jacobian(platform, motion)
    return np.linalg.solve(np.swapaxes(jacobian, 1, 2), np.stack(wrenches, axis=2))


def _smooth_leg_forces(platform: Platform, motion: Trajectory, dt_s: float) -> Array:
    return _leg_forces(platform, motion, np.gradient(_hinge_speeds(platform, motion), dt_s, axis=0))


def _offset_variance(platform: Platform, motion: Trajectory, dt_s: float, rows: slice, covariance: Array) -> Array:
    """Errors of B, C and D are a part of theta on the run, T_run, and on another motion, T: what is left is their
    difference. The other motions are the run's halves, at its own pace and slower."""
    differences = []
    for pace in PACES:
        slower = replace(
            motion,
            velocity_m_s=pace * motion.velocity_m_s,
            angular_velocity_rad_s=pace * motion.angular_velocity_rad_s,
        )
        of_body = leg_equations(platform, slower, dt_s / pace)
        of_legs = _smooth_leg_forces(platform, slower, dt_s / pace)
        if pace == 1.0:
            of_run = _as_offset(of_body[rows], of_legs[rows])
        middle = len(of_body) // 2
        for half in (slice(rows.start, middle), slice(middle, rows.stop)):
            differences.append(_as_offset(of_body[half], of_legs[half]) - of_run)
    return np.mean([np.diagonal(one @ covariance @ one.T) for one in differences], axis=0)


def _as_offset(of_body: Array, of_legs: Array) -> Array:
    """T, (10, 3): the theta that a motion makes of B, C and D."""
    return np.linalg.lstsq(of_body.reshape(-1, OFFSETS), of_legs.reshape(-1, PARAMETERS), rcond=None)[0]
