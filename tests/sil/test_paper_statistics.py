"""The paper's scenario over 24 seeds of sensor noise: convergence, rms errors, consistency, distance from the bound."""

import csv
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from hexload.theory.bound import paper_bound

SIMULATOR = Path(os.environ["HEXLOAD_BUILD_DIR"]) / "host_sim" / "hexload_sim"
SCENARIO = Path(os.environ["HEXLOAD_SOURCE_DIR"]) / "host_sim" / "scenarios" / "paper.toml"
SEEDS = range(101, 125)
DURATION_S = 10.0
PARAMETERS = ("dz", "Ixx", "Iyy", "Izz")
TRUTH = np.array([0.3, 25.0, 25.0, 25.0])  # Table 2: m; kg m^2 about the load's own centre of mass
LIMIT_PERCENT = np.array([0.1, 12.0, 35.0, 4.0])


@dataclass(frozen=True)
class Final:
    value: np.ndarray
    sigma: np.ndarray
    verdict: str
    nis_mean: float  # after the first second


@dataclass(frozen=True)
class Campaign:
    runs: list[Final]
    bound: np.ndarray  # of the one trajectory that all seeds share: the servo reads noise-free sensors

    @property
    def errors(self) -> np.ndarray:
        return np.array([run.value for run in self.runs]) - TRUTH

    @property
    def sigmas(self) -> np.ndarray:
        return np.array([run.sigma for run in self.runs])

    @property
    def rms(self) -> np.ndarray:
        return np.sqrt((self.errors**2).mean(axis=0))


def simulate(directory: Path, seed: int) -> Path:
    out = directory / str(seed)
    arguments = [SCENARIO, "--seed", seed, "--duration", DURATION_S, "--out", out, "--quiet"]
    finished = subprocess.run([SIMULATOR, *map(str, arguments)], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    return out


def read_final(run_directory: Path) -> Final:
    with (run_directory / "estimates.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    last = rows[-1]
    return Final(
        value=np.array([float(last[name]) for name in PARAMETERS]),
        sigma=np.array([float(last[f"s_{name}"]) for name in PARAMETERS]),
        verdict=last["verdict"],
        nis_mean=float(np.mean([float(row["nis"]) for row in rows if float(row["t"]) >= 1.0])),
    )


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Campaign:
    directory = tmp_path_factory.mktemp("seeds")
    with ThreadPoolExecutor(max_workers=2) as pool:
        run_directories = list(pool.map(lambda seed: simulate(directory, seed), SEEDS))
    bound = paper_bound(run_directories[0])
    return Campaign([read_final(path) for path in run_directories], np.array([bound[name] for name in PARAMETERS]))


def show(record_property, name: str, values) -> None:
    record_property(name, [float(value) for value in np.ravel(values)])
    print(f"{name}:", np.array2string(np.asarray(values), precision=4, suppress_small=True))


def test_every_seed_converges(campaign, record_property):
    # GIVEN 24 runs of 10 s from an estimate of zero
    normalised = np.abs(campaign.errors / campaign.sigmas)
    show(record_property, "largest error in own sigmas", normalised.max(axis=0))
    # WHEN they end THEN each estimate is within five own sigmas: of 96 normal errors one is beyond in 20,000 campaigns.
    # A diverged run, which ends with an inertia far off and a small sigma, is tens of sigmas away
    assert normalised.max() < 5.0
    # AND every run says so itself
    assert {run.verdict for run in campaign.runs} == {"converged"}


def test_rms_errors_are_within_the_limits(campaign, record_property):
    # GIVEN the final errors WHEN taken as rms over the seeds THEN they are below 0.1 / 12 / 35 / 4 %
    rms_percent = 100 * campaign.rms / TRUTH
    show(record_property, "rms error in %", rms_percent)
    show(record_property, "mean error in %", 100 * campaign.errors.mean(axis=0) / TRUTH)
    show(record_property, "worst error in %", 100 * np.abs(campaign.errors).max(axis=0) / TRUTH)
    assert (rms_percent <= LIMIT_PERCENT).all()


def test_rms_errors_are_not_below_the_bound(campaign, record_property):
    # GIVEN the Cramer-Rao bound of the run
    ratio = campaign.rms / campaign.bound
    show(record_property, "bound in %", 100 * campaign.bound / TRUTH)
    show(record_property, "rms error / bound", ratio)
    # WHEN compared THEN no parameter is known better than possible. 24 x (rms / bound)^2 of an ideal filter is
    # chi-square with 24 degrees of freedom; below its 0.01 % point the bound or the test would be wrong
    assert (ratio**2 > chi2.ppf(1e-4, len(campaign.runs)) / len(campaign.runs)).all()


def test_sigmas_are_those_of_the_errors(campaign, record_property):
    # GIVEN the sum over the four parameters of (error / own sigma)^2, the NEES without the correlations, which the
    # output does not hold: its mean is 4 for a consistent filter with or without them
    count = len(campaign.runs)
    squares = ((campaign.errors / campaign.sigmas) ** 2).sum(axis=1)
    band = chi2.ppf([0.025, 0.975], 4 * count) / count
    show(record_property, "NEES (diagonal, 4 parameters) mean, 95 % band from .. to", [squares.mean(), *band])
    show(record_property, "own sigma / bound", campaign.sigmas.mean(axis=0) / campaign.bound)
    # WHEN averaged over the seeds THEN it is in the 99.9 % band of the mean of 24 chi-squares with 4 degrees of freedom
    low, high = chi2.ppf([0.0005, 0.9995], 4 * count) / count
    assert low < squares.mean() < high


def test_innovations_are_as_large_as_the_filter_says(campaign, record_property):
    # GIVEN three measurements a tick WHEN the NIS of 24 x 9 s is averaged
    mean = np.mean([run.nis_mean for run in campaign.runs])
    show(record_property, "NIS mean (ideal 3)", mean)
    # THEN it is 3 but for what the model leaves out: sampling of 216,000 values gives 0.005, force noise counted as
    # independent from tick to tick though the mean of two ticks is not, and forward Euler, some percent
    assert mean == pytest.approx(3.0, rel=0.1)
