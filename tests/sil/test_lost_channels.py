"""A log of another plant, of which single channels or whole rows are missing, through the firmware."""

import json

import numpy as np
import pytest

import hexload
from hexload import project

DATA = project.ROOT / "tests" / "data"
LEG = 2
HALF_WINDOW_TICKS = 6  # of a log without velocities, at 1 kHz
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


@pytest.mark.parametrize("step", [3, 4])
def test_a_row_that_is_missing_each_time_is_missing_and_no_slower_clock(log, theta, step):
    # GIVEN a log without its second row of three or four, which begins with a step of two ticks WHEN it is replayed
    rows = np.arange(len(log.t_s)) % step != 1
    channels = (log.displacement_m[rows], log.velocity_m_s[rows], log.force_n[rows])
    load = hexload.replay(log.t_s[rows], *channels, DATA / "unknown_load.toml")
    # THEN its period is that of rows that follow one another
    assert load.refused == 0 and load.health_counts["sample missing"] == pytest.approx(len(log.t_s) / step, abs=2.0)
    assert load.verdict[-1] == "converged"
    assert np.abs((load.value[-1] - theta) / load.sigma[-1]).max() < MOST_SIGMAS


def test_two_missing_forces_are_a_missing_sample(log):
    # GIVEN a log without two forces in three rows WHEN it is replayed
    force_n = log.force_n.copy()
    force_n[5000:5003, :2] = np.nan
    load = replayed(log, log.displacement_m, force_n)
    # THEN these samples are refused, and the next one says that some are missing
    assert load.refused == 3
    assert load.health_counts["sample missing"] == 1
    assert load.verdict[-1] == "converged"


@pytest.fixture(scope="module")
def papers_log():
    return hexload.read_log(DATA / "paper_noisy.csv.gz")


def by_paper(log, displacement_m, force_n):
    platform = DATA / "paper_load.toml"
    return hexload.replay(log.t_s, displacement_m, log.velocity_m_s, force_n, platform, kind="paper")


def test_the_papers_estimator_waits_for_a_missing_force(papers_log):
    # GIVEN a log without the force of one leg for two seconds WHEN the paper's estimator has it
    lost = (papers_log.t_s >= 5.0) & (papers_log.t_s < 7.0)
    force_n = papers_log.force_n.copy()
    force_n[lost, LEG] = np.nan
    whole = by_paper(papers_log, papers_log.displacement_m, papers_log.force_n)
    load = by_paper(papers_log, papers_log.displacement_m, force_n)
    # THEN nothing is refused, the missing channel is reported, and without the torque nothing is learnt
    assert load.refused == 0
    assert load.health_counts["channel lost"] == lost.sum()
    assert np.ptp(load.value[lost], axis=0).max() == 0.0
    assert (load.sigma[lost][-1] > whole.sigma[lost][-1]).all()
    # AND with it it goes on
    assert load.verdict[-1] == "converged"
    assert (np.abs(load.value[-1] - whole.value[-1]) < MOST_SIGMAS * load.sigma[-1]).all()


def test_single_missing_forces_cost_the_papers_estimator_no_restart(papers_log):
    # GIVEN a log without a force in every hundredth row WHEN the paper's estimator has it
    force_n = papers_log.force_n.copy()
    force_n[50::100, LEG] = np.nan
    load = by_paper(papers_log, papers_log.displacement_m, force_n)
    # THEN the filter goes over each gap as over that of a missing sample
    assert load.health_counts["channel lost"] == len(force_n[50::100])
    assert load.health_counts["rate reseeded"] == 0
    assert load.verdict[-1] == "converged"


def test_the_papers_estimator_goes_on_without_one_displacement(papers_log):
    displacement_m = papers_log.displacement_m.copy()
    lost = (papers_log.t_s >= 5.0) & (papers_log.t_s < 7.0)
    displacement_m[lost, LEG] = np.nan
    load = by_paper(papers_log, displacement_m, papers_log.force_n)
    assert load.refused == 0
    assert load.health_counts["channel lost"] == lost.sum()
    assert load.verdict[-1] == "converged"


def test_without_velocity_sensors_a_missing_force_is_bridged_too(log, theta):
    # GIVEN a log without velocities, and without the force of one leg for two seconds, WHEN it is replayed
    lost = (log.t_s >= 4.0) & (log.t_s < 6.0)
    force_n = log.force_n.copy()
    force_n[lost, LEG] = np.nan
    load = hexload.replay(log.t_s, log.displacement_m, None, force_n, DATA / "unknown_load.toml")
    # THEN it is right within its sigmas, AND the word stands as long as a window has one of the missing in it
    assert load.refused == 0
    assert load.verdict[-1] == "converged"
    assert np.abs((load.value[-1] - theta) / load.sigma[-1]).max() < MOST_SIGMAS
    assert load.load_changes_s == []
    assert load.health_counts["channel lost"] == lost.sum() + 2 * HALF_WINDOW_TICKS


def test_without_velocity_sensors_the_papers_estimator_waits_for_a_missing_force(papers_log):
    lost = (papers_log.t_s >= 4.0) & (papers_log.t_s < 6.0)
    force_n = papers_log.force_n.copy()
    force_n[lost, LEG] = np.nan
    platform = DATA / "paper_load.toml"
    load = hexload.replay(papers_log.t_s, papers_log.displacement_m, None, force_n, platform, kind="paper")
    assert load.refused == 0
    assert load.health_counts["channel lost"] == lost.sum() + 2 * HALF_WINDOW_TICKS
    # a guess in no window: values stand still from the first to the last tick that has one
    assert np.ptp(load.value[lost], axis=0).max() == 0.0
