"""A run and its replay are the same firmware on the same values: their estimates agree to the byte."""

import pytest

from forked_command import hexload
from hexload.estimation import load_summary
from hexload.io.run_directory import read_run
from hexload.report import table3
from hexload.report.page import write_report

DURATION_S = "1.5"


@pytest.fixture(scope="module", params=["safe", "printed"])
def run_directory(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / request.param
    result = hexload("sim", "paper", "--duration", DURATION_S, "--seed", 3, "--prior", request.param, "--out", out)
    assert result.returncode == 0, result.stderr
    return out


def test_replay_of_a_runs_log_gives_the_runs_estimates_byte_for_byte(run_directory, tmp_path):
    # GIVEN the log that the simulator wrote, with the sensor values that the estimator saw
    prior = run_directory.name
    # WHEN the log is replayed with the run's platform file and start covariance
    out = tmp_path / "estimates.csv"
    result = hexload(
        "replay",
        run_directory / "log.csv",
        "--platform",
        run_directory / "platform.toml",
        "--prior",
        prior,
        "--out",
        out,
    )
    # THEN every byte of the estimates is the same
    assert result.returncode == 0, result.stderr
    assert out.read_bytes() == (run_directory / "estimates.csv").read_bytes()


def test_the_same_seed_gives_the_same_bytes_in_every_file(run_directory, tmp_path):
    # GIVEN the same scenario, seed and options
    again = tmp_path / "again"
    result = hexload(
        "sim", "paper", "--duration", DURATION_S, "--seed", 3, "--prior", run_directory.name, "--out", again
    )
    assert result.returncode == 0, result.stderr
    # THEN both run directories hold the same
    names = sorted(path.name for path in run_directory.iterdir())
    assert sorted(path.name for path in again.iterdir()) == names
    for name in names:
        assert (again / name).read_bytes() == (run_directory / name).read_bytes(), name


def test_another_seed_gives_another_log(run_directory, tmp_path):
    other = tmp_path / "other"
    assert hexload("sim", "paper", "--duration", DURATION_S, "--seed", 4, "--out", other).returncode == 0
    assert (other / "log.csv").read_bytes() != (run_directory / "log.csv").read_bytes()


def test_the_report_of_a_real_run_has_its_numbers(run_directory, tmp_path):
    # GIVEN a run of the simulator
    run = read_run(run_directory)
    # WHEN its report is written
    write_report([run_directory], tmp_path / "page.html")
    # THEN the table has the last line of the run's estimates, and a bound on each parameter
    page = (tmp_path / "page.html").read_text()
    for row in table3.compare(run):
        assert f"{row.estimate:.{load_summary.DIGITS[row.name]}f}" in page
        assert row.bound is not None and row.bound > 0
