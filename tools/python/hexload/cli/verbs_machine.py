"""Verbs before a machine runs: its platform file, a motion for it, its controller's key."""

from pathlib import Path
from typing import Annotated

import typer

from hexload.cli.options import AsJson, Force, PlatformFile, Quiet


def platform_new(
    out: Annotated[Path, typer.Option(help="Platform file to write (.toml), with comments.")],
    platform_radius: Annotated[str | None, typer.Option(help="Radius of the circle of the platform's hinges.")] = None,
    platform_angle: Annotated[
        str | None,
        typer.Option(
            help="Half the angle between the hinges of a pair of the platform, base pairs around 0, 120, 240 deg, platform pairs 60 deg further; or its six hinges' angles."
        ),
    ] = None,
    platform_hinges: Annotated[
        str | None,
        typer.Option(
            help="The platform's hinges, instead of radius and angle: x, y, z of six, or a file (.csv) of them."
        ),
    ] = None,
    base_radius: Annotated[str | None, typer.Option(help="Radius of the circle of the base's hinges.")] = None,
    base_angle: Annotated[
        str | None,
        typer.Option(help="Half the angle between the hinges of a pair of the base; or its six hinges' angles."),
    ] = None,
    base_hinges: Annotated[
        str | None,
        typer.Option(help="The base's hinges, instead of radius and angle: x, y, z of six, or a file (.csv) of them."),
    ] = None,
    leg_length: Annotated[
        str | None, typer.Option(help="Length of the legs at home, between hinge centres: one number, or six.")
    ] = None,
    home_height: Annotated[
        str | None,
        typer.Option(help="Height of the platform's origin over the base's at home, instead of --leg-length."),
    ] = None,
    stroke: Annotated[
        str | None, typer.Option(help="Shortest and longest displacement of a leg from home; one number: both ways.")
    ] = None,
    leg_range: Annotated[
        str | None, typer.Option(help="Shortest and longest length of a leg, instead of --stroke.")
    ] = None,
    mass: Annotated[
        str | None, typer.Option(help="Mass of the empty platform, with the parts of the legs that move with it.")
    ] = None,
    com: Annotated[
        str | None,
        typer.Option(help="Centre of mass of the empty platform, x, y, z in platform axes.", show_default="0, 0, 0"),
    ] = None,
    inertia: Annotated[
        str | None,
        typer.Option(
            help="Inertia of the empty platform about its origin: xx, yy, zz[, xy, xz, yz].", show_default="of a disc"
        ),
    ] = None,
    displacement_sigma: Annotated[
        str | None, typer.Option(help="Noise of a leg's displacement sensor, one standard deviation.")
    ] = None,
    velocity_sigma: Annotated[
        str | None,
        typer.Option(help="Noise of a leg's velocity sensor, one standard deviation; none: there are no such sensors."),
    ] = None,
    force_sigma: Annotated[
        str | None, typer.Option(help="Noise of a leg's force sensor, one standard deviation.")
    ] = None,
    leg_speed: Annotated[str | None, typer.Option(help="Speed of an unloaded leg; for hexload excite.")] = None,
    leg_force: Annotated[str | None, typer.Option(help="Leg force at standstill; for hexload excite.")] = None,
    speed_sum: Annotated[
        str | None,
        typer.Option(help="Largest sum of the six legs' speeds that the pump or supply feeds; for hexload excite."),
    ] = None,
    load: Annotated[str | None, typer.Option(help="Mass of the load, if it is known.")] = None,
    gravity: Annotated[str | None, typer.Option(help="Acceleration of gravity.", show_default="9.81")] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Writes the platform file of your machine from radii and angles, or lists of hinges, and the legs at home.

    Numbers may have a unit (400mm, 15deg, 5kN); of one without, a guess is made and told. What is missing is asked for, on a terminal.
    The file is then checked as `hexload platform check` does. Exit status: 0; 2 for something that is refused, and nothing is written; 3 for a
    file with something implausible in it.

    Example:  hexload platform new --out mine.toml --platform-radius 400mm --platform-angle 15 --base-radius 600mm --base-angle 10 --leg-length 874mm --stroke 300mm --mass 100 --displacement-sigma 20um --velocity-sigma none --force-sigma 5
    """
    from hexload.cli import output, platform_check, platform_new

    given = {
        "platform-radius": platform_radius,
        "platform-angle": platform_angle,
        "platform-hinges": platform_hinges,
        "base-radius": base_radius,
        "base-angle": base_angle,
        "base-hinges": base_hinges,
        "leg-length": leg_length,
        "home-height": home_height,
        "stroke": stroke,
        "leg-range": leg_range,
        "mass": mass,
        "com": com,
        "inertia": inertia,
        "displacement-sigma": displacement_sigma,
        "velocity-sigma": velocity_sigma,
        "force-sigma": force_sigma,
        "leg-speed": leg_speed,
        "leg-force": leg_force,
        "speed-sum": speed_sum,
        "load": load,
        "gravity": gravity,
    }
    guesses, checked = platform_new.new(given, out, force)  # outside of told(): it asks for what is missing
    with output.told(as_json, quiet) as figures:
        platform_new.print_new(guesses, out)
        platform_check.print_findings(checked)
        figures.update({"file": out, "guesses": guesses}, **platform_check.figures(checked))
    if checked.findings:
        raise typer.Exit(output.IMPLAUSIBLE)


def platform_check(
    platform: Annotated[Path, typer.Argument(help="Platform file (.toml).")],
    report: Annotated[
        Path | None,
        typer.Option(help="Page to write (.html): pictures of the machine, its workspace, maps of condition."),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """What a platform file says of a machine: home pose, reach along each axis, condition over x, y and tilt; and what of it cannot be.

    Named are hinges in another unit, legs mirrored or in each other's place, a home pose that is nearly singular, a stroke that cannot be
    used, mass, inertia, noise and actuators of another kind of machine. Exit status: 0; 2 for a file that no command takes; 3 when
    something is implausible.

    Example:  hexload platform check mine.toml --report mine.html
    """
    from hexload.cli import output
    from hexload.cli import platform_check as verb
    from hexload.estimation.machine_check import check

    with output.told(as_json, quiet) as figures:
        checked = check(platform)
        verb.print_checked(checked)
        if report is not None:
            verb.write_page(checked, report)
            print(f"page:      {report}")
        figures.update(verb.figures(checked))
    if checked.findings:
        raise typer.Exit(output.IMPLAUSIBLE)


def excite(
    platform: PlatformFile,
    duration: Annotated[float, typer.Option(help="Seconds that the motion may take, run-in and run-out included.")],
    out: Annotated[
        Path, typer.Option(help="Trajectory to write (.csv: t,x,y,z,roll,pitch,yaw); a summary (.json) goes beside it.")
    ],
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario whose hydraulics and servo bound the motion, instead of what the actuators can do."
        ),
    ] = None,
    leg_speed: Annotated[
        float | None,
        typer.Option(
            help="Speed of an unloaded leg, m/s.", show_default="actuators.leg_speed_m_s of the platform file"
        ),
    ] = None,
    leg_force: Annotated[
        float | None,
        typer.Option(help="Leg force at standstill, N.", show_default="actuators.leg_force_n of the platform file"),
    ] = None,
    speed_sum: Annotated[
        float | None,
        typer.Option(
            help="Largest sum of the six legs' speeds that the pump or supply feeds, m/s.",
            show_default="actuators.speed_sum_m_s of the platform file",
        ),
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(
            help="Mass of the expected load, kg.",
            show_default="the platform file's known mass, or twice the platform's",
        ),
    ] = None,
    mass_max: Annotated[
        float | None,
        typer.Option(
            help="Mass of the heaviest load that may be on the platform, kg.", show_default="1.5 times the expected one"
        ),
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(
            help="Height of the load's centre of mass over the platform, m.", show_default="3/4 of the hinges' radius"
        ),
    ] = None,
    empty: Annotated[
        bool,
        typer.Option("--empty", help="No load, for hexload commission: the platform's own parameters are looked for."),
    ] = False,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the random starts; the same seed gives the same motion.")
    ] = 1,
    starts: Annotated[int, typer.Option(min=1, help="Searches, each from another random motion.")] = 4,
    iterations: Annotated[
        int, typer.Option(min=1, help="Steps of the best search at most; the others take a quarter.")
    ] = 60,
    sines: Annotated[
        int, typer.Option(min=2, max=30, help="Number of frequencies in each of the six coordinates.")
    ] = 8,
    frequency_max: Annotated[
        float, typer.Option(help="Highest frequency of the motion, Hz: the servo's bandwidth.")
    ] = 2.5,
    tilt_max: Annotated[
        float, typer.Option(help="Largest angle between the platform's normal and the vertical, deg.")
    ] = 30.0,
    condition_max: Annotated[
        float | None,
        typer.Option(
            help="Largest condition number of the Jacobian (Frobenius norm, moments divided by the hinges' radius); 1 at best.",
            show_default="3 times that of home",
        ),
    ] = None,
    distance_min: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="Smallest distance of that Jacobian to a singular one, 1 / |J^-1|.",
            show_default="0.3 of that of home",
        ),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Finds a motion that identifies a load as well as the machine's stroke, actuators and supply allow in a given time.

    Six finite Fourier series, from rest at home to rest at home, for the smallest worst bound on the ten parameters relative to their
    scales, inside limits of stroke, speed, supply, force, tilt, condition and distance to singularity. Then simulated with servo and
    no, the expected and the heaviest load; scaled down, or refused, when the machine does not follow or leaves its workspace.
    With --empty the ten parameters are the platform's own, for hexload commission.
    The tables show each limit with the margin left, and the bounds beside those of the paper's motion and of the multisine.

    Example:  hexload excite --platform tests/data/paper_load.toml --scenario multisine --duration 5 --out excite.csv
    """
    from hexload.cli import excite as verb
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep, refuse_existing

    wish = verb.Wish(
        platform_file=platform,
        duration_s=duration,
        scenario=scenario,
        mass_kg=mass,
        height_m=height,
        seed=seed,
        starts=starts,
        iterations=iterations,
        sines=sines,
        frequency_max_hz=frequency_max,
        mass_max_kg=mass_max,
        actuators=(leg_speed, leg_force, speed_sum),
        tilt_max_deg=tilt_max,
        condition_max=condition_max,
        distance_min=distance_min,
        empty=empty,
    )
    with output.said(as_json, quiet):
        keep((platform,), (out, verb.summary_of(out)))
        refuse_existing((out, verb.summary_of(out)), force)
        found = verb.design(wish, out)
        verb.print_summary(found, wish, out)
    if as_json:
        print(verb.summary_of(out).read_text(encoding="utf-8"), end="")


def key_new(file: Annotated[Path, typer.Argument(help="Key file to write, which its owner alone can read.")]) -> None:
    """Writes a new key file: 32 random hexadecimal digits, mode 0600.

    A controller that has it (hexload_ecu --key, at build HEXLOAD_KEY_FILE) accepts commands only from holders of the
    same key (sim, view: --key). Copy it to their computers over a secure channel.

    Example:  hexload key new platform.key
    """
    from hexload.io.key_file import new_key

    new_key(file)
    print(file)
