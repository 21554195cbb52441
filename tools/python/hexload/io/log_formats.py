"""Leg logs of every kind: the file's first bytes say which reader it needs."""

import gzip
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hexload.errors import InputError
from hexload.io.log_file import LegLog, read_log


@dataclass(frozen=True)
class _Format:
    name: str
    first_bytes: bytes
    suffixes: tuple[str, ...]
    reader: Callable[[Path], LegLog]


def _candump(path: Path) -> LegLog:
    from hexload.io import can_log

    return can_log.read_candump(path)


def _blf(path: Path) -> LegLog:
    from hexload.io import can_log

    return can_log.read_blf(path)


def _asc(path: Path) -> LegLog:
    from hexload.io import can_log

    return can_log.read_asc(path)


def _lcm(path: Path) -> LegLog:
    from hexload.io import lcm_log

    return lcm_log.read_lcm_log(path)


FORMATS = (
    _Format("a candump log (candump -L or -l)", b"(", (".log", ".candump"), _candump),
    _Format("a Vector binary log", b"LOGG", (".blf",), _blf),
    _Format("a Vector text log", b"date ", (".asc",), _asc),
    _Format("an LCM event log", b"\xed\xa1\xda\x01", (".lcm",), _lcm),
)


def read_any_log(path: Path) -> LegLog:
    """Reads CSV, candump, .blf, .asc (text also compressed: .gz) or LCM event logs. Raises InputError."""
    start = _first_bytes(path)
    for kind in FORMATS:
        if start.startswith(kind.first_bytes):
            return kind.reader(path)
    for kind in FORMATS:
        if Path(path.name.removesuffix(".gz")).suffix in kind.suffixes and path.exists():
            raise InputError(f"{path}: found the first bytes {start!r}, expected {kind.name}")
    return read_log(path)


def _first_bytes(path: Path) -> bytes:
    length = max(len(kind.first_bytes) for kind in FORMATS)
    try:
        with path.open("rb") as stream:
            start = stream.read(length)
        if start.startswith(b"\x1f\x8b"):
            with gzip.open(path) as stream:
                start = stream.read(length)
    except (OSError, EOFError, zlib.error):
        return b""  # the CSV reader says what is wrong with the file
    return start.removeprefix(b"\xef\xbb\xbf")
