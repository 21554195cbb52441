"""Faults that come and go: a kind of fault in a stretch of a recording, the rest of which stays as it was."""

from dataclasses import fields, replace

import numpy as np

from hexload.estimation.rig_model import LegMotion
from hexload.faults.kinds import KINDS, Kind
from hexload.faults.recording import LoadStep, Recording
from hexload.io.log_file import CHANNEL_KEYS, LegLog

OF_LOADS = (KINDS["pendulum"].group, KINDS["leaking"].group)


def with_passing_fault(
    recording: Recording, kind: Kind, size: float, rows: slice, random: np.random.Generator
) -> Recording | None:
    """The fault is one in those rows alone, in which the load does not change. None: the kind is none that comes and goes,
    but of the machine as it is stated, of the load, or of the rows and their times, or of a load where there is none."""
    stretch = _stretch(recording, rows)
    if kind.group in OF_LOADS and stretch.theta[0] <= 0.0:
        return None
    faulty = kind.apply(stretch, size, random)
    same_rows = len(faulty.log.t_s) == len(stretch.log.t_s) and np.array_equal(faulty.log.t_s, stretch.log.t_s)
    if not same_rows or faulty.platform != stretch.platform or faulty.changes_s != stretch.changes_s:
        return None
    parts = {}
    for name in CHANNEL_KEYS.values():
        parts[name] = getattr(recording.log, name).copy()
        parts[name][rows] = getattr(faulty.log, name)
    return replace(recording, log=replace(recording.log, **parts))


def load_at(recording: Recording, t_s: float) -> np.ndarray:
    """(10,), true."""
    return [load.theta for load in recording.loads if load.at_s <= t_s + 1e-9][-1]


def _stretch(recording: Recording, rows: slice) -> Recording:
    """A recording of its own, from 0 s on, with one load."""
    load = LoadStep(0.0, load_at(recording, recording.t_s[rows.start]))
    motion = LegMotion(*(getattr(recording.motion, field.name)[rows] for field in fields(LegMotion)))
    logs = {name: _rows_of(getattr(recording, name), rows) for name in ("log", "clean")}
    return replace(recording, motion=motion, position_m=recording.position_m[rows], loads=(load,), changes_s=(), **logs)


def _rows_of(log: LegLog, rows: slice) -> LegLog:
    return LegLog(
        log.t_s[rows] - log.t_s[rows.start], log.displacement_m[rows], log.velocity_m_s[rows], log.force_n[rows]
    )
