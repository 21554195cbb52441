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


class FirmwareReplay:
    """run_firmware() of a log that comes in parts; its result keeps `most_rows` rows at most, its files have all."""

    def __init__(
        self,
        native: ModuleType,
        platform,
        first: LegLog,
        out: Path,
        estimator: str | None,
        prior: str | None,
        tare,
        bodies: Path | None,
        trace: Path | None,
        most_rows: int,
    ):
        """`first`: the log's first part, which is not run yet. Raises ValueError, as the others do."""
        self._sampling_s = native.sampling_period_s(first.t_s)
        paths = [None if path is None else str(path) for path in (bodies, trace)]
        timing = (first.t_s[0], self._sampling_s, first.has_velocity)
        self._native = native.Replay(platform, estimator, prior, *timing, str(out), tare, *paths, most_rows)

    def step(self, part: LegLog) -> None:
        legs = (_as_float32(channel) for channel in (part.displacement_m, part.velocity_m_s, part.force_n))
        self._native.step(part.t_s, *legs)

    def finish(self) -> dict:
        return self._native.finish()


def _as_float32(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The controller's samples are float32, whatever the log's digits and the precision of the firmware build."""
    return values.astype(np.float32).astype(np.float64)
