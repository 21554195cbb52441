"""Verbs that show a controller in operation, or a run afterwards: view and watch."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import Estimator, ListenBus, ListenLcm, Profile
from hexload.errors import InputError


def view(
    recorded: Annotated[
        Path | None,
        typer.Argument(
            help="Run directory, or a log (formats as of hexload replay) with --platform; without it live, with --bus or --lcm."
        ),
    ] = None,
    platform: Annotated[
        Path | None, typer.Option(help="Platform file (.toml) of the log, or of the live machine.")
    ] = None,
    bus: ListenBus = None,
    profile: Profile = None,
    lcm: ListenLcm = None,
    estimator: Annotated[
        Estimator | None, typer.Option(help="Estimator to replay a log with, instead of the platform file's.")
    ] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file of hexload commission to replay a log with.")] = None,
    key: Annotated[
        Path | None, typer.Option(help="Key file of the controller on the bus, for the buttons (hexload key new).")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page on 127.0.0.1; where it is taken, the next free one.")
    ] = 8080,
    screenshot: Annotated[
        Path | None, typer.Option(help="Write the page as a picture (.png) and end; needs chromium.")
    ] = None,
    at: Annotated[float | None, typer.Option(help="Moment of the picture, s.", show_default="the end")] = None,
) -> None:
    """Shows hexapod and load in the browser: live from a bus or LCM, or a recorded run or log with a time slider.

    Legs in the colour of their force or of the stroke that is left, the true and the estimated load as bodies, estimates with
    three-sigma bands, verdicts and events, health of bus and controller; live, buttons that command the controller. The page
    is for this computer alone; it only listens, and looks 30 times a second whatever comes in.

    Example:  hexload view build/runs/paper-1

    Example:  hexload view --bus socketcan:can0 --platform platform.toml
    """
    from hexload.view import verb

    if recorded is not None:
        shown = verb.recording_of(recorded, platform, estimator, rig)
        if screenshot is None:
            verb.show(*shown, port)
        else:
            verb.show_picture(*shown, screenshot, at)
        return
    if bus is None and lcm is None:
        raise InputError("view: found nothing to show, expected a run directory, a log, --bus or --lcm")
    if platform is None or screenshot is not None:
        raise InputError("view: found --bus or --lcm, expected --platform with it, and no --screenshot")
    verb.show_live(platform, bus, profile, lcm, port, key)


def watch(
    bus: ListenBus = None,
    profile: Profile = None,
    lcm: ListenLcm = None,
    platform: Annotated[
        Path | None,
        typer.Option(help="Platform file (.toml): tick, and the known mass that the paper's filter goes with."),
    ] = None,
    key: Annotated[
        Path | None, typer.Option(help="Key file of the controller on the bus: are the codes of its answers its own?")
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print a JSON line four times a second instead, with the events since the last."),
    ] = False,
    once: Annotated[bool, typer.Option("--once", help="Print the first answer and end.")] = False,
    patience: Annotated[float, typer.Option(help="Seconds that --once waits; then the status is 1.")] = 5.0,
) -> None:
    """Shows a controller in operation on the terminal: mass, centre, sigmas, verdicts, events, health, samples per second.

    For a look over ssh, where no browser is; drawn four times a second, whatever comes in. It only listens. q or Ctrl-C ends it.

    Example:  hexload watch --bus socketcan:can0

    Example:  hexload watch --lcm default --once --json
    """
    from hexload.io.key_file import read_key
    from hexload.view import watch as verb

    if bus is None and lcm is None:
        raise InputError("watch: found neither --bus nor --lcm, expected one of them, or both")
    machine = None
    if platform is not None:
        from hexload.platform import Platform

        machine = Platform.of(platform).native()
    key_bytes = None if key is None else read_key(key)
    verb.watch(bus, profile, lcm, machine, as_json, patience if once else None, key_bytes)
