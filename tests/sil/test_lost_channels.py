"""A log of another plant, of which single channels or whole rows are missing, through the firmware."""

import json

import numpy as np
import pytest

import hexload
from hexload import project

DATA = project.ROOT / "tests" / "data"
LEG = 2
MOST_SIGMAS = 4.5  # of the largest of ten errors: 7e-5 of normal ones are beyond


@pytest.fixture(scope="module")
def log():
    return hexload.read_log(DATA / "multisine_eccentric.csv.gz")


@pytest.fixture(scope="module")
def theta():
    return np.array(json.loads((DATA / "multisine_eccentric.truth.json").read_text())["segments"][-1]["theta"])


def replayed(log, displacement_m, force_n):
    return hexload.replay(log.t_s, displacement_m, log.velocity_m_s, force_n, DATA / "unknown_load.toml")


@pytest.mark.parametrize("from_s", [0.0, 3.0])
def test_without_one_force_the_load_is_found_with_larger_sigmas(log, theta, from_s):
    # GIVEN a log without the force of one leg from some time on WHEN it is replayed
    force_n = log.force_n.copy()
    force_n[log.t_s >= from_s, LEG] = np.nan
    whole = replayed(log, log.displacement_m, log.force_n)
    load = replayed(log, log.displacement_m, force_n)
    # THEN it is right within its sigmas, which are larger, and the missing channel is reported
    assert load.verdict[-1] == "converged"
    assert np.abs((load.value[-1] - theta) / load.sigma[-1]).max() < MOST_SIGMAS
    assert (load.sigma[-1] > whole.sigma[-1]).all()
    assert load.health_counts["channel lost"] == (log.t_s >= from_s).sum()
    assert load.load_changes_s == []


def test_without_one_displacement_for_two_seconds_the_load_is_found(log, theta):
    displacement_m = log.displacement_m.copy()
    lost = (log.t_s >= 4.0) & (log.t_s < 6.0)
    displacement_m[lost, LEG] = np.nan
    load = replayed(log, displacement_m, log.force_n)
    assert load.verdict[-1] == "converged"
    assert np.abs((load.value[-1] - theta) / load.sigma[-1]).max() < MOST_SIGMAS
    assert load.health_counts["channel lost"] == lost.sum()
    assert load.refused == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_with_a_fifth_of_the_rows_lost_at_random_the_load_is_found(seed):
    # GIVEN slow work motion of which every fifth row is lost at random WHEN the rest is replayed
    log = hexload.read_log(DATA / "work_motion.csv.gz")
    truth = np.array(json.loads((DATA / "work_motion.truth.json").read_text())["segments"][-1]["theta"])
    rows = np.random.default_rng(seed).uniform(size=len(log.t_s)) >= 0.2
    channels = (log.displacement_m[rows], log.velocity_m_s[rows], log.force_n[rows])
    load = hexload.replay(log.t_s[rows], *channels, DATA / "unknown_load.toml")
    # THEN it is as right as the filter itself says, and what is lost is reported
    assert np.abs((load.value[-1] - truth) / load.own_sigma[-1]).max() < MOST_SIGMAS
    assert load.verdict[-1] == "converged"
    assert load.health_counts["sample missing"] > 0.1 * len(log.t_s)


def test_two_missing_forces_are_a_missing_sample(log):
    # GIVEN a log without two forces in three rows WHEN it is replayed
    force_n = log.force_n.copy()
    force_n[5000:5003, :2] = np.nan
    load = replayed(log, log.displacement_m, force_n)
    # THEN these samples are refused, and the next one says that some are missing
    assert load.refused == 3
    assert load.health_counts["sample missing"] == 1
    assert load.verdict[-1] == "converged"


def test_the_papers_estimator_needs_every_channel():
    # GIVEN a log without one force in ten rows WHEN the paper's estimator has it THEN it refuses these
    log = hexload.read_log(DATA / "paper_noisy.csv.gz")
    force_n = log.force_n.copy()
    force_n[5000:5010, LEG] = np.nan
    load = hexload.replay(
        log.t_s, log.displacement_m, log.velocity_m_s, force_n, DATA / "paper_load.toml", kind="paper"
    )
    assert load.refused == 10
