"""Posterior Cramer-Rao bound of the load parameters along a known trajectory.

No unbiased estimator that sees the leg speeds and leg forces of a run can have, on average over runs, a smaller
standard deviation than this bound. It is the covariance of a Kalman filter that is told the true trajectory
(P. Tichavsky, C. Muravchik, A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998, doi:10.1109/78.668800): for a
process model without noise in theta the recursion of the information matrix is that of the linearised filter.

The model is the momentum formulation. Linear and angular momentum of platform + load about the fixed home point,

    P = m v + w x R h          H = p x P + R h x v + R I R^T w          mu = [P; H] = Y(p, R, V) theta_total
    d mu / dt = [F; N + p x F] + G(p, R) theta_total                    theta_total = theta + theta_platform

are exactly linear in theta = [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz]: h = m c, c the load's centre of mass, I
the inertia tensor entries about O_A, both in platform axes. State [mu; theta], one step per tick of dt:

    F = [E, Gbar; 0, E], Gbar = dt/2 (G_k + G_{k-1})      Q_mu = dt^2 sigma_f^2 Jw Jw^T
    H = J M^-1 [E, -Y],  R = sigma_v^2 E6                 Jw column j = [e_j; R a_j x e_j + p x e_j]

The pose counts as known: 20 um of displacement noise are nothing beside 1 mm/s of speed noise.

With the displacements as measurements too (Sigmas.displacement_m) the errors l of the leg displacements join the state,
the integral of the errors of the leg speeds s, and are measured as they are, with R = sigma_d^2 E6:

    l_k = l_k-1 + dt/2 (s_k + s_k-1)        s = J M^-1 [E, -Y] [mu; theta]

What l does to the pose is left out: it would add some l v / 0.9 m to the speeds v of the legs, 0.5 /s, beside the
sigma_v / sigma_d = 50 /s with which the measurements take l away, and 0.02 N of 1 kN to the forces, beside 5 N. That is
half a percent of the bound.

With the machine's own effects as more unknowns (LegFriction), a leg's force sensor shows more than the force on the
platform, which is f - b - c s(v) - d v: a bias b, Coulomb and viscous friction c and d, s(v) = v / sqrt(v^2 + v0^2). The
leg speeds v = J M^-1 mu depend on the state, so with D = diag(c s'(v) + d) and B = Jw D J M^-1 the derivatives of
d mu / dt are -B by mu, G + B Y by theta and -Jw [E, diag(s), diag(v)] by x = [b; c; d]. The trapezoidal rule has B at both ends
of the period, hence

    F_mu = W (E - dt/2 B_k-1), F_theta = W dt/2 (g_k + g_k-1), g = G + B Y, likewise F_x, W = (E + dt/2 B_k)^-1
    Q_mu = W dt^2 sigma_f^2 Jw Jw^T W^T

Units are SI; angular velocity and forces are in base axes; R maps platform axes to base axes; the displacement p of
O_A counts from home. Arrays carry the tick as their first axis.
"""

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload.errors import InputError
from hexload.io.toml_document import read_toml
from hexload.theory.kinematics import LEGS, cross_matrix, jacobian_of, leg_vectors

Array = NDArray[np.float64]
Parameters = Literal["ten", "paper"]
Prior = Literal["safe", "printed"]

THETA_NAMES = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
PAPER_NAMES = ("dz", "Ixx", "Iyy", "Izz")
TENSOR = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))  # rows and columns of Ixx, Iyy, Izz, Ixy, Ixz, Iyz in the tensor
EFFECTS = ("bias", "coulomb", "viscous")  # x: six legs of the first, of the second, of the third; N, N, N s/m


@dataclass(frozen=True)
class Platform:
    """The machine without its load."""

    base_hinges_m: Array  # (6, 3), base axes
    platform_hinges_m: Array  # (6, 3), platform axes
    home_height_m: float  # height of O_A over the base origin at home
    theta: Array  # (10,), the platform's own parameters, as theta of the load
    gravity_m_s2: float

    @property
    def base_from_home_m(self) -> Array:
        """Base hinges from O_A at home, (6, 3), base axes."""
        return self.base_hinges_m - [0.0, 0.0, self.home_height_m]


@dataclass(frozen=True)
class Trajectory:
    """True motion of O_A, one row per tick."""

    p_m: Array  # (n, 3)
    rotation: Array  # (n, 3, 3)
    velocity_m_s: Array  # (n, 3)
    angular_velocity_rad_s: Array  # (n, 3)


@dataclass(frozen=True)
class Sigmas:
    """Standard deviation of the white noise of one leg sensor at one tick."""

    velocity_m_s: float
    force_n: float
    displacement_m: float | None = None  # None: displacements tell the pose, but nothing of the speeds


@dataclass(frozen=True)
class LegFriction:
    """What the force sensors show beside the force on the platform; the bound does not depend on the biases."""

    coulomb_n: Array  # (6,)
    viscous_n_s_m: Array  # (6,)
    friction_speed_m_s: float  # v0 of s(v)


def tensor_of(inertia: Array) -> Array:
    """(3, 3) of [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def unit_of(name: str) -> str:
    """Of one of the ten: mass, first moments h of mass, moments and products of inertia."""
    return {"m": "kg", "h": "kg m", "I": "kg m²"}[name[0]]


def scale_of(theta: Array) -> Array | None:
    """What percentages refer to: a parameter's own value for m, hz, Ixx, Iyy, Izz; |h| for hx, hy; the mean moment for
    products. None for the empty platform, which has none.
    """
    if theta[0] == 0.0:
        return None
    scale = np.abs(theta)
    scale[1:3] = np.linalg.norm(theta[1:4])
    scale[7:] = theta[4:7].mean()
    return scale


def read_platform(path: Path) -> Platform:
    """The platform of a platform TOML file, which the simulator has already checked."""
    return platform_of(read_toml(path))


def platform_of(table: dict) -> Platform:
    """Of the tables of a platform file."""
    base = np.array(table["geometry"]["base_hinges_m"], float)
    upper = np.array(table["geometry"]["platform_hinges_m"], float)
    mass = float(table["platform"]["mass_kg"])
    com = np.array(table["platform"]["com_m"], float)
    inertia = np.array(table["platform"]["inertia_kg_m2"], float)
    return Platform(
        base_hinges_m=base,
        platform_hinges_m=upper,
        home_height_m=_home_height_m(base, upper, table["geometry"]["home_leg_length_m"]),
        theta=np.concatenate([[mass], mass * com, inertia]),
        gravity_m_s2=float(table["environment"]["gravity_m_s2"]),
    )


def hexload_momentum_regressor(trajectory: Trajectory) -> Array:
    """Y, (n, 6, 10): momentum about the home point per unit of each parameter."""
    p, rotation = trajectory.p_m, trajectory.rotation
    v, w = trajectory.velocity_m_s, trajectory.angular_velocity_rad_s
    y = np.zeros((len(p), 6, 10))
    y[:, :3, 0] = v
    y[:, :3, 1:4] = cross_matrix(w) @ rotation
    y[:, 3:, :4] = cross_matrix(p) @ y[:, :3, :4]
    y[:, 3:, 1:4] -= cross_matrix(v) @ rotation
    body_w = np.einsum("nji,nj->ni", rotation, w)
    y[:, 3:, 4:] = rotation @ inertia_times(body_w)
    return y


def gravity_regressor(platform: Platform, trajectory: Trajectory) -> Array:
    """G, (n, 6, 10): rate of the momentum under gravity per unit of each parameter."""
    gravity = np.array([0.0, 0.0, -platform.gravity_m_s2])
    g = np.zeros((len(trajectory.p_m), 6, 10))
    g[:, :3, 0] = gravity
    g[:, 3:, 0] = np.cross(trajectory.p_m, gravity)
    g[:, 3:, 1:4] = -cross_matrix(gravity) @ trajectory.rotation
    return g


def leg_jacobian(platform: Platform, trajectory: Trajectory) -> Array:
    """J, (n, 6, 6): leg speed = J [v; w], row i = [e_i^T, (R a_i x e_i)^T]."""
    return jacobian_of(platform.base_from_home_m, trajectory.p_m, vectors_of_legs(platform, trajectory))


def vectors_of_legs(platform: Platform, trajectory: Trajectory) -> Array:
    """From lower to upper hinge, (n, 6, 3), base axes."""
    return leg_vectors(platform.base_from_home_m, platform.platform_hinges_m, trajectory.p_m, trajectory.rotation)


def momentum_matrix(theta_total: Array, trajectory: Trajectory) -> Array:
    """M, (n, 6, 6): momentum about the home point = M [v; w]."""
    zero = np.zeros_like(trajectory.p_m)
    columns = []
    for axis in range(6):
        unit = np.broadcast_to(np.eye(6)[axis], (len(zero), 6))
        motion = Trajectory(trajectory.p_m, trajectory.rotation, unit[:, :3], unit[:, 3:])
        columns.append(hexload_momentum_regressor(motion) @ theta_total)
    return np.stack(columns, axis=2)


def paper_jacobian(theta: ArrayLike) -> Array:
    """(10, 4): derivative of theta by the paper's (dz, Ixx, Iyy, Izz), mass and the other entries held.

    The paper's moments are about the load's own centre of mass; theta's are about O_A, so that dz enters
    h = m c and, by the parallel-axis theorem, I = I_C + m (|c|^2 E - c c^T).
    """
    mass, hx, hy, hz = np.asarray(theta, float)[:4]
    jacobian = np.zeros((10, 4))
    jacobian[3, 0] = mass
    jacobian[4, 0] = jacobian[5, 0] = 2.0 * hz
    jacobian[8, 0], jacobian[9, 0] = -hx, -hy
    jacobian[4, 1] = jacobian[5, 2] = jacobian[6, 3] = 1.0
    return jacobian


def crlb(
    platform: Platform,
    truth: Trajectory,
    theta: ArrayLike,
    sigmas: Sigmas,
    prior_sigma: ArrayLike,
    parameters: Parameters = "ten",
    dt_s: float = 1e-3,
    machine: LegFriction | None = None,
) -> Array:
    """Bound on the standard deviation of each parameter after each tick.

    theta        (10,) true load parameters
    prior_sigma  what is known before the first tick: (10,) for "ten", (4,) for "paper", 18 more with a machine; the
                 twist is not known
    machine      its effects, which are to be found with the load; None: there are none, and that is known
    returns      (n, 10) in the order of THETA_NAMES, or (n, 4) in that of PAPER_NAMES, 18 more columns with a machine

    Raises ValueError if prior_sigma has the wrong shape. 10,000 ticks take about a second.
    """
    theta = np.asarray(theta, float)
    to_theta = {"ten": np.eye(10), "paper": paper_jacobian(theta)}[parameters]
    unknowns = to_theta.shape[1] + (0 if machine is None else len(EFFECTS) * LEGS)
    prior_sigma = np.asarray(prior_sigma, float)
    if prior_sigma.shape != (unknowns,):
        raise ValueError(f"prior_sigma: found shape {prior_sigma.shape}, expected ({unknowns},)")

    jacobian = leg_jacobian(platform, truth)
    y = hexload_momentum_regressor(truth) @ to_theta
    rate = gravity_regressor(platform, truth) @ to_theta
    damping = np.zeros_like(jacobian)
    wrench_map = _about_home(np.swapaxes(jacobian, 1, 2), truth.p_m)
    # The measurement J M^-1 [E, -Y] is used as [E, -Y] with the noise carried over by M J^-1: the same information.
    to_momentum = momentum_matrix(platform.theta + theta, truth) @ np.linalg.inv(jacobian)
    measurement = sigmas.velocity_m_s**2 * to_momentum @ np.swapaxes(to_momentum, 1, 2)
    if machine is not None:
        effects, slope = _rub(wrench_map, leg_speeds(jacobian, truth), machine)
        damping = slope @ np.linalg.inv(to_momentum)
        rate = np.concatenate([rate + damping @ y, effects], axis=2)
        y = np.concatenate([y, np.zeros_like(effects)], axis=2)
    transition, process = _over_a_tick(damping, rate, wrench_map, dt_s, sigmas.force_n)
    if sigmas.displacement_m is not None:
        speeds = np.linalg.inv(to_momentum) @ np.concatenate([np.broadcast_to(np.eye(6), jacobian.shape), -y], axis=2)
        transition, process = _with_displacements(transition, process, speeds, dt_s)
        y = np.concatenate([y, np.zeros_like(y)], axis=1)
        measurement = np.pad(measurement, [(0, 0), (0, 6), (0, 6)])
        measurement[:, 6:, 6:] = sigmas.displacement_m**2 * np.eye(6)
    return _covariance_recursion(y, transition, process, measurement, prior_sigma)


def leg_speeds(jacobian: Array, trajectory: Trajectory) -> Array:
    """(n, 6), m/s."""
    twist = np.hstack([trajectory.velocity_m_s, trajectory.angular_velocity_rad_s])
    return np.einsum("nij,nj->ni", jacobian, twist)


def _rub(wrench_map: Array, speed_m_s: Array, machine: LegFriction) -> tuple[Array, Array]:
    """Derivatives of d mu / dt by the effects, (n, 6, 18), and by minus the leg speeds, (n, 6, 6)."""
    root = np.sqrt(speed_m_s**2 + machine.friction_speed_m_s**2)
    sign, sign_slope = speed_m_s / root, machine.friction_speed_m_s**2 / root**3
    effects = [wrench_map, wrench_map * sign[:, None], wrench_map * speed_m_s[:, None]]
    slope = wrench_map * (machine.coulomb_n * sign_slope + machine.viscous_n_s_m)[:, None]
    return -np.concatenate(effects, axis=2), slope


def _over_a_tick(
    damping: Array, rate: Array, wrench_map: Array, dt_s: float, force_sigma_n: float
) -> tuple[Array, Array]:
    """[F_mu, F_theta] from each tick to the next, (n - 1, 6, 6 + k), and the Q_mu that comes with it, (n - 1, 6, 6)."""
    half = 0.5 * dt_s
    implicit = np.linalg.inv(np.eye(6) + half * damping[1:])
    explicit = np.eye(6) - half * damping[:-1]
    transition = implicit @ np.concatenate([explicit, half * (rate[1:] + rate[:-1])], axis=2)
    push = dt_s * force_sigma_n * implicit @ wrench_map[1:]
    return transition, push @ np.swapaxes(push, 1, 2)


def _with_displacements(transition: Array, process: Array, speeds: Array, dt_s: float) -> tuple[Array, Array]:
    """F and Q of [mu; l] from those of mu; speeds, (n, 6, 6 + k), are the derivatives of the leg speeds."""
    half = 0.5 * dt_s
    after = speeds[1:, :, :6] @ transition
    after[:, :, 6:] += speeds[1:, :, 6:]
    both = np.concatenate([transition, half * (speeds[:-1] + after)], axis=1)
    kept = np.concatenate([np.zeros((6, 6)), np.eye(6)])  # l_k-1 leaves mu and adds to l
    moved = np.concatenate([both[:, :, :6], np.broadcast_to(kept, (len(both), 12, 6)), both[:, :, 6:]], axis=2)
    push = np.concatenate([np.broadcast_to(np.eye(6), (len(both), 6, 6)), half * speeds[1:, :, :6]], axis=1)
    return moved, push @ process @ np.swapaxes(push, 1, 2)


def paper_prior_sigma(prior: Prior, mass_kg: float) -> Array:
    """Sigma of the paper filter's start values of (dz, Ixx, Iyy, Izz), m and kg m^2, from the variances in its P0.

    "printed" is the paper's P0, "safe" the one of this project, whose inertias grow with the load's mass.
    """
    if prior == "printed":
        return np.sqrt([1.0, 10.0, 500.0, 500.0])
    return np.sqrt([0.1, 500.0, 500.0, 500.0]) * [1.0, *(3 * [mass_kg / 500.0])]


def paper_bound(run_directory: Path) -> dict[str, float]:
    """Bound at the end of a run on (dz, Ixx, Iyy, Izz), m and kg m^2, for the load that it ends with.

    run_directory is what hexload_sim writes. The time counts from the tick at which that load appeared, the prior is
    that of the run's own estimator, the noise is the one that the simulator added.
    """
    run_directory = Path(run_directory)
    meta = json.loads((run_directory / "meta.json").read_text())
    load = meta["loads"][-1]
    truth = read_truth(run_directory / "truth.csv", from_s=load["at_s"])
    sigma = crlb(
        read_platform(run_directory / "platform.toml"),
        truth,
        load["theta"],
        Sigmas(meta["sensors"]["velocity_sigma_m_s"], meta["sensors"]["force_sigma_n"]),
        paper_prior_sigma(meta["estimator"]["prior"], load["mass_kg"]),
        "paper",
        meta["tick_s"],
    )
    return dict(zip(PAPER_NAMES, map(float, sigma[-1]), strict=True))


def read_truth(path: Path, from_s: float = 0.0) -> Trajectory:
    """The true motion of a run directory's truth.csv from the given time on."""
    with open(path, newline="") as file:
        names = next(csv.reader(file))
        expected = ["t", "x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "wx", "wy", "wz"]
        if names[:13] != expected:
            raise InputError(f"{path}: line 1: found columns {','.join(names[:13])}, expected {','.join(expected)}")
        rows = np.loadtxt(file, delimiter=",", usecols=range(13), ndmin=2)
    rows = rows[rows[:, 0] >= from_s - 1e-9]
    return Trajectory(rows[:, 1:4], rotation_from_rpy(rows[:, 4:7]), rows[:, 7:10], rows[:, 10:13])


def _covariance_recursion(y: Array, transition: Array, process: Array, measurement: Array, prior_sigma: Array) -> Array:
    """Sigma of theta after each tick, (n, k), from a diffuse moving state [mu] or [mu; l] before tick 0."""
    moving, k = y.shape[1:]
    prior = np.diag(prior_sigma**2)
    # Limit of the first update for an infinite covariance of mu: mu - Y theta is known to the measurement's noise.
    covariance = np.zeros((moving + k, moving + k))
    covariance[moving:, moving:] = prior
    covariance[:moving, moving:] = y[0] @ prior
    covariance[moving:, :moving] = covariance[:moving, moving:].T
    covariance[:moving, :moving] = y[0] @ prior @ y[0].T + measurement[0]

    variance = np.empty((len(y), k))
    variance[0] = prior_sigma**2
    for tick in range(1, len(y)):
        covariance[:moving] = transition[tick - 1] @ covariance
        covariance[:, :moving] = covariance @ transition[tick - 1].T
        covariance[:moving, :moving] += process[tick - 1]
        cross = covariance[:moving] - y[tick] @ covariance[moving:]
        innovation = cross[:, :moving] - cross[:, moving:] @ y[tick].T + measurement[tick]
        covariance -= cross.T @ np.linalg.solve(innovation, cross)
        covariance = 0.5 * (covariance + covariance.T)  # rounding of one half against the other grows without bound
        variance[tick] = np.diagonal(covariance)[moving:]
    return np.sqrt(variance)


def _home_height_m(base: Array, upper: Array, home_leg_length_m: float | list[float]) -> float:
    """Height at which, level and centred, the mean leg length is the mean home leg length (Newton's method)."""
    target = float(np.mean(home_leg_length_m))
    offset = upper - base
    height = target
    for _ in range(50):
        legs = offset + [0.0, 0.0, height]
        lengths = np.linalg.norm(legs, axis=1)
        height -= (lengths.mean() - target) / (legs[:, 2] / lengths).mean()
    return height


def _about_home(wrench_columns: Array, p: Array) -> Array:
    """Moves the moment of wrench columns [e; R a x e] from O_A to the home point: adds p x e."""
    moved = wrench_columns.copy()
    moved[:, 3:] += cross_matrix(p) @ wrench_columns[:, :3]
    return moved


def inertia_times(w: Array) -> Array:
    """L(w), (n, 3, 6): I w = L(w) [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."""
    matrix = np.zeros((len(w), 3, 6))
    x, y, z = w.T
    matrix[:, 0, 0], matrix[:, 0, 3], matrix[:, 0, 4] = x, y, z
    matrix[:, 1, 1], matrix[:, 1, 3], matrix[:, 1, 5] = y, x, z
    matrix[:, 2, 2], matrix[:, 2, 4], matrix[:, 2, 5] = z, x, y
    return matrix


def rotation_from_rpy(rpy: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), (n, 3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy).T, np.cos(rpy).T
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
