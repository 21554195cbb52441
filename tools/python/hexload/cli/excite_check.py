"""Whether a machine with its servo can run a motion: simulated with several loads, before anybody runs it.

The simulator has rigid-body dynamics, actuators, servo and end stops. A run is safe when in each tick, until the
platform stands still after the motion's end without shaking, the legs keep away from their end stops, tilt, condition and distance to
singularity keep their limits on the side of the singularity on which home is, no leg turns too far in its joints, actuators and supply are not asked for
more than they have, and no leg is behind its reference by so much that its valve is fully open, or by 15 % of the stroke.
"""

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.theory.bound import Trajectory, leg_jacobian, rotation_from_rpy
from hexload.theory.excitation import Limits, Problem, home_posture, leg_displacement, posture, posture_ratios

Array = NDArray[np.float64]

SETTLING_S = 4.0  # simulated beyond the end of the motion
REST_WINDOW_TICKS = 500  # at its end
AT_REST = 0.01  # of the speed of a leg
AT_REST_OF_RUN = 0.05  # of the fastest leg of the run: shaking counts more beside a slow motion
JOINT_RAD = np.radians(60.0)  # of a leg from its direction at home: more than most joints take
STILL = 1e-3  # of the speed of a leg: what is faster must die down from one window to the next
POSTURE = ("tilt_rad", "condition", "distance")
QUANTITIES = (
    "stroke_share",
    "leg_speed_m_s",
    "speed_sum_m_s",
    "leg_force_n",
    "tilt_rad",
    "condition",
    "distance",
    "joint_rad",
    "leg_error_m",
    "rest_speed_m_s",
)
# Found and expected, where a share of a limit does not say it.
WITHOUT_NUMBER = {
    "pose": ("no finite pose", "one"),
    "distance": ("a way through a singular pose", "poses on the same side as home"),
    "rest_speed_m_s": ("legs that shake on after the motion's end", "legs that come to rest"),
}


@dataclass(frozen=True)
class MachineLimits:
    """What must not be exceeded; the limits of a motion keep a margin to it."""

    limits: Limits
    leg_error_m: float  # the valve is fully open, or the leg far behind

    def allowed(self) -> dict[str, float]:
        limits = self.limits
        return {
            "stroke_share": 1.0,
            "leg_speed_m_s": limits.leg_speed_m_s,
            "speed_sum_m_s": limits.speed_sum_m_s,
            "leg_force_n": limits.leg_force_n,
            "tilt_rad": limits.tilt_rad,
            "condition": limits.condition,
            "distance": limits.distance,
            "joint_rad": JOINT_RAD,
            "leg_error_m": self.leg_error_m,
            "rest_speed_m_s": AT_REST * limits.leg_speed_m_s,
        }


@dataclass(frozen=True)
class Use:
    """The extremes of a run, and as shares of what is allowed; beyond 1: unsafe."""

    load: str
    extremes: dict[str, float]
    shares: dict[str, float]

    @property
    def worst(self) -> str:
        return max(self.shares, key=self.shares.__getitem__)

    @property
    def is_safe(self) -> bool:
        return self.shares[self.worst] <= 1.0


def simulate(
    native: ModuleType,
    scenario,
    platform,
    problem: Problem,
    machine: MachineLimits,
    file: Path,
    loads: dict[str, Array],
) -> list[Use]:
    """One run with each load. `loads`: theta, on the platform's axis; `file`: the trajectory. Raises InputError."""
    uses = []
    for name, theta in loads.items():
        try:
            rows = scenario.simulated(platform, file, native_load(native, theta), problem.duration_s + SETTLING_S)
        except ValueError as error:
            raise InputError(f"simulation with {name} load: {error}") from None
        uses.append(_use_of(name, problem, machine, rows))
    return uses


def native_load(native: ModuleType, theta: Array):
    """The load of these parameters; massless: none."""
    if theta[0] == 0.0:
        return native.Load(0.0, np.zeros(3), np.zeros((3, 3)))
    com = theta[1:4] / theta[0]
    xx, yy, zz, xy, xz, yz = theta[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return native.Load(theta[0], com, about_origin - theta[0] * (com @ com * np.eye(3) - np.outer(com, com)))


def _use_of(name: str, problem: Problem, machine: MachineLimits, rows: Array) -> Use:
    if not np.isfinite(rows).all():
        nothing = dict.fromkeys(QUANTITIES, float("nan"))
        return Use(name, nothing, dict.fromkeys(QUANTITIES, float("inf")))
    pose, reference = (_trajectory_of_poses(rows[:, k : k + 6]) for k in (0, 6))
    displacement, speed, force = rows[:, 12:18], np.abs(rows[:, 18:24]), np.abs(rows[:, 24:30])
    limits, jacobian = machine.limits, leg_jacobian(problem.platform, pose)
    found = posture(problem, pose, jacobian)
    wanted = leg_displacement(problem, reference)
    extremes = {
        "stroke_share": np.maximum(displacement / limits.stroke_max_m, displacement / limits.stroke_min_m).max(),
        "leg_speed_m_s": speed.max(),
        "speed_sum_m_s": speed.sum(axis=1).max(),
        "leg_force_n": force.max(),
        "tilt_rad": found.tilt_rad.max(),
        "condition": found.condition.max(),
        "distance": found.distance.min(),
        "joint_rad": joint_rad(problem, jacobian, pose.rotation).max(),
        "leg_error_m": np.abs(displacement - wanted).max(),
        "rest_speed_m_s": speed[-REST_WINDOW_TICKS:].max(),
    }
    shares = {key: extremes[key] / most for key, most in machine.allowed().items() if key not in POSTURE}
    shares |= dict(zip(POSTURE, posture_ratios(problem, found, limits).max(axis=0)))
    if (np.linalg.det(jacobian) * np.linalg.det(jacobian[0]) <= 0.0).any():
        shares["distance"] = float("inf")  # through the singularity between two ticks
    before = speed[-2 * REST_WINDOW_TICKS : -REST_WINDOW_TICKS].max()
    shaking_m_s = min(AT_REST_OF_RUN * extremes["leg_speed_m_s"], max(before, STILL * limits.leg_speed_m_s))
    if extremes["rest_speed_m_s"] > shaking_m_s:
        shares["rest_speed_m_s"] = float("inf")  # the servo shakes on, or more and more
    return Use(name, {key: float(value) for key, value in extremes.items()}, {k: float(v) for k, v in shares.items()})


def joint_rad(problem: Problem, jacobian: Array, rotation: Array) -> Array:
    """(n, 6): how far each leg is turned from its direction at home, in base or in platform axes, whichever is more."""
    home = leg_jacobian(problem.platform, _trajectory_of_poses(np.zeros((1, 6))))[0, :, :3]
    leg = jacobian[:, :, :3]
    in_platform = np.einsum("nji,nlj->nli", rotation, leg)
    cosine = np.minimum((leg * home).sum(axis=2), (in_platform * home).sum(axis=2))
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def planned_use(problem: Problem, machine: MachineLimits, forces: Array, rows: Array) -> dict[str, float]:
    """What the motion itself asks for. `rows`: q and twist at each tick; `forces`: shares of the planned force."""
    truth = Trajectory(rows[:, :3], rotation_from_rpy(rows[:, 3:6]), rows[:, 6:9], rows[:, 9:12])
    jacobian = leg_jacobian(problem.platform, truth)
    found, limits = posture(problem, truth, jacobian), machine.limits
    speed = np.abs(np.einsum("nij,nj->ni", jacobian, rows[:, 6:]))
    displacement = leg_displacement(problem, truth)
    return {
        "stroke_share": float(np.maximum(displacement / limits.stroke_max_m, displacement / limits.stroke_min_m).max()),
        "leg_speed_m_s": float(speed.max()),
        "speed_sum_m_s": float(speed.sum(axis=1).max()),
        "leg_force_n": float(forces.max() * problem.limits.leg_force_n),
        "tilt_rad": float(found.tilt_rad.max()),
        "condition": float(found.condition.max()),
        "distance": float(found.distance.min()),
        "joint_rad": float(joint_rad(problem, jacobian, truth.rotation).max()),
    }


def check_home(problem: Problem, machine: MachineLimits) -> None:
    """Home itself must be far enough from a singularity. Raises InputError."""
    home = home_posture(problem)
    if not home.condition[0] < problem.limits.condition:
        raise InputError(
            f"--condition-max: found {machine.limits.condition:.3g}, of which a motion may use "
            f"{problem.limits.condition:.3g}, expected more than the {home.condition[0]:.3g} of the home pose"
        )
    if not home.distance[0] > problem.limits.distance:
        raise InputError(
            f"--distance-min: found {machine.limits.distance:.3g}, to which a motion keeps "
            f"{problem.limits.distance:.3g}, expected less than the {home.distance[0]:.3g} of the home pose"
        )


def refusal(use: Use, machine: MachineLimits, tries: int) -> str:
    key = use.worst
    found = use.extremes[key]
    what = f"{key} {found:.4g}"
    bound = f"{'at least' if key == 'distance' else 'at most'} {machine.allowed()[key]:.4g}"
    if np.isinf(use.shares[key]):
        what, bound = WITHOUT_NUMBER["pose" if np.isnan(found) else key]
    return (
        f"no motion found that the simulated machine follows, in {tries} tries, each smaller than the one before: "
        f"with {use.load} load found {what}, expected {bound}; nothing is written: "
        "a faster servo, stronger actuators, a lower --frequency-max or a lighter --mass may help"
    )


def _trajectory_of_poses(q: Array) -> Trajectory:
    return Trajectory(q[:, :3], rotation_from_rpy(q[:, 3:6]), np.zeros((len(q), 3)), np.zeros((len(q), 3)))
