"""host_sim's velocity Jacobian and forward kinematics against finite differences of its own leg lengths.

Central differences with step h: truncation h^2 / 6 times the third derivative of a leg length, at most about
3 / (0.6 m)^2 along a direction of unit speed, is 1.4e-10 for h = 1e-5; rounding is 1e-16 / h = 1e-11.
"""

import hexload_native as native
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from machines import paper_machine, random_machine, random_state, write_platform

STEP = 1e-5
TOLERANCE = 1e-9


@pytest.fixture(params=["paper", "random 1", "random 2", "random 3"])
def platform(request, tmp_path):
    seed = int(request.param.split()[1]) if request.param != "paper" else 0
    machine = random_machine(np.random.default_rng([3, seed])) if seed else paper_machine()
    return native.load_platform(write_platform(machine, tmp_path / "platform.toml"))


def moved(state, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pose after a small displacement and a small rotation about axes of the base."""
    return state.p_m + direction[:3], Rotation.from_rotvec(direction[3:]).as_matrix() @ state.R


def test_jacobian_columns_are_the_differences_of_leg_displacement(platform):
    # GIVEN random poses
    rng = np.random.default_rng(30)
    for state in (random_state(rng) for _ in range(50)):
        jacobian = native.jacobian(platform, state.p_m, state.R)
        # WHEN the platform is moved to both sides along each axis and turned to both sides about each
        for column in range(6):
            step = STEP * np.eye(6)[column]
            ahead = native.leg_displacement(platform, *moved(state, step))
            behind = native.leg_displacement(platform, *moved(state, -step))
            # THEN the legs change by that column
            np.testing.assert_allclose(jacobian[:, column], (ahead - behind) / (2 * STEP), atol=TOLERANCE)


def test_leg_velocity_is_the_rate_of_leg_displacement_along_a_twist(platform):
    # GIVEN random poses and twists, up to 1.7 m/s and 1.7 rad/s
    rng = np.random.default_rng(31)
    for state in (random_state(rng) for _ in range(50)):
        # WHEN the platform is moved along the twist THEN the legs change at leg_velocity; third derivatives grow with
        # the cube of the speed, about 15
        ahead = native.leg_displacement(platform, *moved(state, STEP * state.V))
        behind = native.leg_displacement(platform, *moved(state, -STEP * state.V))
        velocity = native.leg_velocity(platform, state.p_m, state.R, state.V)
        np.testing.assert_allclose(velocity, (ahead - behind) / (2 * STEP), atol=15 * TOLERANCE)


def test_forward_kinematics_inverts_leg_displacement(platform):
    # GIVEN the legs of random poses WHEN the pose is searched from home
    rng = np.random.default_rng(32)
    for state in (random_state(rng) for _ in range(50)):
        p, R = native.forward_kinematics(platform, native.leg_displacement(platform, state.p_m, state.R))
        # THEN it is the pose; lengths to 1e-15 m through a Jacobian whose inverse is about 10 leave 1e-14, and the
        # search may stop a little before
        np.testing.assert_allclose(p, state.p_m, atol=1e-11)
        np.testing.assert_allclose(R, state.R, atol=1e-11)
