"""Frames from somebody else on the bus: what one of them, or a few, may do to a run. Over UDP multicast, on this kernel."""

import socket
import struct
import time
from collections.abc import Callable
from contextlib import closing
from typing import NamedTuple

import msgpack
import pytest

from bus_frames import (
    BY_ID,
    BY_NAME,
    COMMANDS,
    LOCKSTEP,
    Frame,
    SampleCodes,
    decode,
    encode,
    encode_code,
    encode_command,
    from_message,
    to_message,
)
from hexload import project
from hexload.io.key_file import new_key, read_key
from hexload.io.python_can import can
from hexload.view.bus_listener import BusListener
from hexload.view.live import Live
from loop import OPEN
from test_32_lcm_bridge import open_bus

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PATIENCE_S = 20.0
CODES = 2  # beside the pacing, in START: samples have codes
ESTIMATING, FAULT = (2, 3), (4,)  # states: estimating or converged
NO_FAULT, WRONG_PROFILE, SECOND_CONTROLLER, SECOND_SOURCE, NOT_AUTHENTICATED = 0, 3, 4, 6, 7
LEG_FORCE_N = 600 * 9.81 / 6 * 0.8741 / 0.798276  # what holds platform and load at home
TICKS_BEFORE = 50
STOP = COMMANDS["stop"]
FRAMES_REFUSED = 15  # health bit
REFUSES = "controller refuses frames: damaged, another's, or samples lack the code of its key"
SESSION = 1234  # of the source


def sample(tick: int, share: float = 1.0) -> Frame:
    legs = {f"force_{leg}": share * (LEG_FORCE_N + leg * tick % 8) for leg in range(1, 7)}
    return encode("LegSampleFd", tick=tick, version=2, **legs)


def damaged(frame: Frame) -> Frame:
    return frame._replace(data=frame.data[:-1] + bytes([frame.data[-1] ^ 1]))


def shortened(frame: Frame) -> Frame:
    return frame._replace(data=frame.data[:4], is_fd=False, bit_rate_switch=False)


STATUS = encode("ControllerStatus", state=2)


ACKNOWLEDGE = encode("Acknowledge", command=STOP, source=1, session=77)


def start_command(counter: int) -> Frame:
    return encode_command("start", counter, LOCKSTEP, SESSION)


class Attack(NamedTuple):
    name: str
    frames: Callable[[int, int], list[Frame]]  # at the source's next tick, with the counter of its START
    fault: int  # after it


ATTACKS = [
    Attack("one status of another controller", lambda tick, counter: [STATUS], NO_FAULT),
    Attack("a hundred with a wrong checksum", lambda tick, counter: [damaged(STATUS)] * 100, NO_FAULT),
    Attack("a hundred short ones", lambda tick, counter: [shortened(STATUS)] * 100, NO_FAULT),
    Attack("three whole ones", lambda tick, counter: [STATUS] * 3, SECOND_CONTROLLER),
    Attack("two samples of the other profile", lambda tick, counter: [encode("LegSample1")] * 2, NO_FAULT),
    Attack("three of them", lambda tick, counter: [encode("LegSample1")] * 3, WRONG_PROFILE),
    Attack("a command with a wrong checksum", lambda tick, counter: [damaged(encode_command(STOP, 7))] * 100, NO_FAULT),
    Attack("the last sample again", lambda tick, counter: [sample(tick - 1)], NO_FAULT),
    Attack("the last one with larger forces", lambda tick, counter: [sample(tick - 1, 1.1)], SECOND_SOURCE),
    Attack("the next one before the source", lambda tick, counter: [sample(tick, 1.1)], SECOND_SOURCE),
    Attack("old samples", lambda tick, counter: [sample(tick - n) for n in range(2, 22)], NO_FAULT),
    Attack("the next two in the wrong order", lambda tick, counter: [sample(tick + 1), sample(tick)], NO_FAULT),
    Attack(
        "a sample under a sigma's identifier",
        lambda tick, counter: [sample(tick, 1.1)._replace(id=0x106)] * 100,
        NO_FAULT,
    ),
    Attack("a hundred damaged samples", lambda tick, counter: [damaged(sample(tick, 1.1))] * 100, NO_FAULT),
    Attack("the source's START once more", lambda tick, counter: [start_command(counter)] * 5, NO_FAULT),
    Attack(
        "another command with its counter",
        lambda tick, counter: [encode_command(STOP, counter, 0.0, SESSION)],
        SECOND_SOURCE,
    ),
    Attack("an acknowledge of somebody else's command", lambda tick, counter: [ACKNOWLEDGE], NO_FAULT),
    Attack("one far ahead", lambda tick, counter: [sample(tick + 2**30)], NO_FAULT),
]


class Source:
    """A simulator in lockstep."""

    def __init__(self, bus: can.BusABC):
        self._bus = bus
        self.counter = 0  # of its last command

    def send(self, frames: list[Frame]) -> None:
        for frame in frames:
            self._bus.send(to_message(frame))

    def receive(self, name: str, patience_s: float) -> dict | None:
        until = time.monotonic() + patience_s
        while (left := until - time.monotonic()) > 0:
            try:
                message = self._bus.recv(left)
            except can.CanOperationError:  # what is no frame
                continue
            if message is None or message.arbitration_id not in BY_ID:
                continue
            if (frame := from_message(message)).name == name:
                return decode(frame).values
        return None

    def command(self, name: str, argument: float = 0.0) -> dict:
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:  # it listens before it answers
            self.counter += 1
            self.send([encode_command(name, self.counter, argument, SESSION)])
            if (acknowledge := self.receive("Acknowledge", 0.1)) is not None:
                return acknowledge
        pytest.fail(f"{name} is not acknowledged")

    def ask(self, tick: int) -> dict:
        self.send([sample(tick)])
        while (health := self.receive("HealthFd", PATIENCE_S)) is not None:
            if health["tick"] == tick:
                return health
        pytest.fail(f"tick {tick} is not answered")


@pytest.fixture
def source(start, ecu, free_bus):
    start(ecu, OPEN, "--bus", free_bus, "--platform", PLATFORM).wait_for("ready on")
    with open_bus(free_bus) as bus:
        source = Source(bus)
        source.command("reset")
        yield source


def begin_run(source: Source) -> int:
    source.command("reset")
    assert source.command("start", LOCKSTEP)["result"] == 0
    for tick in range(TICKS_BEFORE):
        assert source.ask(tick)["state"] in ESTIMATING
    return TICKS_BEFORE


def test_what_somebody_else_sends_ends_a_run_with_its_name_or_does_nothing(source):
    for attack in ATTACKS:
        # GIVEN a run under way WHEN somebody else sends this beside the source
        tick = begin_run(source)
        source.send(attack.frames(tick, source.counter))
        health = [source.ask(tick + n) for n in range(20)][-1]
        # THEN the controller goes on, or is in fault and says which
        assert health["fault"] == attack.fault, attack.name
        assert health["state"] in (FAULT if attack.fault else ESTIMATING), attack.name
        time.sleep(1.05 if attack.name.startswith(("one status", "a hundred", "two samples")) else 0)  # it forgets


# Against a controller with a key, of somebody without it who hears all that is on the bus.


class KeyedSource(Source):
    """With the controller's key; what it has said last stays in `said`."""

    def __init__(self, bus: can.BusABC, key: bytes):
        super().__init__(bus)
        self.key = key
        self.nonce = b""  # of the last command
        self.said: list[Frame] = []

    def command(self, name: str, argument: float = 0.0) -> dict:
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            self.counter += 1
            if (nonce := self.challenge()) is not None:
                self.nonce = nonce
                command = encode_command(name, self.counter, argument, SESSION)
                self.said = [command, encode_code(self.key, nonce, command)]
                self.send(self.said)
                if (acknowledge := self.receive("Acknowledge", 0.1)) is not None:
                    return acknowledge
        pytest.fail(f"{name} is not acknowledged")

    def challenge(self) -> bytes | None:
        self.send([encode_command("challenge", 0, 0.0, SESSION)])
        nonce = self.receive("Challenge", 0.1)
        return None if nonce is None else int(nonce["nonce"]).to_bytes(8, "little")


def forged(name: str, counter: int) -> list[Frame]:
    command = encode_command(name, counter, 0.0, SESSION)
    return [command, encode_code(bytes(16), bytes(8), command)]


def under_other_code(said: list[Frame]) -> list[Frame]:
    return [encode_command("stop", 3, 0.0, SESSION), said[1]]


class AttackOnKey(NamedTuple):
    name: str
    frames: Callable[[list[Frame], bytes], list[Frame]]  # of what the source said last, and the next challenge
    refused: int  # frames that are counted as such


ATTACKS_ON_KEY = [
    AttackOnKey("STOP without a code", lambda said, nonce: [encode_command("stop", 3, 0.0, SESSION)], 1),
    AttackOnKey("STOP with the code of another key", lambda said, nonce: forged("stop", 3), 1),
    AttackOnKey("the source's START once more, with its code", lambda said, nonce: said, 1),
    AttackOnKey("the same, ten times", lambda said, nonce: said * 10, 10),
    AttackOnKey("its code before it", lambda said, nonce: said[::-1], 2),
    AttackOnKey("STOP with START's code", lambda said, nonce: under_other_code(said), 1),
    AttackOnKey("a code alone", lambda said, nonce: said[1:], 1),
    AttackOnKey("a STOP with its counter", lambda said, nonce: forged("stop", said[0].data[1] & 15), 1),
    AttackOnKey("the challenge as a code", lambda said, nonce: [forged("stop", 3)[0], said[1]._replace(data=nonce)], 1),
    AttackOnKey(
        "a false challenge", lambda said, nonce: [Frame(BY_NAME["Challenge"].frame_id, False, False, bytes(8))], 0
    ),
]


@pytest.fixture
def keyed_source(start, ecu, free_bus, tmp_path):
    key = tmp_path / "of.key"
    new_key(key)
    start(ecu, "--key", key, "--bus", free_bus, "--platform", PLATFORM).wait_for("for commands with its key")
    with open_bus(free_bus) as bus:
        yield KeyedSource(bus, read_key(key))


def refused_frames(source: Source) -> int:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        status = source.receive("ControllerStatus", PATIENCE_S)
        if status is not None and "frames_refused" in status:
            return status["frames_refused"]
    pytest.fail("no status with the frames refused")


def test_without_the_key_nobody_commands_the_controller(keyed_source):
    source, refused = keyed_source, 0
    tick = begin_run(source)
    said = source.said
    for attack in ATTACKS_ON_KEY:
        # GIVEN a run under way on a controller with a key WHEN somebody without it sends this
        source.send(attack.frames(said, source.challenge()))
        time.sleep(0.08)  # a command waits for its code, and after a guess none is looked at
        # THEN the run goes on
        health = source.ask(tick)
        tick += 1
        assert (health["state"] in ESTIMATING, health["fault"]) == (True, NO_FAULT), attack.name
        refused += attack.refused
    # AND each was refused and counted
    assert refused_frames(source) == refused
    # AND the source still commands
    assert source.command("stop")["result"] == 0


# What of a run with codes somebody without the key sends in the source's place, which has fallen silent at TICKS_BEFORE.
FORGED_RUNS = {
    "samples without codes": lambda codes, tick: [sample(tick)],
    "with larger forces and the code of another key": lambda codes, tick: SampleCodes.after(
        codes, tick, sample(tick, 1.1)
    ),
    "ticks that are no multiple of 16": lambda codes, tick: [sample(tick)] if tick % 16 else [],
    "codes alone, of zeros": lambda codes, tick: [
        sample(tick),
        *[Frame(BY_NAME["SampleMac"].frame_id, False, False, bytes(8))] * (tick % 16 == 15),
    ],
}


@pytest.mark.parametrize("name", FORGED_RUNS)
def test_who_goes_on_in_the_sources_place_without_the_key_ends_the_run(keyed_source, name):
    # GIVEN a run under way whose samples have codes
    source = keyed_source
    source.command("reset")
    assert source.command("start", LOCKSTEP + CODES)["result"] == 0
    codes = SampleCodes(source.key, source.nonce)
    for tick in range(TICKS_BEFORE):
        source.send(codes.after(tick, sample(tick)))
        assert source.receive("HealthFd", PATIENCE_S)["state"] in ESTIMATING
    # WHEN somebody without the key goes on in the source's place
    forged = SampleCodes(bytes(16), source.nonce)
    faults = []
    for tick in range(TICKS_BEFORE, TICKS_BEFORE + 100):
        if frames := FORGED_RUNS[name](forged, tick):
            source.send(frames)
            faults.append(source.receive("HealthFd", PATIENCE_S)["fault"])
    # THEN the controller is in fault within 80 ticks, and says why
    assert faults[0] == NO_FAULT and set(faults[80:]) == {NOT_AUTHENTICATED}


def test_who_speaks_in_the_sources_place_for_a_while_is_told_by_a_bit_a_count_and_an_event(keyed_source, free_bus):
    # GIVEN a run under way whose samples have codes, and a listener
    source = keyed_source
    source.command("reset")
    assert source.command("start", LOCKSTEP + CODES)["result"] == 0
    codes, healths = SampleCodes(source.key, source.nonce), []
    live = Live("a run", 1e-3)
    with closing(BusListener(live, free_bus)):
        # WHEN somebody keeps the source away for three times sixteen ticks, speaks in its place, and lets it go on
        for tick in range(160):
            is_forged = 48 <= tick < 96
            source.send([sample(tick, 1.01)] if is_forged else codes.after(tick, sample(tick)))
            healths.append(source.receive("HealthFd", PATIENCE_S))
            assert healths[-1]["state"] in ESTIMATING
        # THEN a bit of the answers tells it from the second sixteen on, a count that stays, and an event
        bits = [int(health["health"]) >> FRAMES_REFUSED & 1 for health in healths]
        assert bits == [0] * 65 + [1] * (len(bits) - 65)
        assert refused_frames(source) == 3
        assert [event.words for event in live.events() if "refuses frames" in event.words] == [REFUSES]


def test_a_datagram_to_an_address_of_this_computer_is_not_of_the_bus(source, free_bus):
    # GIVEN a run under way
    tick = begin_run(source)
    # WHEN a whole STOP is sent to the bus's port, but to an address of this computer and not to the group
    stop = encode_command(STOP, 9)
    fields = {"arbitration_id": stop.id, "is_extended_id": False, "is_remote_frame": False, "is_error_frame": False}
    packed = msgpack.packb(fields | {"data": stop.data, "is_fd": False, "timestamp": 0.0})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(10):
            sender.sendto(packed, ("127.0.0.1", int(free_bus.rsplit(":", 1)[1])))
    # THEN it is not heard
    assert source.receive("Acknowledge", 0.1) is None
    assert source.ask(tick)["state"] in ESTIMATING


def test_a_datagram_that_claims_more_than_it_holds_costs_nothing(source, free_bus):
    # GIVEN a run under way WHEN datagrams of five bytes claim arrays and maps of 2^27 entries, alone and in a field
    tick = begin_run(source)
    _, group, port = free_bus.split(":")
    claims = [bytes([header]) + struct.pack(">I", 2**27) for header in (0xDD, 0xDF, 0xDB, 0xC6)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        begun = time.monotonic()
        for claim in claims * 5:
            sender.sendto(claim, (group, int(port)))
            sender.sendto(b"\x81\xa4data" + claim, (group, int(port)))
    # THEN the run goes on at once: 40 such allocations took seconds
    assert source.ask(tick)["state"] in ESTIMATING
    assert time.monotonic() - begun < 5.0
