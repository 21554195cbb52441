"""Reader of ASAM MDF logs, version 4: channels by name, with their units, at the times of the first displacement."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from asammdf import MDF

from hexload.errors import InputError
from hexload.io.column_map import ColumnMap
from hexload.io.log_columns import LEGS, WITHOUT_VELOCITY, select
from hexload.io.log_file import LegLog
from hexload.io.mcap_log import table_log

HEADER_AT, HEADER = 64, b"##HD"  # ASAM MDF 4.1, 4.3: the header block follows the identification block


def read_mf4(path: Path, columns: ColumnMap, home_leg_length_m: Sequence[float] | None) -> LegLog:
    """Raises InputError."""
    with path.open("rb") as stream:
        start = stream.read(HEADER_AT + len(HEADER))
    if start[HEADER_AT:] != HEADER:
        raise InputError(f"{path}: found no header block at byte {HEADER_AT}, expected MF4: damaged or incomplete data")
    try:
        with MDF(path) as mdf:
            return _read(path, mdf, columns, home_leg_length_m)
    except InputError:
        raise
    except Exception as error:  # asammdf names no class of its own for damaged files
        raise InputError(f"{path}: found damaged or incomplete data, expected MF4 ({error})") from None


def _read(path: Path, mdf: MDF, columns: ColumnMap, home_leg_length_m: Sequence[float] | None) -> LegLog:
    places = [
        (group, index)
        for group, content in enumerate(mdf.groups)
        for index in range(len(content.channels))
        if index != mdf.masters_db.get(group)
    ]
    found = [mdf.groups[group].channels[index] for group, index in places]
    names, units = ["t", *(channel.name for channel in found)], ["s", *(channel.unit.strip() for channel in found)]
    chosen = select(f"{path}:", names, columns, home_leg_length_m, units)
    if chosen.positions[0] != 0:
        raise InputError(f"{path}: found a column for t, expected none: a channel's time is that of its group")
    signals = [mdf.get(group=places[k - 1][0], index=places[k - 1][1]) for k in chosen.positions[1:]]
    t_s = np.asarray(signals[0].timestamps, float)
    if len(t_s) < 2:
        raise InputError(f"{path}: found {len(t_s)} samples, expected at least 2")
    same = [len(each.timestamps) == len(t_s) and np.array_equal(each.timestamps, t_s) for each in signals]
    remarks = chosen.remarks
    if not all(same):
        remarks += ("channels of other times are put on those of dl1, by straight lines",)
    numbers = [
        np.asarray(each.samples, float) if is_same else np.interp(t_s, each.timestamps, np.asarray(each.samples, float))
        for each, is_same in zip(signals, same)
    ]
    values = chosen.to_si(np.column_stack([t_s, *numbers]))
    if chosen.channels == WITHOUT_VELOCITY:
        values = np.insert(values, [7] * len(LEGS), np.nan, axis=1)
    return table_log(path, values, remarks)
