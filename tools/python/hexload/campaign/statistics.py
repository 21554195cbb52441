"""What the cases of a class say together: errors against truth and bound, consistency, times, alarms.

For a consistent filter NEES is chi-square with as many degrees of freedom as parameters, so the mean over runs has a
band (Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, Wiley 2001, section 5.4).
The squared ratio of RMSE and bound, for an efficient one, is chi-square of as many degrees as runs, over their number.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hexload.campaign.cases import Case
from hexload.campaign.one_case import FAILURE, scale_of
from hexload.theory.bound import EFFECTS, LEGS, THETA_NAMES
from hexload.theory.nis import BAND

Array = NDArray[np.float64]

PARAMETERS = len(THETA_NAMES)
FAILURE_NEES = 100.0
DOUBTS = {"inconsistent", "input implausible"}  # health that sensors in order never have
ALARM_DUE_S = 0.5  # an alarm within this time after a change detects it; any other is false
TIMES = ("within_5", "within_1", "mass_and_moments_within_2")


@dataclass(frozen=True)
class Times:
    """When the runs settled, s after the load appeared; infinite where that quantile of them never did."""

    median: float
    p95: float
    never: int


@dataclass(frozen=True)
class EstimatorStatistics:
    runs: int
    bias: Array  # (10,), SI
    bias_sigmas: Array  # (10,), in standard errors of that mean
    rmse: Array  # (10,), SI
    rmse_percent: Array | None  # (10,) of the scale; None: an empty platform has none
    largest_percent: Array | None  # (10,) largest error of all runs, of the scale
    ratio: Array  # (10,) RMSE / bound
    nees_mean: float | None  # ideal 10
    nees_in_band: float | None  # share of the runs, ideal 0.95
    failures: int | None  # runs with NEES > FAILURE_NEES, or below 0: then the covariance is none
    nis_mean: float | None
    times: dict[str, Times]  # of estimators that go along with the time

    @property
    def ratio_mean(self) -> float:
        return float(self.ratio.mean())

    @property
    def ratio_worst(self) -> float:
        return float(self.ratio.max())

    @property
    def worst_name(self) -> str:
        return THETA_NAMES[int(self.ratio.argmax())]


@dataclass(frozen=True)
class Alarms:
    changes: int
    missed: int
    delays_s: Array  # of those detected
    false: int
    runs_with_false: int


@dataclass(frozen=True)
class EffectStatistics:
    """Of the machine's own effects, over runs and legs."""

    rmse: dict[str, float]  # of bound.EFFECTS, in their units
    ratio: dict[str, float]  # RMSE / bound
    nees_mean: float  # of load and machine together
    nees_ideal: int


@dataclass(frozen=True)
class RigStatistics:
    """Over runs: median and 95 % point of the errors, and how many of the parameters are within their sigmas."""

    mass_percent: tuple[float, float]
    centre_mm: tuple[float, float]
    inertia_percent: tuple[float, float]  # of the tensor about the centre of mass, of its mean moment
    within_3_sigmas: float  # share of the parameters of all runs
    largest_sigmas: float


@dataclass(frozen=True)
class FailedCase:
    """A case that has no numbers, as a log of it was refused."""

    name: str
    reason: str


@dataclass(frozen=True)
class ClassStatistics:
    """All but the failed cases is of those that have numbers; there must be one."""

    name: str
    runs: int
    failed: tuple[FailedCase, ...]  # not among the runs
    controller: str  # name of the controller's estimator among the others
    estimators: dict[str, EstimatorStatistics]
    effects: EffectStatistics | None  # None: the class has none
    rig: RigStatistics | None  # None: the class is not one of rigs
    alarms: Alarms
    verdicts: dict[str, int]  # of the controller at the end
    doubted: int  # runs in which sensors that are in order were contradicted at any tick: one of DOUBTS
    nees_mean_band: tuple[float, float]  # of a consistent estimator in as many runs
    ratio_band: tuple[float, float]  # of RMSE / bound of an efficient one

    @property
    def own(self) -> EstimatorStatistics:
        return self.estimators[self.controller]


def failed_cases(results: Sequence[dict]) -> tuple[FailedCase, ...]:
    failed = [result for result in results if FAILURE in result]
    return tuple(FailedCase(Case(**result["case"]).name, result[FAILURE]) for result in failed)


def summarise(name: str, results: Sequence[dict]) -> ClassStatistics:
    """Of the results of a class, of which one must have numbers."""
    failed = failed_cases(results)
    results = [result for result in results if FAILURE not in result]
    estimators = {
        estimator: _estimator(
            [result["estimators"][estimator] for result in results],
            [result["bound"] for result in results],
            [scale_of(np.array(result["theta"])) for result in results],
        )
        for estimator in results[0]["estimators"]
    }
    verdicts = [result["verdict"] for result in results]
    return ClassStatistics(
        name=name,
        runs=len(results),
        failed=failed,
        controller=results[0]["controller"],
        estimators=estimators,
        effects=None if results[0]["effects"] is None else _effects([result["effects"] for result in results]),
        rig=None if results[0]["rig"] is None else _rig([result["rig"] for result in results]),
        alarms=alarms([(result["changes_s"], result["alarms_s"]) for result in results]),
        verdicts={verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))},
        doubted=sum(not DOUBTS.isdisjoint(result["health"]) for result in results),
        nees_mean_band=nees_mean_band(len(results)),
        ratio_band=ratio_band(len(results)),
    )


def _estimator(scores: Sequence[dict], bounds: Sequence[list], scales: Sequence[Array | None]) -> EstimatorStatistics:
    error = np.array([score["error"] for score in scores])
    has_scale = all(scale is not None for scale in scales)
    nees = None if scores[0]["nees"] is None else np.array([score["nees"] for score in scores])
    low, high = chi2.ppf(BAND, PARAMETERS)
    return EstimatorStatistics(
        runs=len(scores),
        bias=error.mean(axis=0),
        bias_sigmas=standard_errors(error),
        rmse=root_mean_square(error),
        rmse_percent=100.0 * root_mean_square(error / np.array(scales)) if has_scale else None,
        largest_percent=100.0 * np.abs(error / np.array(scales)).max(axis=0) if has_scale else None,
        ratio=root_mean_square(error / np.array(bounds)),
        nees_mean=None if nees is None else float(nees.mean()),
        nees_in_band=None if nees is None else float(np.mean((nees >= low) & (nees <= high))),
        failures=None if nees is None else int(np.sum(~((nees >= 0.0) & (nees <= FAILURE_NEES)))),
        nis_mean=None if scores[0]["nis"] is None else float(np.mean([score["nis"] for score in scores])),
        times={name: settling([score[name] for score in scores]) for name in TIMES if name in scores[0]},
    )


def _effects(scores: Sequence[dict]) -> EffectStatistics:
    error = np.array([score["error"] for score in scores]).reshape(-1, len(EFFECTS), LEGS)
    ratio = error / np.array([score["bound"] for score in scores]).reshape(error.shape)
    return EffectStatistics(
        rmse={name: float(np.sqrt(np.mean(error[:, k] ** 2))) for k, name in enumerate(EFFECTS)},
        ratio={name: float(np.sqrt(np.mean(ratio[:, k] ** 2))) for k, name in enumerate(EFFECTS)},
        nees_mean=float(np.mean([score["nees"] for score in scores])),
        nees_ideal=PARAMETERS + len(EFFECTS) * LEGS,
    )


def _rig(scores: Sequence[dict]) -> RigStatistics:
    def spread(name: str) -> tuple[float, float]:
        median, p95 = np.quantile([score[name] for score in scores], (0.5, 0.95))
        return float(median), float(p95)

    sigmas = np.array([score["sigmas"] for score in scores])
    return RigStatistics(
        mass_percent=spread("mass_percent"),
        centre_mm=spread("centre_mm"),
        inertia_percent=spread("inertia_percent"),
        within_3_sigmas=float(np.mean(sigmas <= 3.0)),
        largest_sigmas=float(sigmas.max()),
    )


def root_mean_square(error: Array) -> Array:
    return np.sqrt(np.mean(error**2, axis=0))


def standard_errors(error: Array) -> Array:
    """The mean of each column in standard errors of that mean; 0 for a single run or a column of zeros."""
    runs = len(error)
    if runs < 2:
        return np.zeros(error.shape[1])
    spread = error.std(axis=0, ddof=1) / np.sqrt(runs)
    return np.divide(error.mean(axis=0), spread, out=np.zeros_like(spread), where=spread > 0)


def nees_mean_band(runs: int) -> tuple[float, float]:
    low, high = chi2.ppf(BAND, PARAMETERS * runs) / runs
    return float(low), float(high)


def ratio_band(runs: int) -> tuple[float, float]:
    low, high = np.sqrt(chi2.ppf(BAND, runs) / runs)
    return float(low), float(high)


def settling(times_s: Sequence[float | None]) -> Times:
    """Quantiles are times of runs, the first by which that share has settled; never is later than all."""
    values = np.sort([np.inf if time is None else time for time in times_s])
    median, p95 = (float(values[int(np.ceil(share * len(values))) - 1]) for share in (0.5, 0.95))
    return Times(median, p95, int(np.isinf(values).sum()))


def alarms(runs: Sequence[tuple[Sequence[float], Sequence[float]]]) -> Alarms:
    """Of pairs (times of changes, times of alarms): the first alarm in time detects a change, all others are false."""
    delays, changes, false, runs_with_false = [], 0, 0, 0
    for changes_s, alarms_s in runs:
        detected = []
        for change_s in changes_s:
            due = [alarm for alarm in alarms_s if -1e-9 <= alarm - change_s <= ALARM_DUE_S]
            detected += due[:1]
            delays += [alarm - change_s for alarm in due[:1]]
        changes += len(changes_s)
        others = len(alarms_s) - len(detected)
        false += others
        runs_with_false += others > 0
    return Alarms(changes, changes - len(delays), np.array(delays), false, runs_with_false)
