"""The controller on another processor computes what hexload_ecu computes here, and says so when it cannot go on.

The processor has no fused multiply-add, so hexload_ecu is the one that was built without.
"""

import re
import shutil
import subprocess

import pytest

from bus_frames import answers_of, sent_with_the_ticks
from hexload_dev import zynqmp_r5
from loop import PAPER_S, PAPER_TICKS, Controller, Loop

pytestmark = [pytest.mark.vcan, pytest.mark.needs("emulator")]

UNDEFINED = bytes.fromhex("00de")  # Thumb: UDF #0
PROFILE = "classic"


@pytest.fixture
def on_linux(start, simulator, can_interface) -> Loop:
    return Loop(start, Controller.linux_separate(), (), simulator, can_interface)


def test_answers_are_those_of_the_linux_process_to_the_byte(paper_run, on_linux, tmp_path):
    # GIVEN the paper's scenario with this controller WHEN it is run with hexload_ecu
    ours = paper_run(PROFILE)
    print(ours.output)
    theirs = on_linux.record(tmp_path / "run", PROFILE, "--duration", PAPER_S[PROFILE])
    # THEN both were sent the same samples
    assert sent_with_the_ticks(ours.frames, "SIMULATOR") == sent_with_the_ticks(theirs.frames, "SIMULATOR")
    # and every answer is the same, byte for byte
    assert len(answers_of(ours.frames)) == (PAPER_TICKS[PROFILE] + 1) // 2
    assert answers_of(ours.frames) == answers_of(theirs.frames)


def test_a_processor_that_cannot_go_on_says_why_and_leaves_the_bus(loop, monkeypatch, peer, tmp_path):
    # GIVEN an image whose main() is no instruction
    image = tmp_path / zynqmp_r5.NAME
    shutil.copyfile(zynqmp_r5.program(), image)
    symbols = subprocess.run(["arm-none-eabi-nm", image], capture_output=True, text=True, check=True).stdout
    address = int(re.search(r"^([0-9a-f]+) T main$", symbols, re.MULTILINE)[1], 16)
    headers = subprocess.run(["arm-none-eabi-readelf", "-lW", image], capture_output=True, text=True, check=True).stdout
    offset = int(re.search(r"LOAD +(0x[0-9a-f]+) 0x00000000", headers)[1], 16)
    with image.open("r+b") as file:
        file.seek(offset + address)
        file.write(UNDEFINED)
    monkeypatch.setenv("HEXLOAD_ZYNQMP_R5", str(image))
    # WHEN it is started THEN the launcher ends with the cause and its address
    controller = loop.second_controller()
    assert controller.wait() == zynqmp_r5.STOPPED
    said = controller.wait_for("the controller has stopped: fault: undefined instruction at 0x([0-9a-f]{8})$")
    assert abs(int(said[1], 16) - address) <= 4
    # and nothing was on the bus
    assert peer.can.recv(0) is None
