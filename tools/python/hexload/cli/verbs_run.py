"""Verbs of simulated runs: demo, sim and report; bridge, which listens beside one."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import BUSES, AsJson, Estimator, Prior, Profile, Quiet, View


def demo(view: View = False, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """The main job: simulator and controller in closed loop on the paper's motion, then the report.

    Example:  hexload demo --view
    """
    from hexload.cli import demo as verb
    from hexload.cli import output

    with output.told(as_json, quiet) as figures:
        directory, found = verb.run_demo(as_json or quiet)
        figures.update(found)
    if view:
        from hexload.view.verb import show_run

        show_run(directory)


def sim(
    scenario: Annotated[str, typer.Argument(help="Name of a scenario in host_sim/scenarios, or a .toml file.")],
    out: Annotated[Path | None, typer.Option(help="Run directory.", show_default="build/runs/NAME-SEED")] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of noise and trajectory, instead of the scenario's.")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds, instead of the scenario's.")] = None,
    substeps: Annotated[int | None, typer.Option(min=1, help="RK4 steps per tick, instead of the scenario's.")] = None,
    estimator: Annotated[
        Estimator | None,
        typer.Option(
            help="Estimator of the controller, instead of the platform file's.",
            show_default="the platform file's; of paper where the load or the legs are not what it takes them for, one that fits",
        ),
    ] = None,
    prior: Prior = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file of hexload commission that the controller has.")] = None,
    bus: Annotated[
        str | None,
        typer.Option(
            help="Run simulator and controller as two programs on this bus: socketcan:INTERFACE, udp_multicast:GROUP[:PORT]; with --external-controller also slcan:HOST:PORT, slcan:DEVICE."
        ),
    ] = None,
    profile: Profile = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Tick k + 1 follows when tick k is answered (default on a bus).")
    ] = False,
    real_time: Annotated[bool, typer.Option("--real-time", help="One tick per millisecond, by the clock.")] = False,
    key: Annotated[
        Path | None,
        typer.Option(
            help="Key file of the controller on the bus (hexload key new).",
            show_default="a new one for this run; with --external-controller none",
        ),
    ] = None,
    sample_codes: Annotated[
        bool, typer.Option("--sample-codes", help="Authenticate samples with the key too: a code for 16 ticks.")
    ] = False,
    answer_codes: Annotated[
        bool,
        typer.Option(
            "--answer-codes", help="Authenticate answers with the key too: a code for 16 ticks, or for 64 (classic)."
        ),
    ] = False,
    feed: Annotated[
        str | None,
        typer.Option(help="Run simulator and controller as two programs on LCM instead of a bus: lcm, lcm:URL."),
    ] = None,
    publish: Annotated[
        str | None,
        typer.Option(help="Publish the run on LCM, samples and truth, for hexload spy and lcm-logger: lcm, lcm:URL."),
    ] = None,
    answer_timeout: Annotated[
        float | None,
        typer.Option(
            help="Seconds of the controller's silence that end a run in lockstep, or are reported in real time."
        ),
    ] = None,
    external_controller: Annotated[
        bool,
        typer.Option("--external-controller", help="The controller is on the bus already: do not start hexload_ecu."),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the run directory given by --out.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    view: Annotated[
        bool,
        typer.Option(
            "--view",
            help="Show it in the browser: with --real-time as it runs, with a controller that takes commands; else afterwards.",
        ),
    ] = False,
) -> None:
    """Runs a scenario in closed loop and writes a run directory: log, truth, estimates, metadata.

    Ctrl-C ends a run early, status 130; the run directory then holds what there was.

    Status on a bus: 3 the controller is silent, 4 it speaks another profile, 5 a second one is on the bus, 6 the bus is down, 7
    the controller is in fault.

    Example:  hexload sim paper --seed 7 --out runs/seven

    Example:  hexload vm -- tools/hexload sim paper --bus socketcan:vcan0 --lockstep
    """
    from hexload.cli import sim as verb
    from hexload.simulation.sim import SimRequest, resolve_scenario

    request = SimRequest(
        scenario=resolve_scenario(scenario),
        out=out,
        seed=seed,
        duration=duration,
        substeps=substeps,
        estimator=estimator,
        prior=prior,
        rig=rig,
        bus=bus,
        profile=profile,
        lockstep=lockstep,
        real_time=real_time,
        key=key,
        sample_codes=sample_codes,
        answer_codes=answer_codes,
        feed=feed,
        publish=publish,
        answer_timeout=answer_timeout,
        external_controller=external_controller,
        force=force,
        quiet=quiet or as_json,
    )
    verb.run(request, as_json, view)


def report(
    runs: Annotated[list[Path], typer.Argument(help="One or several run directories.", metavar="RUN_DIR...")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Page to write (.html).", show_default="RUN_DIR/report.html; of several: build/runs/report.html"
        ),
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help="Picture to write (.png) of the page's upper part; needs chromium.")
    ] = None,
) -> None:
    """Writes one self-contained HTML page: tracking, signals, estimates, consistency, configuration; of the paper's filter
    Table 3, of the momentum filters the ten parameters with verdicts in words and the load as a body.

    Example:  hexload report build/runs/paper-1 --out paper.html
    """
    from hexload.report import page as verb

    out = out or verb.default_page(runs)
    verb.write_report(runs, out)
    print(out)
    if screenshot is not None:
        from hexload.io.atomic_file import replaced_when_done
        from hexload.view.picture import write_page_picture

        with replaced_when_done(screenshot) as file:
            write_page_picture(out, file)
        print(screenshot)


def bridge(
    bus: Annotated[
        str,
        typer.Option(help=f"Bus to listen on: {BUSES}."),
    ],
    profile: Profile = None,
    lcm: Annotated[
        str | None, typer.Option(help="LCM to publish on: its URL.", show_default="udpm://239.255.76.67:7667?ttl=0")
    ] = None,
    samples: Annotated[
        bool, typer.Option("--samples", help="Publish the leg samples too, as the bus rounds them.")
    ] = False,
) -> None:
    """Listens on a CAN bus, never sends, and publishes on LCM what it carried: estimates, health, bus statistics.

    Ends with Ctrl-C, with a summary.

    Example:  hexload bridge --bus socketcan:can0 --samples
    """
    from hexload.simulation import bridge as verb

    given = {"--bus": bus, "--profile": profile, "--lcm": lcm}
    options = [word for name, value in given.items() if value is not None for word in (name, value)]
    verb.run_bridge((*options, *(["--samples"] if samples else [])))
