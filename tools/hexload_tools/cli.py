"""The command line: verbs, their options and examples. Each verb's work is in the module of its name."""

import sys
from pathlib import Path
from typing import Annotated, Literal, Optional

import typer

from hexload_tools.errors import InputError, ToolFailed

app = typer.Typer(
    name="hexload",
    help="Identifies the load of a Gough-Stewart platform: simulator, controller firmware, replay and report.\n\n"
    "Start here:  hexload demo",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

Estimator = Literal["paper", "momentum"]
Prior = Literal["safe", "printed"]


@app.command()
def demo() -> None:
    """The main job: simulator and controller in closed loop on the paper's motion, then the report.

    Example:  hexload demo
    """
    from hexload_tools import demo as verb

    verb.run_demo()


@app.command()
def test(
    preset: Annotated[Optional[list[str]], typer.Option(help="Only this build preset; may be repeated.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only the preset host.")] = False,
    regex: Annotated[Optional[str], typer.Option("-R", "--regex", help="Only tests whose name matches, with all that they print.")] = None,
) -> None:
    """Builds and runs every test; the last line reads 'N passed, N failed'.

    Example:  hexload test --quick -R kinematics
    """
    from hexload_tools import test as verb

    raise typer.Exit(verb.run_tests(["host"] if quick else preset, regex))


@app.command()
def sim(
    scenario: Annotated[str, typer.Argument(help="Name of a scenario in host_sim/scenarios, or a .toml file.")],
    out: Annotated[Optional[Path], typer.Option(help="Run directory.  [default: build/runs/NAME-SEED]")] = None,
    seed: Annotated[
        Optional[int], typer.Option(min=0, help="Seed of noise and trajectory, instead of the scenario's.")
    ] = None,
    duration: Annotated[Optional[float], typer.Option(help="Seconds, instead of the scenario's.")] = None,
    substeps: Annotated[
        Optional[int], typer.Option(min=1, help="RK4 steps per tick, instead of the scenario's.")
    ] = None,
    estimator: Annotated[Optional[Estimator], typer.Option(help="Instead of the platform file's.")] = None,
    prior: Annotated[Optional[Prior], typer.Option(help="Start covariance, instead of the platform file's.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the run directory given by --out.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress, no summary.")] = False,
) -> None:
    """Runs a scenario in closed loop and writes a run directory: log, truth, estimates, metadata.

    Example:  hexload sim paper --seed 7 --out runs/seven
    """
    from hexload_tools import sim as verb

    given = {"--duration": duration, "--substeps": substeps, "--estimator": estimator, "--prior": prior}
    options = [word for name, value in given.items() if value is not None for word in (name, str(value))]
    options += [name for name, wanted in (("--force", force), ("--quiet", quiet)) if wanted]
    print(verb.run_simulation(scenario, out, seed, tuple(options)))


@app.command()
def replay(
    log: Annotated[Path, typer.Argument(help="Leg log, .csv or .csv.gz: t,dl1..dl6,vl1..vl6,f1..f6 in SI units.")],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml).")],
    out: Annotated[Path, typer.Option(help="Estimates to write (.csv), one row per tick.")],
    estimator: Annotated[Optional[Estimator], typer.Option(help="Instead of the platform file's.")] = None,
    prior: Annotated[Optional[Prior], typer.Option(help="Start covariance, instead of the platform file's.")] = None,
) -> None:
    """Runs the controller's own C code over a recorded log.

    Example:  hexload replay tests/data/paper_noisy.csv.gz --platform tests/data/paper_load.toml --out estimates.csv
    """
    from hexload_tools import replay as verb

    verb.print_summary(verb.replay_log(log, platform, estimator, prior, out), out)


@app.command()
def report(
    runs: Annotated[list[Path], typer.Argument(help="One or several run directories.", metavar="RUN_DIR...")],
    out: Annotated[
        Optional[Path],
        typer.Option(help="Page to write (.html).  [default: RUN_DIR/report.html; of several: build/runs/report.html]"),
    ] = None,
) -> None:
    """Writes one self-contained HTML page: tracking, signals, estimates, Table 3, consistency, configuration.

    Example:  hexload report build/runs/paper-1 --out paper.html
    """
    from hexload_tools import report as verb

    out = out or verb.default_page(runs)
    verb.write_report(runs, out)
    print(out)


@app.command()
def bench() -> None:
    """Measures the simulator's speed, alone and with the firmware, against a MuJoCo model of the same platform.

    Example:  hexload bench
    """
    from hexload_tools import bench as verb

    verb.run_bench()


def main() -> None:
    """Runs a verb; a refusal ends with one line on stderr and the status of its kind."""
    try:
        sys.exit(app(prog_name="hexload", standalone_mode=False))
    except (InputError, ToolFailed) as error:
        if str(error):
            print(f"hexload: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except typer.TyperException as error:  # a wrong option or argument
        print(f"hexload: {error.format_message()} (see hexload --help)", file=sys.stderr)
        sys.exit(2)
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(130)
