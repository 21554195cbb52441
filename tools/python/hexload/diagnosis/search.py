"""The search for causes in the leg forces: load changes first, then what explains the rest best, one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis import causes
from hexload.diagnosis.bank import Bank, Candidate, Selected
from hexload.diagnosis.cause import Cause, Defect
from hexload.diagnosis.causes import Family
from hexload.diagnosis.dynamics import TEN, Dynamics, fade_around
from hexload.diagnosis.finding import SIGMAS

Array = NDArray[np.float64]

MOST_CAUSES = 4
LATER_SHARE = 0.02  # of the first misfit, that a further cause explains at least
EXPLAINED = 1.3  # misfit that needs none
MOST_CHANGES = 5
MOST_REPORTED = 12  # changes by an estimator that are looked at; one that tells more has another trouble
ENOUGH = 40.0  # score of a cause
EXCESS = 1.5  # of the residual over the sensors' noise, from which the dear families are tried
CLEAR = 0.3  # of the sum of squares: a load change that leaves no more is one
ONE_OF_SOME = 0.9  # of it: what leaves more than that is no load change
REFINE_S = 0.5
RINGING_S = np.linspace(0.0, 0.2, 5)  # after a change: rows that feel its shock
CLOSE = 10.0  # of scores that do not tell two causes apart


@dataclass(frozen=True)
class Change:
    at_s: float
    theta: Array  # (10,) by which the load has changed
    score: float


@dataclass(frozen=True)
class Explained:
    selected: tuple[Selected, ...]  # the first explains most
    alternatives: tuple[tuple[Cause, ...], ...]  # causes that explain as much as each
    changes: tuple[Change, ...]
    misfit: float  # mean square of the whitened residual with none of them: 1 is the noise of the sensors
    left: float  # the same with all of them


def explain(d: Dynamics, reported_changes_s: Sequence[float] = ()) -> Explained:
    """`reported_changes_s`: when an estimator has detected another load."""
    at_s: list[float] = []
    scores: list[float] = []
    while True:
        bank = _bank(d, at_s)
        best = _offered(bank, reported_changes_s, at_s)
        is_change = best.family.cause.defect == Defect.LOAD_CHANGE and best.left < ONE_OF_SOME * bank.left
        if best.score < ENOUGH or not is_change or len(at_s) == MOST_CHANGES:
            break
        at_s.append(_refined_change(bank, best.family.detail))
        scores.append(best.score)
    misfit = bank.left / bank.rows
    selected, alternatives = _select(bank)
    loads = bank.coefficients()[0].reshape(-1, TEN)
    order = np.argsort(at_s)
    changes = [Change(at_s[k], loads[n + 1] - loads[n], scores[k]) for n, k in enumerate(order)]
    return Explained(tuple(selected), tuple(alternatives), tuple(changes), misfit, bank.left / bank.rows)


def _bank(d: Dynamics, at_s: Sequence[float]) -> Bank:
    t_s = d.smooth.t_s
    edges = [-np.inf, *sorted(at_s), np.inf]
    segments = [((t_s >= start) & (t_s < end)).astype(float) for start, end in zip(edges[:-1], edges[1:])]
    if not at_s:
        return Bank(d, segments)
    d = d.faded(fade_around(t_s, np.add.outer(sorted(at_s), RINGING_S).ravel()))
    loads = Bank(d, segments).coefficients()[0].reshape(-1, TEN)
    return Bank(d.with_noise_of(loads[loads[:, 0].argmax()]), segments)


def _offered(bank: Bank, reported_s: Sequence[float], at_s: Sequence[float]) -> Candidate:
    d, theta = bank.dynamics, bank.theta()
    bank.offer(list(causes.quick(d, theta)))
    grid = np.arange(d.smooth.t_s[0] + 0.5, d.smooth.t_s[-1] - 0.5, causes.JUMP_GRID_S)
    moments = np.concatenate([grid, list(reported_s)[:MOST_REPORTED]])
    free = [moment for moment in moments if all(abs(moment - other) > 0.1 for other in at_s)]
    bank.offer(list(causes.jumps(d, np.array(free))))
    best = bank.ranked()[0]
    if best.family.cause.defect == Defect.LOAD_CHANGE and best.left < CLEAR * bank.left:
        return best
    if best.score > ENOUGH or bank.left > EXCESS * bank.rows:
        residual = d.smooth.force - causes.of_load(d.of_body, theta)
        bank.offer(list(causes.slow(d, theta, residual)))
        best = bank.ranked()[0]
    return best


def _refined_change(bank: Bank, about_s: float) -> float:
    t_s = bank.dynamics.smooth.t_s
    near = t_s[np.abs(t_s - about_s) <= REFINE_S]
    return max(causes.jumps(bank.dynamics, near), key=lambda family: bank.score(family)).detail


def _select(bank: Bank) -> tuple[list[Selected], list[tuple[Cause, ...]]]:
    selected: list[Selected] = []
    alternatives: list[tuple[Cause, ...]] = []
    first = bank.left
    while len(bank.chosen) < MOST_CAUSES and not (selected and bank.left < EXPLAINED * bank.rows):
        ranked = [each for each in bank.ranked() if each.family.cause.defect != Defect.LOAD_CHANGE]
        if not ranked or ranked[0].score < ENOUGH:
            break
        if selected and bank.left - ranked[0].left < LATER_SHARE * first:
            break
        near = [each.family.cause for each in ranked[1:] if each.score > ranked[0].score - CLOSE]
        family = _refined(bank, ranked[0].family)
        choice = bank.choose(family)
        if choice.sigmas < SIGMAS:
            break
        if all(family.cause != other.family.cause for other in selected):  # else it is what is left of its shape
            selected.append(choice)
            alternatives.append(tuple(dict.fromkeys(cause for cause in near if cause != family.cause)))
    return selected, alternatives


def _refined(bank: Bank, family: Family) -> Family:
    """The frequency and damping of an oscillation between those of the grid."""
    if family.cause.defect != Defect.NOT_RIGID:
        return family
    theta, span = bank.theta(), 0.08
    for damping in (0.005, 0.01, 0.02, 0.05):
        for hz in family.detail * np.linspace(1.0 - span, 1.0 + span, 5):
            other = causes.oscillator(bank.dynamics, theta, float(hz), damping)
            if bank.score(other) > bank.score(family):
                family = other
        span *= 0.5
    return family
