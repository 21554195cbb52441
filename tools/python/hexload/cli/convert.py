"""`hexload convert`: a log of any kind as CSV or MCAP."""

import gzip
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hexload.errors import InputError
from hexload.estimation.input_check import InputCheck
from hexload.io.atomic_file import replaced_when_done
from hexload.io.column_map import read_column_map
from hexload.io.log_columns import COLUMNS, WITHOUT_VELOCITY
from hexload.io.log_file import LegLog
from hexload.io.log_formats import Reading, read_parts
from hexload.io.progress import progress_of
from hexload.platform import Platform

KINDS = (".csv", ".csv.gz", ".mcap")


def convert(
    log: Path,
    out: Path,
    columns: Sequence[str],
    resample_s: float | None,
    platform: Path | None,
    estimates: Path | None,
    is_unchecked: bool = False,
) -> tuple[int, tuple[str, ...]]:
    """The rows written, and what the reader remarks. What contradicts itself is refused; without a platform file that is
    units and signs of displacements, velocities and time beside each other. Raises InputError."""
    if not out.name.endswith(KINDS):
        raise InputError(
            f"{out}: found no kind of log that is written, expected a name that ends in {', '.join(KINDS)}"
        )
    if estimates is not None and out.suffix != ".mcap":
        raise InputError(f"--estimates: found it with {out.name}, expected an .mcap log, which can carry them")
    reading, machine = Reading(read_column_map(columns), resample_s), None
    if platform is not None:
        machine = Platform.of(platform).native()
        reading = replace(reading, home_leg_length_m=machine.home_leg_length_m, tick_s=machine.tick_s)
    remarks: dict[str, None] = {}
    with replaced_when_done(out) as temporary, progress_of(log) as progress:
        parts = _remarked(read_parts(log, reading, progress), remarks)
        if not is_unchecked:
            parts = _checked(log, parts, machine)
        if out.suffix == ".mcap":
            rows = _write_mcap(temporary, parts, estimates)
        else:
            rows = _write_csv(temporary, parts, is_packed=out.suffix == ".gz")
    return rows, tuple(remarks)


def _remarked(parts: Iterator[LegLog], remarks: dict[str, None]) -> Iterator[LegLog]:
    for part in parts:
        remarks.update(dict.fromkeys(part.remarks))
        yield part


def _checked(log: Path, parts: Iterator[LegLog], machine) -> Iterator[LegLog]:
    check = None
    for part in parts:
        if check is None and len(part.t_s) > 1:
            check = InputCheck(log, machine, float(np.median(np.diff(part.t_s))), None)
        if check is not None:
            check.add(part)
        yield part


def _write_csv(path: Path, parts: Iterator[LegLog], is_packed: bool) -> int:
    rows = 0
    with gzip.open(path, "wt", encoding="utf-8") if is_packed else path.open("w", encoding="utf-8") as stream:
        for part in parts:
            if rows == 0:
                has_velocity = part.has_velocity
                names = COLUMNS if has_velocity else WITHOUT_VELOCITY
                stream.write(",".join(names) + "\n")
            legs = [part.displacement_m, *([part.velocity_m_s] if has_velocity else []), part.force_n]
            line = "%.12g" + ",%.9g" * (len(names) - 1) + "\n"  # float32 needs nine digits
            stream.writelines(line % tuple(row) for row in np.column_stack([part.t_s, *legs]).tolist())
            rows += len(part.t_s)
    return rows


def _write_mcap(path: Path, parts: Iterator[LegLog], estimates: Path | None) -> int:
    try:
        from hexload.io.mcap_log import write_mcap
    except ModuleNotFoundError as error:
        raise InputError(f'{path.name}: writing MCAP needs {error.name}: pip install "hexload[logs]"') from None
    return write_mcap(path, parts, estimates)
