"""The paper's Table 3 beside a run: truth, paper, estimate, sigma, and the bound that no estimator can beat."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.load_summary import DIGITS
from hexload.io.run_directory import PAPER_PARAMETERS, Run
from hexload.theory.bound import paper_bound

PAPER_DIGITS = DIGITS | {"dz": 4}
PERCENT_DIGITS = {"dz": 3, "Ixx": 2, "Iyy": 2, "Izz": 2}

# Table 2 (mass from Table 1) and Table 3 of the paper: true value; identified value, relative error (37) in percent.
PAPER_LOAD_MASS_KG = 500.0
PAPER_TRUTH = {"dz": 0.3, "Ixx": 25.0, "Iyy": 25.0, "Izz": 25.0}
PAPER_IDENTIFIED = {"dz": (0.2978, 0.73), "Ixx": (25.94, 3.76), "Iyy": (24.75, 1.00), "Izz": (28.20, 12.80)}

CONVERGED_WITHIN = 0.05


@dataclass(frozen=True)
class Row:
    """One parameter at the end of a run, in SI units."""

    name: str
    truth: float
    paper: tuple[float, float] | None  # identified value and relative error in %; None: another load than the paper's
    estimate: float
    sigma: float
    bound: float | None  # posterior Cramer-Rao bound on sigma; None: not defined for this run
    converged_at_s: float | None  # from then on within CONVERGED_WITHIN of the truth

    @property
    def error_percent(self) -> float:
        """Magnitude of the relative error, (37); nan where the truth is 0, as with an empty platform."""
        return abs(self.estimate - self.truth) / abs(self.truth) * 100.0 if self.truth else float("nan")

    @property
    def error_sigmas(self) -> float:
        return (self.estimate - self.truth) / self.sigma


def compare(run: Run) -> list[Row]:
    t_s = run.estimates["t"]
    truth = run.load_parameters(t_s)
    bound = _bound(run)
    paper = PAPER_IDENTIFIED if has_paper_load(run) else {}
    return [
        Row(
            name=name,
            truth=truth[name][-1],
            paper=paper.get(name),
            estimate=run.estimates[name][-1],
            sigma=run.estimates[f"s_{name}"][-1],
            bound=bound.get(name),
            converged_at_s=_converged_at_s(t_s, run.estimates[name], truth[name]),
        )
        for name in PAPER_PARAMETERS
    ]


def has_paper_load(run: Run) -> bool:
    end = run.estimates["t"][-1:]
    values = {name: value[0] for name, value in run.load_parameters(end).items()}
    return run.final_load["mass_kg"] == PAPER_LOAD_MASS_KG and values == PAPER_TRUTH


def _bound(run: Run) -> dict[str, float]:
    sensors = run.meta["sensors"]
    noisy = sensors["velocity_sigma_m_s"] > 0 and sensors["force_sigma_n"] > 0
    return paper_bound(run.directory) if noisy and run.final_load["mass_kg"] > 0 else {}


def _converged_at_s(
    t_s: NDArray[np.float64], estimate: NDArray[np.float64], truth: NDArray[np.float64]
) -> float | None:
    outside = np.flatnonzero(~(np.abs(estimate - truth) <= CONVERGED_WITHIN * np.abs(truth)))
    first_inside = outside[-1] + 1 if outside.size else 0
    return float(t_s[first_inside]) if first_inside < len(t_s) else None
