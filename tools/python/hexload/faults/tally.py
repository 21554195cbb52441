"""What the cases of a campaign of faults say together: outcomes by kind, and the words that came with them."""

import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from hexload.faults.kinds import KINDS
from hexload.faults.one_fault import FaultCase
from hexload.faults.score import OUTCOMES

MOST_WORDS = 4
LONGEST = 110  # characters of a sentence
NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[+-]?\d+)?")


@dataclass(frozen=True)
class Tally:
    """Of some cases."""

    label: str
    runs: int
    outcomes: dict[str, int]  # of score.OUTCOMES
    false_changes: int  # runs, whatever their outcome, with a reported change of the load that was none
    words: dict[str, int]  # of the last 3 s, in how many runs; the most frequent ones
    wrong: dict[str, int]  # parameters of silent and weak runs, in how many; the most frequent first
    largest_percent: float | None  # error of silent runs, of the scale
    named: dict[str, int]  # naming's outcomes; empty: causes were not asked for
    sentences: dict[str, int]  # that name the first cause, the most frequent ones

    def share(self, outcome: str) -> float:
        return self.outcomes[outcome] / self.runs


@dataclass(frozen=True)
class KindTally:
    kind: str
    whole: Tally
    sizes: tuple[Tally, ...]


@dataclass(frozen=True)
class EstimatorTally:
    estimator: str
    whole: Tally  # of all faults; without the clean runs
    groups: dict[str, Tally]  # in the order of kinds.GROUPS
    kinds: tuple[KindTally, ...]
    silent: tuple[FaultCase, ...]


def tally(results: Mapping[FaultCase, dict], estimators: Sequence[str]) -> list[EstimatorTally]:
    """One entry for each estimator that has cases."""
    entries = []
    for estimator in estimators:
        own = {case: result for case, result in results.items() if case.estimator == estimator}
        if own:
            entries.append(_of_estimator(estimator, own))
    return entries


def _of_estimator(estimator: str, results: Mapping[FaultCase, dict]) -> EstimatorTally:
    by_kind = {name: [case for case in results if case.kind == name] for name in KINDS}
    by_kind = {name: cases for name, cases in by_kind.items() if cases}
    by_group: dict[str, list[FaultCase]] = {}
    for name, cases in by_kind.items():
        by_group.setdefault(KINDS[name].group, []).extend(cases)

    def of(label: str, cases: Iterable[FaultCase]) -> Tally:
        return _of_cases(label, [results[case] for case in cases])

    def of_sizes(name: str, cases: Sequence[FaultCase]) -> tuple[Tally, ...]:
        sizes = [size for size in KINDS[name].sizes if any(case.size == size for case in cases)]
        words = KINDS[name].size_in_words
        return tuple(of(words(size), (case for case in cases if case.size == size)) for size in sizes)

    faulty = [case for case in results if KINDS[case.kind].is_fault] or list(results)
    return EstimatorTally(
        estimator,
        of("all faults", faulty),
        {group: of(group, cases) for group, cases in by_group.items()},
        tuple(KindTally(name, of(name, cases), of_sizes(name, cases)) for name, cases in by_kind.items()),
        tuple(case for case, result in results.items() if result["outcome"] == "silent"),
    )


def _gist(sentence: str) -> str:
    """What runs of other legs and numbers have in common."""
    of_any_leg = re.sub(r"\b(leg |[dvf]l)\d", r"\1N", sentence)
    return textwrap.shorten(NUMBER.sub("x", of_any_leg), LONGEST, placeholder=" ...")


def _of_cases(label: str, results: Sequence[dict]) -> Tally:
    found = Counter(result["outcome"] for result in results)
    words = Counter(word for result in results for word in {_gist(sentence) for sentence in result["words"]})
    trusted = [result for result in results if result["outcome"] in ("silent", "weak")]
    wrong = Counter(entry["name"] for result in trusted for entry in result["wrong"])
    asked = [result["named"] for result in results if result.get("named") is not None]
    errors = [entry["percent"] for result in trusted for entry in result["wrong"] if result["outcome"] == "silent"]
    return Tally(
        label,
        len(results),
        {outcome: found[outcome] for outcome in OUTCOMES},
        sum(bool(result["false_changes_s"]) for result in results),
        dict(words.most_common(MOST_WORDS)),
        dict(wrong.most_common()),
        max((error for error in errors if error is not None), default=None),
        dict(Counter(named["outcome"] for named in asked)),
        dict(Counter(named["sentence"] for named in asked if named["sentence"]).most_common(MOST_WORDS)),
    )
