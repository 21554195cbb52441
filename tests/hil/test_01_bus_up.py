"""The bus without any program of ours on it: frames of both kinds go through, none lost, and multicast works."""

import re
import subprocess
import time
from pathlib import Path

import lcm
import pytest

from hexload.io.python_can import can
from hexload_dev import doctor, vcan

pytestmark = [pytest.mark.vcan, pytest.mark.needs("process")]

PATIENCE_S = 60.0


@pytest.fixture
def buses(can_interface):
    """Two participants on the same bus."""
    pair = [can.Bus(interface="socketcan", channel=can_interface, fd=True) for _ in range(2)]
    yield pair
    for bus in pair:
        bus.shutdown()


def test_the_interface_is_up_and_takes_fd_frames(can_interface):
    (interface,) = [i for i in vcan.can_interfaces() if i.name == can_interface]
    assert interface.up and interface.mtu == 72


def test_the_doctor_finds_the_bus():
    rows = {row.capability: row.state for row in doctor.diagnose(doctor.look())}
    assert {rows[name] for name in ("AF_CAN socket", "vcan0", "multicast", "can-utils")} == {doctor.OK}
    assert rows["kmod"] in (doctor.OK, doctor.NOT_NEEDED)


@pytest.mark.parametrize(
    "message",
    [
        can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(range(8))),
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b""),
        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b"\xff"),
        can.Message(arbitration_id=0x123, is_extended_id=False, is_fd=True, bitrate_switch=True, data=bytes(range(64))),
    ],
    ids=["classic", "classic_empty", "classic_extended", "fd_64_bytes"],
)
def test_a_frame_arrives_as_it_was_sent(buses, message):
    # GIVEN two participants WHEN one sends a frame
    sender, receiver = buses
    sender.send(message)
    # THEN the other receives it, equal in all but time and channel
    received = receiver.recv(PATIENCE_S)
    assert received is not None
    assert received.equals(message, timestamp_delta=None, check_channel=False, check_direction=False)


def test_thousands_of_fd_frames_arrive_in_order(buses):
    # GIVEN two participants
    sender, receiver = buses
    count, burst = 4_000, 50
    began = time.monotonic()
    # WHEN one sends numbered frames of 64 bytes, in bursts that the receiver's buffer holds
    for first in range(0, count, burst):
        numbers = range(first, first + burst)
        for number in numbers:
            data = number.to_bytes(64, "little")
            sender.send(can.Message(arbitration_id=0x100, is_extended_id=False, is_fd=True, data=data))
        # THEN each arrives, in order
        received = [receiver.recv(PATIENCE_S) for _ in numbers]
        assert [int.from_bytes(message.data, "little") for message in received] == list(numbers)
    print(f"python-can: {count / (time.monotonic() - began):.0f} frames/s of 64 bytes")


def test_can_utils_lose_no_frame_between_them(start, can_interface):
    # GIVEN candump listening for as many frames as will be sent
    count = 20_000
    recorder = start("candump", "-n", count, "-T", 1000 * int(PATIENCE_S), "-r", 8 << 20, "-L", can_interface)
    wait_until_listening()
    # WHEN cangen sends classic frames whose data count upwards, as fast as it can
    began = time.monotonic()
    subprocess.run(
        ["cangen", can_interface, "-g", "0", "-n", str(count), "-I", "100", "-L", "8", "-D", "i"], check=True
    )
    assert recorder.wait() == 0
    print(f"can-utils: {count / (time.monotonic() - began):.0f} frames/s of 8 bytes")
    # THEN the log has all of them, in order
    numbers = [int.from_bytes(bytes.fromhex(line.split("#")[1]), "little") for line in recorder.output.splitlines()]
    assert numbers == list(range(count))


def wait_until_listening():
    """Until a program has a receive filter on the bus: /proc/net/can has a line for each."""
    until = time.monotonic() + PATIENCE_S
    while not re.search(rf"^ *{vcan.INTERFACE} ", Path("/proc/net/can/rcvlist_all").read_text(), re.MULTILINE):
        assert time.monotonic() < until, "candump does not listen"
        time.sleep(0.01)


def test_a_datagram_of_ttl_0_comes_back():
    assert doctor.multicast_error() is None


def test_an_lcm_message_of_ttl_0_comes_back():
    # GIVEN a subscriber on a port of the test's own
    bus = lcm.LCM("udpm://239.255.76.67:7671?ttl=0")
    received = []
    bus.subscribe("HEXLOAD_TEST", lambda channel, data: received.append(data))
    # WHEN a message larger than a datagram is published THEN it comes back whole
    message = bytes(range(256)) * 400
    bus.publish("HEXLOAD_TEST", message)
    assert bus.handle_timeout(int(1000 * PATIENCE_S)) > 0
    assert received == [message]
