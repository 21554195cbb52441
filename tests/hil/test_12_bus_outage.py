"""The bus goes down and up again: real time recovers and counts, lockstep ends; a bus that is not there is refused."""

import pytest

from bus_frames import PROFILES
from loop import SCENARIO, SLOW_MACHINE, interface_state, read_meta

pytestmark = pytest.mark.vcan

BUS_DOWN, NO_BUS = 6, 4  # exit statuses of hexload_sim and hexload_ecu


@pytest.fixture
def interface(can_interface):
    """interface("down"), interface("up"); it is up again after the test."""
    yield lambda state: interface_state(can_interface, state)
    interface_state(can_interface, "up")


@pytest.mark.needs("bus state")
@pytest.mark.apart
@pytest.mark.parametrize("profile", PROFILES)
def test_real_time_survives_an_outage_and_counts_it(loop, interface, profile, tmp_path):
    # GIVEN a run in real time that is under way
    controller = loop.controller("--profile", profile, *SLOW_MACHINE)
    simulation = loop.simulation(tmp_path / "run", "--real-time", "--profile", profile, "--duration", 4)
    controller.wait_for("estimating|converged")
    # WHEN the bus goes down THEN both sides say so
    interface("down")
    controller.wait_for(r"fault: the bus is down, last tick \d+: waiting for it")
    simulation.wait_for("the bus is down since tick")
    # WHEN it comes up THEN they go on without help
    interface("up")
    simulation.wait_for("the bus is up again at tick")
    simulation.wait_for("the controller has been started again at tick")
    assert simulation.wait() == 0
    # and the metadata counts the outage, the samples that could not be sent, and the new start
    bus = read_meta(tmp_path / "run")["bus"]
    assert (bus["outages"], bus["rejoins"]) == (1, 1)
    assert bus["unsent"] > 0 and bus["send_failures"] >= bus["unsent"]
    assert bus["answers"] + bus["answers_missing"] == bus["answers_expected"]
    # and the controller has estimated again
    controller.wait_for(r"the bus is down(.|\n)*(estimating|converged) at tick")


@pytest.mark.needs("bus state")
@pytest.mark.parametrize("profile", PROFILES)
def test_lockstep_ends_when_the_bus_goes_down(loop, interface, profile, tmp_path):
    # GIVEN a run in lockstep that is under way
    controller = loop.controller("--profile", profile)
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--profile", profile)
    controller.wait_for("estimating|converged")
    # WHEN the bus goes down THEN the run ends with its status and says so
    interface("down")
    assert simulation.wait() == BUS_DOWN
    simulation.wait_for(r"the bus went down at tick \d+|tick \d+ cannot be sent: the bus is down")
    # and the controller waits, and is there again when the bus is
    controller.wait_for("fault: the bus is down")
    interface("up")
    controller.wait_for("idle: the bus is up again")
    again = loop.simulation(tmp_path / "again", "--lockstep", "--profile", profile, "--duration", 0.1)
    assert again.wait() == 0


def test_a_bus_that_is_down_is_refused_with_the_command_that_mends_it(loop, interface, tmp_path):
    # GIVEN an interface that is down WHEN either program is started THEN it ends and names the command
    interface("down")
    simulation = loop.simulation(tmp_path / "run")
    controller = loop.second_controller()
    for program, status in ((simulation, BUS_DOWN), (controller, NO_BUS)):
        assert program.wait() == status
        program.wait_for(f"found the interface down, expected it up: ip link set {loop.interface} up")
    assert not (tmp_path / "run").exists()


def test_a_bus_that_does_not_exist_is_refused(start, loop, simulator, tmp_path):
    # GIVEN no such interface WHEN either program is started THEN it ends and says what it has not found
    simulation = start(simulator, SCENARIO, "--out", tmp_path / "run", "--bus", "socketcan:nowhere0")
    controller = loop.second_controller(bus="socketcan:nowhere0")
    for program, status in ((simulation, BUS_DOWN), (controller, NO_BUS)):
        assert program.wait() == status
        program.wait_for("found no interface nowhere0, expected one that is up")
