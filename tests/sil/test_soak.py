"""Hours of simulated motion through the estimator: `hexload soak`, here for a minute and a half."""

import subprocess
import sys

import pytest

from hexload_dev.soak import FAULTS, faults

CLEAN = {"nees": 9.0, "smallest_pivot": 0.2} | dict.fromkeys(FAULTS, 0)


def soak(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "hexload_dev", "soak", *arguments], capture_output=True, text=True)


def test_steady_work_is_without_a_fault():
    # GIVEN 90 s of work motion WHEN they are soaked THEN nothing is found, at every tenth of the time that is judged
    finished = soak("work", "--hours", "0.025")
    assert finished.returncode == 0, finished.stdout + finished.stderr
    assert finished.stdout.splitlines()[-1] == "verdict: nothing found"
    assert finished.stdout.count("[hexload]") == 4


def test_a_load_that_changes_is_found():
    # GIVEN a scenario whose load does change, as if none had been expected WHEN it is soaked THEN that is a fault
    finished = soak("load_change", "--hours", "0.018")
    assert finished.returncode == 1, finished.stderr
    assert "load changes that were none" in finished.stdout.splitlines()[-1]


def test_a_time_in_which_nothing_is_judged_is_refused():
    finished = soak("work", "--hours", "0.01")
    assert finished.returncode == 2
    assert "hours" in finished.stderr


@pytest.mark.parametrize(
    ("report", "words"),
    [
        *(({name: 2}, f"2 {words}") for name, words in FAULTS.items()),
        ({"smallest_pivot": -1e-9}, "a covariance with the pivot -1e-09"),
        ({"smallest_pivot": float("nan")}, "a covariance with the pivot nan"),
        ({"nees": 54.0}, "NEES 54.0"),
        ({"nees": float("nan")}, "NEES nan"),
    ],
)
def test_each_fault_is_said(report, words):
    assert faults(CLEAN) == []
    (said,) = faults(CLEAN | report)
    assert words in said
