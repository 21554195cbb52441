"""Verbs over recorded logs: replay and convert."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import (
    AsJson,
    Columns,
    Estimator,
    PlatformFile,
    Prior,
    Quiet,
    Resample,
    Unchecked,
    View,
)


def replay(
    log: Annotated[
        Path,
        typer.Argument(
            help="Leg log: .csv or .csv.gz (t,dl1..dl6,vl1..vl6,f1..f6; vl1..vl6 may be absent), .mcap, .mf4, candump, .blf, .asc, .trc or LCM event log."
        ),
    ],
    platform: PlatformFile,
    out: Annotated[Path, typer.Option(help="Estimates to write (.csv), one row per tick.")],
    estimator: Annotated[
        Estimator | None, typer.Option(help="Estimator to run, instead of the platform file's.")
    ] = None,
    prior: Prior = None,
    tare: Annotated[
        Path | None, typer.Option(help="Tare file of hexload tare, made with the same platform file.")
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file of hexload commission, made with the same platform file.")
    ] = None,
    bodies: Annotated[
        Path | None,
        typer.Option(
            help="The load as a body to write (.csv), one row per tick: centre of mass, central tensor, nearest consistent body."
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Page to write (.html): the parameters, the load as a body, verdicts, signals."),
    ] = None,
    columns: Columns = None,
    resample: Resample = None,
    unchecked: Unchecked = False,
    trace: Annotated[
        Path | None,
        typer.Option(
            help="Measurement updates to write (.csv), a row per tick: innovations, their variances, NIS, that of their sums, gate."
        ),
    ] = None,
    view: View = False,
    commanded: Annotated[
        Path | None,
        typer.Option(
            help="Motion that was commanded (.csv: t,x,y,z,roll,pitch,yaw, as of hexload excite), to check that each leg is the one that it is taken for."
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Runs the controller's own C code over a recorded log.

    With --tare the empty platform is what its tare run found, and the sigmas include the tare's uncertainty too. What the mass of
    its legs needs beside is taken off the forces first: the firmware knows of no such mass.

    All ten parameters (--estimator momentum) are shown as a body too: mass, centre of mass and tensor about it, whether any body
    can have them, and if none can, the nearest one that a body can have.

    --commanded tells what no log can: legs renumbered or mirrored in all channels of a symmetric machine.

    Exit status: 0; 2 for a file or an option that is refused, also as its units, signs, order or time cannot be; 3 when the estimates
    are written but not to be believed, as channels of the log contradict each other at its end, most samples are refused or the
    verdict is misfit or inconsistent. The last line then says what to do.

    Example:  hexload replay tests/data/paper_noisy.csv.gz --platform tests/data/paper_load.toml --out estimates.csv
    """
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep
    from hexload.cli.replay import figures, is_believed, print_summary
    from hexload.estimation.input_check import WayIn
    from hexload.estimation.replay import replay_log

    way_in = WayIn(columns or (), resample, unchecked)
    with output.told(as_json, quiet) as told:
        keep((log, platform, tare, rig, commanded), (out, bodies, report, trace))
        result = replay_log(log, platform, estimator, prior, out, tare, bodies, report, trace, rig, way_in, commanded)
        print_summary(result, out, bodies, report, trace)
        told.update(figures(result), files={"estimates": out, "bodies": bodies, "page": report, "trace": trace})
    if view:
        from hexload.view.verb import show_replay

        show_replay(platform, log, result)
    if not is_believed(result):
        raise typer.Exit(output.IMPLAUSIBLE)


def convert(
    log: Annotated[Path, typer.Argument(help="Leg log; formats as of hexload replay.")],
    out: Annotated[Path, typer.Argument(help="Log to write: .csv or .csv.gz in SI units, or .mcap.")],
    columns: Columns = None,
    resample: Resample = None,
    platform: Annotated[
        Path | None, typer.Option(help="Platform file (.toml), whose home length absolute leg lengths need.")
    ] = None,
    estimates: Annotated[
        Path | None, typer.Option(help="Estimates of hexload replay (.csv) that go beside it into an .mcap log.")
    ] = None,
    unchecked: Unchecked = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Writes a log of any kind as the CSV that every command takes, or as MCAP, which Foxglove and PlotJuggler open.

    Example:  hexload convert recorded.mf4 log.csv --columns columns.toml

    Example:  hexload convert log.csv log.mcap --estimates estimates.csv
    """
    from hexload.cli import convert as verb
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep

    with output.told(as_json, quiet) as figures:
        keep((log, platform, estimates), (out,))
        rows, remarks = verb.convert(log, out, columns or (), resample, platform, estimates, unchecked)
        for remark in remarks:
            print(f"log:       {remark}")
        print(f"written:   {out}, {rows} rows")
        figures.update(log=out, rows=rows, remarks=remarks)
