"""Which columns of a table are a log's channels, by their names and the user's column map, and what makes SI of them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.io.column_map import SI, ColumnMap, factor_of, kind_of, si_of, units_in_words

LEGS = range(1, 7)
COLUMNS = ("t", *(f"{channel}{leg}" for channel in ("dl", "vl", "f") for leg in LEGS))
WITHOUT_VELOCITY = tuple(name for name in COLUMNS if not name.startswith("vl"))
HEADER = "t,dl1..dl6,vl1..vl6,f1..f6"
WITH_UNIT = re.compile(r"(.*\S)\s*[\[(]([^\[\]()]*)[\])]")
MOST_NAMED = 8


@dataclass(frozen=True)
class Selection:
    """Of a table's columns, those of COLUMNS or WITHOUT_VELOCITY in this order."""

    channels: tuple[str, ...]
    columns: tuple[str, ...]  # the channel that each column is of: once each, then of rod chambers
    positions: tuple[int, ...]  # of the columns
    factors: NDArray[np.float64]
    offsets: NDArray[np.float64]  # of the channels
    remarks: tuple[str, ...]

    def to_si(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, channels) of `values` (n, columns), in the table's units, which it changes."""
        for column in np.flatnonzero(self.factors != 1.0):
            values[:, column] *= self.factors[column]
        count = len(self.channels)
        for column in range(count, len(self.columns)):
            values[:, self.channels.index(self.columns[column])] += values[:, column]
        values = values[:, :count]
        for column in np.flatnonzero(self.offsets != 0.0):
            values[:, column] += self.offsets[column]
        return values


@dataclass(frozen=True)
class _Cell:
    """A column's heading."""

    whole: str
    name: str  # without its unit
    unit: str | None


def select(
    where: str,
    headings: Sequence[str],
    given: ColumnMap,
    home_leg_length_m: Sequence[float] | None = None,
    units: Sequence[str] | None = None,
) -> Selection:
    """`units`: of each column, "" for none; None: in the headings, "name [unit]", or SI. Raises InputError."""
    cells = [_cell(heading, None if units is None else units[k]) for k, heading in enumerate(headings)]
    _refuse_repeated(where, cells)
    has_lengths = _has_lengths(cells, given)
    wanted = COLUMNS if _has_velocity(cells, given) else WITHOUT_VELOCITY
    sources = {channel: channel.replace("dl", "l") if has_lengths else channel for channel in wanted}
    used = [_column(where, cells, sources[channel], given, "column") for channel in wanted]
    rods = tuple(channel for channel in wanted if given.of(channel).rod_column)
    used += [_column(where, cells, channel, given, "rod_column") for channel in rods]
    positions, factors = zip(*used)
    offsets = [
        (given.of(source).offset or 0.0) - (_home_length(where, source, home_leg_length_m) if source[0] == "l" else 0.0)
        for source in sources.values()
    ]
    remarks = []
    if has_lengths:
        remarks.append(
            f"absolute leg lengths: the platform's home length, {home_leg_length_m[0]:g} m of leg 1, is taken off"
        )
    if rods:
        remarks.append(f"force of legs {', '.join(f[-1] for f in rods)} from the pressures of both chambers")
    converted = {kind_of(channel) for channel, factor in zip(wanted, factors) if abs(factor) != 1.0}
    if converted:
        remarks.append(f"made SI by the units of the columns: {', '.join(sorted(converted))}")
    rest = [cell.whole for k, cell in enumerate(cells) if k not in positions]
    if rest:
        named = ", ".join(rest[:MOST_NAMED]) + (", ..." if len(rest) > MOST_NAMED else "")
        remarks.append(f"{len(rest)} column{'s' * (len(rest) > 1)} of no channel left out: {named}")
    return Selection(wanted, wanted + rods, positions, np.array(factors), np.array(offsets), tuple(remarks))


def _column(where: str, cells: Sequence[_Cell], channel: str, given: ColumnMap, key: str) -> tuple[int, float]:
    """Position of a channel's column, or that of its rod's chamber, and what makes SI of it."""
    said = given.of(channel)
    name = getattr(said, key)
    position = _position_of(where, cells, channel, name)
    si = si_of(channel, said)
    unit = said.unit or cells[position].unit or _cell(name or "", None).unit or si
    area = said.area_m2 if key == "column" else -said.rod_area_m2
    return position, _factor(where, cells[position], channel, unit, si) * (said.sign or 1.0) * (area or 1.0)


def _cell(heading: str, unit: str | None) -> _Cell:
    whole = heading.strip().strip('"').strip()
    match = WITH_UNIT.fullmatch(whole)
    if unit is not None or match is None:
        return _Cell(whole, whole, unit or None)
    return _Cell(whole, match[1], match[2].strip())


def _has_velocity(cells: Sequence[_Cell], given: ColumnMap) -> bool:
    """Some of them: a log that lacks others is refused."""
    if given.without_velocity:
        return False
    named = any(channel.startswith("vl") and said.column for channel, said in given.channels.items())
    return named or any(_is_called(cell, f"vl{leg}") for cell in cells for leg in LEGS)


def _has_lengths(cells: Sequence[_Cell], given: ColumnMap) -> bool:
    for kind in ("dl", "l"):  # what the map names counts, then displacements
        if any(given.of(f"{kind}{leg}").column for leg in LEGS):
            return kind == "l"
    for kind in ("dl", "l"):
        if any(_is_called(cell, f"{kind}{leg}") for cell in cells for leg in LEGS):
            return kind == "l"
    return False


def _is_called(cell: _Cell, name: str) -> bool:
    return name.lower() in (cell.whole.lower(), cell.name.lower())


def _position_of(where: str, cells: Sequence[_Cell], channel: str, name: str | None) -> int:
    """`name`: of the column; None: as the channel."""
    if name is None:
        found = [k for k, cell in enumerate(cells) if _is_called(cell, channel)]
    else:
        found = [k for k, cell in enumerate(cells) if cell.whole == name]
        found = found or [k for k, cell in enumerate(cells) if cell.name == name]
        found = found or _with_the_maps_unit(where, cells, channel, name)
    if len(found) == 1:
        return found[0]
    leg = "" if channel == "t" else f" (leg {channel[-1]})"
    names = ", ".join(f"'{cell.whole}'" for cell in cells[:MOST_NAMED]) + (", ..." if len(cells) > MOST_NAMED else "")
    if len(found) > 1:
        raise InputError(f"{where} found {len(found)} columns {channel}{leg}, expected it once")
    if name is not None:
        raise InputError(f"{where} found no column '{name}' for {channel}{leg}, expected one of {names}")
    raise InputError(
        f"{where} found no column {channel}{leg}, expected the header {HEADER}; the columns are {names}: "
        f"say which is which, --columns '{channel} = \"NAME [{SI[kind_of(channel)]}]\"', or in a file (.toml)"
    )


def _with_the_maps_unit(where: str, cells: Sequence[_Cell], channel: str, column: str) -> list[int]:
    """`column` is a name with the unit that the heading does not have."""
    said = _cell(column, None)
    found = [k for k, cell in enumerate(cells) if said.unit is not None and cell.name == said.name]
    for k in found:
        if cells[k].unit not in (None, said.unit):
            raise InputError(
                f"{where} column '{cells[k].whole}': found the unit {cells[k].unit}, and {said.unit} in the column map; "
                f"expected one of them: --columns '{channel} = {{ unit = \"{said.unit}\" }}' overrules the log"
            )
    return found


def _factor(where: str, cell: _Cell, channel: str, unit: str, si: str) -> float:
    if channel == "t" and unit == "clock":
        return 1.0
    factor = factor_of(si, unit)
    if factor is None:
        of_chamber = (
            "; pressures of a cylinder become a force by area_m2, rod_column and rod_area_m2 in the column map"
            if si == "N" and factor_of("Pa", unit) is not None
            else ""
        )
        raise InputError(
            f"{where} column '{cell.whole}': found the unit '{unit}', expected {units_in_words(si)} in the heading, "
            f"or --columns '{channel} = {{ unit = \"{si}\" }}'{of_chamber}"
        )
    return factor


def _home_length(where: str, channel: str, home_leg_length_m: Sequence[float] | None) -> float:
    if home_leg_length_m is None:
        raise InputError(
            f"{where} found absolute leg lengths, l1..l6: expected --platform, whose home length is taken off"
        )
    return float(home_leg_length_m[int(channel[-1]) - 1])


def _refuse_repeated(where: str, cells: Sequence[_Cell]) -> None:
    """Of the log's own names; others may repeat, as in the exports of some recorders."""
    for name in COLUMNS:
        if (count := sum(_is_called(cell, name) for cell in cells)) > 1:
            raise InputError(f"{where} found {count} columns {name}, expected it once")
