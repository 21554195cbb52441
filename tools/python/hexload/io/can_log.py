"""Reader of CAN logs (candump -L or -l, Vector .blf and .asc, PEAK .trc) in either profile of firmware/bus/hexload.dbc.

A sample whose legs did not all come is left out, as the controller does, and remarked. Anything that no sound bus carries
(wrong length, checksum or value, a leg twice, two buses, two profiles, two runs) is refused with file and place.
"""

import gzip
import io
import logging
import math
import struct
import zlib
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hexload import project
from hexload.errors import InputError
from hexload.io.end_to_end import checksum, found_checksum
from hexload.io.log_file import CHANNEL_KEYS, LEGS, LegLog
from hexload.io.python_can import can, cantools

TICK_S = 1e-3  # until log_formats knows the machine's
TICKS_OF_FOUR_BITS = 16
FARTHEST_AHEAD = 8  # ticks that a leg frame may be ahead of the last; the rest of the four bits is behind it
CHANNELS = tuple(CHANNEL_KEYS)
PARSE_ERRORS = (
    ValueError,
    LookupError,
    struct.error,
    zlib.error,
    EOFError,
    OSError,
    NotImplementedError,
    can.io.blf.BLFParseError,
)


LONGEST_LINE = 1 << 12  # characters; a line of 64 bytes has some 300


class _CountedLines(io.TextIOWrapper):
    """Text that knows the line it is in, which python-can's readers do not say, and that has no line beyond a length: a MB
    of gzip can hold one of gigabytes."""

    number = 0

    def __next__(self) -> str:
        self.number += 1
        line = self.readline(LONGEST_LINE)
        if not line:
            raise StopIteration
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            raise ValueError(f"found more than {LONGEST_LINE} characters")
        return line


def read_candump(path: Path) -> LegLog:
    return _read_text(path, can.CanutilsLogReader, "a candump line, (time) bus id#data")


def read_asc(path: Path) -> LegLog:
    return _read_text(path, can.ASCReader, "an .asc line")


def read_trc(path: Path) -> LegLog:
    return _read_text(path, can.TRCReader, "a .trc line")


def read_blf(path: Path) -> LegLog:
    samples = _Samples(path, _Contract())
    number = 0
    with _python_can_is_silent(), path.open("rb") as stream:
        try:
            reader = can.BLFReader(stream)
            size = path.stat().st_size
            if size < reader.file_size:  # python-can would stop at the end without a word
                raise InputError(f"{path}: found {size} bytes, expected the {reader.file_size} of its header: cut off")
            for number, frame in enumerate(reader, start=1):
                samples.take(f"frame {number}", frame)
        except PARSE_ERRORS as error:
            raise InputError(f"{path}: found damaged data after frame {number}, expected .blf ({error})") from None
    return samples.whole_log()


def _read_text(path: Path, reader: type, expected: str) -> LegLog:
    samples = _Samples(path, _Contract())
    packed = path.read_bytes()[:2] == b"\x1f\x8b"
    with _python_can_is_silent(), gzip.open(path) if packed else path.open("rb") as raw:
        lines = _CountedLines(raw, encoding="utf-8-sig")
        try:
            for frame in reader(lines):
                samples.take(f"line {lines.number}", frame)
        except PARSE_ERRORS as error:
            raise InputError(f"{path}: line {lines.number}: {error}, expected {expected}") from None
    return samples.whole_log()


class _python_can_is_silent:
    """python-can also logs what it then raises; the message to the user is ours."""

    def __enter__(self) -> None:
        self._logger = logging.getLogger("can")
        self._level = self._logger.level
        self._logger.setLevel(logging.CRITICAL)

    def __exit__(self, *_) -> None:
        self._logger.setLevel(self._level)


class _Contract:
    """hexload.dbc: the frames that make leg samples."""

    def __init__(self):
        self._messages = {
            message.frame_id: message for message in cantools.database.load_file(project.bus_contract()).messages
        }

    def message_of(self, frame: can.Message):
        """The contract's message with this identifier, or None."""
        if frame.is_error_frame or frame.is_remote_frame or frame.is_extended_id:
            return None
        return self._messages.get(frame.arbitration_id)

    @staticmethod
    def decode(message, frame: can.Message) -> dict[str, float]:
        """Signals by name. Raises ValueError with what is wrong in the frame."""
        if len(frame.data) != message.length or frame.is_fd != message.is_fd:
            kinds = {True: "CAN FD", False: "classic CAN"}
            raise ValueError(
                f"found {len(frame.data)} bytes of {kinds[frame.is_fd]}, "
                f"expected {message.length} of {kinds[message.is_fd]}"
            )
        signals = message.decode(bytes(frame.data), decode_choices=False)
        found, expected = found_checksum(frame.data), checksum(frame.arbitration_id, bytes(frame.data))
        if found != expected:
            raise ValueError(f"found checksum {found:#x}, expected {expected:#x}")
        for signal in message.signals:
            half_step = signal.scale / 2
            beyond = signal.minimum - signals[signal.name]
            if signal.name.startswith(("displacement", "velocity", "force")) and half_step < beyond < 3 * half_step:
                signals[signal.name] = math.nan  # no sensor: one step beyond the range
                continue
            if not signal.minimum - half_step < signals[signal.name] < signal.maximum + half_step:
                raise ValueError(
                    f"{signal.name}: found {signals[signal.name]:g}, expected {signal.minimum:g} .. {signal.maximum:g}"
                )
        return signals


@dataclass
class _Partial:
    """A classic sample that is being put together."""

    tick: int
    place: str
    legs: dict[int, list[float]] = field(default_factory=dict)


class _Samples:
    """Puts leg samples together, frame by frame."""

    def __init__(self, path: Path, contract: _Contract):
        self._path = path
        self._contract = contract
        self._ticks: list[int] = []
        self._rows = array("d")  # sample after sample, leg after leg: displacement, velocity, force
        self._frames = 0
        self._source: tuple[str, str] | None = None  # profile and bus of the first sample frame
        self._partial: _Partial | None = None
        self._incomplete: list[str] = []
        self._before_first_tick = 0

    def take(self, place: str, frame: can.Message) -> None:
        """One frame of the log; those that carry no samples are passed over."""
        self._frames += 1
        message = self._contract.message_of(frame)
        if message is None or not message.name.startswith(("LegSample", "SampleTick")):
            return
        self._check_source(place, "fd" if message.name == "LegSampleFd" else "classic", str(frame.channel))
        try:
            signals = self._contract.decode(message, frame)
        except ValueError as error:
            raise InputError(f"{self._path}: {place}: {message.name}: {error}") from None
        if message.name == "LegSampleFd":
            self._check_tick(place, signals["tick"], self._ticks[-1] if self._ticks else None)
            self._add(signals["tick"], [signals[f"{channel}_{leg}"] for leg in LEGS for channel in CHANNELS])
        elif message.name == "SampleTick":
            self._check_tick(place, signals["tick"], self._partial.tick if self._partial else None)
            self._begin(place, signals["tick"])
        else:
            self._take_leg(place, int(message.name[-1]), signals)

    def _take_leg(self, place: str, leg: int, signals: dict[str, float]) -> None:
        if self._partial is None:
            self._before_first_tick += 1
            return
        ahead = (signals["tick_low"] - self._partial.tick) % TICKS_OF_FOUR_BITS
        if ahead > FARTHEST_AHEAD:
            raise InputError(
                f"{self._path}: {place}: found leg {leg} of tick {self._partial.tick + ahead - TICKS_OF_FOUR_BITS} "
                f"after tick {self._partial.tick}, expected it in the order of ticks"
            )
        if ahead > 0:
            self._begin(place, self._partial.tick + ahead)
        elif leg in self._partial.legs:
            raise InputError(
                f"{self._path}: {place}: found leg {leg} of tick {self._partial.tick} twice, expected it once"
            )
        self._partial.legs[leg] = [signals[channel] for channel in CHANNELS]
        if len(self._partial.legs) == len(LEGS):
            self._add(self._partial.tick, [value for one in LEGS for value in self._partial.legs[one]])

    def _begin(self, place: str, tick: int) -> None:
        self._end_partial()
        self._partial = _Partial(tick, place)

    def _end_partial(self) -> None:
        if self._partial is not None and len(self._partial.legs) < len(LEGS):
            missing = ", ".join(str(leg) for leg in LEGS if leg not in self._partial.legs)
            self._incomplete.append(f"{self._partial.place}: tick {self._partial.tick} without leg {missing}")

    def _add(self, tick: int, row: list[float]) -> None:
        self._ticks.append(tick)
        self._rows.extend(row)

    def _check_source(self, place: str, profile: str, bus: str) -> None:
        self._source = self._source or (profile, bus)
        if profile != self._source[0]:
            raise InputError(
                f"{self._path}: {place}: found a leg sample of the {profile} profile after those of the "
                f"{self._source[0]} profile, expected one profile"
            )
        if bus != self._source[1]:
            raise InputError(
                f"{self._path}: {place}: found a leg sample on bus {bus} after those on bus {self._source[1]}, "
                "expected one bus"
            )

    def _check_tick(self, place: str, tick: int, last: int | None) -> None:
        check_tick(f"{self._path}: {place}", tick, last)

    def whole_log(self) -> LegLog:
        self._end_partial()
        if len(self._ticks) < 2:
            raise InputError(
                f"{self._path}: found {len(self._ticks)} whole leg samples in {self._frames} frames, expected at least 2"
            )
        return leg_log(self._ticks, self._rows, self._remarks())

    def _remarks(self) -> Iterator[str]:
        if self._before_first_tick:
            yield f"{self._before_first_tick} leg frames before the first SampleTick left out"
        if self._incomplete:
            yield f"{len(self._incomplete)} incomplete samples left out, the first at {self._incomplete[0]}"


def check_tick(where: str, tick: int, last: int | None) -> None:
    """Raises InputError unless `tick` is later than `last`."""
    if last is None or tick > last:
        return
    if tick == last:
        raise InputError(f"{where}: found tick {tick} twice, expected a later one")
    raise InputError(
        f"{where}: found tick {tick} after tick {last}, a second run; expected one run, cut the log before this place"
    )


def leg_log(ticks: list[int], rows: Sequence, remarks: Iterator[str]) -> LegLog:
    """`rows`: of each tick leg after leg displacement, velocity, force; nan where there is no velocity sensor."""
    values = np.array(rows).reshape(len(ticks), len(LEGS), len(CHANNELS))
    legs = [np.ascontiguousarray(values[:, :, channel]) for channel in range(len(CHANNELS))]
    return LegLog(np.array(ticks) * TICK_S, *legs, remarks=tuple(remarks))
