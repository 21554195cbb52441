"""`hexload replay`: runs the firmware's own C over a recorded log."""

from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hexload_tools import build, project
from hexload_tools.atomic_file import replaced_when_done
from hexload_tools.errors import InputError
from hexload_tools.log_formats import read_any_log
from hexload_tools.table3 import DIGITS, SYMBOLS, UNITS


def replay_log(log: Path, platform_file: Path, estimator: str | None, prior: str | None, out: Path) -> dict:
    """Writes the estimates CSV to `out`, one row per log row, and returns what hexload_native.replay returns, with the log reader's remarks.

    `estimator` and `prior` override the platform file's [estimator] table.
    """
    samples = read_any_log(log)
    build.ensure_built("hexload_native")
    native = project.native_module()
    platform = _load_platform(native, platform_file)
    legs = [_as_float32(part) for part in (samples.displacement_m, samples.velocity_m_s, samples.force_n)]
    with replaced_when_done(out) as temporary:
        try:
            result = native.replay(platform, estimator, prior, samples.t_s, *legs, str(temporary))
        except ValueError as error:
            raise InputError(f"{log} with {platform_file}: {error}") from None
    return result | {"remarks": samples.remarks}


def _as_float32(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The controller's samples are float32, whatever the log's digits and the precision of the firmware build."""
    return values.astype(np.float32).astype(np.float64)


def _load_platform(native: ModuleType, path: Path):
    try:
        return native.load_platform(str(path))
    except ValueError as error:  # names the file itself
        raise InputError(str(error)) from None


def print_summary(result: dict, out: Path) -> None:
    """The final estimates on the terminal."""
    table = Table()
    table.add_column("parameter")
    table.add_column("estimate", justify="right")
    table.add_column("sigma", justify="right")
    for name, value, sigma in zip(result["names"], result["value"][-1], result["sigma"][-1]):
        digits = DIGITS[name]
        table.add_row(f"{SYMBOLS[name]}, {UNITS[name]}", f"{value:.{digits}f}", f"{sigma:.{digits}f}")
    Console().print(table)
    health = ", ".join(f"{name} in {ticks} ticks" for name, ticks in result["health_counts"].items() if ticks)
    print(f"verdict:   {result['verdict'][-1]} after {len(result['t'])} ticks")
    print(f"health:    {health or 'no remark'}")
    if result["refused"]:
        print(f"refused:   {result['refused']} samples, the first at {result['first_refusal']}")
    for remark in result["remarks"]:
        print(f"log:       {remark}")
    print(f"estimates: {out}")
