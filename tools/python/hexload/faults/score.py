"""What an estimator's answer to a run is worth: one outcome, by these rules alone.

A parameter is *wrong* when, at the end of the run, it is off by more than 5 of its own published sigmas and by more than
2 % of its scale. The scale is the supervisor's, with the true value in place of the estimate: the parameter's own value, of
h its length, of products of inertia the mean moment; at least that of the empty platform (of the paper's filter: its prior
sigma). What is said counts when it is said in the last 3 s. Outcomes, the first that applies:

    refused      the log is refused as a whole, or more than half of the run's samples, or of those of the last 3 s, are
    silent       a parameter is wrong, its own verdict is `converged`, and no health bit, event or refusal in the last 3 s
    indistinguishable       as silent or weak, but nothing in the log can show it: with the same machine it is to the last digit the log
                 of another motion and another load, and for that load no parameter is wrong
    weak         a parameter is wrong, its own verdict is `converged`, but a bit, event or refusal is there
    said         parameters are wrong, and none of them has the verdict `converged`
    false_alarm  no parameter is wrong, but a change of the load was reported where there was none, or the verdict
                 `inconsistent`, at any time of the run
    right        no parameter is wrong: right, or honestly open

A report is true from a change of the load until ALARM_DUE_S after it; a load that changes all the time has one long window.
So has, of the paper's filter, a load that is not of the stated mass: that the legs do not carry that mass is true.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.campaign.statistics import ALARM_DUE_S

Array = NDArray[np.float64]

OUTCOMES = ("right", "said", "weak", "silent", "indistinguishable", "refused", "false_alarm")
WRONG_SIGMAS = 5.0
WRONG_SHARE = 0.02
LAST_S = 3.0
MOST = 0.5  # share of refused samples beyond which there is no answer
CHANGED, INCONSISTENT, CONVERGED = "load changed", "inconsistent", "converged"
REFUSED_SAMPLES = "samples refused"


@dataclass(frozen=True)
class Truth:
    value: Array  # (n,) at the end of the run
    scale: Array  # (n,)
    changes_s: tuple[tuple[float, float], ...] = ()  # from when to when the load changes, s


@dataclass(frozen=True)
class Reported:
    """All that is reported to a user in a run; k answers of `samples` samples."""

    names: tuple[str, ...]  # of the n parameters that have a verdict
    value: Array  # (n,) at the end
    sigma: Array  # (n,), published
    parameter_verdict: tuple[str, ...]  # (n,) at the end
    t_s: Array  # (k,)
    verdict: Sequence[str]  # (k,)
    bits: Mapping[str, Array]  # health bit -> (k,) whether it was set
    sample_t_s: Array  # (samples,)
    causes: tuple[tuple[float, str], ...] = ()  # in words, and when they were named


@dataclass(frozen=True)
class WrongParameter:
    name: str
    sigmas: float
    percent: float  # of its scale
    verdict: str


@dataclass(frozen=True)
class Score:
    outcome: str
    words: tuple[
        str, ...
    ]  # bits, events, refusals of the last 3 s, and the verdict at the end if it is not `converged`
    words_before: tuple[str, ...]  # those of the rest of the run
    wrong: tuple[WrongParameter, ...]
    largest_sigmas: float  # of the errors of all parameters at the end
    false_changes_s: tuple[float, ...]
    is_called_inconsistent: bool  # where no change of the load explains it


def score(reported: Reported, truth: Truth, twin: Truth | None = None) -> Score:
    """The outcome of a run that was not refused as a whole; see the rules above. `twin`: of the other load whose log it is."""
    end_s = float(reported.sample_t_s[-1])
    is_late = reported.t_s >= end_s - LAST_S
    late_refused = _refused_share(reported, reported.sample_t_s >= end_s - LAST_S, is_late)
    run_refused = _refused_share(reported, np.ones(len(reported.sample_t_s), bool), np.ones(len(reported.t_s), bool))
    wrong, largest = _wrong(reported, truth)
    bits_late = _names_set(reported.bits, is_late) + ((REFUSED_SAMPLES,) if late_refused > 0.0 else ())
    words = bits_late + _last_verdict(reported, bits_late) + _causes(reported, end_s - LAST_S, np.inf)
    false_changes = _false_changes(reported, truth)
    is_inconsistent = _is_called_inconsistent(reported, truth)
    is_trusted = any(parameter.verdict == CONVERGED for parameter in wrong)
    if max(run_refused, late_refused) > MOST:
        outcome = "refused"
    elif is_trusted and twin is not None and not _wrong(reported, twin)[0]:
        outcome = "indistinguishable"
    elif is_trusted:
        outcome = "weak" if bits_late else "silent"
    elif wrong:
        outcome = "said"
    else:
        outcome = "false_alarm" if false_changes or is_inconsistent else "right"
    before = _names_set(reported.bits, ~is_late) + _causes(reported, -np.inf, end_s - LAST_S)
    before = tuple(word for word in before if word not in words)
    return Score(outcome, words, before, wrong, largest, false_changes, is_inconsistent)


def refusal(reason: str) -> Score:
    """Of a run that was refused as a whole, with the reason for the user."""
    return Score("refused", (reason,), (), (), float("nan"), (), False)


def load_scale(theta: Array, platform_theta: Array) -> Array:
    """(10,) of a load and its empty platform, as momentum_supervisor.c has it."""
    moment, own_moment = abs(theta[4:7].mean()), platform_theta[4:7].mean()
    length = max(np.linalg.norm(theta[1:4]), 0.1 * np.sqrt(platform_theta[0] * own_moment))
    moments = np.maximum(np.abs(theta[4:7]), own_moment)
    return np.array(
        [max(abs(theta[0]), platform_theta[0]), *(3 * [length]), *moments, *(3 * [max(moment, own_moment)])]
    )


def _wrong(reported: Reported, truth: Truth) -> tuple[tuple[WrongParameter, ...], float]:
    error = np.abs(reported.value - truth.value)
    with np.errstate(divide="ignore", invalid="ignore"):
        sigmas = np.where(error == 0.0, 0.0, error / reported.sigma)
    share = error / truth.scale
    is_wrong = ~((sigmas <= WRONG_SIGMAS) | (share <= WRONG_SHARE))  # not a number is wrong too
    wrong = tuple(
        WrongParameter(reported.names[k], float(sigmas[k]), 100.0 * float(share[k]), reported.parameter_verdict[k])
        for k in np.flatnonzero(is_wrong)
    )
    return wrong, float(sigmas.max())


def _refused_share(reported: Reported, samples: NDArray[np.bool_], answers: NDArray[np.bool_]) -> float:
    given = int(samples.sum())
    return 0.0 if given == 0 else 1.0 - int(answers.sum()) / given


def _names_set(bits: Mapping[str, Array], ticks: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(name for name, is_set in bits.items() if is_set[ticks].any())


def _causes(reported: Reported, from_s: float, to_s: float) -> tuple[str, ...]:
    return tuple(dict.fromkeys(words for t_s, words in reported.causes if from_s <= t_s < to_s))


def _last_verdict(reported: Reported, said: tuple[str, ...]) -> tuple[str, ...]:
    words = [verdict.replace("_", " ") for verdict in reported.verdict[-1:]]
    return tuple(word for word in words if word != CONVERGED and word not in said)


def _is_due(t_s: Array, truth: Truth) -> NDArray[np.bool_]:
    due = np.zeros(len(t_s), bool)
    for from_s, to_s in truth.changes_s:
        due |= (t_s >= from_s - 1e-9) & (t_s <= to_s + ALARM_DUE_S)
    return due


def _false_changes(reported: Reported, truth: Truth) -> tuple[float, ...]:
    alarms_s = reported.t_s[reported.bits[CHANGED]]
    return tuple(float(t_s) for t_s in alarms_s[~_is_due(alarms_s, truth)])


def _is_called_inconsistent(reported: Reported, truth: Truth) -> bool:
    is_called = np.array([verdict == INCONSISTENT for verdict in reported.verdict], bool)
    return bool((is_called & ~_is_due(reported.t_s, truth)).any())
