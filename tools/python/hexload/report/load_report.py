"""What the page says of an estimate of all ten parameters: of a run, whose truth is known, or of a replayed log.

Of a run too, the firmware's own C goes over its log again: verdicts with their reasons and the load as a body come from
the whole covariance, which no bus carries.
"""

import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.diagnose import Diagnosis
from hexload.errors import InputError
from hexload.estimation import load_summary
from hexload.estimation.firmware_run import load_platform, native_firmware, run_firmware
from hexload.estimation.input_check import mend_of
from hexload.estimation.load_summary import EFFECT_UNITS, EFFECT_WORDS, BodyNumber, Parameter
from hexload.io.log_file import LegLog
from hexload.io.run_directory import Run
from hexload.report import figures
from hexload.theory import nis
from hexload.theory.bound import EFFECTS, LEGS, THETA_NAMES, scale_of

Array = NDArray[np.float64]

TEN = len(THETA_NAMES)


@dataclass(frozen=True)
class ParameterRow:
    estimate: Parameter
    truth: float | None
    error_percent: float | None  # of the parameter's scale; None: no truth, or the empty platform, which has no scale

    @property
    def error_sigmas(self) -> float | None:
        if self.truth is None or self.estimate.sigma == 0.0:
            return None
        return (self.estimate.value - self.truth) / self.estimate.sigma


@dataclass(frozen=True)
class EffectRow:
    """One of the machine's effects, leg by leg; of the base's tilt x and y."""

    name: str
    legs: list[Parameter]
    truth: list[float] | None


@dataclass(frozen=True)
class LoadEstimate:
    parameters: list[ParameterRow]
    effects: list[EffectRow]
    body: list[BodyNumber]  # none of the paper's filter, which finds no whole body
    true_body: list[float] | None
    is_consistent: bool
    consistent: str  # whether a body can have the estimate, in words
    known_mass_kg: float | None  # what the filter was given
    is_of_paper: bool
    given_wrong: list[dict]  # of the run's loads in meta.json, those that weigh something else
    changes_s: list[float]  # when it has detected another load
    verdict: str
    mend: str  # what to do about a verdict that the machine causes; empty when it does not
    diagnosis: Diagnosis | None  # of a replayed log
    nis: nis.NisSummary
    health_ticks: dict[str, int]
    samples: int
    duration_s: float
    refused: int

    @property
    def reasons(self) -> list[tuple[str, str]]:
        return load_summary.reasons([row.estimate for row in self.parameters])

    @property
    def worst(self) -> ParameterRow | None:
        judged = [row for row in self.parameters if row.error_percent is not None]
        return max(judged, key=lambda row: row.error_percent, default=None)

    @property
    def inside_three_sigma(self) -> int:
        return sum(row.error_sigmas is not None and abs(row.error_sigmas) <= 3.0 for row in self.parameters)


def of_run(run: Run) -> tuple[LoadEstimate, dict]:
    """And its figures. Raises InputError."""
    native = native_firmware()
    platform = load_platform(native, run.directory / "platform.toml")
    estimator = run.meta["estimator"]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "estimates.csv"
        try:
            result = run_firmware(native, platform, run.log, out, estimator["kind"], estimator["prior"])
        except ValueError as error:
            raise InputError(f"{run.directory}: {error}") from None
    estimate = _estimate(result, run.platform.get("load", {}).get("known_mass_kg"), run)
    return estimate, _figures(estimate, result, run.log, run.theta(result["t"]))


def of_replay(result: dict, log: LegLog, known_mass_kg: float | None) -> tuple[LoadEstimate, dict]:
    """And its figures. `result`: what hexload_native.replay returns of the log."""
    estimate = _estimate(result, known_mass_kg, None)
    return estimate, _figures(estimate, result, log, None)


def _estimate(result: dict, known_mass_kg: float | None, run: Run | None) -> LoadEstimate:
    numbers = load_summary.parameters(result)
    diagnosis = result.get("diagnosis")
    load = None if run is None else run.final_load
    body, is_of_paper = result.get("body"), "body" not in result
    measurements = nis.PAPER_MEASUREMENTS if is_of_paper else nis.LOAD_MEASUREMENTS
    return LoadEstimate(
        parameters=_parameter_rows(numbers[:TEN], None if load is None else np.array(load["theta"])),
        effects=_effect_rows(numbers[TEN:], run),
        body=[] if body is None else load_summary.body_numbers(body),
        true_body=None if load is None else [load["mass_kg"], *load["com_m"], *load["inertia_com_kg_m2"]],
        is_consistent=body is None or body["is_consistent"],
        consistent="" if body is None else load_summary.consistent_in_words(body),
        known_mass_kg=known_mass_kg,
        is_of_paper=is_of_paper,
        given_wrong=[] if run is None or known_mass_kg is None else _given_wrong(run, known_mass_kg),
        changes_s=load_summary.load_changes_s(result),
        verdict=result["verdict"][-1],
        mend=mend_of(result),
        diagnosis=diagnosis,
        nis=nis.summarise(result["t"], result["nis"], measurements),
        health_ticks=result["health_counts"],
        samples=len(result["t"]),
        duration_s=float(result["t"][-1] - result["t"][0]),
        refused=result["refused"],
    )


def _given_wrong(run: Run, known_mass_kg: float) -> list[dict]:
    loads = run.meta["loads"]
    return [load for load in loads if load["mass_kg"] != known_mass_kg and load["at_s"] <= run.meta["duration_s"]]


def _parameter_rows(numbers: list[Parameter], theta: Array | None) -> list[ParameterRow]:
    if theta is None:
        return [ParameterRow(number, None, None) for number in numbers]
    scale = scale_of(theta)
    errors = np.abs([number.value for number in numbers] - theta)
    percent = [None] * TEN if scale is None else (100.0 * errors / scale).tolist()
    return [ParameterRow(*row) for row in zip(numbers, theta.tolist(), percent, strict=True)]


def _effect_rows(numbers: list[Parameter], run: Run | None) -> list[EffectRow]:
    if not numbers:
        return []
    truth = dict.fromkeys(EFFECTS) if run is None else _true_effects(tomllib.loads(run.scenario_toml))
    rows = [
        EffectRow(f"{EFFECT_WORDS[name]}, {EFFECT_UNITS[name]}", numbers[LEGS * k : LEGS * (k + 1)], truth[name])
        for k, name in enumerate(EFFECTS)
    ]
    tilt = numbers[LEGS * len(EFFECTS) :]
    if any(number.sigma > 0.0 for number in tilt):
        rows.append(EffectRow(f"tilt: gravity's x, y, {EFFECT_UNITS['g']}", tilt, None))
    return rows


def _true_effects(scenario: dict) -> dict[str, list[float]]:
    """Of a scenario with every default filled in."""
    hydraulics = scenario["hydraulics"]
    return {
        "bias": scenario["sensors"]["force_bias_n"],
        "coulomb": np.broadcast_to(hydraulics["coulomb_friction_n"], LEGS).tolist(),  # one number for all, or six
        "viscous": np.broadcast_to(hydraulics["viscous_friction_n_s_m"], LEGS).tolist(),
    }


def _figures(estimate: LoadEstimate, result: dict, log: LegLog, truth: Array | None) -> dict:
    t_s, marks = result["t"], figures.marks_of(estimate.changes_s)
    value, sigma = result["value"][:, :TEN], result["sigma"][:, :TEN]
    if estimate.is_of_paper:
        drawn = figures.paper_estimates(t_s, value, sigma)
    else:
        drawn = figures.load_estimates(t_s, value, sigma, truth, estimate.changes_s, marks)
    return {
        "estimates": drawn,
        "nis": figures.innovation(t_s, result["nis"], estimate.nis, marks),
        "legs": figures.leg_signals(log, marks),
    }
