"""Leg logs of every kind: the file's first bytes say which reader it needs."""

import gzip
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path

from hexload.errors import InputError
from hexload.io.column_map import ColumnMap
from hexload.io.log_file import LegLog, Progress, joined, log_parts
from hexload.io.resample import resampled

TICK_S = 1e-3  # in which the readers of ticks count


@dataclass(frozen=True)
class Reading:
    """How a log is to be read, where it does not say it."""

    columns: ColumnMap = field(default_factory=ColumnMap)
    resample_s: float | None = None  # sampling period of the rows that are made
    home_leg_length_m: Sequence[float] | None = None  # six, taken off absolute leg lengths
    tick_s: float = TICK_S  # of a log whose samples have ticks and no times


@dataclass(frozen=True)
class _Format:
    name: str
    first_bytes: tuple[bytes, ...]
    suffixes: tuple[str, ...]
    module: str
    reader: str  # of the module: (path), or (path, columns, home_leg_length_m) where the log is a table
    is_table: bool = False


FORMATS = (
    _Format("a candump log (candump -L or -l)", (b"(",), (".log", ".candump"), "can_log", "read_candump"),
    _Format("a Vector binary log", (b"LOGG",), (".blf",), "can_log", "read_blf"),
    _Format("a Vector text log", (b"date ",), (".asc",), "can_log", "read_asc"),
    _Format("a PEAK trace", (b";$FILEVERSION", b";####"), (".trc",), "can_log", "read_trc"),
    _Format("an LCM event log", (b"\xed\xa1\xda\x01",), (".lcm",), "lcm_log", "read_lcm_log"),
    _Format("an MCAP log", (b"\x89MCAP0",), (".mcap",), "mcap_log", "read_mcap", True),
    _Format("an ASAM MDF log, version 4", (b"MDF     4",), (".mf4",), "mf4_log", "read_mf4", True),
)


def read_any_log(path: Path, reading: Reading | None = None) -> LegLog:
    """Reads CSV, candump, .blf, .asc, .trc (text also compressed: .gz), LCM event logs, MCAP or MF4. Raises
    InputError."""
    return joined(list(read_parts(path, reading or Reading())))


def read_parts(path: Path, reading: Reading, progress: Progress | None = None) -> Iterator[LegLog]:
    """The same in parts, one after the other: CSV in some ten thousand rows, the others whole."""
    kind = _format_of(path)
    if kind is None:
        parts = log_parts(path, reading.columns, reading.home_leg_length_m, progress)
    else:
        parts = iter([_read(kind, path, reading)])
    return parts if reading.resample_s is None else resampled(parts, reading.resample_s)


def _format_of(path: Path) -> _Format | None:
    """None: CSV."""
    start = _first_bytes(path)
    for kind in FORMATS:
        if start.startswith(kind.first_bytes):
            return kind
    for kind in FORMATS:
        if Path(path.name.removesuffix(".gz")).suffix.lower() in kind.suffixes and path.exists():
            raise InputError(f"{path}: found the first bytes {start!r}, expected {kind.name}")
    return None


def _read(kind: _Format, path: Path, reading: Reading) -> LegLog:
    try:
        reader = getattr(import_module(f"hexload.io.{kind.module}"), kind.reader)
    except ModuleNotFoundError as error:
        raise InputError(f'{path}: reading {kind.name} needs {error.name}: pip install "hexload[logs]"') from None
    if kind.is_table:
        return reader(path, reading.columns, reading.home_leg_length_m)
    if not reading.columns.is_empty:
        raise InputError(
            f"{path}: found --columns for {kind.name}, whose channels are known: expected it of tables alone"
        )
    log = reader(path)
    return replace(log, t_s=log.t_s * (reading.tick_s / TICK_S))


def _first_bytes(path: Path) -> bytes:
    length = max(len(start) for kind in FORMATS for start in kind.first_bytes)
    try:
        with path.open("rb") as stream:
            start = stream.read(length)
        if start.startswith(b"\x1f\x8b"):
            with gzip.open(path) as stream:
                start = stream.read(length)
    except (OSError, EOFError, zlib.error):
        return b""  # the CSV reader says what is wrong with the file
    return start.removeprefix(b"\xef\xbb\xbf")
