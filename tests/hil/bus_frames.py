"""Frames of firmware/bus/hexload.dbc as Python reads and writes them: cantools for the signals, the checksums in Python."""

import random
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from hexload import project
from hexload.io.authentication import code_of, code_over
from hexload.io.end_to_end import UNCHECKED, checksum, found_checksum, protected
from hexload.io.python_can import can, cantools

DBC = cantools.database.load_file(project.ROOT / "firmware" / "bus" / "hexload.dbc")
BY_ID = {message.frame_id: message for message in DBC.messages}
BY_NAME = {message.name: message for message in DBC.messages}
COMMANDS = {"start": 1, "stop": 2, "reset": 3, "select filter": 4, "set known mass": 5, "challenge": 6}
ARGUMENTS = {1: "pacing", 4: "estimator", 5: "known_mass"}  # by command
REAL_TIME, LOCKSTEP = 0.0, 1.0  # arguments of start
PROFILES = ("fd", "classic")  # in the order of their codes
PARAMETERS = ("dz", "Ixx", "Iyy", "Izz")
FILTERS = ("paper", "momentum")  # in the order of their codes
LOAD_PARAMETERS = tuple(f"load_{name}" for name in ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"))
# By the clock, not by the ticks: a command comes again when its acknowledge is late, and status pages come every 50 ms.
BY_THE_CLOCK = ("Command", "CommandMac", "Acknowledge", "Challenge", "ControllerStatus")


def is_of(message, profile: str, filter_name: str = "paper") -> bool:
    """Whether frames of this kind are on the bus in this profile, with this filter."""
    return _attribute(message, "HexloadProfile") in (profile, "both") and _attribute(message, "HexloadFilter") in (
        filter_name,
        "both",
    )


def _attribute(message, name: str) -> str:
    definition = DBC.dbc.attribute_definitions[name]
    attribute = message.dbc.attributes.get(name)
    return definition.default_value if attribute is None else definition.choices[attribute.value]


class Frame(NamedTuple):
    id: int
    is_fd: bool
    bit_rate_switch: bool
    data: bytes

    @property
    def name(self) -> str:
        return BY_ID[self.id].name


class Signals(NamedTuple):
    """A decoded frame."""

    name: str
    values: dict[str, float]


def encode(name: str, **values: float) -> Frame:
    """A frame with its checksum; signals that are not given are 0. Values may be beyond the contract's range."""
    message = DBC.get_message_by_name(name)
    signals = {signal.name: 0 for signal in message.signals} | values
    data = protected(message.frame_id, bytes(message.encode(signals, strict=False)))
    return Frame(message.frame_id, message.is_fd, message.is_fd, data)


def encode_command(command: str | int, counter: int, argument: float = 0.0, session: int = 0, **others: int) -> Frame:
    """`counter`: of the session's commands, its low four bits."""
    code = COMMANDS.get(command, command)
    if code in ARGUMENTS:
        others[ARGUMENTS[code]] = argument if ARGUMENTS[code] == "known_mass" else int(argument)
    if code not in COMMANDS.values():  # the codec knows no page of such a command: that of one without argument
        stop = encode("Command", command=COMMANDS["stop"], counter=counter % 16, session=session)
        data = bytes([stop.data[0], stop.data[1] & 0x0F | code << 4]) + stop.data[2:]
        return stop._replace(data=protected(stop.id, data))
    return encode("Command", command=code, counter=counter % 16, session=session, **others)


class SampleCodes:
    """SampleMac of FD samples: one for sixteen."""

    def __init__(self, key: bytes, nonce: bytes):
        self._key, self._nonce, self._bytes = key, nonce, b""

    def after(self, tick: int, sample: Frame) -> list[Frame]:
        """The sample, and its code where one is due. From a tick on that is a multiple of 16."""
        self._bytes = (b"" if tick % 16 == 0 else self._bytes) + sample.data
        if tick % 16 != 15:
            return [sample]
        identifier = BY_NAME["SampleMac"].frame_id
        code = code_over(self._key, identifier, self._nonce, struct.pack("<I", tick - 15) + self._bytes)
        return [sample, Frame(identifier, False, False, code)]


def encode_code(key: bytes, nonce: bytes, command: Frame) -> Frame:
    """CommandMac of a command to a controller with a key."""
    return Frame(BY_NAME["CommandMac"].frame_id, False, False, code_of(key, nonce, command.data))


def decode(frame: Frame, scaled: bool = True) -> Signals:
    """Numbers, also of codes; `scaled`: in units, else the numbers on the bus."""
    message = BY_ID[frame.id]
    return Signals(message.name, message.decode(frame.data, decode_choices=False, scaling=scaled))


def assert_fits_contract(frame: Frame) -> None:
    """Identifier, format, length, and checksum."""
    message = BY_ID.get(frame.id)
    assert message is not None, f"found identifier {frame.id:#05x}, expected one of the DBC"
    assert (frame.is_fd, frame.bit_rate_switch) == (message.is_fd, message.is_fd), message.name
    assert len(frame.data) == message.length, message.name
    is_checked = frame.id not in UNCHECKED
    assert not is_checked or found_checksum(frame.data) == checksum(frame.id, frame.data), (
        f"{message.name}: {frame.data.hex()}"
    )


def to_message(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.id,
        is_extended_id=False,
        is_fd=frame.is_fd,
        bitrate_switch=frame.bit_rate_switch,
        data=frame.data,
    )


def from_message(message: can.Message) -> Frame:
    return Frame(message.arbitration_id, message.is_fd, message.is_fd and message.bitrate_switch, bytes(message.data))


def read_candump(path: Path) -> list[Frame]:
    """A log of `candump -L`, without its extended frames: the contract has none. Anything else in it is an error."""
    frames = []
    for line in path.read_text().splitlines():
        _, _, text = line.split(" ")
        identifier, _, rest = text.partition("#")
        if len(identifier) > 3:
            continue
        is_fd = rest.startswith("#")
        switches = is_fd and int(rest[1], 16) & 1 == 1
        frames.append(Frame(int(identifier, 16), is_fd, switches, bytes.fromhex(rest[2:] if is_fd else rest)))
    return frames


def sample_frames_by_tick(frames: list[Frame]) -> list[list[Frame]]:
    """The frames of each leg sample, in the order of the log."""
    samples, sample = [], []
    for frame in frames:
        if frame.name.startswith(("LegSample", "SampleTick")):
            sample.append(frame)
        if frame.name in ("LegSampleFd", "LegSample6"):
            samples.append(sample)
            sample = []
    return samples


def sent_with_the_ticks(frames: list[Frame], sender: str) -> list[Frame]:
    """A sender's frames but for those that go by the clock, in its own order.

    The order of two senders is not that of the log: the kernel hands a frame to one listener after the other, and the
    first may answer before the last has it.
    """
    names = {message.name for message in DBC.messages if sender in message.senders} - set(BY_THE_CLOCK)
    return [frame for frame in frames if frame.name in names]


def answers_of(frames: list[Frame]) -> list[Frame]:
    return sent_with_the_ticks(frames, "CONTROLLER")


def tick_of_fd(frame: Frame) -> int:
    """The FD frames all begin with the tick."""
    return struct.unpack_from("<I", frame.data)[0]


def garbage(seed: int) -> Iterator[can.Message]:
    """Frames without end that are none of the contract's: other identifiers, or the simulator's with a wrong length.

    Identifiers of a controller are left out: whoever sends them is a second controller.
    """
    source = random.Random(seed)
    others = [identifier for identifier in range(0x800) if identifier not in BY_ID]
    simulators = [
        message for message in DBC.messages if "SIMULATOR" in message.senders and message.frame_id not in UNCHECKED
    ]
    lengths = (*range(9), 12, 16, 20, 24, 32, 48, 64)
    while True:
        length, identifier, is_extended = source.choice(lengths), source.choice(others), False
        kind = source.choice(("other", "wrong length", "extended"))
        if kind == "wrong length":
            message = source.choice(simulators)
            identifier = message.frame_id
            length = source.choice([length for length in lengths if length != message.length])
        elif kind == "extended":
            identifier, is_extended = source.choice([*BY_ID, source.getrandbits(29)]), True
        yield can.Message(
            arbitration_id=identifier,
            is_extended_id=is_extended,
            is_fd=length > 8 or source.random() < 0.5,
            data=source.randbytes(length),
        )
