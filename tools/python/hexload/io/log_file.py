"""Reader of leg logs: CSV or CSV.gz, SI units, one row per tick, header t,dl1..dl6,vl1..vl6,f1..f6.

A log without vl1..vl6 is of a machine without velocity sensors. Ticks may be missing, and single displacements and
forces: an empty cell or nan. Anything else that is wrong in a log is refused with file, line and column.
"""

import gzip
import itertools
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError

LONGEST_LINE_BYTES = 1 << 16
LEGS = range(1, 7)
COLUMNS = ("t", *(f"{channel}{leg}" for channel in ("dl", "vl", "f") for leg in LEGS))
WITHOUT_VELOCITY = tuple(name for name in COLUMNS if not name.startswith("vl"))


@dataclass(frozen=True)
class LegLog:
    """n rows, six legs each; time strictly increasing, all values finite but for displacements and forces that are
    missing, which are nan."""

    t_s: NDArray[np.float64]  # (n,)
    displacement_m: NDArray[np.float64]  # (n, 6), positive = extended
    velocity_m_s: NDArray[np.float64]  # (n, 6); nan throughout: no velocity sensors
    force_n: NDArray[np.float64]  # (n, 6), positive pushes the platform away from the base
    remarks: tuple[str, ...] = ()  # what the reader left out, for the user

    @property
    def has_velocity(self) -> bool:
        return not np.isnan(self.velocity_m_s[0, 0])

    def whole(self, name: str) -> "LegLog":
        """This log, for who needs every value. Raises InputError with `name` and the first that is missing."""
        for column, values in (("dl", self.displacement_m), ("f", self.force_n)):
            missing = np.argwhere(np.isnan(values))
            if missing.size:
                row, leg = missing[0]
                raise InputError(
                    f"{name}: row {row + 1} at {self.t_s[row]:.9g} s: found no {column}{leg + 1}, expected a log "
                    "without missing values"
                )
        return self


def read_log(path: Path | str) -> LegLog:
    """Raises InputError when the file is not a log; see the module's first lines."""
    path = Path(path)
    lines = _read_text(path).splitlines()
    if not lines:
        raise InputError(f"{path}: found an empty file, expected the header {_header()} and at least 2 rows")
    columns = _columns(path, lines[0].split(","))
    while lines[-1].strip() == "" and len(lines) > 1:
        lines.pop()
    if len(lines) < 3:
        raise InputError(f"{path}: found {len(lines) - 1} rows after the header, expected at least 2")
    rows = np.array([_parse_row(path, number, line, columns) for number, line in enumerate(lines[1:], start=2)])
    _check_time(path, rows[:, 0])
    if columns == WITHOUT_VELOCITY:
        rows = np.insert(rows, [7] * len(LEGS), np.nan, axis=1)
    return LegLog(*(np.ascontiguousarray(part) for part in (rows[:, 0], rows[:, 1:7], rows[:, 7:13], rows[:, 13:19])))


def _header() -> str:
    return "t,dl1..dl6,vl1..vl6,f1..f6"


def _read_text(path: Path) -> str:
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
            raw = b"".join(_bounded_lines(path, file))
        return raw.decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: found no such file, expected a log (.csv or .csv.gz)") from None
    except IsADirectoryError:
        raise InputError(f"{path}: found a folder, expected a log (.csv or .csv.gz)") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: found bytes that are not text at offset {error.start}, expected CSV") from None
    except (EOFError, gzip.BadGzipFile, zlib.error):
        raise InputError(f"{path}: found damaged or incomplete gzip data, expected a .csv.gz log") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {error.strerror}") from None


def _bounded_lines(path: Path, file: BinaryIO) -> Iterator[bytes]:
    """A MB of gzip can hold a line of gigabytes."""
    for number in itertools.count(1):
        line = file.readline(LONGEST_LINE_BYTES + 1)
        if not line:
            return
        if len(line) > LONGEST_LINE_BYTES:
            raise InputError(
                f"{path}: line {number}: found more than {LONGEST_LINE_BYTES} bytes, expected a row of a log"
            )
        yield line


def _columns(path: Path, header: list[str]) -> tuple[str, ...]:
    found = tuple(name.strip() for name in header)
    if found in (COLUMNS, WITHOUT_VELOCITY):
        return found
    where = f"{path}: line 1:"
    for name in COLUMNS:
        if name not in found:
            leg = f" (leg {name[-1]})" if name != "t" else ""
            raise InputError(f"{where} found no column {name}{leg}, expected the header {_header()}")
    for position, name in enumerate(found, start=1):
        if name not in COLUMNS:
            raise InputError(f"{where} column {position}: found '{name}', expected the header {_header()} alone")
    for position, (name, expected) in enumerate(zip(found, COLUMNS), start=1):
        if name != expected:
            raise InputError(f"{where} column {position}: found '{name}', expected '{expected}' (order {_header()})")
    raise InputError(f"{where} found {len(found)} columns, expected the {len(COLUMNS)} of {_header()}, each once")


def _parse_row(path: Path, number: int, line: str, columns: tuple[str, ...]) -> list[float]:
    fields = line.split(",")
    if len(fields) != len(columns):
        raise InputError(f"{path}: line {number}: found {len(fields)} values, expected {len(columns)}")
    values = [_missing(name, field) or _finite(field) for name, field in zip(columns, fields, strict=True)]
    if None in values:
        column = values.index(None)
        name, field = columns[column], fields[column]
        raise InputError(f"{path}: line {number}: column {name}: found '{field}', expected a finite number")
    return values


def _missing(column: str, field: str) -> float | None:
    return math.nan if column.startswith(("dl", "f")) and field.strip().lower() in ("", "nan") else None


def _finite(field: str) -> float | None:
    try:
        value = float(field)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in field else None  # Python alone would read 1_000


def _check_time(path: Path, t_s: NDArray[np.float64]) -> None:
    wrong = np.flatnonzero(np.diff(t_s) <= 0)
    if wrong.size == 0:
        return
    before, found = t_s[wrong[0]], t_s[wrong[0] + 1]
    what = "time running backwards" if found < before else "the same time again"
    raise InputError(
        f"{path}: line {wrong[0] + 3}: column t: found {found:.9g} after {before:.9g}, {what}; expected a later time"
    )
