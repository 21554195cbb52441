"""The momentum filter over the bus: all ten parameters, and a changed load as an event, in either profile."""

from pathlib import Path

import numpy as np
import pytest

from bus_frames import LOAD_PARAMETERS, PROFILES, Frame, assert_fits_contract, decode
from hexload import project
from hexload.io.log_file import read_log
from loop import OPEN, PATIENT, Recording, estimates, read_meta
from momentum_scenario import HEAVY, PICK_UP_S, TICKS, platform_of, write
from test_04_convergence import CHANNELS, quantised, step_of

ROUND_TICKS = 52  # of a classic answer: 26 pages, one at every second tick
DETECTED_S = 0.010
STATES = {"converged": 3, "converging": 2, "not_excited": 2, "misfit": 2, "inconsistent": 2}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("momentum"))


def replay(
    scenario: Path, profile: str, directory: Path, out: Path, rig: Path | None = None
) -> tuple[dict[str, str], list[float]]:
    """The firmware in this process over a run's log, quantised as the profile does: its rows by time, and when it
    detected another load."""
    log = read_log(directory / "log.csv")
    legs = [quantised(getattr(log, name), step_of(profile, channel)) for channel, name in CHANNELS.items()]
    native = project.native_module()
    platform = native.load_platform(str(platform_of(scenario)))
    platform = platform if rig is None else native.with_rig(platform, str(rig))
    result = native.replay(platform, None, None, log.t_s, *(part.astype(float) for part in legs), str(out))
    bit = list(result["health_counts"]).index("load changed")
    detected_s = [float(t_s) for t_s in log.t_s[result["health"].astype(int) >> bit & 1 == 1]]
    header, *rows = (line.split(",") for line in out.read_text().splitlines())
    carried = [k for k, name in enumerate(header) if not name.startswith("n_")]  # a bus has no own sigmas
    return {row[0]: ",".join(row[k] for k in carried) for row in rows}, detected_s


def last_estimate(directory: Path) -> dict[str, str]:
    lines = (directory / "estimates.csv").read_text().splitlines()
    return dict(zip(lines[0].split(","), lines[-1].split(",")))


def assert_same(received: list[str], replayed: list[str], is_same_arithmetic: bool) -> None:
    """To the last digit, or, from a processor that rounds otherwise than this one, within what float may differ by."""
    if is_same_arithmetic:
        assert received == replayed
        return
    for ours, theirs in zip(received, replayed, strict=True):
        one, other = (np.array(line.split(",")[1:21], float) for line in (ours, theirs))
        assert (np.abs(one[:10] - other[:10]) <= 0.3 * other[10:]).all(), ours


def check_run(
    scenario: Path, profile: str, directory: Path, output: str, tmp_path: Path, is_same_arithmetic: bool = True
) -> None:
    """What a run over any bus has to show."""
    # WHEN the firmware runs over the quantised log in this process
    replayed, detected_s = replay(scenario, profile, directory, tmp_path / "replayed.csv")
    # THEN every estimate that came over the bus is its own: each one, or one in a round of pages
    received = estimates(directory)
    assert len(received) == {"fd": TICKS, "classic": TICKS // ROUND_TICKS}[profile]
    assert_same(received, [replayed[line.split(",")[0]] for line in received], is_same_arithmetic)
    # AND the new load was reported as an event of the tick at which the firmware detected it, once
    meta = read_meta(directory)
    assert meta["load_changes_detected_s"] == detected_s and len(detected_s) == 1
    assert PICK_UP_S <= detected_s[0] <= PICK_UP_S + DETECTED_S
    assert meta["health_ticks"]["load changed"] == 1
    assert meta["bus"]["events_missing"] == 0
    assert f"another load detected at {detected_s[0]:.3f} s" in output
    # AND the estimate has come to the new load
    last = last_estimate(directory)
    mass, com = HEAVY
    for name, truth in zip(("m", "hx", "hy", "hz"), (mass, *(mass * c for c in com))):
        estimate, sigma = float(last[name]), float(last[f"s_{name}"])
        print(f"{profile} {name}: {estimate:.2f} +- {sigma:.2g}, truth {truth:.2f}")
        assert abs(estimate - truth) < 5 * sigma, name
    assert float(last["s_m"]) < 0.01 * mass


@pytest.mark.parametrize("profile", PROFILES)
def test_over_udp_multicast_all_ten_are_the_firmwares_and_a_new_load_is_an_event(
    start, ecu, simulator, scenario, profile, free_bus, tmp_path
):
    # GIVEN the loop of two programs in lockstep, without a CAN bus
    controller = start(ecu, OPEN, "--bus", free_bus, "--profile", profile, "--platform", platform_of(scenario))
    controller.wait_for("ready on")
    program = start(simulator, scenario, "--out", tmp_path / "run", "--bus", free_bus, "--profile", profile, *PATIENT)
    assert program.wait() == 0
    check_run(scenario, profile, tmp_path / "run", program.output, tmp_path)
    # and the controller says it too
    controller.wait_for("armed, lockstep, momentum filter")
    controller.wait_for("another load detected at tick 10")


@pytest.fixture(scope="module")
def recorded(in_module, scenario, tmp_path_factory):
    """recorded(profile): a run over vcan0, with all that was on the bus."""
    recordings: dict[str, Recording] = {}

    def recorder(profile: str) -> Recording:
        if profile not in recordings:
            folder = tmp_path_factory.mktemp("recorded") / "run"
            recordings[profile] = in_module.record(folder, profile, scenario=scenario, platform=platform_of(scenario))
        return recordings[profile]

    return recorder


@pytest.mark.vcan
@pytest.mark.parametrize("profile", PROFILES)
def test_over_can_all_ten_are_the_firmwares_and_a_new_load_is_an_event(recorded, kind, scenario, profile, tmp_path):
    recording = recorded(profile)
    check_run(scenario, profile, recording.directory, recording.output, tmp_path, kind.name == "linux")


def values(frames: list[Frame], *names: str) -> list[dict]:
    return [decode(frame).values for frame in frames if frame.name in names]


@pytest.mark.vcan
@pytest.mark.parametrize("profile", PROFILES)
def test_frames_of_the_momentum_filter_fit_the_contract_and_no_others_answer(recorded, profile):
    # GIVEN everything that was on the bus WHEN its checksums are computed anew THEN every frame fits the contract
    frames = recorded(profile).frames
    for frame in frames:
        assert_fits_contract(frame)
    # and the answers are those of this filter
    answers = {"LoadFd", "LoadSigmaFd", "HealthFd"} if profile == "fd" else {"AnswerPage"}
    kinds = {frame.name for frame in frames} - {"Command", "Acknowledge", "ControllerStatus", "SampleTick"}
    assert {name for name in kinds if not name.startswith("LegSample")} == answers | {"LoadChange"}
    # and the event comes before the answer to its sample
    order = [frame.name for frame in frames if frame.name in (*answers, "LoadChange")]
    ticks = [signals["tick"] for signals in values(frames, "LoadChange")]
    assert [signals["load_changes"] for signals in values(frames, "LoadChange")] == [1]
    before = order.index("LoadChange")
    assert before == {"fd": 3 * ticks[0], "classic": (ticks[0] + 1) // 2}[profile]


@pytest.mark.vcan
def test_classic_pages_are_the_estimates_that_the_simulator_wrote(recorded):
    # GIVEN the pages on the bus, 26 for one answer, and the rows of estimates.csv
    recording = recorded("classic")
    codes = [0, *range(13, 33), 9, 10, 11, 12, 33]
    pages = values(recording.frames, "AnswerPage")
    assert [page["page"] for page in pages] == [codes[n % 26] for n in range(len(pages))]
    # WHEN whole rounds are put together THEN each is a row, number for number
    rows = [line.split(",") for line in estimates(recording.directory)]
    rounds = [pages[first : first + 26] for first in range(0, len(pages) - 25, 26)]
    for whole, row in zip(rounds, rows, strict=True):
        answer = {name: value for page in reversed(whole) for name, value in page.items()}
        names = [*LOAD_PARAMETERS, *(f"sigma_{name}" for name in LOAD_PARAMETERS), "nis"]
        assert [f"{answer[name]:.9g}" for name in names] == row[1:-1]
        assert answer["verdict"] == max(answer[f"verdict_{name}"] for name in LOAD_PARAMETERS)
        assert answer["state"] == STATES[row[-1]]
        assert (answer["filter"], answer["status"], answer["fault"], answer["refused"]) == (1, 0, 0, 0)
    # and the new load is reported in the round after it, and in that one only
    reported = [whole[0]["health"] >> 10 & 1 for whole in rounds]
    assert sum(reported) == 1 and reported.index(1) == round(1000 * PICK_UP_S) // ROUND_TICKS + 1
