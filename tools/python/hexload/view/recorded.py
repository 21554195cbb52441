"""A recorded run or log as a source: any instant of it can be asked for."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hexload.estimation import load_summary
from hexload.io.log_file import LegLog
from hexload.io.run_directory import PAPER_PARAMETERS, Run, read_run, theta_at
from hexload.platform import Platform
from hexload.theory.bound import THETA_NAMES
from hexload.view.frame import CURVE_POINTS, EVENTS, Curves, Estimate, Event, Frame, Health, Truth

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Answers:
    """What was estimated, a row per answer."""

    names: tuple[str, ...]
    t_s: Array
    value: Array
    sigma: Array
    verdict: tuple[str, ...]


class Recording:
    """Plays between 0 and `duration_s`; `t_s` is where it stands, and belongs to the page."""

    def __init__(self, title: str, log: LegLog, answers: Answers, truths: tuple[Array, Array] | None):
        """`truths`: theta at each answer (n, 10), and what the answers' names mean (n, k)."""
        self.title = title
        self.t_s = 0.0
        self.duration_s = float(log.t_s[-1])
        force = log.force_n[np.isfinite(log.force_n)]
        self.force_range_n = (float(force.min()), float(force.max())) if force.size else (-1.0, 1.0)
        self._log, self._answers, self._truths = log, answers, truths
        self.load_changes_s: tuple[float, ...] = ()  # detected
        self.remarks: tuple[str, ...] = ()
        self.input_faults: tuple[tuple[float, str], ...] = ()
        rows = np.unique(np.linspace(0, len(answers.t_s) - 1, CURVE_POINTS).round().astype(int))
        self._thinned = rows

    def frame(self) -> Frame:
        row = _row_at(self._log.t_s, self.t_s)
        legs = (self._log.displacement_m[row], self._log.force_n[row])
        answer = _row_at(self._answers.t_s, self.t_s)
        if self._answers.t_s[answer] > self.t_s:
            return Frame(self.t_s, *legs)
        answers = self._answers
        estimate = Estimate(answers.names, answers.value[answer], answers.sigma[answer], answers.verdict[answer])
        truth = None if self._truths is None else Truth(*(part[answer] for part in self._truths))
        return Frame(self.t_s, *legs, estimate, truth)

    def curves(self) -> Curves | None:
        answers = self._answers
        rows = self._thinned[answers.t_s[self._thinned] <= self.t_s]
        rows = np.union1d(rows, [_row_at(answers.t_s, self.t_s)])
        if len(rows) < 2:
            return None
        truth = np.full((len(rows), len(answers.names)), np.nan) if self._truths is None else self._truths[1][rows]
        changes = tuple(t_s for t_s in self.load_changes_s if t_s <= self.t_s)
        return Curves(answers.names, answers.t_s[rows], answers.value[rows], answers.sigma[rows], truth, changes)

    def events(self) -> list[Event]:
        changes = [Event(t_s, "another load detected") for t_s in self.load_changes_s]
        found = [*changes, *(Event(t_s, words) for t_s, words in self.input_faults), *self._verdicts()]
        return sorted((event for event in found if event.t_s <= self.t_s), key=lambda event: event.t_s)[-EVENTS:]

    def _verdicts(self) -> list[Event]:
        words = np.array(self._answers.verdict)
        changes = np.flatnonzero(words[1:] != words[:-1]) + 1
        return [Event(float(self._answers.t_s[row]), f"verdict: {words[row].replace('_', ' ')}") for row in changes]

    def health(self) -> Health:
        return Health(self.remarks)


def _row_at(t_s: Array, moment_s: float) -> int:
    """The last row that is not after the moment, at least the first."""
    return max(int(np.searchsorted(t_s, moment_s + 1e-9, side="right")) - 1, 0)


def recording_of_run(directory: Path) -> tuple[Platform, Recording]:
    """Raises InputError when it is no run directory."""
    return Platform.of(directory / "platform.toml"), recording_of(read_run(directory))


def recording_of(run: Run) -> Recording:
    names = PAPER_PARAMETERS if run.is_of_paper else THETA_NAMES
    estimates = run.estimates
    value, sigma = (np.stack([estimates[mark + name] for name in names], axis=1) for mark in ("", "s_"))
    answers = Answers(names, estimates["t"], value, sigma, _verdicts_of(run.directory))
    recording = Recording(f"{run.name}, seed {run.meta['seed']}", run.log, answers, _truths(run, estimates["t"]))
    recording.load_changes_s = tuple(run.meta.get("load_changes_detected_s", ()))
    recording.input_faults = tuple((fault["t_s"], fault["fault"]) for fault in run.meta.get("input_faults", ()))
    remark = load_summary.health_in_words(run.meta["health_ticks"]) or "no remark"
    lost = f"{run.meta['rows']} samples, {run.meta['missing']} missing, {run.meta['refused']} refused"
    recording.remarks = (lost, f"health of the whole run: {remark}")
    return recording


def _truths(run: Run, t_s: Array) -> tuple[Array, Array]:
    theta = run.theta(t_s)
    return theta, (np.stack(list(run.load_parameters(t_s).values()), axis=1) if run.is_of_paper else theta)


def _verdicts_of(directory: Path) -> tuple[str, ...]:
    with (directory / "estimates.csv").open(encoding="utf-8") as file:
        column = file.readline().rstrip("\n").split(",").index("verdict")
        return tuple(line.rstrip("\n").split(",")[column] for line in file)


def recording_of_replay(title: str, result: dict, loads: list[dict] | None = None) -> Recording:
    """Of what replay_log returned. `loads`: the true ones, as in a run's meta.json."""
    log = result["log"]
    count = min(len(result["names"]), len(THETA_NAMES))  # the machine's effects are no load
    answers = Answers(
        tuple(result["names"][:count]),
        np.asarray(result["t"]),
        np.asarray(result["value"])[:, :count],
        np.asarray(result["sigma"])[:, :count],
        tuple(result["verdict"]),
    )
    truths = None if loads is None else 2 * (theta_at(loads, answers.t_s),)
    recording = Recording(title, log, answers, truths)
    recording.load_changes_s = tuple(load_summary.load_changes_s(result))
    recording.input_faults = tuple(result["input_faults"])
    remark = load_summary.health_in_words(result["health_counts"]) or "no remark"
    recording.remarks = (
        f"{result['rows']} samples, {result['refused']} refused",
        f"health of the whole log: {remark}",
        *log.remarks,
    )
    return recording
