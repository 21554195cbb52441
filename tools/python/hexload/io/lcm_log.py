"""Reader of LCM event logs, as lcm-logger writes them: the channel of leg samples."""

from collections.abc import Iterator
from pathlib import Path

import lcm
import numpy as np

from hexload import project
from hexload.errors import InputError
from hexload.io.can_log import check_tick, leg_log
from hexload.io.log_file import LegLog

CHANNEL = "HEXLOAD_LEG_SAMPLE"


def read_lcm_log(path: Path) -> LegLog:
    """Raises InputError when there are no samples, a message is of another type, or the ticks are not those of one run."""
    project.ensure_built("hexload_lcm_python")
    leg_sample_t = project.message_type("leg_sample_t")
    ticks, rows, sequences, others = [], [], [], set()
    for event in lcm.EventLog(str(path), "r"):
        if event.channel != CHANNEL:
            others.add(event.channel)
            continue
        where = f"{path}: event {event.eventnum}"
        try:
            sample = leg_sample_t.decode(event.data)
        except ValueError:
            raise InputError(f"{where}: found a message of another type or version, expected leg_sample_t") from None
        check_tick(where, sample.tick, ticks[-1] if ticks else None)
        row = np.stack((sample.displacement_m, sample.velocity_m_s, sample.force_n), axis=1).ravel()
        if np.isinf(row).any():
            raise InputError(f"{where}: found an infinite value in tick {sample.tick}, expected a number")
        ticks.append(sample.tick)
        rows.append(row)
        sequences.append(sample.sequence)
    if len(ticks) < 2:
        seen = ", ".join(sorted(others)) or "no other channel"
        raise InputError(f"{path}: found {len(ticks)} messages on {CHANNEL}, expected at least 2; the log has {seen}")
    return leg_log(ticks, rows, _remarks(sequences))


def _remarks(sequences: list[int]) -> Iterator[str]:
    lost = sequences[-1] - sequences[0] + 1 - len(sequences)
    if lost > 0:
        yield f"{lost} messages of {CHANNEL} were lost before the log was written"
