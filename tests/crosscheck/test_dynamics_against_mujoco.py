"""host_sim's rigid-body dynamics and leg kinematics against MuJoCo on random machines, loads and states.

Tolerance: both compute in double. MuJoCo finds the principal axes of each body by an iteration that stops at 1e-12;
host_sim inverts a mass matrix with a condition number of up to about 1e3. 1e-9 of the size of the whole vector or
matrix, as the requirement says, leaves a margin of some 1e3 over that and none for a wrong term: the smallest one, the
centripetal force, is 1e-2 of the whole.
"""

import hexload_native as native
import numpy as np
import pytest

from hexload.theory.bound import read_platform
from machines import (
    LARGEST_ROTATION_RAD,
    Body,
    RigidMachine,
    State,
    paper_machine,
    random_load,
    random_machine,
    random_state,
    write_platform,
)
from mujoco_plant import MujocoPlant
from recorded_truth import DATA

RELATIVE = 1e-9
STATES_PER_MACHINE = 40
PAPER_LOAD = Body(500.0, np.array([0.0, 0.0, 0.3]), 25.0 * np.eye(3))


class Pair:
    """The same machine and load in both programs."""

    def __init__(self, machine: RigidMachine, load: Body, directory):
        path = write_platform(machine, directory / "platform.toml")
        self.platform = native.load_platform(path)
        self.load = native.Load(load.mass_kg, load.com_m, load.inertia_com_kg_m2)
        self.mujoco = MujocoPlant(machine, load, read_platform(path).home_height_m)


# One paper machine with the paper's load, four machines with general hinges, platform and load: 200 states in all.
@pytest.fixture(scope="module", params=["paper", "random 1", "random 2", "random 3", "random 4"])
def pair(request, tmp_path_factory) -> Pair:
    directory = tmp_path_factory.mktemp("machine")
    if request.param == "paper":
        return Pair(paper_machine(), PAPER_LOAD, directory)
    rng = np.random.default_rng([2, int(request.param.split()[1])])
    return Pair(random_machine(rng), random_load(rng), directory)


@pytest.fixture(scope="module")
def states() -> list[State]:
    rng = np.random.default_rng(20)
    return [random_state(rng) for _ in range(STATES_PER_MACHINE)]


def largest_relative_difference(ours: list[np.ndarray], theirs: list[np.ndarray]) -> float:
    """Norm of the difference over the norm of the whole, worst of all states."""
    return max(np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in zip(ours, theirs, strict=True))


def over_states(pair: Pair, states: list[State], ours, theirs) -> float:
    expected, found = [], []
    for state in states:
        pair.mujoco.set_state(state)
        expected.append(theirs(state))
        found.append(ours(state))
    return largest_relative_difference(found, expected)


def report(record_property, name: str, difference: float) -> None:
    record_property(name, difference)
    print(f"{name}: largest relative difference {difference:.1e}")


def at_rest(state: State) -> State:
    return State(state.p_m, state.R, np.zeros(6), state.leg_force_n)


def test_the_paper_machine_of_the_test_is_the_one_of_the_logs():
    # GIVEN the platform recorded with the logs WHEN compared with Table 1 and the hinge angles THEN it is the same
    recorded = read_platform(DATA / "paper_load.toml")
    machine = paper_machine()
    np.testing.assert_allclose(machine.base_hinges_m, recorded.base_hinges_m, atol=1e-15)
    np.testing.assert_allclose(machine.platform_hinges_m, recorded.platform_hinges_m, atol=1e-15)


def test_mass_matrix_agrees_with_mujoco(pair, states, record_property):
    difference = over_states(
        pair, states, lambda s: native.mass_matrix(pair.platform, pair.load, s.R), lambda s: pair.mujoco.mass_matrix()
    )
    report(record_property, "mass matrix", difference)
    assert difference < RELATIVE


def test_gravity_wrench_agrees_with_mujoco(pair, states, record_property):
    # GIVEN a body at rest WHEN MuJoCo is asked what holds it THEN that is gravity alone
    difference = over_states(
        pair,
        [at_rest(state) for state in states],
        lambda s: native.gravity_wrench(pair.platform, pair.load, s.R),
        lambda s: pair.mujoco.holding_wrench(),
    )
    report(record_property, "gravity wrench", difference)
    assert difference < RELATIVE


def test_bias_wrench_agrees_with_mujoco(pair, states, record_property):
    # GIVEN a body in motion WHEN gravity is taken off what holds it THEN the centripetal and gyroscopic terms remain
    def velocity_terms(state: State) -> np.ndarray:
        moving = pair.mujoco.holding_wrench()
        pair.mujoco.set_state(at_rest(state))
        return moving - pair.mujoco.holding_wrench()

    difference = over_states(
        pair, states, lambda s: native.bias_wrench(pair.platform, pair.load, s.R, s.V[3:]), velocity_terms
    )
    report(record_property, "bias wrench", difference)
    assert difference < RELATIVE


def test_acceleration_agrees_with_mujoco(pair, states, record_property):
    difference = over_states(
        pair,
        states,
        lambda s: native.acceleration(pair.platform, pair.load, s.p_m, s.R, s.V, s.leg_force_n),
        lambda s: pair.mujoco.acceleration(),
    )
    report(record_property, "acceleration", difference)
    assert difference < RELATIVE


def test_leg_forces_give_back_the_acceleration_of_mujoco(pair, states, record_property):
    # GIVEN MuJoCo's acceleration under leg forces WHEN host_sim computes the forces that it needs THEN they are those
    difference = over_states(
        pair,
        states,
        lambda s: native.leg_forces(pair.platform, pair.load, s.p_m, s.R, s.V, pair.mujoco.acceleration()),
        lambda s: s.leg_force_n,
    )
    report(record_property, "leg forces", difference)
    assert difference < RELATIVE


def test_leg_displacement_agrees_with_mujoco_tendons(pair, states, record_property):
    difference = over_states(
        pair,
        states,
        lambda s: native.leg_displacement(pair.platform, s.p_m, s.R),
        lambda s: pair.mujoco.leg_displacement_m(),
    )
    report(record_property, "leg displacement", difference)
    assert difference < RELATIVE


def test_leg_velocity_agrees_with_mujoco_tendons(pair, states, record_property):
    difference = over_states(
        pair,
        states,
        lambda s: native.leg_velocity(pair.platform, s.p_m, s.R, s.V),
        lambda s: pair.mujoco.leg_velocity_m_s(),
    )
    report(record_property, "leg velocity", difference)
    assert difference < RELATIVE


def test_the_random_states_reach_the_edge_of_their_range(states):
    # GIVEN 40 rotation angles uniform in 0 .. 15 degrees THEN the largest is below 12 in one of (15 / 12)^40 = 7,500
    # choices of the seed
    angle_rad = [np.arccos((np.trace(state.R) - 1) / 2) for state in states]
    assert max(angle_rad) > 0.8 * LARGEST_ROTATION_RAD
