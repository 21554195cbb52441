"""hexload_bridge: LCM shows what the CAN bus carried, and everything that was wrong on it."""

import csv
import select
import signal
import subprocess
import time
from collections import Counter, deque
from collections.abc import Iterator
from typing import NamedTuple

import pytest

import momentum_scenario
from bus_frames import BY_ID, BY_THE_CLOCK, PARAMETERS, PROFILES
from hexload import project
from hexload.io.python_can import can
from hexload_dev import bus_document
from lcm_listener import PATIENCE_S, Listener, private_url
from loop import OPEN, PATIENT, read_meta
from momentum_scenario import TICKS as MOMENTUM_TICKS
from momentum_scenario import platform_of, write

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
GROUP = "239.74.163.2"
DURATION_S = 1
TICKS = 1000 * DURATION_S + 1
STATUS = "ControllerStatus"
NO_VERSION = "0.0.0"  # the page has not come yet
ANSWERS = ("EstimateFd", "SigmaFd", "LoadFd", "LoadSigmaFd", "HealthFd", "AnswerPage")
FRAMES_PER_ANSWER = {("fd", "paper"): 3, ("fd", "momentum"): 3, ("classic", "paper"): 13, ("classic", "momentum"): 26}
TICKS_PER_ANSWER = {("fd", "paper"): 1, ("fd", "momentum"): 1, ("classic", "paper"): 26, ("classic", "momentum"): 52}


@pytest.fixture
def url():
    return private_url()


def bus_of_its_own() -> str:
    return f"udp_multicast:{GROUP}:{private_url().split(':')[-1].split('?')[0]}"


def open_bus(name: str) -> can.BusABC:
    _, group, port = name.split(":")
    return can.Bus(interface="udp_multicast", channel=group, port=int(port), fd=True, hop_limit=0)


class Relay:
    """Between a simulator on a bus of its own, `simulators`, and a controller and a bridge on `controllers`. It hands an
    answer on when LCM has told all before it: in lockstep the simulator is never faster than bridge and listener."""

    def __init__(self, listener: Listener, frames_per_answer: int, has_samples: bool):
        self.simulators, self.controllers = bus_of_its_own(), bus_of_its_own()
        self.seen: Counter[str] = Counter()  # frames handed on, by name
        self._listener, self._frames_per_answer, self._has_samples = listener, frames_per_answer, has_samples
        self._held: deque[can.Message] = deque()

    def run_with(self, process: subprocess.Popen) -> None:
        """Until the simulator has ended."""
        until = time.monotonic() + PATIENCE_S
        with open_bus(self.simulators) as near, open_bus(self.controllers) as far:
            while process.poll() is None:
                select.select([near, far, self._listener.lcm], [], [], 0.05)
                for message in self._frames(near, "SIMULATOR"):
                    far.send(message)
                self._held.extend(self._frames(far, "CONTROLLER"))
                self._listener.hear_what_is_there()
                while self._held and self._all_is_told():
                    near.send(self._held.popleft())
                assert time.monotonic() < until, f"still running after {PATIENCE_S:g} s"

    def _frames(self, bus: can.BusABC, sender: str) -> Iterator[can.Message]:
        """Those of `sender` that have come."""
        while (message := bus.recv(0)) is not None:
            kind = BY_ID[message.arbitration_id]
            if sender in kind.senders:
                self.seen[kind.name] += 1
                yield message

    def _all_is_told(self) -> bool:
        told = self._listener.messages
        answers = sum(self.seen[name] for name in ANSWERS) // self._frames_per_answer
        samples = self.seen["LegSampleFd"] + self.seen["LegSample6"] if self._has_samples else 0
        return len(told["estimate_t"]) >= answers and len(told["leg_sample_t"]) >= samples


class Bridged(NamedTuple):
    rows: list[dict[str, str]]  # of the run's estimates
    meta: dict
    messages: dict[str, list]
    seen: Counter[str]  # frames on the bus, by name
    teller: object


@pytest.fixture
def run_bridged(start, ecu, simulator, bridge, url, tmp_path):
    """run_bridged(profile, filter_name, *options of the bridge): a run in lockstep, and on until `is_told(messages)`."""

    def runner(profile, filter_name, *bridge_options, is_told=lambda messages: True) -> Bridged:
        scenario, platform, duration_s = project.SCENARIOS / "paper.toml", PLATFORM, DURATION_S
        if filter_name == "momentum":
            scenario = write(tmp_path)
            platform, duration_s = platform_of(scenario), momentum_scenario.DURATION_S
        listener = Listener(url)
        relay = Relay(listener, FRAMES_PER_ANSWER[profile, filter_name], "--samples" in bridge_options)
        teller = start(bridge, "--bus", relay.controllers, "--profile", profile, "--lcm", url, *bridge_options)
        teller.wait_for("^hexload_bridge: ready on " + relay.controllers)
        start(ecu, OPEN, "--bus", relay.controllers, "--profile", profile, "--platform", platform).wait_for("ready on")
        options = ["--out", tmp_path / "run", "--duration", duration_s, "--bus", relay.simulators, "--profile", profile]
        program = start(simulator, scenario, *options, *PATIENT)
        relay.run_with(program.process)
        assert program.wait() == 0
        listener.listen_until(lambda: is_told(listener.messages))
        teller.process.send_signal(signal.SIGTERM)
        listener.listen_until(lambda: teller.process.poll() is not None)
        assert teller.wait() == 0
        with (tmp_path / "run" / "estimates.csv").open() as file:
            rows = list(csv.DictReader(file))
        return Bridged(rows, read_meta(tmp_path / "run"), listener.messages, relay.seen, teller)

    return runner


@pytest.mark.parametrize("profile", PROFILES)
def test_estimates_and_health_on_lcm_are_those_of_the_bus(run_bridged, profile):
    # GIVEN a run over a CAN bus with a bridge on it
    run = run_bridged(profile, "paper")
    by_tick = {round(float(row["t"]) * 1000): row for row in run.rows}
    estimates = {message.tick: message for message in run.messages["estimate_t"]}
    # THEN every estimate of the run is on LCM, to the last digit
    assert estimates.keys() == by_tick.keys()
    assert len(by_tick) == TICKS // TICKS_PER_ANSWER[profile, "paper"]
    for tick, row in by_tick.items():
        message = estimates[tick]
        assert list(message.name) == list(PARAMETERS)
        for index, name in enumerate(PARAMETERS):
            assert f"{message.value[index]:.9g}" == row[name]
            assert f"{message.sigma[index]:.9g}" == row[f"s_{name}"]
        assert message.verdict == row["verdict"]
        assert f"{message.nis:.9g}" == row["nis"]
    # and the health goes with it
    states = {message.state for message in run.messages["health_t"]}
    assert states <= {"armed", "estimating", "converged"} and "estimating" in states
    # and the samples are not: the simulator may publish them
    assert run.messages["leg_sample_t"] == []
    run.teller.wait_for(r"ended; .* refused 0 by length, 0 by checksum, 0 by value, 0 by tick, 0 of the other profile")


@pytest.mark.parametrize("profile", PROFILES)
def test_ten_parameters_and_the_event_of_a_new_load_are_on_lcm(run_bridged, profile):
    # GIVEN a bridge on a bus in lockstep, whose controller runs the momentum filter
    # WHEN another load is picked up, and the controller's page that counts it has come
    def is_counted(messages):
        return messages["bus_statistics_t"] and messages["bus_statistics_t"][-1].controller_load_changes == 1

    run = run_bridged(profile, "momentum", "--samples", is_told=is_counted)
    # THEN LCM has the event, once, and the estimates of all ten
    detected_s = run.meta["load_changes_detected_s"]
    assert [change.tick / 1000 for change in run.messages["load_change_t"]] == detected_s
    assert len(detected_s) == 1
    told = run.messages["estimate_t"]
    assert len(told) == len(run.rows) == MOMENTUM_TICKS // TICKS_PER_ANSWER[profile, "momentum"]
    assert {(message.filter, message.count) for message in told} == {("momentum", 10)}


@pytest.mark.parametrize("profile", PROFILES)
def test_bus_statistics_agree_with_the_bus_document_and_the_controller(run_bridged, profile):
    # GIVEN a run, and the statistics of all its periods
    def has_controller(messages):
        return messages["bus_statistics_t"] and messages["bus_statistics_t"][-1].controller_version != NO_VERSION

    run = run_bridged(profile, "paper", "--samples", is_told=has_controller)
    told = run.messages["bus_statistics_t"]
    assert [message.sequence for message in told] == list(range(len(told)))
    last = told[-1]
    # WHEN their rates are counted up THEN they are the frames of the ticks, each as often as the contract says, and some
    # that go by the clock
    contract = bus_document.load_contract()
    kinds = bus_document.messages_of(contract, profile, "paper")
    cyclic = [kind for kind in kinds if kind.cycle_time and kind.name != STATUS]
    frames = {kind.name: (TICKS - 1) // kind.cycle_time + 1 for kind in cyclic}
    assert {name: run.seen[name] for name in frames} == frames
    counted = sum((m.frames_to_controller_1_s + m.frames_from_controller_1_s) * m.period_s for m in told)
    by_the_clock = round(counted) - sum(frames.values())
    assert counted == pytest.approx(round(counted), abs=1e-6)
    assert by_the_clock >= sum(run.seen[name] for name in BY_THE_CLOCK)
    # and together they keep the bus busy as long as the bus document says
    times_s = {kind.name: bus_document.frame_time_s(kind, bus_document.DATA_MBIT_S) for kind in contract.messages}
    assert len({times_s[name] for name in BY_THE_CLOCK}) == 1
    expected_s = by_the_clock * times_s[STATUS] + sum(count * times_s[name] for name, count in frames.items())
    assert sum(message.load_1 * message.period_s for message in told) == pytest.approx(expected_s, rel=1e-9)
    assert last.peak_load_1 == max(message.load_1 for message in told)
    assert (last.bus.split(":")[0], last.profile) == ("udp_multicast", profile)
    # and samples are counted as LCM has them
    assert last.samples == len(run.messages["leg_sample_t"]) == TICKS
    assert last.samples_missing == last.samples_incomplete == last.answers_incomplete == last.receive_drops == 0
    # and the controller's own view came through
    assert last.has_controller
    assert last.controller_version == run.meta["version"]
    assert last.controller_fault == "no fault"


def test_frames_that_are_wrong_or_foreign_are_counted_by_kind(start, bridge, url):
    # GIVEN a bridge alone on a bus
    bus = bus_of_its_own()
    listener = Listener(url)
    teller = start(bridge, "--bus", bus, "--lcm", url)
    teller.wait_for("ready on")
    classic, _ = project.native_module().bus.encode_sample("classic", 0, *3 * [6 * [0.0]])
    frames = {
        "refused_length": can.Message(arbitration_id=128, is_extended_id=False, is_fd=True, data=bytes(32)),
        "refused_checksum": can.Message(
            arbitration_id=128, is_extended_id=False, is_fd=True, bitrate_switch=True, data=bytes(64)
        ),
        "refused_profile": can.Message(arbitration_id=classic[0][0], is_extended_id=False, data=classic[0][2]),
        "foreign": can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"\x01"),
    }
    # WHEN frames come that are not as the contract says
    with open_bus(bus) as sender:
        for frame in frames.values():
            sender.send(frame)
        until = time.monotonic() + PATIENCE_S
        while True:
            listener.lcm.handle_timeout(100)
            told = listener.messages["bus_statistics_t"]
            foreign = round(sum(message.foreign_frames_1_s * message.period_s for message in told))
            if told and told[-1].refused_profile and foreign:
                break
            assert time.monotonic() < until, teller.tail()
    # THEN each is counted once, where it belongs
    last = told[-1]
    assert (last.refused_length, last.refused_checksum, last.refused_profile) == (1, 1, 1)
    assert (last.refused_value, last.refused_tick, last.samples, foreign) == (0, 0, 0, 1)
    assert not last.has_controller


def test_a_bus_that_does_not_exist_is_refused(start, bridge):
    program = start(bridge, "--bus", "serial:1")
    assert program.wait() == 2
    program.wait_for("^hexload_bridge: bus: found 'serial:1', expected socketcan:INTERFACE")
