"""What a user reads of a faulty log: it is written to files, and `hexload replay` tells about it."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from hexload.errors import InputError
from hexload.estimation.input_check import mend_of
from hexload.estimation.load_summary import load_changes_s, moments_in_words
from hexload.estimation.replay import replay_log
from hexload.faults.recording import Recording, write_files


@dataclass(frozen=True)
class Told:
    verdict: str  # at the end, or "refused"
    new_load: str  # when another load was detected; empty: none
    sentence: str  # the last line, what to do; else the first cause, or the reason of the refusal; empty: none


def told_by_replay(faulty: Recording, estimator: str) -> Told:
    with tempfile.TemporaryDirectory(prefix="hexload-faults-") as name:
        log, platform = write_files(faulty, Path(name))
        try:
            result = replay_log(log, platform, estimator, None, Path(name) / "estimates.csv")
        except InputError as refused:
            return Told("refused", "", str(refused).replace(f"{name}/", ""))
    times_s = load_changes_s(result)
    new_load = f"new load: detected {moments_in_words(times_s)}" if times_s else ""
    harmless = next((finding.sentence for finding in result["diagnosis"].findings), "")
    return Told(result["verdict"][-1].replace("_", " "), new_load, mend_of(result) or harmless)
