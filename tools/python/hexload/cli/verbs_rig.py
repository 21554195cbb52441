"""Verbs that find what one real machine is like, from logs of it, for replay and controller: tare, commission, export."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import AsJson, Columns, EmptyLog, Force, PlatformFile, Quiet, Resample, Unchecked


def tare(
    log: EmptyLog,
    platform: PlatformFile,
    out: Annotated[Path, typer.Option(help="Tare file to write (.toml), for hexload replay --tare.")],
    largest_offset: Annotated[
        float,
        typer.Option(
            min=0.0, max=0.45, help="More than this share of the platform's own parameters is taken for a load."
        ),
    ] = 0.25,
    columns: Columns = None,
    resample: Resample = None,
    unchecked: Unchecked = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Finds how the empty platform differs from its platform file: leg mass, cables, what the drawing does not tell.

    Runs the momentum estimator over the log. Of legs with mass the file also says what is no constant offset, which hexload replay
    takes off the forces. Refused, and nothing written: an estimate that has not converged or is inconsistent,
    a load that changes, and an offset of mass, moment of mass or inertia that is rather a load. A load below --largest-offset
    cannot be told from a heavier platform.

    Example:  hexload tare empty.csv --platform platform.toml --out tare.toml
    """
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep
    from hexload.cli.tare import figures, print_summary
    from hexload.estimation.input_check import WayIn
    from hexload.estimation.tare import make_tare

    with output.told(as_json, quiet) as told:
        keep((log, platform), (out,))
        found = make_tare(log, platform, out, largest_offset, WayIn(columns or (), resample, unchecked))
        print_summary(found, out)
        told.update(figures(found), file=out)


def commission(
    log: EmptyLog,
    platform: PlatformFile,
    out: Annotated[Path, typer.Option(help="Rig file to write (.toml), for hexload replay --rig.")],
    reference: Annotated[
        Path | None,
        typer.Option(
            help="Leg log of the platform in motion with a known mass on it: tells the force sensors' common gain and how "
            "friction grows with force."
        ),
    ] = None,
    reference_mass: Annotated[
        float | None, typer.Option(min=1.0, help="Mass on the platform in the log of --reference, kg.")
    ] = None,
    loaded: Annotated[
        bool,
        typer.Option(
            "--loaded", help="The platform carries a load: its own mass and inertia stay the platform file's."
        ),
    ] = False,
    largest_offset: Annotated[
        float,
        typer.Option(min=0.0, help="More than this share beyond the platform's own parameters is taken for a load."),
    ] = 0.75,
    report: Annotated[
        Path | None,
        typer.Option(help="Page to write (.html): what was found, how well, residual spectra, friction curves."),
    ] = None,
    force: Force = False,
    columns: Columns = None,
    resample: Resample = None,
    unchecked: Unchecked = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Finds what one machine is like beyond its platform file: friction, offsets, gains, delays, tilt, legs, hinges, platform.

    One regression on 10 to 20 s of motion of all six axes with the empty platform. The table tolerances of the platform file says what is
    known of gains, offsets, hinges and tilt. Without a reference mass the common gain stays the remaining error of every mass.
    Refused, with the cause, and nothing written: forces that no empty platform on these legs takes, and a motion that tells too little.

    Example:  hexload commission empty.csv --platform platform.toml --out rig.toml
    """
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep, refuse_existing

    keep((log, platform, reference), (out, report))
    refuse_existing((out, report), force)
    from hexload.cli.commission import print_summary
    from hexload.estimation import commission as verb
    from hexload.estimation.input_check import WayIn

    wish = verb.Wish(
        log=log,
        platform=platform,
        out=out,
        reference=reference,
        reference_mass_kg=reference_mass,
        loaded=loaded,
        largest_offset=largest_offset,
        report=report,
        way_in=WayIn(columns or (), resample, unchecked),
    )
    with output.told(as_json, quiet) as told:
        found = verb.commission(wish)
        print_summary(found, out)
        if report is not None:
            print(f"page:      {report}")
        told.update(found, file=out, page=report)


def export(
    rig: Annotated[Path, typer.Argument(help="Rig file of hexload commission (.toml).")],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml) that it was made with.")],
    out: Annotated[Path, typer.Option(help="C header to write (NAME.h); the constant in it is called NAME.")],
    tick: Annotated[
        float | None, typer.Option(help="Sampling period of the controller, s.", show_default="the platform file's")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Writes machine, sensors, estimator and rig as a C header: a constant hexload_config_t for a controller, in flash.

    Its numbers are, to the bit, those with which hexload replay --rig runs.

    Example:  hexload export rig.toml --platform platform.toml --out rig_config.h
    """
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep
    from hexload.estimation.config_header import export as write_header

    with output.told(as_json, quiet) as figures:
        keep((rig, platform), (out,))
        name = write_header(rig, platform, out, tick, force)
        print(f"header:    {out}")
        print(f'use:       #include <hexload/hexload.h> and "{out.name}", then hexload_init(&estimator, &{name})')
        figures.update(file=out, constant=name)
