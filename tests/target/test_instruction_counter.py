"""The counts on which the budgets rest: right, and the same every time."""

import hexload_native
import numpy as np
import pytest

from hexload_dev import target
from hexload_dev.hard_inputs import hard_samples
from recorded import log_of, platform_file

TICK_S = 1e-3
RUNS = 3


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    platform = hexload_native.load_platform(platform_file("paper_noisy", tmp_path_factory.mktemp("platform")))
    samples = hard_samples(hexload_native, platform, target.samples_of(log_of("paper_noisy"), 1.0))
    return hexload_native.config_bytes(platform, TICK_S), samples


@pytest.fixture(scope="module", params=target.CORTEX_M7.values())
def replayed(request, inputs, tmp_path_factory) -> list[target.Replayed]:
    """Of inputs that lead through every branch, several times."""
    folder = tmp_path_factory.mktemp("replay")
    return [target.replay(request.param, *inputs, folder) for _ in range(RUNS)]


def test_three_runs_give_the_same_counts(replayed):
    # GIVEN inputs that lead through every branch WHEN they are run three times
    runs = [run.answers for run in replayed]
    # THEN every answer is the same, instructions of every stage of every tick included
    for other in runs[1:]:
        np.testing.assert_array_equal(other, runs[0])


@pytest.mark.parametrize("profile", target.PROFILES)
@pytest.mark.parametrize("filter_name", target.FILTERS)
@pytest.mark.parametrize("preset", target.CORTEX_M7.values())
def test_two_runs_over_frames_give_the_same_counts(preset, filter_name, profile, inputs, tmp_path):
    # GIVEN the same inputs as frames WHEN they are run again THEN every count is the same
    runs = [target.run_node(preset, profile, filter_name, *inputs, tmp_path).answers for _ in range(2)]
    np.testing.assert_array_equal(*runs)


def test_a_thousand_instructions_count_as_a_thousand(replayed):
    # GIVEN a program that counts a thousand instructions without effect WHEN it runs
    # THEN it counts them, and perhaps the one that reads the counter
    assert {run.nop_instructions for run in replayed} <= {1000, 1001}


def test_stages_and_bookkeeping_make_up_the_tick(replayed):
    answers = replayed[0].answers
    accepted = answers[answers["status"] == 0]
    # GIVEN accepted samples WHEN the tick is compared with the sum of its stages THEN what it does besides, calls and
    # the counting of health bits, is a twentieth of it
    besides = accepted["tick_instructions"].astype(int) - accepted["stage_instructions"].sum(axis=1)
    assert besides.min() > 0
    assert besides.max() < 0.05 * np.median(accepted["tick_instructions"])
