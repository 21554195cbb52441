"""Partners that do not fit: another profile, a second controller. Each is named by whoever notices."""

import time

import pytest

from bus_frames import LOCKSTEP, PROFILES, encode, sample_frames_by_tick
from loop import estimates

pytestmark = pytest.mark.vcan

WRONG_PROFILE, SECOND_CONTROLLER = 4, 5  # exit statuses of hexload_sim
TAKEN = 3  # of hexload_ecu
ESTIMATING = 2
STRANGERS = 3  # whole frames within a second that a controller believes
UNDER_WAY_S = 1.2  # of a run in lockstep: it lasts longer than another controller listens
AGAIN_S = 0.1  # more often than frames count for: a guest may stand still between two
ROUNDS = 100
AFTERWARDS_S = 0.15  # of a run that begins when the other controller has gone: some rounds of pages


@pytest.mark.parametrize(("spoken", "expected"), [PROFILES, PROFILES[::-1]])
@pytest.mark.parametrize("pacing", ["--lockstep", "--real-time"])
def test_a_simulator_of_another_profile_ends_and_names_both(loop, spoken, expected, pacing, tmp_path):
    # GIVEN a controller that speaks one profile WHEN a simulator of the other begins a run
    controller = loop.controller("--profile", spoken)
    simulation = loop.simulation(tmp_path / "run", pacing, "--profile", expected)
    # THEN it ends before a sample is sent, and says what to do; the controller is none the worse
    assert simulation.wait() == WRONG_PROFILE
    simulation.wait_for(f"the controller speaks the profile {spoken}, this simulator {expected}: give both --profile")
    assert "fault" not in controller.output
    assert controller.interrupt() == 0


@pytest.mark.needs("fd")  # it hears one and speaks the other
@pytest.mark.parametrize(("spoken", "other"), [PROFILES, PROFILES[::-1]])
def test_a_controller_that_sees_samples_of_another_profile_says_how_to_mend_it(loop, peer, short_run, spoken, other):
    # GIVEN a sample of one profile, and a controller that has been started in the other
    sample = sample_frames_by_tick(short_run(other).frames)[0]
    controller = loop.controller("--profile", spoken)
    assert peer.command("start", LOCKSTEP)["result"] == 0
    # WHEN it is on the bus three times THEN the controller is in fault, and says so
    peer.send(sample * STRANGERS)
    controller.wait_for(
        f"fault: samples of the profile {other} are on the bus, this controller speaks {spoken}: start it with"
    )
    assert peer.command("stop")["fault"] == 3
    assert peer.status("frames_refused") == STRANGERS * {"fd": 7, "classic": 1}[spoken]


@pytest.mark.parametrize("profile", PROFILES)
def test_a_second_controller_goes_away_and_the_first_is_undisturbed(loop, kind, short_run, profile, tmp_path):
    # GIVEN the estimates of an undisturbed run, and a run in lockstep that is under way, or begins when the other one,
    # which is slow, has gone
    undisturbed = estimates(short_run(profile).directory)
    first = loop.controller("--profile", profile)
    duration_s = UNDER_WAY_S if kind.keeps_up else AFTERWARDS_S
    options = ("--lockstep", "--profile", profile, "--duration", duration_s)
    if kind.keeps_up:
        simulation = loop.simulation(tmp_path / "run", *options)
        first.wait_for("estimating|converged")
    # WHEN another controller is started THEN it hears the first before it speaks, ends and says why
    second = loop.second_controller("--profile", profile)
    assert second.wait() == TAKEN
    second.wait_for("a second controller: another one is on the bus already; stop it first")
    # and the run is as if nothing had happened
    if not kind.keeps_up:
        simulation = loop.simulation(tmp_path / "run", *options)
    assert simulation.wait() == 0
    again = estimates(tmp_path / "run")
    both = min(len(again), len(undisturbed))
    assert both > 3 and again[:both] == undisturbed[:both]
    assert "fault" not in first.output


@pytest.mark.parametrize(
    "foreign",
    [
        "ControllerStatus",
        "Acknowledge",
        pytest.param("HealthFd", marks=pytest.mark.needs("fd")),
        pytest.param("AnswerPage", marks=pytest.mark.needs("fd")),  # of the other profile
    ],
)
def test_frames_of_a_second_controller_end_a_run_in_lockstep(loop, peer, foreign, any_profile, tmp_path):
    # GIVEN a run in lockstep that is under way
    controller = loop.controller()
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--profile", any_profile)
    controller.wait_for("estimating|converged")
    # WHEN a frame that only a controller sends comes from elsewhere, and goes on coming, as a controller's do
    signals = {"ControllerStatus": {"state": ESTIMATING}, "Acknowledge": {"profile": PROFILES.index(any_profile)}}
    for _ in range(ROUNDS):
        if "fault" in controller.output and simulation.has_ended():
            break
        peer.send([encode(foreign, **signals.get(foreign, {}))] * STRANGERS)
        time.sleep(AGAIN_S)
    # THEN both name the cause, and the run ends
    controller.wait_for("fault: a second controller is on the bus: stop one of the two")
    expected = WRONG_PROFILE if foreign == "AnswerPage" else SECOND_CONTROLLER
    assert simulation.wait() == expected
    simulation.wait_for("second controller" if expected == SECOND_CONTROLLER else "another profile than fd")
