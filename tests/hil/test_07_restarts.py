"""Either program may be restarted in mid-run: the other one notices, says so, and goes on."""

import signal

import pytest

from bus_frames import PROFILES
from loop import SHORT_S, SLOW_MACHINE, estimates, read_meta

pytestmark = pytest.mark.vcan

LONG_S = 4


@pytest.mark.needs("real time")
@pytest.mark.apart
def test_a_controller_that_is_restarted_in_mid_run_is_started_again_and_counted(loop, tmp_path):
    # GIVEN a run in real time that is under way
    first = loop.controller(*SLOW_MACHINE)
    simulation = loop.simulation(tmp_path / "run", "--real-time", "--duration", LONG_S)
    first.wait_for("estimating|converged")
    # WHEN the controller ends and another one is started
    assert first.interrupt() == 0
    simulation.wait_for("the controller is silent since tick")
    second = loop.controller(*SLOW_MACHINE)
    # THEN the simulator sees it, starts it, and ends well
    said = simulation.wait_for(r"the controller has been started again at tick (\d+)")
    second.wait_for("estimating|converged")
    assert simulation.wait() == 0
    # and what was lost is in the metadata
    bus = read_meta(tmp_path / "run")["bus"]
    assert bus["rejoins"] == 1 and bus["outages"] == 0
    assert bus["answers_missing"] > 0
    assert bus["answers"] + bus["answers_missing"] == bus["answers_expected"] == bus["samples"] == 1000 * LONG_S + 1
    assert len(estimates(tmp_path / "run")) <= bus["answers"]
    # and the last estimate is the new controller's
    assert 1000 * float(estimates(tmp_path / "run")[-1].split(",")[0]) > int(said[1])


@pytest.mark.needs("real time")
@pytest.mark.apart
@pytest.mark.parametrize("profile", PROFILES)
def test_a_simulator_that_is_restarted_finds_the_controller_as_if_fresh(loop, short_run, profile, tmp_path):
    # GIVEN the estimates with a fresh controller, and a run in real time that is under way
    fresh = estimates(short_run(profile).directory)
    controller = loop.controller("--profile", profile, "--sample-timeout-ms", 500)
    first = loop.simulation(tmp_path / "first", "--real-time", "--profile", profile)
    controller.wait_for("estimating|converged")
    # WHEN the simulator is killed THEN the controller says since when it hears nothing
    first.process.send_signal(signal.SIGKILL)
    assert first.wait() == -signal.SIGKILL
    controller.wait_for(r"fault: the samples are silent since tick \d+: is the simulator still running\?")
    # WHEN the simulator is started again THEN the run is as with a fresh controller
    second = loop.simulation(tmp_path / "run", "--lockstep", "--profile", profile, "--duration", SHORT_S)
    assert second.wait() == 0
    assert estimates(tmp_path / "run") == fresh
    assert controller.interrupt() == 0


def test_a_controller_that_is_restarted_ends_a_run_in_lockstep(loop, any_profile, tmp_path):
    # GIVEN a run in lockstep that is under way
    first = loop.controller()
    options = ["--lockstep", "--profile", any_profile, "--answer-timeout", 20]
    simulation = loop.simulation(tmp_path / "run", *options)
    first.wait_for("estimating|converged")
    # WHEN the controller is replaced
    first.interrupt()
    loop.controller()
    # THEN the run, which waits for the answer of the one that has gone, ends: the new one was never started
    assert simulation.wait() == 7
    simulation.wait_for(r"the controller has stopped at tick \d+: it was restarted, or another program commands it")
