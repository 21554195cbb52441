"""A program that falls silent: the other one says which, since when, and ends or goes on in a defined way."""

import pytest

from bus_frames import LOCKSTEP, PROFILES, REAL_TIME, sample_frames_by_tick
from loop import SLOW_MACHINE, read_meta

pytestmark = pytest.mark.vcan

SILENT_CONTROLLER = 3  # exit status of hexload_sim


@pytest.mark.parametrize("profile", PROFILES)
def test_lockstep_ends_when_the_controller_falls_silent(loop, profile, tmp_path):
    # GIVEN a run in lockstep that is under way
    controller = loop.controller("--profile", profile)
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--profile", profile, "--answer-timeout", 1)
    controller.wait_for("estimating|converged")
    # WHEN the controller no longer runs THEN the run ends and names it, the tick and the last answer
    loop.hold(controller)
    try:
        assert simulation.wait() == SILENT_CONTROLLER
    finally:
        loop.go_on(controller)
    last = r"\((?:last answer to tick (\d+)|no answer so far)\)"
    said = simulation.wait_for(rf"the controller is silent since tick (\d+) {last}")
    step = {"fd": 1, "classic": 2}[profile]
    assert int(said[1]) == (int(said[2]) + step if said[2] else 0)


@pytest.mark.needs("process")
@pytest.mark.parametrize("pacing", ["--lockstep", "--real-time"])
def test_a_run_without_any_controller_ends_and_asks_for_one(loop, pacing, tmp_path):
    # GIVEN nobody else on the bus WHEN a run is begun THEN it ends and says what it misses
    simulation = loop.simulation(tmp_path / "run", pacing, "--answer-timeout", 0.5)
    assert simulation.wait() == SILENT_CONTROLLER
    simulation.wait_for(
        r"socketcan:.*: no controller acknowledges RESET within \d+ ms: is hexload_ecu, .* running there\?"
    )


@pytest.mark.needs("real time")
@pytest.mark.apart
def test_real_time_goes_on_while_the_controller_is_silent_and_counts_what_is_missing(loop, tmp_path):
    # GIVEN a run in real time that is under way
    controller = loop.controller(*SLOW_MACHINE)
    simulation = loop.simulation(tmp_path / "run", "--real-time", "--duration", 4)
    controller.wait_for("estimating|converged")
    # WHEN the controller pauses until that has been detected, and goes on
    loop.hold(controller)
    simulation.wait_for("the controller is silent since tick")
    loop.go_on(controller)
    # THEN the simulator says so and ends well
    simulation.wait_for("the controller answers again at tick")
    assert simulation.wait() == 0
    # and all answers are accounted for: those of the pause came late, as the kernel kept the samples
    bus = read_meta(tmp_path / "run")["bus"]
    assert bus["answers"] + bus["answers_missing"] == bus["answers_expected"] == 4001
    assert bus["answers_late"] + bus["answers_missing"] > 0
    assert bus["rejoins"] == bus["outages"] == 0


@pytest.mark.needs("real time")
@pytest.mark.apart
def test_real_time_that_ends_in_silence_has_a_status_that_says_so(loop, tmp_path):
    # GIVEN a run in real time that is under way
    controller = loop.controller(*SLOW_MACHINE)
    simulation = loop.simulation(tmp_path / "run", "--real-time", "--duration", 3)
    controller.wait_for("estimating|converged")
    # WHEN the controller ends for good THEN the run comes to its end, is written down, and has the status of silence
    controller.interrupt()
    assert simulation.wait() == SILENT_CONTROLLER
    simulation.wait_for("the controller was silent at the end of the run")
    assert read_meta(tmp_path / "run")["bus"]["answers_missing"] > 0


@pytest.mark.needs("real time")
@pytest.mark.apart
def test_a_controller_waits_without_limit_for_the_first_sample_and_not_for_the_next(loop, peer, short_run):
    # GIVEN a controller that has been started and waits
    samples = sample_frames_by_tick(short_run("fd").frames)
    controller = loop.controller("--sample-timeout-ms", 200)
    assert peer.command("start", REAL_TIME)["result"] == 0
    assert peer.status("samples_missing") == 0
    assert "fault" not in controller.output
    # WHEN samples come and then no more THEN it is in fault, names the tick that did not come, and goes on living
    for sample in samples[:3]:
        peer.ask(sample, 3)
    controller.wait_for("fault: the samples are silent since tick 3: is the simulator still running")
    assert peer.command("start", LOCKSTEP)["fault"] == 1
    assert peer.command("reset")["fault"] == 0
