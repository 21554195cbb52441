"""hexload_bridge: LCM shows what the CAN bus carried, and everything that was wrong on it."""

import csv
import json
import signal
import time

import can
import pytest
from lcm_listener import Listener, private_url
from momentum_scenario import TICKS, platform_of, write

from hexload_tools import bus_document, project

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PARAMETERS = ["dz", "Ixx", "Iyy", "Izz"]


@pytest.fixture
def port():
    return private_url().split(":")[-1].split("?")[0]


@pytest.fixture
def url():
    return private_url()


@pytest.fixture
def run_bridged(start, ecu, simulator, bridge, port, url, tmp_path):
    """A run by the clock, as long as it is slow enough for every listener: (rows of its estimates, messages, bridge)."""
    bus = f"udp_multicast:239.74.163.2:{port}"

    def runner(profile, *bridge_options):
        teller = start(bridge, "--bus", bus, "--profile", profile, "--lcm", url, *bridge_options)
        teller.wait_for("^hexload_bridge: ready on " + bus)
        controller = start(ecu, "--bus", bus, "--profile", profile, "--platform", PLATFORM)
        controller.wait_for("ready on")
        listener = Listener(url)
        out = tmp_path / "run"
        options = ["--out", out, "--duration", "2.5", "--real-time", "--bus", bus, "--profile", profile]
        program = start(simulator, project.SCENARIOS / "paper.toml", *options)
        listener.listen_until(lambda: program.process.poll() is not None)
        assert program.wait() == 0
        teller.process.send_signal(signal.SIGTERM)
        listener.listen_until(lambda: teller.process.poll() is not None)
        assert teller.wait() == 0
        with (out / "estimates.csv").open() as file:
            rows = list(csv.DictReader(file))
        return rows, listener.messages, teller

    return runner


@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_estimates_and_health_on_lcm_are_those_of_the_bus(run_bridged, profile):
    # GIVEN a run over a CAN bus with a bridge on it
    rows, messages, teller = run_bridged(profile)
    by_tick = {round(float(row["t"]) * 1000): row for row in rows}
    estimates = {message.tick: message for message in messages["estimate_t"]}
    # THEN every estimate of the run is on LCM, to the last digit
    common = by_tick.keys() & estimates.keys()
    assert len(common) >= 0.9 * len(by_tick) > 50
    for tick in common:
        row, message = by_tick[tick], estimates[tick]
        assert list(message.name) == PARAMETERS
        for index, name in enumerate(PARAMETERS):
            assert f"{message.value[index]:.9g}" == row[name]
            assert f"{message.sigma[index]:.9g}" == row[f"s_{name}"]
        assert message.verdict == row["verdict"]
        assert f"{message.nis:.9g}" == row["nis"]
    # and the health goes with it
    states = {message.state for message in messages["health_t"]}
    assert states <= {"armed", "estimating", "converged"} and "estimating" in states
    # and the samples are not: the simulator may publish them
    assert messages["leg_sample_t"] == []
    teller.wait_for(r"ended; .* refused 0 by length, 0 by checksum, 0 by value, 0 by tick, 0 of the other profile")


@pytest.mark.parametrize("profile, ticks_per_answer", [("fd", 1), ("classic", 52)])
def test_ten_parameters_and_the_event_of_a_new_load_are_on_lcm(
    start, ecu, simulator, bridge, port, url, tmp_path, profile, ticks_per_answer
):
    # GIVEN a bridge on a bus in lockstep, whose controller runs the momentum filter
    scenario, bus = write(tmp_path), f"udp_multicast:239.74.163.2:{port}"
    teller = start(bridge, "--bus", bus, "--profile", profile, "--lcm", url)
    teller.wait_for("ready on")
    start(ecu, "--bus", bus, "--profile", profile, "--platform", platform_of(scenario)).wait_for("ready on")
    listener = Listener(url)
    # WHEN another load is picked up
    program = start(simulator, scenario, "--out", tmp_path / "run", "--bus", bus, "--profile", profile, "--real-time")
    listener.listen_until(lambda: program.process.poll() is not None)
    assert program.wait() == 0
    noticed_s = json.loads((tmp_path / "run" / "meta.json").read_text())["load_changes_noticed_s"]
    # THEN LCM has the event, once, and the estimates of all ten
    assert [change.tick / 1000 for change in listener.messages["load_change_t"]] == noticed_s
    assert len(noticed_s) == 1
    told = listener.messages["estimate_t"]
    assert 0.9 * TICKS / ticks_per_answer <= len(told) + 1 <= TICKS / ticks_per_answer + 1
    assert {(message.filter, message.count) for message in told} == {("momentum", 10)}
    # and the controller's count of changes is in the statistics when its page has come
    teller.process.send_signal(signal.SIGTERM)
    listener.listen_until(lambda: teller.process.poll() is not None)
    assert listener.messages["bus_statistics_t"][-1].controller_load_changes == 1


@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_bus_statistics_agree_with_the_bus_document_and_the_controller(run_bridged, profile):
    _, messages, _ = run_bridged(profile, "--samples")
    # GIVEN the period of which most lay within the run
    busiest = max(messages["bus_statistics_t"], key=lambda message: message.load_1)
    last = messages["bus_statistics_t"][-1]
    # THEN the load is that of the contract's cyclic frames: a run that was held up may catch up a little, and a period
    # may be half idle
    contract = bus_document.bus_load(bus_document.load_contract(), profile, "paper")
    assert 0.4 * contract < busiest.load_1 < 1.2 * contract
    assert last.peak_load_1 == busiest.load_1
    assert (last.bus.split(":")[0], last.profile) == ("udp_multicast", profile)
    # and samples are counted as LCM has them
    assert last.samples == len(messages["leg_sample_t"])
    assert last.samples + last.samples_missing + last.samples_incomplete >= 2500
    # and the controller's own view came through
    assert last.has_controller and last.controller_version == "0.1.0"
    assert last.controller_fault == "no fault"


def test_frames_that_are_wrong_or_foreign_are_counted_by_kind(start, bridge, port, url):
    # GIVEN a bridge alone on a bus
    bus = f"udp_multicast:239.74.163.2:{port}"
    listener = Listener(url)
    teller = start(bridge, "--bus", bus, "--lcm", url)
    teller.wait_for("ready on")
    frames = {
        "refused_length": can.Message(arbitration_id=128, is_extended_id=False, is_fd=True, data=bytes(32)),
        "refused_checksum": can.Message(arbitration_id=128, is_extended_id=False, is_fd=True, bitrate_switch=True, data=bytes(64)),
        "refused_profile": can.Message(arbitration_id=129, is_extended_id=False, data=bytes(8)),
        "foreign": can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b"\x01"),
    }
    # WHEN frames come that are not as the contract says
    with can.Bus(interface="udp_multicast", channel="239.74.163.2", port=int(port), fd=True, hop_limit=0) as sender:
        for frame in frames.values():
            sender.send(frame)
        until = time.monotonic() + 60
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
