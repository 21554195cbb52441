"""`hexload replay`: runs the firmware's own C over a recorded log."""

import math
from contextlib import nullcontext
from itertools import zip_longest
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload_tools.atomic_file import replaced_when_done
from hexload_tools.errors import InputError
from hexload_tools.firmware_run import load_platform, native_firmware, run_firmware
from hexload_tools.log_formats import read_any_log
from hexload_tools.table3 import DIGITS, SYMBOLS, UNITS
from hexload_tools.tare import tare_for, unit_of

MACHINE_UNITS = {"bias": "N", "coulomb": "N", "viscous": "N s/m"}  # of each leg's effects
TEN_DIGITS = 4  # of the momentum filter's parameters, in kg, kg m and kg m^2


def replay_log(
    log: Path,
    platform_file: Path,
    estimator: str | None,
    prior: str | None,
    out: Path,
    tare: Path | None = None,
    bodies: Path | None = None,
) -> dict:
    """Writes the estimates CSV to `out`, one row per log row, and returns what hexload_native.replay returns, with the log reader's remarks.

    `estimator` and `prior` override the platform file's [estimator] table. `tare`: file of `hexload tare`, made with
    the same platform. `bodies`: a CSV for the load as a body, one row per log row.
    """
    if bodies is not None and bodies.absolute() == out.absolute():
        raise InputError(f"{out}: found the same file for --out and --bodies, expected two")
    samples = read_any_log(log)
    native = native_firmware()
    platform = load_platform(native, platform_file)
    offset = None if tare is None else tare_for(tare, native, platform, platform_file)
    files = f"{log} with {platform_file}" + ("" if tare is None else f" and {tare}")
    with replaced_when_done(out) as temporary, replaced_when_done(bodies) if bodies else nullcontext() as body_file:
        try:
            result = run_firmware(native, platform, samples, temporary, estimator, prior, offset, body_file)
        except ValueError as error:
            raise InputError(f"{files}: {error}") from None
    return result | {"remarks": samples.remarks}


# What has not moved when a parameter is not excited.
MISSING_MOTION = {
    "m": "no weight and no acceleration",
    "hx": "no weight and no acceleration",
    "hy": "no weight and no acceleration",
    "hz": "no tilt and no horizontal acceleration",
    "dz": "no roll and no pitch acceleration",
    "Ixx": "no roll acceleration",
    "Iyy": "no pitch acceleration",
    "Izz": "no yaw acceleration",
    "Ixy": "no roll and no pitch acceleration",
    "Ixz": "no roll and no yaw acceleration",
    "Iyz": "no pitch and no yaw acceleration",
}


def in_words(name: str, verdict: str, hidden: str | None = None) -> str:
    """A parameter's verdict with its reason. `hidden`: why it cannot be told from the machine's own effects."""
    if hidden is not None and verdict != "inconsistent":
        return f"{verdict.replace('_', ' ')}: {hidden}"
    if verdict == "not_excited":
        return f"not excited: {MISSING_MOTION[name]} in the last 10 s, or too little"
    if verdict == "inconsistent":
        return "inconsistent: friction, other noise or another load than the model's"
    return verdict


def load_changes_s(result: dict) -> list[float]:
    """When the firmware has noticed another load."""
    bit = list(result["health_counts"]).index("load changed")  # they are in the order of the bits
    return [float(t_s) for t_s in result["t"][result["health"].astype(int) >> bit & 1 == 1]]


BODY_UNITS = {"m": "kg", "c": "m", "I": "kg m²"}
BODY_DIGITS = {"m": TEN_DIGITS, "c": 6, "I": TEN_DIGITS}


def body_table(body: dict) -> Table:
    """The load as a body: what is not known is a dash."""
    table = Table()
    table.add_column("load as a body")
    columns = {"estimate": body["value"], "sigma": body["sigma"]}
    if not body["is_possible"]:
        columns["nearest possible"] = body["nearest"]
    for heading in columns:
        table.add_column(heading, justify="right")
    for row, name in enumerate(body["names"]):
        numbers = [values[row] for values in columns.values()]
        words = ["-" if math.isnan(number) else f"{number:.{BODY_DIGITS[name[0]]}f}" for number in numbers]
        table.add_row(f"{name}, {BODY_UNITS[name[0]]}", *words)
    return table


def possible_in_words(body: dict) -> str:
    if body["is_possible"]:
        return "possible"
    if math.isnan(body["distance_sigmas"]):
        return "impossible, and far from any that is possible"
    distance = f"{body['distance_sigmas']:.2f} sigma off"
    return f"impossible: no body has these parameters; the nearest possible ones are {distance}"


def print_summary(result: dict, out: Path) -> None:
    """The final estimates on the terminal."""
    table = Table()
    table.add_column("parameter")
    table.add_column("estimate", justify="right")
    table.add_column("sigma", justify="right")
    table.add_column("verdict")
    rows = zip_longest(result["names"], result["value"][-1], result["sigma"][-1], result["parameter_verdict"])
    for name, value, sigma, verdict in rows:
        digits = TEN_DIGITS if "m" in result["names"] else DIGITS[name]
        unit = UNITS.get(name) or MACHINE_UNITS.get(name[:-1]) or unit_of(name)
        numbers = (f"{value:.{digits}f}", f"{sigma:.{digits}f}")
        words = "" if verdict is None else in_words(name, verdict, result["hidden"].get(name))
        table.add_row(f"{SYMBOLS.get(name, name)}, {unit}", *numbers, words)
    Console().print(table)
    if "body" in result:
        Console().print(body_table(result["body"]))
        print(f"body:      {possible_in_words(result['body'])}")
    health = ", ".join(f"{name} in {ticks} ticks" for name, ticks in result["health_counts"].items() if ticks)
    print(f"verdict:   {result['verdict'][-1]} after {len(result['t'])} ticks")
    print(f"health:    {health or 'no remark'}")
    if times_s := load_changes_s(result):
        print(f"new load:  noticed at {', '.join(f'{t_s:.3f} s' for t_s in times_s)}")
    if result["refused"]:
        print(f"refused:   {result['refused']} samples, the first at {result['first_refusal']}")
    for remark in result["remarks"]:
        print(f"log:       {remark}")
    print(f"estimates: {out}")
