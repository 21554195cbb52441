"""The worst run of each group of faults, done once more and drawn as the page's small animated view."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from hexload.faults.kinds import GROUPS, KINDS
from hexload.faults.one_fault import FaultCase, repeat
from hexload.report import motion
from hexload.view.recorded import recording_of_replay

# Of score.OUTCOMES; what was refused has no answer.
WORST_FIRST = ("silent", "weak", "false_alarm", "said", "indistinguishable", "right")


@dataclass(frozen=True)
class WorstRun:
    case: FaultCase
    outcome: str
    motion: str  # HTML


def worst_runs(results: Mapping[FaultCase, dict], logs: Path) -> list[WorstRun]:
    """In the order of kinds.GROUPS. `logs`: the folder of clean runs. Raises ToolFailed, InputError."""
    found = []
    for number, group in enumerate(GROUPS):
        cases = [case for case in results if KINDS[case.kind].group == group and KINDS[case.kind].is_fault]
        answered = [case for case in cases if results[case]["outcome"] in WORST_FIRST]
        if not answered:
            continue
        case = min(answered, key=lambda each: _rank(results[each]))
        platform, replay, loads = repeat(case, logs)
        recording = recording_of_replay(case.name, replay, [asdict(load) for load in loads])
        html = motion.to_html(platform, recording, f"group-{number}-motion", motion.FRAMES_OF_MANY)
        found.append(WorstRun(case, results[case]["outcome"], html))
    return found


def _rank(result: dict) -> tuple[int, float]:
    return WORST_FIRST.index(result["outcome"]), -(result["largest_sigmas"] or 0.0)
