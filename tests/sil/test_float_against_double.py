"""The controller's single precision against the double-precision reference, over a minute of each motion."""

from pathlib import Path
from types import ModuleType

import hexload_native
import hexload_native_double
import numpy as np
import pytest

from hexload.campaign.cases import Case
from hexload.campaign.one_case import simulate
from hexload.estimation.firmware_run import run_firmware
from hexload.io.log_file import read_log

SECONDS = 60.0
SETTLED_S = 1.0  # before, a parameter may be unknown to both, and the difference means nothing


def replay(native: ModuleType, folder: Path, log) -> dict:
    return run_firmware(native, native.load_platform(folder / "platform.toml"), log, folder / "e.csv", "momentum")


@pytest.mark.parametrize("motion", ["multisine", "paper", "work"])
def test_a_minute_of_rounding_stays_below_a_third_of_sigma(motion, tmp_path, record_property):
    # GIVEN a minute of simulated motion with nominal noise and a load drawn at random
    log = read_log(simulate(Case(motion, 1, SECONDS), tmp_path) / "log.csv")
    # WHEN the momentum filter of either precision takes it, from the same samples
    single, double = (replay(native, tmp_path, log) for native in (hexload_native, hexload_native_double))
    # THEN all ten estimates differ by 0.3 sigma at most, at every tick once they have settled
    settled = double["t"] >= SETTLED_S
    difference = (np.abs(single["value"] - double["value"]) / double["sigma"])[settled].max(axis=0)
    record_property("float_minus_double_in_sigma", difference.tolist())
    print(f"{motion}: float - double in sigma", np.round(difference, 3))
    assert single["refused"] == double["refused"] == 0
    assert (difference < 0.3).all()
