"""Commands from Python, their acknowledges, and what they do to the estimates that follow."""

import numpy as np
import pytest

from bus_frames import (
    DBC,
    LOCKSTEP,
    PARAMETERS,
    PROFILES,
    REAL_TIME,
    decode,
    encode,
    encode_command,
    sample_frames_by_tick,
)
from hexload import project
from loop import NOTHING_COMES_S, PLATFORM

pytestmark = pytest.mark.vcan

DONE, UNKNOWN_COMMAND, WRONG_STATE, BAD_ARGUMENT = range(4)
IDLE, ARMED, ESTIMATING, CONVERGED, FAULT = range(5)
NO_FAULT, WRONG_PROFILE = 0, 3
SAMPLES = 60

# Command, argument, result, state after it: in this order, from a controller that has just been started.
CONVERSATION = [
    ("stop", 0, DONE, IDLE),
    ("reset", 0, DONE, IDLE),
    ("select filter", 0, DONE, IDLE),
    ("select filter", 1, DONE, IDLE),
    ("select filter", 2, DONE, IDLE),
    ("select filter", 3, BAD_ARGUMENT, IDLE),
    ("select filter", 255, BAD_ARGUMENT, IDLE),
    ("select filter", 1, DONE, IDLE),
    ("set known mass", 450, DONE, IDLE),
    ("set known mass", -1, BAD_ARGUMENT, IDLE),
    (0, 0, UNKNOWN_COMMAND, IDLE),
    (6, 0, UNKNOWN_COMMAND, IDLE),
    (15, 1, UNKNOWN_COMMAND, IDLE),
    ("start", 2, BAD_ARGUMENT, IDLE),
    ("start", 255, BAD_ARGUMENT, IDLE),
    ("start", REAL_TIME, DONE, ARMED),
    ("start", REAL_TIME, WRONG_STATE, ARMED),
    ("select filter", 0, WRONG_STATE, ARMED),
    ("select filter", 1, WRONG_STATE, ARMED),
    ("set known mass", 500, WRONG_STATE, ARMED),
    (6, 0, UNKNOWN_COMMAND, ARMED),
    ("stop", 0, DONE, IDLE),
    ("start", LOCKSTEP, DONE, ARMED),
    ("reset", 0, DONE, IDLE),
]


@pytest.fixture
def samples(short_run):
    """The first leg samples of a run, each a list of one FD frame."""
    return sample_frames_by_tick(short_run("fd").frames)[:SAMPLES]


def ask_all(peer, samples) -> list[dict]:
    """The signals of the answers to FD samples, in lockstep."""
    answers = []
    for sample in samples:
        frames = peer.ask(sample, 3)
        answers.append({name: value for frame in frames for name, value in decode(frame).values.items()})
    return answers


def numbers(answer: dict) -> list[float]:
    return [answer[name] for name in PARAMETERS] + [answer[f"sigma_{name}"] for name in PARAMETERS]


@pytest.mark.parametrize("profile", PROFILES)
def test_each_command_is_acknowledged_with_its_result_and_the_state_after_it(loop, peer, profile):
    # GIVEN a controller that has just been started
    loop.controller("--profile", profile)
    # WHEN it is sent commands, good and bad, one after the other
    for command, argument, result, state in CONVERSATION:
        acknowledge = peer.command(command, argument)
        # THEN the acknowledge says what became of each, in which state, and of which profile the controller is
        found = (acknowledge["result"], acknowledge["state"], acknowledge["fault"])
        assert found == (result, state, NO_FAULT), (command, argument)
        assert acknowledge["profile"] == PROFILES.index(profile)


@pytest.mark.needs("fd")
def test_a_fault_is_told_and_only_reset_ends_it(loop, peer):
    # GIVEN an FD controller in fault: it has seen leg samples of the classic profile
    loop.controller()
    peer.send([encode("LegSample1")] * 3)
    # WHEN it is sent commands THEN all but reset are refused with the fault in the acknowledge
    for command, result, state, fault in [
        ("start", WRONG_STATE, FAULT, WRONG_PROFILE),
        ("stop", WRONG_STATE, FAULT, WRONG_PROFILE),
        ("set known mass", WRONG_STATE, FAULT, WRONG_PROFILE),
        ("reset", DONE, IDLE, NO_FAULT),
        ("start", DONE, ARMED, NO_FAULT),
    ]:
        acknowledge = peer.command(command)
        assert (acknowledge["result"], acknowledge["state"], acknowledge["fault"]) == (result, state, fault), command


@pytest.mark.needs("fd")
def test_a_known_mass_that_is_set_is_the_one_that_is_estimated_with(loop, peer, samples, tmp_path):
    # GIVEN a platform file with another mass, and the firmware's estimates with it in this process
    text = PLATFORM.read_text()
    assert text.count("known_mass_kg = 500.0") == 1
    other = tmp_path / "platform.toml"
    other.write_text(text.replace("known_mass_kg = 500.0", "known_mass_kg = 430.0"))
    native = project.native_module()
    replayed = native.replay(
        native.load_platform(str(other)),
        None,
        None,
        np.arange(SAMPLES) / 1000,
        *legs_of(samples),
        str(tmp_path / "out.csv"),
    )
    # WHEN a controller with the first file is told that mass, and fed the same samples
    loop.controller()
    assert peer.command("set known mass", 430)["result"] == DONE
    assert peer.command("start", LOCKSTEP)["result"] == DONE
    answers = ask_all(peer, samples)
    # THEN its estimates are the same float32 numbers
    expected = np.hstack([replayed["value"], replayed["sigma"]]).astype(np.float32)
    assert np.array_equal(np.array([numbers(answer) for answer in answers], dtype=np.float32), expected)


def legs_of(samples) -> list[np.ndarray]:
    """Displacement, velocity, force, as the codec gives them: a number of steps times the step, in float32."""
    message = DBC.get_message_by_name("LegSampleFd")
    raw = [decode(frame, scaled=False).values for (frame,) in samples]
    legs = []
    for channel in ("displacement", "velocity", "force"):
        names = [f"{channel}_{leg}" for leg in range(1, 7)]
        step = np.float32(message.get_signal_by_name(names[0]).scale)
        steps = np.array([[row[name] for name in names] for row in raw], dtype=np.float32)
        legs.append((steps * step).astype(float))
    return legs


@pytest.mark.needs("fd")
def test_stop_keeps_the_estimate_and_start_and_reset_forget_it(loop, peer, samples, short_run):
    # GIVEN a controller that has estimated for a while, as in the recorded run
    recorded = [frame for frame in short_run("fd").frames if frame.name in ("EstimateFd", "SigmaFd", "HealthFd")]
    loop.controller()
    assert peer.command("start", LOCKSTEP)["state"] == ARMED
    answered = [frame for sample in samples[:-1] for frame in peer.ask(sample, 3)]
    assert answered == recorded[: len(answered)]
    last = {name: value for frame in answered[-3:] for name, value in decode(frame).values.items()}
    # WHEN it is stopped THEN samples are answered with the state and the last estimate
    assert peer.command("stop")["state"] == IDLE
    (stopped,) = ask_all(peer, samples[-1:])
    assert stopped["state"] == IDLE and stopped["tick"] == last["tick"] + 1
    assert numbers(stopped) == numbers(last)
    # WHEN it is reset THEN they are answered with the prior: nothing is known
    assert peer.command("reset")["state"] == IDLE
    (reset,) = ask_all(peer, samples[-1:])
    assert numbers(reset)[:4] == [0, 0, 0, 0] and min(numbers(reset)[4:]) > max(numbers(last)[4:5])
    # WHEN it is started again THEN it estimates as the first time
    assert peer.command("start", LOCKSTEP)["state"] == ARMED
    assert [frame for sample in samples[:10] for frame in peer.ask(sample, 3)] == recorded[:30]


def test_a_command_with_an_argument_that_is_no_number_of_the_contract_is_refused_and_counted(loop, peer):
    # GIVEN a controller WHEN a command comes with NaN, with infinity, or beyond the contract's range
    loop.controller()
    for counter, argument in enumerate((float("nan"), float("inf"), 1e30)):
        peer.send(encode_command("set known mass", counter, argument))
    # THEN none is acknowledged, all are counted, and the next command is carried out
    assert peer.receive("Acknowledge", patience_s=NOTHING_COMES_S) is None
    assert peer.status("frames_refused") == 3
    assert peer.command("start", LOCKSTEP)["result"] == DONE


@pytest.mark.needs("process")
def test_states_that_follow_one_another_at_once_are_all_said(loop, peer, samples):
    # GIVEN a controller that is given no time
    controller = loop.controller()
    loop.hold(controller)
    # WHEN it goes on, and START and the first sample are there
    peer.send([encode_command("start", 1, LOCKSTEP), *samples[0]])
    loop.go_on(controller)
    # THEN it says how it was armed, and that it estimates
    controller.wait_for("hexload_ecu: armed, lockstep, paper filter\nhexload_ecu: estimating at tick 0")
