"""`hexload demo`: the paper's scenario from the signal generator to its Table 3, on the terminal and as a page."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from hexload.estimation.load_summary import DIGITS, SYMBOLS, UNITS
from hexload.io.run_directory import Run
from hexload.report import page as report
from hexload.report import table3
from hexload.report.table3 import PAPER_DIGITS, PERCENT_DIGITS, Row
from hexload.simulation import sim

SCENARIO = "paper"


def run_demo(is_quiet: bool = False) -> tuple[Path, dict]:
    """The run directory, and the figures of Table 3. `is_quiet`: the simulator says nothing."""
    directory = sim.run_simulation(sim.SimRequest(sim.resolve_scenario(SCENARIO), quiet=is_quiet))
    page = report.default_page([directory])
    (run,) = report.write_report([directory], page)
    console = Console()
    console.print()
    rows = table3.compare(run)
    console.print(terminal_table(run, rows))
    console.print("error: relative error (37); sigma: the filter's own; bound: no unbiased estimator does better\n")
    print(f"verdict: {run.verdict}\nreport:  {page}")
    return directory, {"run": directory, "page": page, "verdict": run.verdict, "table_3": rows}


def terminal_table(run: Run, rows: list[Row]) -> Table:
    title = f"{run.name}, seed {run.meta['seed']}: Table 3 of the paper beside this run"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("", "true", "paper", "off %", "this run", "off %", "sigma", "bound"):
        table.add_column(heading, justify="right" if heading else "left", no_wrap=True)
    for row in rows:
        digits = DIGITS[row.name]
        table.add_row(
            f"{SYMBOLS[row.name]}, {UNITS[row.name]}",
            f"{row.truth:g}",
            f"{row.paper[0]:.{PAPER_DIGITS[row.name]}f}" if row.paper else "-",
            f"{row.paper[1]:.2f}" if row.paper else "-",
            f"{row.estimate:.{digits}f}",
            f"{row.error_percent:.{PERCENT_DIGITS[row.name]}f}",
            f"{row.sigma:.{digits}f}",
            "-" if row.bound is None else f"{row.bound:.{digits}f}",
        )
    return table
