"""The rivals in a campaign: exact where there is no noise, and each good for what it is made for."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hexload import project
from hexload.campaign import baselines, verb
from hexload.campaign.cases import Case
from hexload.campaign.one_case import run_case, scale_of
from hexload.io.log_file import read_log
from hexload.theory import bound
from hexload.theory.leg_regression import motion_of_legs

THETA = np.array([500.0, 30.0, -40.0, 150.0, 70.0, 80.0, 30.0, 1.0, -2.0, 0.5])
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
NOMINAL_FORCE_SIGMA_N = 5.0
WIDE_PRIOR = np.full(10, 1e3)
SCENARIO = f"""\
name = "noise_free"
platform = "{PLATFORM}"

[simulation]
duration_s = 3.0
seed = 5

[[load]]
at_s = 0.0
mass_kg = 400.0
com_m = [0.06, -0.04, 0.30]
inertia_com_kg_m2 = [25.0, 30.0, 20.0, 1.0, -2.0, 0.5]

[trajectory]
kind = "multisine"

[sensors]
noise_scale = 0.0
"""


@pytest.fixture(scope="module")
def regressors():
    return np.random.default_rng(1).normal(size=(4000, 6, 10)) * np.geomspace(10.0, 0.1, 10)


@pytest.fixture(scope="module")
def noise_free(tmp_path_factory):
    """A run of the simulator, whose dynamics share nothing with the regression's."""
    folder = tmp_path_factory.mktemp("noise_free")
    (folder / "scenario.toml").write_text(SCENARIO)
    simulator = Path(os.environ["HEXLOAD_BUILD_DIR"]) / "host_sim" / "hexload_sim"
    subprocess.run([simulator, folder / "scenario.toml", "--out", folder / "run", "--quiet"], check=True)
    return folder / "run"


def test_every_method_solves_equations_without_noise(regressors):
    # GIVEN b = A theta exactly
    rows, values = regressors.reshape(-1, 10), regressors @ THETA
    # WHEN solved THEN theta is found to rounding: 24,000 equations whose columns differ by 100 in size
    for answer in (
        baselines.least_squares(rows, values.ravel()),
        baselines.total_least_squares(rows, values.ravel()),
        baselines.instrumental_variables(rows, values.ravel(), rows + 1.0),
    ):
        assert answer.theta == pytest.approx(THETA, rel=1e-9, abs=1e-9)
    # and by the recursive one to what a prior of 1000 beside a sigma of 1e-3 leaves, less than (1e-3 / 1e3)^2 of theta
    recursive = baselines.recursive_least_squares(regressors, values, WIDE_PRIOR, 1e-3)
    assert recursive.theta == pytest.approx(THETA, rel=1e-9, abs=1e-9)
    assert recursive.history[-1] == pytest.approx(recursive.theta)


def test_the_recursive_method_is_least_squares_when_it_knew_nothing(regressors):
    # GIVEN noise in b alone
    values = regressors @ THETA + np.random.default_rng(2).normal(size=(4000, 6))
    # WHEN solved at once and tick by tick THEN both agree to the weight of the prior, and so do their covariances
    once = baselines.least_squares(regressors.reshape(-1, 10), values.ravel())
    recursive = baselines.recursive_least_squares(regressors, values, WIDE_PRIOR, 1.0)
    assert recursive.theta == pytest.approx(once.theta, abs=1e-3 * np.sqrt(recursive.covariance.diagonal().min()))
    # the variance of the residual of 24,000 equations is known to sqrt(2 / 24000) = 0.9 %
    assert recursive.covariance.diagonal() == pytest.approx(once.covariance.diagonal(), rel=0.04)


def test_noise_in_the_regressors_biases_least_squares_but_not_instruments():
    # GIVEN one column with as much noise as signal, and an instrument with noise of its own
    random = np.random.default_rng(3)
    true = random.normal(size=(20_000, 1))
    seen, instrument = (true + random.normal(size=true.shape) for _ in range(2))
    values = 2.0 * true[:, 0]
    # WHEN solved THEN least squares finds half of it and the instrument all, each to 5 of its sigmas of 1 % and 2 %
    assert baselines.least_squares(seen, values).theta[0] == pytest.approx(1.0, abs=0.05)
    assert baselines.instrumental_variables(seen, values, instrument).theta[0] == pytest.approx(2.0, abs=0.1)
    # and total least squares finds all when b has as much noise, relative to its size
    noisy = values + 2.0 * random.normal(size=values.shape)
    assert baselines.total_least_squares(seen, noisy).theta[0] == pytest.approx(2.0, abs=0.1)


def test_legs_give_the_motion_that_the_simulator_had(noise_free):
    # GIVEN the legs of a run without noise, in float32: 3e-8 m, 6e-8 of the speed
    log, truth = read_log(noise_free / "log.csv"), bound.read_truth(noise_free / "truth.csv")
    # WHEN the motion is found THEN it is the simulator's, to that rounding times the inverse Jacobian, of order 5
    motion = motion_of_legs(bound.read_platform(PLATFORM), log.displacement_m, log.velocity_m_s)
    assert np.abs(motion.p_m - truth.p_m).max() < 1e-6
    assert np.abs(motion.rotation - truth.rotation).max() < 1e-6
    assert np.abs(motion.velocity_m_s - truth.velocity_m_s).max() < 1e-5
    assert np.abs(motion.angular_velocity_rad_s - truth.angular_velocity_rad_s).max() < 1e-5


def test_every_method_finds_the_load_of_a_run_without_noise(noise_free):
    # GIVEN a run without noise
    log, platform = read_log(noise_free / "log.csv"), bound.read_platform(PLATFORM)
    theta = np.array(json.loads((noise_free / "meta.json").read_text())["loads"][-1]["theta"])
    # WHEN the ten parameters are identified
    answers = baselines.baselines(log, platform, WIDE_PRIOR, NOMINAL_FORCE_SIGMA_N)
    # THEN they are off by no more than differences over 2 ms are at twice the motion's highest frequency, 2.5 Hz:
    # (2 pi 5 Hz 1 ms)^2 / 6 = 1.6e-4
    for name, answer in answers.items():
        assert np.abs((answer.theta - theta) / scale_of(theta)).max() < 1.6e-4, name


def test_the_shortest_run_at_the_longest_tick_has_an_answer_of_every_method():
    # GIVEN the shortest run that a campaign takes, in rows of the longest tick WHEN a tenth of a second is left out at
    # both of its ends
    result = run_case(Case("multisine", 1, verb.DURATION_S[0], verb.TICK_S[1]), None)
    # THEN the methods that smooth weigh the load to 2 kg, of 100 kg at least
    for name in ("ls_zero_phase", "rls", "tls", "iv"):
        assert abs(result["estimators"][name]["error"][0]) < 2.0, name
