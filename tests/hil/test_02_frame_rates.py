"""In real time each kind of frame comes as often as the contract says, counted in ticks; what is lost is counted."""

from typing import NamedTuple

import pytest

from bus_frames import BY_ID, DBC, PROFILES, Frame, decode, is_of, tick_of_fd
from loop import SLOW_MACHINE, read_meta

pytestmark = [pytest.mark.vcan, pytest.mark.needs("real time"), pytest.mark.apart]

DURATION_S = 2
TICKS = 1000 * DURATION_S + 1
STATUS = DBC.get_message_by_name("ControllerStatus")
STATUS_PAGES = len(STATUS.get_signal_by_name("page").choices)


class RealTimeRun(NamedTuple):
    profile: str
    frames: list[Frame]
    status_times_s: list[float]  # when the status pages were on the bus
    meta: dict

    def count(self, name: str) -> int:
        return sum(frame.name == name for frame in self.frames)

    def cyclic(self, sender: str) -> list:
        """The messages that this sender sends with the ticks in this profile."""
        sent = [message for message in DBC.messages if sender in message.senders and is_of(message, self.profile)]
        return [message for message in sent if message.cycle_time and message != STATUS]


@pytest.fixture(scope="module", params=PROFILES)
def run(request, in_module, tmp_path_factory) -> RealTimeRun:
    profile, directory = request.param, tmp_path_factory.mktemp("rates") / "run"
    controller = in_module.controller("--profile", profile, *SLOW_MACHINE)
    recorder = in_module.recorder()
    simulation = in_module.simulation(directory, "--real-time", "--profile", profile, "--duration", DURATION_S)
    assert simulation.wait() == 0, simulation.output
    print(simulation.output)
    controller.wait_for("hexload_ecu: idle")  # it has taken every sample: STOP comes last
    frames = in_module.finish(recorder)
    assert controller.interrupt() == 0
    pages = [line for line in recorder.output.splitlines() if f" {STATUS.frame_id:03X}#" in line]
    return RealTimeRun(profile, frames, [float(line[1:].split(")")[0]) for line in pages], read_meta(directory))


def test_only_the_profiles_identifiers_are_on_the_bus(run):
    # GIVEN a run in real time WHEN its frames are looked at THEN all have identifiers of their profile
    assert all(is_of(BY_ID[identifier], run.profile) for identifier in {frame.id for frame in run.frames})


def test_frames_of_the_samples_come_once_per_cycle_time(run):
    # GIVEN a run in real time, all of whose samples were sent
    assert (run.meta["bus"]["samples"], run.meta["bus"]["unsent"]) == (TICKS, 0)
    # WHEN the simulator's frames are counted THEN there is one for each tick that is a multiple of its cycle time
    assert len(run.cyclic("SIMULATOR")) == {"fd": 1, "classic": 7}[run.profile]
    for message in run.cyclic("SIMULATOR"):
        assert run.count(message.name) == (TICKS - 1) // message.cycle_time + 1, message.name


def test_ticks_of_the_samples_count_up_by_one(run):
    # GIVEN a run in real time WHEN its leg samples are read in the order of the bus THEN their ticks follow one another
    if run.profile == "fd":
        assert [tick_of_fd(frame) for frame in run.frames if frame.name == "LegSampleFd"] == list(range(TICKS))
    else:
        lows = [decode(frame).values["tick_low"] for frame in run.frames if frame.name.startswith("LegSample")]
        assert lows == [tick % 16 for tick in range(TICKS) for _ in range(6)]


def test_answers_come_once_per_cycle_time_and_what_does_not_come_is_counted(run):
    # GIVEN a run in real time: one answer is due in each cycle time
    bus = run.meta["bus"]
    (cycle_time,) = {message.cycle_time for message in run.cyclic("CONTROLLER")}
    assert bus["answers_expected"] == (TICKS - 1) // cycle_time + 1
    # WHEN the controller's answers are counted THEN the FD controller has answered every sample; a classic one passes
    # over those whose four-bit tick a stall of 8 ms has made ambiguous
    for message in run.cyclic("CONTROLLER"):
        count = run.count(message.name)
        assert bus["answers"] <= count <= bus["answers_expected"], message.name
        assert run.profile == "classic" or count == bus["answers_expected"], message.name
    # and each that the simulator did not get in time is counted as missing
    assert bus["answers"] + bus["answers_missing"] == bus["answers_expected"]


def test_status_pages_come_in_turn_and_tell_the_run(run):
    # GIVEN the status pages of a run
    pages = [decode(frame).values for frame in run.frames if frame.name == STATUS.name]
    # WHEN their numbers are read THEN each follows the one before
    numbers = [page["page"] for page in pages]
    assert numbers == [(numbers[0] + n) % STATUS_PAGES for n in range(len(numbers))]
    assert set(numbers) == set(range(STATUS_PAGES))
    # and the last of each kind tells version, profile and counters
    last = {name: value for page in pages for name, value in page.items()}
    assert f"{last['version_major']}.{last['version_minor']}.{last['version_patch']}" == run.meta["version"]
    assert PROFILES[last["profile"]] == run.profile
    assert last["samples_refused"] == last["frames_refused"] == last["load_changes"] == 0
    assert 0 < last["stack_margin"] < 1 << 20
    assert run.profile == "classic" or last["samples_missing"] == 0
    # and the ticks that they tell go up
    ticks = [page["tick"] for page in pages if page["page"] == 1]
    assert ticks == sorted(ticks) and 0 < ticks[-1] < TICKS


def test_status_pages_come_once_per_cycle_time_at_most(run):
    # GIVEN the times at which the status pages were on the bus WHEN their mean distance is taken THEN it is the cycle
    # time, or longer where the controller was not given its time: a period that is missed is not made up for
    first, last = run.status_times_s[0], run.status_times_s[-1]
    mean_ms = 1000 * (last - first) / (len(run.status_times_s) - 1)
    print(f"{run.profile}: a status page every {mean_ms:.1f} ms")
    assert 0.9 * STATUS.cycle_time < mean_ms < 4 * STATUS.cycle_time
