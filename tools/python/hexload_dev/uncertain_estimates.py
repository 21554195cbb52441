"""Estimates of the ten parameters that are about as wrong as their covariance says: what the tests of the load as a
body (firmware/include/hexload/estimate.h) begin with."""

from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.firmware_run import run_firmware
from hexload.io.log_file import LegLog

Array = NDArray[np.float64]

EARLY_S = (0.3, 0.5, 1.0, 2.0)  # of a log: the filter has learnt something, but not much


def early_covariances(native: ModuleType, platform, log: LegLog, folder: Path) -> list[Array]:
    """The momentum filter's covariance [10, 10] after each of EARLY_S of a log; writes into `folder`."""
    return [
        run_firmware(native, platform, start_of(log, seconds), folder / "estimates.csv", "momentum")["covariance"]
        for seconds in EARLY_S
    ]


def start_of(log: LegLog, seconds: float) -> LegLog:
    rows = log.t_s <= log.t_s[0] + seconds
    parts = (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(*(np.ascontiguousarray(part[rows]) for part in parts))


def estimates(random: np.random.Generator, truth: Array, covariance: Array, count: int) -> Array:
    """Draws [count, 10] with errors of that covariance, in float32's numbers."""
    root = np.linalg.cholesky(covariance)
    drawn = truth + random.standard_normal((count, len(truth))) @ root.T
    return drawn.astype(np.float32).astype(np.float64)
