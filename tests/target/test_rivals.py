"""The filters of `hexload bench` solve the same problem, so their instructions can be compared."""

import numpy as np
import pytest

from hexload_dev import target


@pytest.mark.parametrize("preset", target.CORTEX_M7.values())
def test_rivals_identify_the_same_parameters_as_the_paper_filter(preset, tmp_path):
    # GIVEN a problem without noise WHEN the three filters have taken 300 steps
    answers = target.run_rivals(preset, tmp_path)
    # THEN their estimates agree to the roundings of 300 steps in float
    for name, answer in answers.items():
        print(f"{preset}, {name}: {answer['instructions']} instructions, {answer['parameter']}")
        np.testing.assert_allclose(answer["parameter"], answers["own"]["parameter"], rtol=1e-5)


@pytest.mark.parametrize("preset", target.CORTEX_M7.values())
def test_paper_filter_needs_fewer_instructions_than_its_rivals(preset, tmp_path):
    answers = target.run_rivals(preset, tmp_path)
    for name in ("dense", "eigen"):
        assert answers["own"]["instructions"] < answers[name]["instructions"], name
