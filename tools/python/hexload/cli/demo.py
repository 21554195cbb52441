"""`hexload demo`: the paper's scenario from the signal generator to its Table 3, on the terminal and as a page."""

from rich.console import Console

from hexload.report import page as report
from hexload.report import table3
from hexload.simulation import sim

SCENARIO = "paper"


def run_demo() -> None:
    directory = sim.run_simulation(SCENARIO)
    page = report.default_page([directory])
    (run,) = report.write_report([directory], page)
    console = Console()
    console.print()
    console.print(table3.terminal_table(run, table3.compare(run)))
    console.print("error: relative error (37); sigma: the filter's own; bound: no unbiased estimator does better\n")
    print(f"verdict: {run.verdict}\nreport:  {page}")
