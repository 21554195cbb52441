"""`hexload replay`: runs the firmware's own C over a recorded log."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload_tools.atomic_file import replaced_when_done
from hexload_tools.errors import InputError
from hexload_tools.firmware_run import load_platform, native_firmware, run_firmware
from hexload_tools.log_formats import read_any_log
from hexload_tools.table3 import DIGITS, SYMBOLS, UNITS
from hexload_tools.tare import tare_for, unit_of

TEN_DIGITS = 4  # of the momentum filter's parameters, in kg, kg m and kg m^2


def replay_log(
    log: Path, platform_file: Path, estimator: str | None, prior: str | None, out: Path, tare: Path | None = None
) -> dict:
    """Writes the estimates CSV to `out`, one row per log row, and returns what hexload_native.replay returns, with the log reader's remarks.

    `estimator` and `prior` override the platform file's [estimator] table. `tare`: file of `hexload tare`, made with
    the same platform.
    """
    samples = read_any_log(log)
    native = native_firmware()
    platform = load_platform(native, platform_file)
    offset = None if tare is None else tare_for(tare, native, platform, platform_file)
    files = f"{log} with {platform_file}" + ("" if tare is None else f" and {tare}")
    with replaced_when_done(out) as temporary:
        try:
            result = run_firmware(native, platform, samples, temporary, estimator, prior, offset)
        except ValueError as error:
            raise InputError(f"{files}: {error}") from None
    return result | {"remarks": samples.remarks}


def print_summary(result: dict, out: Path) -> None:
    """The final estimates on the terminal."""
    table = Table()
    table.add_column("parameter")
    table.add_column("estimate", justify="right")
    table.add_column("sigma", justify="right")
    for name, value, sigma in zip(result["names"], result["value"][-1], result["sigma"][-1]):
        digits = TEN_DIGITS if "m" in result["names"] else DIGITS[name]
        unit = UNITS.get(name) or unit_of(name)
        table.add_row(f"{SYMBOLS.get(name, name)}, {unit}", f"{value:.{digits}f}", f"{sigma:.{digits}f}")
    Console().print(table)
    health = ", ".join(f"{name} in {ticks} ticks" for name, ticks in result["health_counts"].items() if ticks)
    print(f"verdict:   {result['verdict'][-1]} after {len(result['t'])} ticks")
    print(f"health:    {health or 'no remark'}")
    if result["refused"]:
        print(f"refused:   {result['refused']} samples, the first at {result['first_refusal']}")
    for remark in result["remarks"]:
        print(f"log:       {remark}")
    print(f"estimates: {out}")
