"""Motions that tell most about a load: finite Fourier series inside the machine's limits, found by optimisation.

The quantity that counts is the posterior Cramer-Rao bound (hexload.theory.bound). Here it is computed without the
bound's recursion of covariances. Leg forces are linear in theta, f = A(q, q', q'') theta by Newton and Euler, and the
force sensors' noise is white. The velocity sensors' noise, through the mass matrix mu in leg coordinates, looks like
force noise that grows with frequency: sigma_f^2 + (w mu sigma_v)^2. A low-pass of time constant tau = mu sigma_v /
sigma_f makes that white:

    information = sum over ticks of (filtered A)^T (filtered A) / sigma_f^2

A pose is far from a singular one when the Jacobian J_s, its moments divided by a characteristic length, is: its
condition is |J_s| |J_s^-1| / 6 by Frobenius norms, 1 at best, and 1 / |J_s^-1| bounds its distance to the next singular
matrix from below.

Angles and arrays as in hexload.theory.bound; q = [x, y, z, roll, pitch, yaw].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, minimize

from hexload.theory.bound import (
    Platform,
    Sigmas,
    Trajectory,
    crlb,
    inertia_times,
    leg_jacobian,
    rotation_from_rpy,
    tensor_of,
    vectors_of_legs,
)
from hexload.theory.kinematics import cross_matrix

Array = NDArray[np.float64]

STEP_S = 10e-3  # 40 steps per period at 2.5 Hz
TICK_S = 1e-3
RUN_IN_S = 0.5
WORST_POWER = 4  # of the smooth maximum over the relative variances
LIMIT_POWER = 60  # of the smooth maximum over ticks and limits
NEGLIGIBLE = 0.6  # of the largest: 0.6^60 = 5e-14
DIFFERENCE = 1e-6  # m, rad and their rates: far above rounding, far below the motion
BISECTIONS = 16
MARGIN = 1e-3  # of the limits: what the file's digits and its interpolation may take


@dataclass(frozen=True)
class Limits:
    """What a motion may use."""

    stroke_min_m: float
    stroke_max_m: float
    leg_speed_m_s: float
    speed_sum_m_s: float  # over six legs
    leg_force_n: float
    tilt_rad: float
    condition: float
    distance: float  # to singularity, at least; 0: only a singular pose is too near


@dataclass(frozen=True)
class Posture:
    """How far poses are from the machine's singular ones."""

    tilt_rad: Array  # (n,) between the platform's normal and the vertical
    condition: Array  # (n,)
    distance: Array  # (n,)


@dataclass(frozen=True)
class Problem:
    platform: Platform
    home_leg_length_m: Array  # (6,)
    length_m: float  # characteristic, of the condition
    limits: Limits
    sigmas: Sigmas
    theta: Array  # (10,) of the expected load
    heaviest_theta: Array  # (10,) of the heaviest, whose forces are limited
    scale: Array  # (10,) that errors are compared with
    prior_sigma: Array  # (10,) before the first tick
    duration_s: float
    frequencies_hz: Array


def optimise(problem: Problem, seed: int, starts: int, iterations: int, progress: Callable[[float], None]) -> Array:
    """Coefficients, (2 frequencies, 6), of the best of several motions.

    Searches that have taken a quarter of their steps rank already as they will end: only the best goes on.
    `progress`: called once an iteration with the worst relative bound of the motion that it has come to; at most
    steps_of() times.
    """
    random, basis = np.random.default_rng(seed), Basis(problem, STEP_S)
    first = _first_steps(starts, iterations)
    found = [_descend(problem, basis, _start(problem, random), first, progress) for _ in range(starts)]
    best = found[0] if starts == 1 else min(found, key=lambda each: _objective(problem, each, basis)[0])
    return best if first == iterations else _descend(problem, basis, best, iterations - first, progress)


def steps_of(starts: int, iterations: int) -> int:
    """Iterations of optimise() at most."""
    return iterations + (starts - 1) * _first_steps(starts, iterations)


def _first_steps(starts: int, iterations: int) -> int:
    return iterations if starts == 1 else max(1, iterations // 4)


def relative_bound(problem: Problem, truth: Trajectory) -> Array:
    """(10,): the bound itself after the last of rows TICK_S apart, as shares of the scales."""
    return (
        crlb(problem.platform, truth, problem.theta, problem.sigmas, problem.prior_sigma, dt_s=TICK_S)[-1]
        / problem.scale
    )


def _start(problem: Problem, random: np.random.Generator) -> Array:
    amplitude = 1.0 / np.tile(problem.frequencies_hz, 2)[:, None]
    return fitted(problem, 0.05 * amplitude * random.standard_normal((len(amplitude), 6)), STEP_S)


def _descend(
    problem: Problem, basis: "Basis", start: Array, iterations: int, progress: Callable[[float], None]
) -> Array:
    unit = np.abs(start).mean(axis=1, keepdims=True)  # amplitudes of high and low frequencies by one measure

    def cost(flat: Array) -> tuple[float, Array]:
        value, gradient = scaled_objective(problem, unit * flat.reshape(start.shape), basis)
        return value, (unit * gradient).ravel()

    options = {"maxiter": iterations, "maxfun": 3 * iterations}

    def told(intermediate_result: OptimizeResult) -> None:
        progress(float(np.exp(intermediate_result.fun)))

    result = minimize(cost, (start / unit).ravel(), jac=True, method="L-BFGS-B", options=options, callback=told)
    return fitted(problem, unit * result.x.reshape(start.shape), STEP_S)


def fitted(problem: Problem, coefficients: Array, step_s: float) -> Array:
    """Scaled up or down to where the first limit is met at one of the steps."""
    basis = Basis(problem, step_s)

    def is_beyond(scale: float) -> bool:
        largest = _limit_ratios(problem, basis.motion(scale * coefficients)).max()
        return not largest <= 1.0 - MARGIN  # also where a leg has no length

    low, high = 0.0, 1.0
    while not is_beyond(high):
        low, high = high, 1.25 * high
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_beyond(middle) else (middle, high)
    return low * coefficients


def force_ratios(problem: Problem, motion: Array) -> Array:
    """(n, 6): the legs' forces under the heaviest load as shares of their limit."""
    return _limit_ratios(problem, motion, with_pose=False)[:, :6]


def force_ratios_at_home(problem: Problem) -> Array:
    return force_ratios(problem, np.zeros((1, 18)))


class Basis:
    """Sines and cosines that grow from rest and go back to it, with two derivatives."""

    def __init__(self, problem: Problem, step_s: float):
        count = round(problem.duration_s / step_s) + 1
        self.t_s = np.linspace(0.0, problem.duration_s, count)
        span_s = min(RUN_IN_S, problem.duration_s / 4)
        rise = _smooth_step(self.t_s, span_s)
        fall = _smooth_step(problem.duration_s - self.t_s, span_s)
        window = _product(rise, (fall[0], -fall[1], fall[2]))
        w = 2.0 * np.pi * problem.frequencies_hz
        sine, cosine = np.sin(np.outer(self.t_s, w)), np.cos(np.outer(self.t_s, w))
        waves = (
            np.hstack([sine, cosine]),
            np.hstack([cosine * w, -sine * w]),
            np.hstack([-sine * w**2, -cosine * w**2]),
        )
        self.functions = _product(tuple(part[:, None] for part in window), waves)

    def motion(self, coefficients: Array) -> Array:
        """(n, 18): q, q', q''."""
        return np.hstack([part @ coefficients for part in self.functions])

    def pull_back(self, gradient: Array) -> Array:
        """From the derivative by the motion, (n, 18), to that by the coefficients."""
        return sum(part.T @ gradient[:, 6 * k : 6 * k + 6] for k, part in enumerate(self.functions))


def trajectory_of(motion: Array) -> Trajectory:
    """Of rows that begin with q and q'."""
    rates = _euler_rates(motion[:, 3:6])
    return Trajectory(
        motion[:, :3],
        rotation_from_rpy(motion[:, 3:6]),
        motion[:, 6:9],
        np.einsum("nij,nj->ni", rates, motion[:, 9:12]),
    )


def information(problem: Problem, motion: Array) -> Array:
    """(10, 10) of theta, prior included, from rows STEP_S apart."""
    regressor = _leg_force_regressor(problem.platform, motion)
    return _information(problem, _whiten(regressor, _delays(problem, motion)))


def _information(problem: Problem, whitened: Array) -> Array:
    weight = STEP_S / TICK_S / problem.sigmas.force_n**2
    return weight * np.einsum("nli,nlj->ij", whitened, whitened) + np.diag(problem.prior_sigma**-2.0)


def scaled_objective(problem: Problem, coefficients: Array, basis: Basis | None = None) -> tuple[float, Array]:
    """The objective where the ray through the coefficients meets the smooth limit. `basis`: that of STEP_S."""
    basis = basis or Basis(problem, STEP_S)
    size, size_gradient = _smooth_limit(problem, coefficients, basis)
    value, gradient = _objective(problem, coefficients / size, basis)
    radial = float((gradient * coefficients).sum()) / size**2
    return value, gradient / size - radial * size_gradient


def _objective(problem: Problem, coefficients: Array, basis: Basis) -> tuple[float, Array]:
    """Logarithm of the smooth worst relative bound, and its derivative."""
    motion = basis.motion(coefficients)
    regressor, delays = _leg_force_regressor(problem.platform, motion), _delays(problem, motion)
    whitened = _whiten(regressor, delays)
    covariance = np.linalg.inv(_information(problem, whitened))
    relative = np.diagonal(covariance) / problem.scale**2
    powers = relative**WORST_POWER
    value = np.log(powers.sum()) / (2 * WORST_POWER)
    by_variance = powers / powers.sum() / np.diagonal(covariance) / 2.0
    by_information = covariance * by_variance @ covariance
    weight = STEP_S / TICK_S / problem.sigmas.force_n**2
    by_regressor = _whiten_back(-2.0 * weight * whitened @ by_information, delays)
    backward = np.diff(whitened, axis=0, prepend=0.0)
    by_delays = -by_regressor @ np.swapaxes(backward, 1, 2)
    gradient = _by_motion(problem, motion, (regressor, delays), (by_regressor, by_delays))
    return float(value), basis.pull_back(gradient)


def _by_motion(problem: Problem, motion: Array, parts: tuple[Array, Array], by_parts: tuple[Array, Array]) -> Array:
    """(n, 18): the derivative by the motion, from those by the regressor A = J^-T W and by the delays J^-T M J^-1.

    With dA = J^-T (dW - dJ^T A), and alike for the delays, only J, W and M are differenced, and those only where they
    depend on a column: J on the pose, W on angles, their rates and accelerations, M on angles.
    """
    (regressor, delays), (by_regressor, by_delays) = parts, by_parts
    trajectory = trajectory_of(motion)
    jacobian = leg_jacobian(problem.platform, trajectory)
    inverse = np.linalg.inv(jacobian)
    inverse_t = np.swapaxes(inverse, 1, 2)
    by_wrench = inverse @ by_regressor
    by_mass = _delay_factor(problem) * inverse @ by_delays @ inverse_t
    by_jacobian = -regressor @ np.swapaxes(by_wrench, 1, 2)
    by_jacobian -= delays @ (by_delays + np.swapaxes(by_delays, 1, 2)) @ inverse_t
    wrench, mass = _wrench_regressor(problem.platform, motion, trajectory), _mass_matrix(problem, trajectory)
    gradient = np.zeros_like(motion)
    for column in (*range(6), *range(9, 18)):
        moved = _moved(motion, column)
        trajectory = trajectory_of(moved)
        if column < 6:
            gradient[:, column] += _dot(by_jacobian, leg_jacobian(problem.platform, trajectory) - jacobian)
        if column >= 3:
            gradient[:, column] += _dot(by_wrench, _wrench_regressor(problem.platform, moved, trajectory) - wrench)
        if 3 <= column < 6:
            gradient[:, column] += _dot(by_mass, _mass_matrix(problem, trajectory) - mass)
    return gradient / DIFFERENCE


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("nij,nij->n", a, b)


def _smooth_limit(problem: Problem, coefficients: Array, basis: Basis) -> tuple[float, Array]:
    """Smooth maximum of what the motion uses of the limits, 1 = all, and its derivative."""
    motion = basis.motion(coefficients)
    ratios = _limit_ratios(problem, motion)
    largest = ratios.max()
    powers = (ratios / largest) ** LIMIT_POWER
    value = largest * powers.sum() ** (1.0 / LIMIT_POWER)
    by_ratio = value / powers.sum() * np.divide(powers, ratios, out=np.zeros_like(ratios), where=ratios > 0)
    gradient, near = np.zeros_like(motion), ratios.max(axis=1) > NEGLIGIBLE * largest
    ratios, by_ratio = ratios[near], by_ratio[near]
    for column in range(18):
        moved = _limit_ratios(problem, _moved(motion[near], column), with_pose=column < 6)
        count = moved.shape[1]
        gradient[near, column] = (by_ratio[:, :count] * (moved - ratios[:, :count])).sum(axis=1) / DIFFERENCE
    return float(value), basis.pull_back(gradient)


def _moved(motion: Array, column: int) -> Array:
    moved = motion.copy()
    moved[:, column] += DIFFERENCE
    return moved


def _limit_ratios(problem: Problem, motion: Array, with_pose: bool = True) -> Array:
    """(n, 22): force and speed of each leg, the sum of speeds, and with_pose, which depend on it alone, displacement of
    each leg, tilt, condition and distance to singularity, as shares of their limits."""
    platform, trajectory, limits = problem.platform, trajectory_of(motion), problem.limits
    twist = np.hstack([trajectory.velocity_m_s, trajectory.angular_velocity_rad_s])
    jacobian = leg_jacobian(platform, trajectory)
    speed = np.abs(np.einsum("nij,nj->ni", jacobian, twist))
    wrench = _wrench(platform, motion, trajectory, platform.theta + problem.heaviest_theta)
    force = np.abs(np.linalg.solve(np.swapaxes(jacobian, 1, 2), wrench[:, :, None])[:, :, 0])
    total = speed.sum(axis=1, keepdims=True) / limits.speed_sum_m_s
    ratios = [force / limits.leg_force_n, speed / limits.leg_speed_m_s, total]
    if with_pose:
        ratios += [_stroke_ratios(problem, trajectory), posture_ratios(problem, posture(problem, trajectory, jacobian))]
    return np.hstack(ratios)


def _stroke_ratios(problem: Problem, trajectory: Trajectory) -> Array:
    displacement = leg_displacement(problem, trajectory)
    return np.maximum(displacement / problem.limits.stroke_max_m, displacement / problem.limits.stroke_min_m)


def leg_displacement(problem: Problem, trajectory: Trajectory) -> Array:
    """(n, 6) from home, m."""
    return np.linalg.norm(vectors_of_legs(problem.platform, trajectory), axis=2) - problem.home_leg_length_m


def posture(problem: Problem, trajectory: Trajectory, jacobian: Array | None = None) -> Posture:
    """Tilt, condition and distance to singularity of each pose. `jacobian`: of the trajectory, if known already."""
    scaled = (leg_jacobian(problem.platform, trajectory) if jacobian is None else jacobian).copy()
    scaled[:, :, 3:] /= problem.length_m
    inverse_norm = np.sqrt((np.linalg.inv(scaled) ** 2).sum(axis=(1, 2)))
    rotation = trajectory.rotation
    return Posture(
        tilt_rad=np.arctan2(np.hypot(rotation[:, 0, 2], rotation[:, 1, 2]), rotation[:, 2, 2]),
        condition=np.sqrt((scaled**2).sum(axis=(1, 2))) * inverse_norm / 6.0,
        distance=1.0 / inverse_norm,
    )


def home_posture(problem: Problem) -> Posture:
    return posture(problem, trajectory_of(np.zeros((1, 18))))


def posture_ratios(problem: Problem, found: Posture, limits: Limits | None = None) -> Array:
    """(n, 3): what poses use of the room for tilt, condition and distance between home and `limits`, the problem's."""
    limits = limits or problem.limits
    home = home_posture(problem)
    condition = (found.condition - home.condition) / (limits.condition - home.condition)
    nearness = 1.0 / found.distance - 1.0 / home.distance
    distance = limits.distance * nearness / (1.0 - limits.distance / home.distance)
    return np.column_stack([found.tilt_rad / limits.tilt_rad, np.maximum(condition, 0.0), np.maximum(distance, 0.0)])


def _wrench(platform: Platform, motion: Array, trajectory: Trajectory, theta: Array) -> Array:
    """(n, 6): force and moment about O_A that move a body, from Newton and Euler."""
    rotation, w = trajectory.rotation, trajectory.angular_velocity_rad_s
    specific, alpha = _accelerations(platform, motion)
    moment = rotation @ theta[1:4]
    inertia = rotation @ tensor_of(theta[4:]) @ np.swapaxes(rotation, 1, 2)
    force = theta[0] * specific + np.cross(alpha, moment) + np.cross(w, np.cross(w, moment))
    spin = np.einsum("nij,nj->ni", inertia, w)
    torque = np.cross(moment, specific) + np.einsum("nij,nj->ni", inertia, alpha) + np.cross(w, spin)
    return np.hstack([force, torque])


def _accelerations(platform: Platform, motion: Array) -> tuple[Array, Array]:
    """Of O_A against free fall, and the angular one; (n, 3) each."""
    alpha = np.einsum("nij,nj->ni", _euler_rates(motion[:, 3:6]), motion[:, 15:18])
    alpha += np.einsum("nij,nj->ni", _euler_rate_derivatives(motion[:, 3:6], motion[:, 9:12]), motion[:, 9:12])
    return motion[:, 12:15] + [0.0, 0.0, platform.gravity_m_s2], alpha


def _leg_force_regressor(platform: Platform, motion: Array) -> Array:
    """A, (n, 6, 10): leg forces per unit of each parameter."""
    trajectory = trajectory_of(motion)
    jacobian = leg_jacobian(platform, trajectory)
    return np.linalg.solve(np.swapaxes(jacobian, 1, 2), _wrench_regressor(platform, motion, trajectory))


def _wrench_regressor(platform: Platform, motion: Array, trajectory: Trajectory) -> Array:
    """(n, 6, 10): force and moment about O_A per unit of each parameter, from Newton and Euler."""
    rotation, w = trajectory.rotation, trajectory.angular_velocity_rad_s
    specific, alpha = _accelerations(platform, motion)
    spin = cross_matrix(w)
    wrench = np.zeros((len(motion), 6, 10))
    wrench[:, :3, 0] = specific
    wrench[:, :3, 1:4] = (cross_matrix(alpha) + spin @ spin) @ rotation
    wrench[:, 3:, 1:4] = -cross_matrix(specific) @ rotation
    body_w, body_alpha = (np.einsum("nji,nj->ni", rotation, vector) for vector in (w, alpha))
    wrench[:, 3:, 4:] = rotation @ (inertia_times(body_alpha) + cross_matrix(body_w) @ inertia_times(body_w))
    return wrench


def _delays(problem: Problem, motion: Array) -> Array:
    """tau / step, (n, 6, 6): the legs' mass matrix by sigma_v / sigma_f."""
    trajectory = trajectory_of(motion)
    inverse = np.linalg.inv(leg_jacobian(problem.platform, trajectory))
    return _delay_factor(problem) * np.swapaxes(inverse, 1, 2) @ _mass_matrix(problem, trajectory) @ inverse


def _delay_factor(problem: Problem) -> float:
    return problem.sigmas.velocity_m_s / problem.sigmas.force_n / STEP_S


def _mass_matrix(problem: Problem, trajectory: Trajectory) -> Array:
    """(n, 6, 6) of platform and expected load about O_A, base axes."""
    theta = problem.platform.theta + problem.theta
    rotation = trajectory.rotation
    arm = cross_matrix(np.einsum("nij,j->ni", rotation, theta[1:4]))
    tensor = rotation @ tensor_of(theta[4:]) @ np.swapaxes(rotation, 1, 2)
    upper = np.concatenate([np.broadcast_to(theta[0] * np.eye(3), arm.shape), -arm], axis=2)
    return np.concatenate([upper, np.concatenate([arm, tensor], axis=2)], axis=1)


def _whiten(regressor: Array, delays: Array) -> Array:
    """z of z + tau z' = A, by Euler's implicit rule from rest."""
    inverse = np.linalg.inv(np.eye(6) + delays)
    whitened = np.empty_like(regressor)
    last = np.zeros_like(regressor[0])
    for k in range(len(regressor)):
        last = whitened[k] = inverse[k] @ (regressor[k] + delays[k] @ last)
    return whitened


def _whiten_back(gradient: Array, delays: Array) -> Array:
    """The transpose of _whiten(): from the derivative by z to that by A. The delays are symmetric."""
    inverse = np.linalg.inv(np.eye(6) + delays)
    result = np.empty_like(gradient)
    carried = np.zeros_like(gradient[0])
    for k in reversed(range(len(gradient))):
        result[k] = inverse[k] @ (gradient[k] + carried)
        carried = delays[k] @ result[k]
    return result


def _smooth_step(t_s: Array, span_s: float) -> tuple[Array, Array, Array]:
    """0 to 1 over span_s, the simulator's quintic, with two derivatives."""
    s = np.clip(t_s / span_s, 0.0, 1.0)
    value = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
    return value, 30.0 * (s * (1.0 - s)) ** 2 / span_s, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / span_s**2


def _product(a: tuple[Array, Array, Array], b: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    return a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]


def _euler_rates(rpy: Array) -> Array:
    """E, (n, 3, 3): angular velocity = E [roll', pitch', yaw'], base axes."""
    (_, sp, sy), (_, cp, cy) = np.sin(rpy).T, np.cos(rpy).T
    zero, one = np.zeros(len(rpy)), np.ones(len(rpy))
    return np.moveaxis(np.array([[cy * cp, -sy, zero], [sy * cp, cy, zero], [-sp, zero, one]]), 2, 0)


def _euler_rate_derivatives(rpy: Array, rates: Array) -> Array:
    """dE/dt."""
    (_, sp, sy), (_, cp, cy) = np.sin(rpy).T, np.cos(rpy).T
    _, pitch, yaw = rates.T
    zero = np.zeros(len(rpy))
    rows = [
        [-sy * cp * yaw - cy * sp * pitch, -cy * yaw, zero],
        [cy * cp * yaw - sy * sp * pitch, -sy * yaw, zero],
        [-cp * pitch, zero, zero],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
