"""The firmware's SLCAN against python-can's: each reads what the other has written."""

import os
import random
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hexload.io.python_can import can

ECHO = Path(os.environ["HEXLOAD_BUILD_DIR"]) / "tests" / "crosscheck" / "slcan_echo"
PATIENCE_S = 60.0
FRAMES = 1000
COMMANDS = ("C", "S8", "", "O", "O", "C")  # of python-can: bit rate, none of data, open, open once more, close


@contextmanager
def python_can_and_echo() -> Iterator[tuple[can.BusABC, subprocess.Popen]]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        channel = f"socket://127.0.0.1:{server.getsockname()[1]}"
        bus = can.Bus(interface="slcan", channel=channel, bitrate=1_000_000, sleep_after_open=0)
        line, _ = server.accept()
    with line:
        echo = subprocess.Popen([ECHO], stdin=line, stdout=line, stderr=subprocess.PIPE, text=True)
    try:
        yield bus, echo
    finally:
        echo.kill()
        echo.wait()


def random_frame(source: random.Random) -> can.Message:
    length = source.randrange(9)
    return can.Message(arbitration_id=source.randrange(0x800), is_extended_id=False, data=source.randbytes(length))


def receive(bus: can.BusABC) -> can.Message:
    message = bus.recv(PATIENCE_S)
    assert message is not None, "no answer"
    return message


def other_frames() -> list[can.Message]:
    """That python-can writes and the firmware has no use for."""
    return [
        can.Message(arbitration_id=0x12345678, is_extended_id=True, data=b"12345678"),
        can.Message(arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=8),
        can.Message(arbitration_id=0x123, is_extended_id=True, is_remote_frame=True, dlc=8),
        can.Message(arbitration_id=0x123, is_extended_id=False, is_fd=True, data=bytes(64)),
        can.Message(arbitration_id=0x123, is_extended_id=True, is_fd=True, bitrate_switch=True, data=bytes(64)),
    ]


def test_frames_of_python_can_are_read_and_its_others_passed_over():
    # GIVEN python-can on a line with the firmware's codec
    source = random.Random(4)
    with python_can_and_echo() as (bus, echo):
        # WHEN it sends frames of all identifiers and lengths, and in between some that are not the contract's
        for number in range(FRAMES):
            if number % 100 == 0:
                for other in other_frames():
                    bus.send(other)
            frame = random_frame(source)
            bus.send(frame)
            # THEN it reads each frame's answer: the bits that it has sent, turned as agreed
            answer = receive(bus)
            assert answer.arbitration_id == frame.arbitration_id ^ 0x7FF
            assert bytes(answer.data) == bytes((byte + 1) % 256 for byte in frame.data)
            assert (answer.dlc, answer.is_extended_id, answer.is_fd, answer.is_remote_frame) == (
                frame.dlc, False, False, False,
            )  # fmt: skip
        bus.shutdown()
        _, counts = echo.communicate(timeout=PATIENCE_S)
    # AND nothing was dropped or refused; commands and other frames were passed over
    passed_over, dropped, refusals = map(int, counts.split())
    print(f"{FRAMES} frames, {passed_over} lines passed over")
    assert (dropped, refusals) == (0, 0)
    assert passed_over == FRAMES // 100 * len(other_frames()) + len(COMMANDS)
