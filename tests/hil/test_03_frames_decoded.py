"""Every frame of both profiles, decoded in Python from the DBC alone, is what the C programs sent and wrote down."""

import re

import numpy as np
import pytest

from bus_frames import DBC, LOCKSTEP, PARAMETERS, PROFILES, assert_fits_contract, decode, sample_frames_by_tick
from hexload.io.log_file import read_log
from loop import Recording, estimates

pytestmark = pytest.mark.vcan

CHANNELS = {"displacement": "displacement_m", "velocity": "velocity_m_s", "force": "force_n"}
LEGS = range(1, 7)
VERDICTS = {"converged": 0, "converging": 1, "not_excited": 2, "misfit": 3, "inconsistent": 4}
PAGES = 13
FLOAT32_ROUNDING = 2.0**-24
OF_PROFILE = {
    "fd": {"LegSampleFd", "EstimateFd", "SigmaFd", "HealthFd"},
    "classic": {"SampleTick", *(f"LegSample{leg}" for leg in LEGS), "AnswerPage"},
}


def decoded(recording: Recording, *names: str) -> list[dict]:
    return [decode(frame).values for frame in recording.frames if frame.name in names]


def rows(recording: Recording) -> list[tuple[float, np.ndarray, str]]:
    """Of estimates.csv: time, float32 numbers, verdict."""
    split = [line.split(",") for line in estimates(recording.directory)]
    return [(float(row[0]), np.array(row[1:-1], dtype=np.float32), row[-1]) for row in split]


@pytest.mark.parametrize("profile", PROFILES)
def test_every_frame_has_the_contracts_format_and_its_checksum(short_run, profile):
    # GIVEN everything that was on the bus WHEN its checksums are computed anew THEN every frame fits the contract
    recording = short_run(profile)
    for frame in recording.frames:
        assert_fits_contract(frame)
    # and every kind of frame has come; status pages go by the clock and need not
    kinds = {frame.name for frame in recording.frames} - {"ControllerStatus"}
    assert kinds == OF_PROFILE[profile] | {"Command", "Acknowledge"}


@pytest.mark.parametrize("profile", PROFILES)
def test_leg_samples_are_the_simulators_log_to_half_a_step(short_run, profile):
    # GIVEN the simulator's log, and its leg samples as they were on the bus
    recording = short_run(profile)
    log = read_log(recording.directory / "log.csv")
    samples = sample_frames_by_tick(recording.frames)
    assert len(samples) == len(log.t_s)
    # WHEN they are decoded THEN each channel is the log's, but for half a step and the float32 arithmetic of the codec:
    # the step, the quotient and the product are rounded
    for channel, attribute in CHANNELS.items():
        if profile == "fd":
            names = [f"{channel}_{leg}" for leg in LEGS]
            found = np.array([[decode(sample[0]).values[name] for name in names] for sample in samples])
            step = DBC.get_message_by_name("LegSampleFd").get_signal_by_name(names[0]).scale
        else:
            found = np.array([[decode(frame).values[channel] for frame in sample[-6:]] for sample in samples])
            step = DBC.get_message_by_name("LegSample1").get_signal_by_name(channel).scale
        sent = getattr(log, attribute)
        error = np.abs(found - sent)
        assert np.all(error <= step / 2 + 3 * FLOAT32_ROUNDING * np.abs(sent)), (channel, error.max() / step)
        assert error.max() > step / 4  # the bound is a tight one


@pytest.mark.parametrize("profile", PROFILES)
def test_ticks_of_leg_samples_count_the_rows_of_the_log(short_run, profile):
    # GIVEN the leg samples of the bus WHEN their ticks are read THEN they are 0, 1, 2 ...
    for tick, sample in enumerate(sample_frames_by_tick(short_run(profile).frames)):
        if profile == "fd":
            assert decode(sample[0]).values["tick"] == tick
        else:
            whole = [decode(frame).values["tick"] for frame in sample if frame.name == "SampleTick"]
            assert whole == ([tick] if tick % 16 == 0 else [])
            assert [frame.name for frame in sample[-6:]] == [f"LegSample{leg}" for leg in LEGS]
            assert {decode(frame).values["tick_low"] for frame in sample[-6:]} == {tick % 16}


@pytest.mark.needs("fd")
def test_fd_answers_are_the_estimates_that_the_simulator_wrote(short_run):
    # GIVEN the answers on the bus and the rows of estimates.csv
    recording = short_run("fd")
    answers = zip(*(decoded(recording, name) for name in ("EstimateFd", "SigmaFd", "HealthFd")), strict=True)
    # WHEN they are compared THEN tick by tick every number is the same float32, and the verdict is the same
    for (estimate, sigma, health), (t_s, numbers, verdict) in zip(answers, rows(recording), strict=True):
        assert estimate["tick"] == sigma["tick"] == health["tick"] == round(1000 * t_s)
        sent = [estimate[name] for name in PARAMETERS] + [sigma[f"sigma_{name}"] for name in PARAMETERS]
        assert np.array_equal(numbers, np.array([*sent, estimate["nis"]], dtype=np.float32))
        assert health["verdict"] == VERDICTS[verdict]
        assert health["verdict"] == max(health[f"verdict_{name}"] for name in PARAMETERS)
        assert (health["status"], health["fault"], health["missing_legs"], health["refused"]) == (0, 0, 0, 0)
        assert health["state"] == (3 if verdict == "converged" else 2)


def test_classic_pages_are_the_estimates_that_the_simulator_wrote(short_run):
    # GIVEN the pages on the bus, 13 for one answer, and the rows of estimates.csv
    recording = short_run("classic")
    pages = decoded(recording, "AnswerPage")
    assert [page["page"] for page in pages] == [n % PAGES for n in range(len(pages))]
    assert [page["tick_low"] for page in pages] == [2 * n for n in range(len(pages))]
    # WHEN whole rounds are put together THEN each is a row, number for number
    rounds = [pages[first : first + PAGES] for first in range(0, len(pages) - PAGES + 1, PAGES)]
    for whole, (t_s, numbers, verdict) in zip(rounds, rows(recording), strict=True):
        answer = {name: value for page in reversed(whole) for name, value in page.items()}
        assert answer["tick_low"] == round(1000 * t_s)
        sent = [answer[name] for name in PARAMETERS] + [answer[f"sigma_{name}"] for name in PARAMETERS]
        assert np.array_equal(numbers, np.array([*sent, answer["nis"]], dtype=np.float32))
        assert answer["verdict"] == VERDICTS[verdict]
        assert (answer["status"], answer["fault"], answer["missing_legs"], answer["refused"]) == (0, 0, 0, 0)


@pytest.mark.needs("fd")
def test_health_bits_of_the_frames_add_up_to_the_ticks_of_the_metadata(short_run):
    # GIVEN the names of the bits, as the contract lists them
    recording = short_run("fd")
    comment = DBC.get_message_by_name("HealthFd").get_signal_by_name("health").comment
    names = {int(bit): name for bit, name in re.findall(r"(\d+) ([a-z ]+)", comment)}
    # WHEN the frames with each bit are counted THEN the metadata has the same names and numbers
    bits = [health["health"] for health in decoded(recording, "HealthFd")]
    assert recording.meta["health_ticks"] == {name: sum(b >> bit & 1 for b in bits) for bit, name in names.items()}
    assert any(bits)


@pytest.mark.parametrize("profile", PROFILES)
def test_commands_and_acknowledges_of_a_run_in_lockstep(short_run, profile):
    # GIVEN the commands of a run, each taken once: they are repeated when the acknowledge is late
    recording = short_run(profile)
    commands = decoded(recording, "Command")
    order = list(dict.fromkeys((command["command"], command.get("pacing")) for command in commands))
    # WHEN they are read THEN they are reset, select the paper's filter, start in lockstep, stop
    assert order == [(3, None), (4, None), (1, LOCKSTEP), (2, None)]
    assert {command.get("estimator", 0) for command in commands} == {0}
    # and each is acknowledged, once, by a controller of this profile
    acknowledges = decoded(recording, "Acknowledge")
    names = ("command", "source", "session")
    asked = [(command["counter"], *(command[name] for name in names)) for command in commands]
    assert [(a["sequence"], *(a[name] for name in names)) for a in acknowledges] == asked
    assert len({(command["source"], command["session"]) for command in commands}) == 1
    assert {PROFILES[acknowledge["profile"]] for acknowledge in acknowledges} == {profile}
    done = {acknowledge["command"]: acknowledge["state"] for acknowledge in acknowledges if acknowledge["result"] == 0}
    assert done == {3: 0, 4: 0, 1: 1, 2: 0}
