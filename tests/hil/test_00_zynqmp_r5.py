"""The launcher of the emulated Cortex-R5F: what it makes of the controller's frames. No emulator is needed."""

import argparse
import re

import pytest

from bus_frames import DBC, encode
from hexload import project
from hexload.errors import InputError
from hexload_dev import boot_options, mps2, zynqmp_r5
from loop import PLATFORM, Controller

IDLE, ARMED, ESTIMATING, FAULT = 0, 1, 2, 4
SAMPLE_TIMEOUT = 1


@pytest.fixture
def report():
    return zynqmp_r5.Report(is_quiet=False)


def take(report, name, **signals):
    frame = encode(name, **signals)
    return report.take(frame.id, frame.data)


def test_numbers_are_those_of_the_contract_and_of_the_firmware():
    # GIVEN the launcher's copies WHEN they are compared with their sources THEN they are the same
    assert zynqmp_r5.ACKNOWLEDGE == DBC.get_message_by_name("Acknowledge").frame_id
    assert zynqmp_r5.CONTROLLER_STATUS == DBC.get_message_by_name("ControllerStatus").frame_id
    port = project.ROOT / "firmware" / "ports" / "zynqmp_r5"
    mark = re.search(r"BOOT_OPTIONS_MARK (0x\w+)u", (port.parent / "boot" / "boot_options.h").read_text())
    assert int(mark[1], 16) == boot_options.MARK
    data = re.search(r"data .*ORIGIN = (\w+), LENGTH = 60K", (port / "zynqmp_r5.ld").read_text())
    assert int(data[1], 16) + 60 * 1024 == zynqmp_r5.BOOT_OPTIONS_ADDRESS
    data = re.search(
        r"data .*ORIGIN = (\w+), LENGTH = 4M - 4K", (port.parent / "mps2_an500" / "mps2_an500.ld").read_text()
    )
    assert int(data[1], 16) + (4 * 1024 - 4) * 1024 == mps2.BOOT_OPTIONS_ADDRESS


def test_each_change_of_state_is_said_once(report):
    # GIVEN pages and acknowledges WHEN the state changes THEN it is said, by whichever comes first
    assert take(report, "ControllerStatus", page=0, state=IDLE) is None
    assert take(report, "Acknowledge", state=ARMED) == "armed"
    assert take(report, "ControllerStatus", page=3, state=ARMED) is None
    assert take(report, "ControllerStatus", page=4, state=ESTIMATING) == "estimating"
    assert take(report, "Acknowledge", state=IDLE) == "idle"


def test_a_fault_that_names_a_tick_waits_for_the_page_that_has_it(report):
    # GIVEN a controller in fault WHEN its pages come THEN the fault is said with the page of the tick
    take(report, "ControllerStatus", page=0, state=ESTIMATING)
    for page in (0, 2):
        assert take(report, "ControllerStatus", page=page, state=FAULT, fault=SAMPLE_TIMEOUT) is None
    said = take(report, "ControllerStatus", page=1, state=FAULT, fault=SAMPLE_TIMEOUT, tick=70_000)
    assert said.startswith("fault: the samples are silent since tick 70001: is the simulator still running?")
    assert take(report, "ControllerStatus", page=1, state=FAULT, fault=SAMPLE_TIMEOUT, tick=70_000) is None


def test_a_quiet_one_says_faults_and_their_end_only():
    report = zynqmp_r5.Report(is_quiet=True)
    assert take(report, "Acknowledge", state=ARMED) is None
    assert take(report, "Acknowledge", state=FAULT, fault=4).startswith("fault: a second controller")
    assert take(report, "Acknowledge", state=IDLE) == "idle"


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"mass_kg = 100.0": "mass_kg = -1.0"}, "platform.mass_kg: found -1.0, expected kg, from 0.001 to 100000"),
        (
            {"displacement_sigma_m = 20e-6": "displacement_sigma_m = 1.0"},
            "sensors.displacement_sigma_m: found 1.0, expected m, from 1e-10 to 0.1",
        ),
    ],
)
def test_a_platform_that_no_controller_can_have_is_refused(tmp_path, keys, words):
    # GIVEN a platform file with a number that cannot be WHEN the launcher is given it THEN it ends and names the key
    text = (project.SCENARIOS / "platforms" / "paper.toml").read_text()
    for key, other in keys.items():
        assert key in text
        text = text.replace(key, other)
    file = tmp_path / "other.toml"
    file.write_text(text)
    options = argparse.Namespace(platform=file, rig=None, sample_timeout_ms=None)
    with pytest.raises(InputError, match=re.escape(words)):
        zynqmp_r5.boot_options_of(options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--profile", "fd"], "--profile: found 'fd', expected classic: this CAN controller has no FD frames"),
        (
            ["--bus", "udp_multicast:239.74.163.2"],
            "--bus: found 'udp_multicast:239.74.163.2', expected socketcan:INTERFACE",
        ),
        (["--sample-timeout-ms", "4"], "--sample-timeout-ms: found 4, expected 5..60000"),
    ],
)
def test_what_it_cannot_be_is_refused_with_the_reason(start, options, words):
    # GIVEN an option that this controller cannot honour WHEN it is started THEN it ends before it looks for a bus
    command = Controller.zynqmp_r5().command
    program = start(*command, "--bus", "socketcan:vcan0", "--platform", PLATFORM, *options)
    assert program.wait() == zynqmp_r5.BAD_INPUT
    program.wait_for(re.escape(words))
