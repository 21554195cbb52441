"""Reader of leg logs: CSV or CSV.gz, one row per tick, columns t,dl1..dl6,vl1..vl6,f1..f6 in SI units or those of their
headings, in any order and among others; with commas, semicolons or tabs between; lines before the header are passed over.
Text is UTF-8, UTF-16 with its mark, or Latin-1, whose letters can stand in names, units and comments alone: never in a number.

A log without vl1..vl6 is of a machine without velocity sensors. Ticks may be missing, and single displacements,
velocities and forces: an empty cell or nan. Anything else that is wrong in a log is refused with file, line and column.
"""

import codecs
import gzip
import itertools
import math
import re
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.io.column_map import UNITS, ColumnMap
from hexload.io.log_columns import COLUMNS as COLUMNS
from hexload.io.log_columns import HEADER, LEGS, WITHOUT_VELOCITY, Selection, select

BLOCK_BYTES = 1 << 23  # that are parsed at once: some 50,000 rows
LONGEST_LINE_BYTES = 1 << 16
HEADER_WITHIN = 60  # lines
LATEST_START_S = 1e7  # beyond, t is a date: it counts from the first row, as no estimate's file has digits for it
DAY_S = 86400.0
ARCHIVE = b"PK\x03\x04"
NO_TEXT = re.compile(rb"[^\t\n\f\r\x1b -\xff]")
SPACED_COMMA = re.compile(" *, *")
Array = NDArray[np.float64]
Progress = Callable[[int], None]  # told the bytes read
CHANNEL_KEYS = {"displacement": "displacement_m", "velocity": "velocity_m_s", "force": "force_n"}  # of LegLog


@dataclass(frozen=True)
class LegLog:
    """n rows, six legs each; time strictly increasing, all values finite but for those that are missing, which are nan."""

    t_s: Array  # (n,)
    displacement_m: Array  # (n, 6), positive = extended
    velocity_m_s: Array  # (n, 6); nan throughout: no velocity sensors
    force_n: Array  # (n, 6), positive pushes the platform away from the base
    remarks: tuple[str, ...] = ()  # what the reader left out, for the user

    @property
    def has_velocity(self) -> bool:
        return not np.isnan(self.velocity_m_s).all()

    def whole(self, name: str) -> "LegLog":
        """This log, for who needs every value. Raises InputError with `name` and the first that is missing."""
        channels = {"dl": self.displacement_m, "vl": self.velocity_m_s, "f": self.force_n}
        if not self.has_velocity:
            del channels["vl"]
        for column, values in channels.items():
            missing = np.argwhere(np.isnan(values))
            if missing.size:
                row, leg = missing[0]
                raise InputError(
                    f"{name}: row {row + 1} at {self.t_s[row]:.9g} s: found no {column}{leg + 1}, expected a log "
                    "without missing values"
                )
        return self

    def rows(self, chosen: slice | Array) -> "LegLog":
        parts = (self.t_s, self.displacement_m, self.velocity_m_s, self.force_n)
        return replace(
            self, **dict(zip(("t_s", "displacement_m", "velocity_m_s", "force_n"), (p[chosen] for p in parts)))
        )


def joined(parts: list[LegLog]) -> LegLog:
    """Of at least one part of a log, one after the other."""
    names = ("t_s", "displacement_m", "velocity_m_s", "force_n")
    remarks = dict.fromkeys(remark for part in parts for remark in part.remarks)
    return LegLog(*(np.concatenate([getattr(part, name) for part in parts]) for name in names), tuple(remarks))


def read_log(
    path: Path | str,
    columns: ColumnMap | None = None,
    home_leg_length_m: Sequence[float] | None = None,
) -> LegLog:
    """`home_leg_length_m`: six, taken off absolute leg lengths, l1..l6. Raises InputError when the file is not a log; see the
    module's first lines."""
    return joined(list(log_parts(Path(path), columns, home_leg_length_m)))


def log_parts(
    path: Path,
    columns: ColumnMap | None = None,
    home_leg_length_m: Sequence[float] | None = None,
    progress: Progress | None = None,
) -> Iterator[LegLog]:
    """The log in parts of some ten thousand rows, in time; together at least two rows. The first has the remarks."""
    try:
        with path.open("rb") as raw:
            stream = gzip.open(raw) if path.suffix == ".gz" else raw
            if stream.peek(2)[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
                stream = codecs.EncodedFile(stream, "utf-8", "utf-16")
            reader = _Reader(path, stream, columns or ColumnMap(), home_leg_length_m)
            for part in reader.parts():
                if progress is not None:
                    progress(raw.tell())
                yield part
    except FileNotFoundError:
        raise InputError(f"{path}: found no such file, expected a log (.csv or .csv.gz)") from None
    except IsADirectoryError:
        raise InputError(f"{path}: found a folder, expected a log (.csv or .csv.gz)") from None
    except (EOFError, gzip.BadGzipFile, zlib.error):
        raise InputError(f"{path}: found damaged or incomplete gzip data, expected a .csv.gz log") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {error.strerror}") from None


class _Reader:
    """One pass through a file."""

    def __init__(self, path: Path, stream: BinaryIO, columns: ColumnMap, home_leg_length_m: Sequence[float] | None):
        self._path = path
        self._stream = stream
        self._given = columns
        self._home_leg_length_m = home_leg_length_m
        self._line = 0  # number of the last one that was taken
        self._blank_lines = 0  # after it: a log may end in them
        self._rows = 0
        self._clock: _Clock | None = None
        self._start_s = 0.0  # taken off all times
        self._last_t_s = -math.inf
        self._of_text: tuple[str, ...] = ()  # remarks

    def parts(self) -> Iterator[LegLog]:
        blocks = self._blocks()
        lines = next(blocks, [])
        if not any(line.strip() for line in lines):
            raise InputError(f"{self._path}: found an empty file, expected the header {HEADER} and at least 2 rows")
        part = self._part(self._after_header(lines))
        part = replace(part, remarks=self._of_text + self._selection.remarks + part.remarks)
        for lines in blocks:
            if self._rows < 2:
                part = joined([part, self._part(lines)])
                continue
            yield part
            part = self._part(lines)
        if self._rows < 2:
            raise InputError(f"{self._path}: found {self._rows} rows after the header, expected at least 2")
        if len(part.t_s):
            yield part

    def _blocks(self) -> Iterator[list[str]]:
        rest = b""
        place = 0
        while block := self._stream.read(BLOCK_BYTES):
            whole, newline, rest = (rest + block).rpartition(b"\n")
            if newline:
                yield self._text(whole, place).splitlines()
                place += len(whole) + 1
            if len(rest) > LONGEST_LINE_BYTES:  # a MB of gzip can hold a line of gigabytes
                found = f"found more than {LONGEST_LINE_BYTES} bytes, expected a row of a log"
                raise InputError(f"{self._path}: line {self._line + 1}: {found}")
        if rest:
            yield self._text(rest, place).splitlines()

    def _text(self, raw: bytes, place: int) -> str:
        if place == 0 and raw.startswith(ARCHIVE):
            raise InputError(f"{self._path}: found a workbook, or another archive, expected CSV: save its sheet as CSV")
        if (strange := NO_TEXT.search(raw)) is not None:
            line = self._line + 1 + raw.count(b"\n", 0, strange.start())
            what_to_do = f"; of UTF-16 without its mark: iconv -f utf-16le -t utf-8 {self._path.name} > utf8.csv"
            found = f"found byte 0x{strange[0][0]:02x} at offset {place + strange.start()}, expected CSV as text"
            raise InputError(f"{self._path}: line {line}: {found}{what_to_do if strange[0] == bytes(1) else ''}")
        try:
            return raw.decode("utf-8-sig" if place == 0 else "utf-8")
        except UnicodeDecodeError as error:
            line = self._line + 1 + raw.count(b"\n", 0, error.start)
            self._of_text = (f"read as Latin-1: line {line} has byte 0x{raw[error.start]:02x}, which is no UTF-8",)
            return raw.decode("latin-1")

    def _after_header(self, lines: list[str]) -> list[str]:
        """The lines after the header, which is the first line that can be one; of none, that of most columns is to blame."""
        most, refused = 0, None
        for number, line in enumerate(lines[:HEADER_WITHIN], start=1):
            separator = next((each for each in ";\t" if each in line), ",")
            headings = line.lstrip("# ").split(separator)
            units = _units_of(lines[number].split(separator) if number < len(lines) else [], len(headings))
            try:
                where = f"{self._path}: line {number}:"
                selection = select(where, headings, self._given, self._home_leg_length_m, units)
            except InputError as error:
                if len(headings) > most:
                    most, refused = len(headings), error
                continue
            self._line = number + (units is not None)
            self._take_columns(separator, len(headings), selection, lines[self._line : self._line + 1])
            return lines[self._line :]
        raise refused

    def _take_columns(self, separator: str, count: int, selection: Selection, first_row: list[str]) -> None:
        self._separator, self._count, self._selection = separator, count, selection
        fields = first_row[0].split(separator) if first_row else []
        used = [fields[k] for k in selection.positions if k < len(fields)]
        self._has_decimal_comma = separator != "," and any("," in field for field in used)
        self._is_all = selection.positions == tuple(range(count))
        if used and ":" in used[0]:
            self._clock = _Clock()

    def _part(self, lines: list[str]) -> LegLog:
        lines = self._without_blank_end(lines)
        first = self._line + 1
        rows = self._selection.to_si(self._numbers(lines, first))
        self._line += len(lines)
        self._rows += len(lines)
        remarks = self._take_time(rows[:, 0], first) if len(rows) else ()
        if self._selection.channels == WITHOUT_VELOCITY:
            rows = np.insert(rows, [7] * len(LEGS), np.nan, axis=1)
        parts = (rows[:, 0], rows[:, 1:7], rows[:, 7:13], rows[:, 13:19])
        return LegLog(*(np.ascontiguousarray(part) for part in parts), remarks)

    def _without_blank_end(self, lines: list[str]) -> list[str]:
        whole = [*[""] * self._blank_lines, *lines]
        count = next((k for k in range(len(whole), 0, -1) if whole[k - 1].strip()), 0)
        self._blank_lines = len(whole) - count
        return whole[:count]

    def _numbers(self, lines: list[str], first: int) -> Array:
        """(n, channels) in the log's units. Line by line where a line is not plain."""
        separator = self._separator
        picked = lines
        if set(map(str.count, lines, itertools.repeat(separator))) - {self._count - 1}:
            return self._numbers_of_each(lines, first)
        if not self._is_all or self._clock:
            picked = [separator.join(self._fields(first + k, line)) for k, line in enumerate(lines)]
        values = _parsed(self._with_commas(separator.join(["", *picked, ""])))
        channels = self._selection.columns
        if values.size != len(lines) * len(channels):
            return self._numbers_of_each(lines, first)
        rows = values.reshape(len(lines), len(channels))
        wrong = ~np.isfinite(rows)
        wrong &= ~(np.isnan(rows) & np.array([_may_be_missing(channel) for channel in channels]))
        return self._numbers_of_each(lines, first) if wrong.any() else rows

    def _with_commas(self, text: str) -> str:
        """As numpy reads it: commas between, decimal points, nan for an empty field, for which numpy would read -1."""
        if self._has_decimal_comma:
            text = text.replace(",", ".")
        text = text.replace(self._separator, ",")
        if '"' in text:
            text = text.replace('"', "")
        if " " in text:
            text = SPACED_COMMA.sub(",", text)
        while ",," in text:
            text = text.replace(",,", ",nan,")
        return text.strip(",")

    def _fields(self, number: int, line: str) -> list[str]:
        """Of the channels, the time of a clock as seconds."""
        every = line.split(self._separator)
        fields = [every[k] for k in self._selection.positions]
        if self._clock is not None:
            seconds = self._clock.seconds(fields[0].strip().strip('"').replace(",", "."))
            if seconds is None:
                raise InputError(
                    f"{self._path}: line {number}: column t: found '{fields[0]}', expected a clock's h:min:s, with or "
                    "without the date before it"
                )
            fields[0] = repr(seconds)
        return fields

    def _numbers_of_each(self, lines: list[str], first: int) -> Array:
        rows = [self._numbers_of(number, line) for number, line in enumerate(lines, start=first)]
        return np.array(rows).reshape(len(lines), len(self._selection.columns))

    def _numbers_of(self, number: int, line: str) -> list[float]:
        where = f"{self._path}: line {number}:"
        if (found := line.count(self._separator) + 1) != self._count:
            raise InputError(f"{where} found {found} values, expected {self._count}")
        channels = self._selection.columns
        fields = [field.replace('"', "") for field in self._fields(number, line)]
        if self._has_decimal_comma:
            fields = [field.replace(",", ".") for field in fields]
        values = [_missing(channel, field) or _finite(field) for channel, field in zip(channels, fields, strict=True)]
        if None in values:
            k = values.index(None)
            raise InputError(f"{where} column {channels[k]}: found '{fields[k]}', expected a finite number")
        return values

    def _take_time(self, t_s: Array, first: int) -> tuple[str, ...]:
        """Refuses time that does not go on; `t_s` of a date counts from the first row, which is said."""
        remarks = ()
        if self._last_t_s == -math.inf and (self._clock or abs(t_s[0]) > LATEST_START_S):
            self._start_s = t_s[0]
            remarks = (f"t counts from the log's first row, {self._clock.first if self._clock else f'{t_s[0]:.6f} s'}",)
        t_s -= self._start_s
        before = np.concatenate([[self._last_t_s], t_s[:-1]])
        wrong = np.flatnonzero(t_s <= before)
        if wrong.size:
            k = wrong[0]
            what = "time running backwards" if t_s[k] < before[k] else "the same time again"
            raise InputError(
                f"{self._path}: line {first + k}: column t: found {t_s[k]:.9g} after {before[k]:.9g}, {what}; "
                "expected a later time"
            )
        self._last_t_s = t_s[-1]
        return remarks


class _Clock:
    """Seconds of a clock, with its date or without: then midnight passes unseen."""

    def __init__(self):
        self.first = ""
        self._first_date: datetime | None = None
        self._days = 0
        self._last_s = -math.inf

    def seconds(self, field: str) -> float | None:
        self.first = self.first or field
        try:
            if " " in field or "T" in field:
                date = datetime.fromisoformat(field)
                self._first_date = self._first_date or date
                return (date - self._first_date).total_seconds()
            hours, minutes, seconds = field.split(":")
            now_s = 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
        except (ValueError, TypeError):  # the latter: a time zone in one of them
            return None
        if now_s < self._last_s - DAY_S / 2:
            self._days += 1
        self._last_s = now_s
        return now_s + DAY_S * self._days


def _parsed(text: str) -> Array:
    """All numbers up to the first field that is none."""
    with warnings.catch_warnings(), suppress(ValueError, DeprecationWarning):
        warnings.simplefilter("error")  # numpy's word for such a field
        return np.fromstring(text, sep=",")
    return np.empty(0)


def _units_of(cells: list[str], count: int) -> list[str] | None:
    """Of a line of units below the header; None: it is no such line."""
    units = [cell.strip().strip('"').strip("[]() ") for cell in cells]
    known = {unit for table in UNITS.values() for unit in table}
    is_one = len(units) == count and sum(unit in known for unit in units) > count / 2
    return units if is_one else None


def _may_be_missing(channel: str) -> bool:
    return channel != "t"


def _missing(channel: str, field: str) -> float | None:
    return math.nan if _may_be_missing(channel) and field.strip().lower() in ("", "nan") else None


def _finite(field: str) -> float | None:
    try:
        value = float(field)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in field else None  # Python alone would read 1_000
