"""`hexload soak`: hours of simulated motion through the momentum estimator, in one process and in constant memory."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev import build

FAULTS = {
    "bad_variances": "variances that are not positive",
    "load_changes": "load changes that were none",
    "restarts": "restarts of the filter",
    "inconsistent_ticks": "ticks with the verdict inconsistent",
    "misstated_ticks": "ticks with the sensors' noise called misstated",
    "refused": "samples refused",
}
LARGEST_NEES = 53.0  # beyond is 1e-7 of chi-square with 10 degrees of freedom


def run_soak(scenario: Path, hours: float, seed: int) -> dict:
    """Prints a line for each tenth of the time, and a verdict. Returns what was found, and the last report."""
    build.ensure_built("hexload_soak")
    table = Table()
    headings = ("simulated h", "sigma of m, kg", "of hz, kg m", "of Ixx, kg m²", "NEES", "smallest pivot", "faults")
    for heading in headings:
        table.add_column(heading, justify="right")
    report = {}
    for report in reports(scenario, 3600.0 * hours, seed):
        sigma = report["sigma"]
        numbers = (f"{report['t_s'] / 3600.0:.3f}", *(f"{sigma[k]:.2g}" for k in (0, 3, 4)), f"{report['nees']:.1f}")
        table.add_row(*numbers, f"{report['smallest_pivot']:.2g}", str(sum(report[name] for name in FAULTS)))
        print(f"[hexload] {numbers[0]} h of {hours:g} h", flush=True)
    Console().print(table)
    found = faults(report)
    print(f"verdict: {'; '.join(found) or 'nothing found'}")
    return {"found": found, "hours": hours, "last": report}


def reports(scenario: Path, duration_s: float, seed: int) -> Iterator[dict]:
    program = project.build_directory() / "host_sim" / "hexload_soak"
    command = [program, scenario, str(duration_s), str(seed)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            yield json.loads(line)
    if process.returncode != 0:
        raise ToolFailed(exit_code=process.returncode)


def faults(report: dict) -> list[str]:
    """What the last report says that should not be: sentences; none: all is well."""
    found = [f"{report[name]} {words}" for name, words in FAULTS.items() if report[name]]
    if not report["smallest_pivot"] > 0.0:
        found.append(f"a covariance with the pivot {report['smallest_pivot']:.2g}, which is none")
    if not (np.isfinite(report["nees"]) and report["nees"] < LARGEST_NEES):
        found.append(f"errors far beyond the sigmas: NEES {report['nees']:.1f} of the ideal 10")
    return found
