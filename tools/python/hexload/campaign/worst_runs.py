"""The run of each class that ended farthest off, run once more and drawn as the page's small animated view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hexload.campaign.cases import Case
from hexload.campaign.one_case import repeat
from hexload.report import motion
from hexload.view.recorded import recording_of_replay


@dataclass(frozen=True)
class WorstRun:
    case: Case
    bounds: float  # root mean square over the ten parameters of error / bound
    verdict: str
    motion: str  # HTML


def worst_run(results: Sequence[dict]) -> WorstRun:
    """Of the results of a class, each with numbers. Raises ToolFailed, InputError."""
    off = [_bounds_off(result) for result in results]
    worst = results[int(np.argmax(off))]
    case = Case(**worst["case"])
    platform, replay, loads = repeat(case)
    recording = recording_of_replay(case.name, replay, loads)
    html = motion.to_html(platform, recording, f"{case.class_name}-motion", motion.FRAMES_OF_MANY)
    return WorstRun(case, max(off), worst["verdict"], html)


def _bounds_off(result: dict) -> float:
    error = np.array(result["estimators"][result["controller"]]["error"])
    return float(np.sqrt(np.mean((error / np.array(result["bound"])) ** 2)))
