"""The firmware's kinematics against host_sim's, which shares no line with it, on the paper's machine.

Float: leg lengths below 2 m are known to half an ulp, 6e-8 m; the inverse Jacobian grows that by up to about 10. So
0.5 um and 0.5 urad are asked for, a fortieth of the displacement noise. Double: 1 nm and 1 nrad, where Newton's
last step ends and not rounding.
"""

from dataclasses import dataclass
from types import ModuleType

import hexload_native
import hexload_native_double
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hexload.theory.bound import Trajectory, leg_jacobian, read_platform
from recorded_truth import DATA

STATES = 1000
STROKE_M = 0.3
TICK_S = 1e-3


@dataclass(frozen=True)
class Precision:
    native: ModuleType
    pose: float  # m and rad
    last_step: float  # m and rad: from the pose of the Jacobian to the pose
    epsilon: float  # rounding unit
    steps_per_tick: int  # Newton steps from the pose of the last tick

    @property
    def platform(self):
        return self.native.load_platform(DATA / "paper_load.toml")


FLOAT = Precision(hexload_native, 0.5e-6, 1e-6, 2.0**-24, 2)
DOUBLE = Precision(hexload_native_double, 1e-9, 1e-9, 2.0**-53, 3)


@pytest.fixture(scope="module", params=[FLOAT, DOUBLE], ids=["float", "double"])
def precision(request) -> Precision:
    return request.param


@pytest.fixture(scope="module")
def workspace() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """1000 random (p, R, V) within 0.25 m and 20 degrees of home whose legs are all within the stroke."""
    rng = np.random.default_rng(40)
    platform = FLOAT.platform
    found = []
    while len(found) < STATES:
        p = rng.uniform(-0.25, 0.25, 3)
        axis = rng.standard_normal(3)
        R = Rotation.from_rotvec(rng.uniform(0, np.radians(20)) * axis / np.linalg.norm(axis)).as_matrix()
        if np.abs(hexload_native.leg_displacement(platform, p, R)).max() < STROKE_M:
            found.append((p, R, rng.uniform(-1, 1, 6)))
    return found


def legs_of(platform, p, R, V) -> tuple[np.ndarray, np.ndarray]:
    """host_sim's leg displacements and velocities."""
    return hexload_native.leg_displacement(platform, p, R), hexload_native.leg_velocity(platform, p, R, V)


def angle_between(R1: np.ndarray, R2: np.ndarray) -> float:
    """Rotation angle in rad; the vector part of R1 R2^T, as the trace loses half of the digits."""
    difference = R1 @ R2.T
    return np.linalg.norm((difference - difference.T)[[2, 0, 1], [1, 2, 0]]) / 2


def test_pose_from_home_agrees_over_the_workspace(precision, workspace, record_property):
    # GIVEN the legs of 1000 poses within the stroke
    reference = FLOAT.platform
    apart_m, apart_rad, steps = [], [], []
    for p, R, V in workspace:
        # WHEN a firmware that stands at home is given them
        motion = precision.native.Kinematics(precision.platform).solve(*legs_of(reference, p, R, V))
        apart_m.append(np.linalg.norm(motion["p_m"] - p))
        apart_rad.append(angle_between(motion["R"], R))
        steps.append(motion["newton_steps"])
    record_property("pose", [max(apart_m), max(apart_rad), max(steps)])
    print(f"pose: worst {max(apart_m):.1e} m, {max(apart_rad):.1e} rad, at most {max(steps)} Newton steps from home")
    # THEN it finds the same poses
    assert max(apart_m) < precision.pose
    assert max(apart_rad) < precision.pose


def test_twist_and_jacobian_agree_over_the_workspace(precision, workspace, record_property):
    # GIVEN the same legs, with velocities
    reference, machine = FLOAT.platform, read_platform(DATA / "paper_load.toml")
    jacobian_apart, twist_apart = [], []
    for p, R, V in workspace:
        motion = precision.native.Kinematics(precision.platform).solve(*legs_of(reference, p, R, V))
        # WHEN its Jacobian is compared with host_sim's and with a third one, in Python
        expected = hexload_native.jacobian(reference, p, R)
        third = leg_jacobian(machine, Trajectory(p[None], R[None], p[None], p[None]))[0]
        np.testing.assert_allclose(expected, third, atol=1e-13)
        jacobian_apart.append(np.abs(motion["J"] - expected).max())
        twist_apart.append(np.linalg.norm(motion["twist"] - V) / np.linalg.cond(expected))
    record_property("jacobian_twist", [max(jacobian_apart), max(twist_apart)])
    print(f"Jacobian: worst {max(jacobian_apart):.1e}; twist: worst {max(twist_apart):.1e} times the condition of J")
    # THEN entries of J, below 1, differ by the distance of the poses over the leg length, at least 0.55 m, and some
    # rounding
    jacobian_error = 2 * (precision.pose + precision.last_step) + 8 * precision.epsilon
    assert max(jacobian_apart) < jacobian_error
    # AND the twist, below 2.5, by that difference grown by the condition number of J at most
    assert max(twist_apart) < 2.5 * jacobian_error


def test_pose_follows_a_motion_tick_by_tick_in_a_few_newton_steps(precision, record_property):
    # GIVEN two seconds of a motion in all six degrees of freedom, up to 1 m/s and 1 rad/s
    t = np.arange(2000) * TICK_S
    frequency, phase = 2 * np.pi * np.array([0.9, 1.1, 0.8, 1.0, 1.3, 0.7]), np.arange(6.0)
    pose = 0.12 * np.sin(t[:, None] * frequency + phase)
    rate = 0.12 * frequency * np.cos(t[:, None] * frequency + phase)
    reference = FLOAT.platform
    kinematics = precision.native.Kinematics(precision.platform)
    worst_m, worst_rad, most_steps = 0.0, 0.0, 0
    for tick, (coordinates, rates) in enumerate(zip(pose, rate, strict=True)):
        R = hexload_native.rotation_from_rpy(coordinates[3:])
        V = np.concatenate([rates[:3], angular_velocity(coordinates[3:], rates[3:])])
        # WHEN the firmware follows it
        motion = kinematics.solve(*legs_of(reference, coordinates[:3], R, V))
        worst_m = max(worst_m, np.linalg.norm(motion["p_m"] - coordinates[:3]))
        worst_rad = max(worst_rad, angle_between(motion["R"], R))
        most_steps = max(most_steps, motion["newton_steps"]) if tick else 0
    record_property("following", [worst_m, worst_rad, most_steps])
    print(f"following: worst {worst_m:.1e} m, {worst_rad:.1e} rad, at most {most_steps} Newton steps a tick")
    # THEN it stays on it. A tick moves the platform by 1 mm, and each step squares the error in units of the leg:
    # 1e-6, which is where float can stop after one more, 1e-12, and in double 1e-24
    assert worst_m < precision.pose
    assert worst_rad < precision.pose
    assert most_steps <= precision.steps_per_tick


def angular_velocity(rpy: np.ndarray, rpy_rate: np.ndarray) -> np.ndarray:
    """omega in base axes of R = Rz(yaw) Ry(pitch) Rx(roll): each rate about its own axis, where that one points."""
    _, pitch, yaw = rpy
    about_roll = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    about_pitch = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    return rpy_rate @ np.array([about_roll, about_pitch, [0.0, 0.0, 1.0]])


def test_legs_of_no_pose_are_refused(precision):
    # GIVEN one leg 0.6 m longer than home and the others 0.3 m shorter: no platform of this size fits
    displacement_m = np.array([0.6, -0.3, -0.3, -0.3, -0.3, -0.3])
    # WHEN the firmware is given them THEN it says so
    with pytest.raises(ValueError):
        precision.native.Kinematics(precision.platform).solve(displacement_m, np.zeros(6))
