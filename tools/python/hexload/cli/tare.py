"""`hexload tare` on the terminal."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload.theory.bound import THETA_NAMES, unit_of


def figures(tare: dict) -> dict:
    columns = zip(THETA_NAMES, tare["theta"], tare["sigma"])
    return {
        "parameters": {
            name: {"offset": value, "sigma": sigma, "unit": unit_of(name)} for name, value, sigma in columns
        },
        "legs_have_mass": bool(tare["legs"]),
        "verdict": tare["verdict"],
        "duration_s": tare["duration_s"],
    }


def print_summary(tare: dict, out: Path) -> None:
    """The offsets on the terminal."""
    table = Table()
    for heading in ("parameter", "offset", "sigma"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    for name, value, sigma in zip(THETA_NAMES, tare["theta"], tare["sigma"]):
        table.add_row(f"{name}, {unit_of(name)}", f"{value:.4f}", f"{sigma:.4f}")
    Console().print(table)
    if tare["legs"]:
        print("legs:    have mass; what of it is no offset is taken off the forces of a log")
    print(f"verdict: {tare['verdict']} after {tare['duration_s']:.3f} s")
    print(f"tare:    {out}")
