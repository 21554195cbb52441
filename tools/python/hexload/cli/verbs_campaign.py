"""Verbs of many runs: campaign and faults."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import AsJson, Quiet, Restart, SeedBase

FOLDER = "Folder of the campaign; one that is there already is continued."


def campaign(
    classes: Annotated[
        str | None,
        typer.Option(
            help="Classes of cases, with commas between them, or all. A wrong one is answered with their names.",
            show_default="multisine,paper,paper_rest,work",
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Cases of each class.")] = 48,
    seed_base: SeedBase = None,
    duration: Annotated[float, typer.Option(help="Seconds of each case.")] = 10.0,
    tick: Annotated[float, typer.Option(help="Sampling period of sensors and controller, s.")] = 1e-3,
    out: Annotated[
        Path | None,
        typer.Option(help=FOLDER, show_default="build/runs/campaign"),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Scheduler of a Dask cluster, tls://HOST:PORT; needs --tls-ca, --tls-cert and --tls-key.",
            show_default="all cores of this machine",
        ),
    ] = None,
    tls_ca: Annotated[Path | None, typer.Option(help="Certificates that the cluster's are checked with, PEM.")] = None,
    tls_cert: Annotated[Path | None, typer.Option(help="This machine's certificate for the cluster, PEM.")] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Private key of that certificate, PEM.")] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Keep the run directory of each case, on the machine that ran it.")
    ] = False,
    restart: Restart = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Many seeded runs with loads, servos, motions and machines drawn anew: how good are the estimators, and how honest?

    Compares the momentum filter, with bias and friction or a tare where the class has them, the paper's filter, least
    squares, recursive and total least squares and instrumental variables with the Cramer-Rao bound of each case. Writes
    report.html, summary.json and a file per case; with the same seeds the same command gives the same numbers, and goes
    on where it was interrupted. Workers of a cluster need this version, built, and start with tools on the PYTHONPATH.

    Example:  hexload campaign --classes multisine,work_pick_up --runs 24 --out build/runs/loads
    """
    from hexload.campaign import schedule, verb
    from hexload.campaign.store import Settings
    from hexload.cli import output

    folder = out or verb.DEFAULT_OUT
    cluster = schedule.cluster_of(scheduler, tls_ca, tls_cert, tls_key)
    with output.said(as_json, quiet):
        settings = Settings(verb.parse_classes(classes), runs, verb.choose_seeds(seed_base), duration, tick)
        print(verb.run_campaign(settings, folder, cluster, keep, restart))
    if as_json:
        print((folder / "summary.json").read_text(encoding="utf-8"), end="")


def faults(
    kind: Annotated[
        str | None,
        typer.Option(
            help="Faults, or groups of them, with commas between; with semicolons where a group's name has a comma.",
            show_default="all",
        ),
    ] = None,
    motion: Annotated[
        str | None,
        typer.Option(help="Motions: some of multisine, paper, work, pick_up; with commas between.", show_default="all"),
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="Estimators: some of momentum, momentum_effects, paper; with commas between.",
            show_default="all; with --quick momentum",
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(min=1, max=1000, help="Seeds of each fault, size and motion.", show_default="3; with --quick 1"),
    ] = None,
    seed_base: SeedBase = None,
    out: Annotated[
        Path | None,
        typer.Option(help=FOLDER, show_default="build/runs/faults"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One size of each fault, one seed, one estimator.")] = False,
    restart: Restart = False,
    rig: Annotated[
        bool,
        typer.Option(
            "--rig",
            help="Commission each machine first, on an empty run that has the same fault if it is one of the machine; "
            "some seconds a fault and size.",
        ),
    ] = False,
    own_machine: Annotated[
        bool,
        typer.Option(
            "--own-machine",
            help="Draw a machine for each seed, hinges, leg lengths, mass, centre and inertia of the platform, instead of the paper's.",
        ),
    ] = False,
    no_velocity: Annotated[
        bool,
        typer.Option("--no-velocity", help="Machines that have no velocity sensors: encoders and load cells alone."),
    ] = False,
    name_causes: Annotated[
        bool,
        typer.Option(
            "--name-causes",
            help="Diagnose each log too, as replay does: is the cause that is named first the true one?",
        ),
    ] = False,
    list_kinds: Annotated[bool, typer.Option("--list", help="Print the faults and their sizes, run nothing.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Puts faults into clean runs, one at a time, and tells what each estimator makes of them: does it say so, or is it
    silently wrong?

    Sensors, wiring, units, clocks, lost rows, hinges, masses, tilt, friction, loads that swing or slosh, forces from
    outside, loads that change: each in some sizes, on several motions, with seeds that no development has seen. A
    run's answer is right within its sigma, said to be wrong, wrong with some word (weak), wrong without any (silent),
    refused, or a false alarm. Writes report.html, table.md, cases.csv, summary.json and a file per case, on all cores;
    the same command goes on where it was interrupted.

    With --name-causes a column has, of the runs whose fault a log can tell, those whose first cause is the true one;
    words.md has what replay says of each fault.

    Example:  hexload faults --kind friction,tilt --runs 2 --out build/runs/friction
    """
    from hexload.campaign.verb import choose_seeds
    from hexload.cli import output
    from hexload.faults import verb

    if list_kinds:
        verb.print_list()
        return
    folder = out or verb.DEFAULT_OUT
    with output.said(as_json, quiet):
        settings = verb.settings_of(
            kind,
            motion,
            estimator,
            runs,
            choose_seeds(seed_base),
            quick,
            is_commissioned=rig,
            names_causes=name_causes,
            has_own_machine=own_machine,
            has_velocity=not no_velocity,
        )
        print(verb.run_faults(settings, folder, restart))
    if as_json:
        print((folder / "summary.json").read_text(encoding="utf-8"), end="")
