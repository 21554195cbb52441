"""The firmware's own C over leg samples, in this process."""

from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.errors import InputError
from hexload.io.log_file import LegLog


def native_firmware() -> ModuleType:
    project.ensure_built("hexload_native")
    return project.native_module()


def load_platform(native: ModuleType, path: Path):
    try:
        return native.load_platform(str(path))
    except ValueError as error:  # names the file itself
        raise InputError(str(error)) from None


def run_firmware(
    native: ModuleType,
    platform,
    samples: LegLog,
    out: Path,
    estimator: str | None = None,
    prior: str | None = None,
    tare=None,
    bodies: Path | None = None,
    trace: Path | None = None,
) -> dict:
    """What hexload_native.replay returns of these samples; writes the estimates CSV to `out`, and to `bodies` what they
    say of the load as a body, to `trace` the measurement update of each tick. Raises ValueError."""
    legs = [_as_float32(part) for part in (samples.displacement_m, samples.velocity_m_s, samples.force_n)]
    body_path = None if bodies is None else str(bodies)
    trace_path = None if trace is None else str(trace)
    return native.replay(platform, estimator, prior, samples.t_s, *legs, str(out), tare, body_path, trace_path)


def _as_float32(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The controller's samples are float32, whatever the log's digits and the precision of the firmware build."""
    return values.astype(np.float32).astype(np.float64)
