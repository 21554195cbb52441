"""The command line: verbs, their options and examples. Each verb's work is in the module of its name."""

import contextlib
import errno
import functools
import inspect
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

from hexload.errors import InputError, ToolFailed

EXIT_IMPLAUSIBLE_INPUT = 3  # of replay: estimates are there, and not to be believed; of platform: the file likewise

app = typer.Typer(
    name="hexload",
    help="Identifies the load of a Gough-Stewart platform: simulator, controller firmware, replay and report.\n\n"
    "Start here:  hexload demo",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

Estimator = Literal["paper", "momentum", "momentum_effects"]
Prior = Literal["safe", "printed"]
Profile = Literal["fd", "classic"]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        help='Which column is which channel, its unit and sign: a file (.toml), or a line of one, as dl = "Cylinder {leg} [mm]". Repeatable.'
    ),
]
Unchecked = Annotated[
    bool,
    typer.Option("--unchecked", help="Go on with a log whose units, signs or order contradict each other, as it is."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON, in SI units, instead of the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress, no summary.")]
Resample = Annotated[
    float | None, typer.Option(help="Put the rows on regular ticks of this period, s; between rows on straight lines.")
]


def _print_version(wanted: bool) -> None:
    if wanted:
        from hexload import project

        print(f"hexload {project.version()}")
        raise typer.Exit()


@app.callback()
def of_all(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    pass


@app.command()
def demo(
    view: Annotated[bool, typer.Option("--view", help="Then play the run in the browser: hexload view.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """The main job: simulator and controller in closed loop on the paper's motion, then the report.

    Example:  hexload demo --view
    """
    from hexload.cli import demo as verb
    from hexload.cli import output

    with output.said(as_json, quiet):
        directory, figures = verb.run_demo(as_json or quiet)
    if as_json:
        output.print_json(figures)
    if view:
        _view_run(directory)


@app.command()
def sim(
    scenario: Annotated[str, typer.Argument(help="Name of a scenario in host_sim/scenarios, or a .toml file.")],
    out: Annotated[Path | None, typer.Option(help="Run directory.", show_default="build/runs/NAME-SEED")] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of noise and trajectory, instead of the scenario's.")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Seconds, instead of the scenario's.")] = None,
    substeps: Annotated[int | None, typer.Option(min=1, help="RK4 steps per tick, instead of the scenario's.")] = None,
    estimator: Annotated[
        Estimator | None,
        typer.Option(
            help="Instead of the platform file's.",
            show_default="the platform file's; of paper where the load or the legs are not what it takes them for, one that fits",
        ),
    ] = None,
    prior: Annotated[Prior | None, typer.Option(help="Start covariance, instead of the platform file's.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file of hexload commission that the controller has.")] = None,
    bus: Annotated[
        str | None,
        typer.Option(
            help="Run simulator and controller as two programs on this bus: socketcan:INTERFACE, udp_multicast:GROUP[:PORT]; with --external-controller also slcan:HOST:PORT, slcan:DEVICE."
        ),
    ] = None,
    profile: Annotated[
        Profile | None, typer.Option(help="Frames of the bus: CAN FD or classic CAN.", show_default="fd")
    ] = None,
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
        bool, typer.Option("--sample-codes", help="Samples have codes of the key too, one for 16 ticks.")
    ] = False,
    answer_codes: Annotated[
        bool,
        typer.Option("--answer-codes", help="Answers have codes of the key too, one for 16 ticks, or 64 (classic)."),
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
    from hexload.cli import output
    from hexload.simulation import sim as verb

    if view and real_time:
        if bus in (None, "inproc") and feed is None:
            feed = "lcm"  # there a page can hear the controller, and command it
        publish = publish or feed or "lcm"
    if estimator is None and rig is None and (fit := verb.fitting_estimator(verb.resolve_scenario(scenario))):
        estimator, reason = fit
        if not (quiet or as_json):
            print(f"estimator {estimator}: {reason}", flush=True)
    stack = contextlib.ExitStack()
    if key is None and bus not in (None, "inproc") and not external_controller:
        key = stack.enter_context(verb.key_for_one_run())
    given = {
        "--duration": duration,
        "--substeps": substeps,
        "--estimator": estimator,
        "--prior": prior,
        "--rig": rig,
        "--bus": bus,
        "--key": key,
        "--profile": profile,
        "--feed": feed,
        "--publish": publish,
        "--answer-timeout": answer_timeout,
    }
    options = [word for name, value in given.items() if value is not None for word in (name, str(value))]
    flags = {
        "--force": force,
        "--quiet": quiet or as_json,
        "--lockstep": lockstep,
        "--real-time": real_time,
        "--sample-codes": sample_codes,
        "--answer-codes": answer_codes,
    }
    options += [name for name, wanted in flags.items() if wanted]
    controller = None
    if (bus not in (None, "inproc") or feed) and not external_controller:
        controller = verb.controller_options(
            bus,
            feed,
            profile,
            estimator,
            prior,
            None if rig is None else str(rig),
            None if key is None else str(key),
            real_time,
        )
    run = functools.partial(verb.run_simulation, scenario, out, seed, tuple(options), controller)
    with stack:
        if view and real_time:
            verb.build_for(controller)  # a page is there when its address is told, and moves
            _view_simulation(verb.platform_file(verb.resolve_scenario(scenario)), bus, profile, publish, key, run)
            return
        directory = run()
    if as_json:
        output.print_json(verb.figures(directory))
    else:
        if not quiet and (mend := verb.mend_in_words(directory)):
            print(f"  mend: {mend}")
        print(directory)
    if view:
        _view_run(directory)


@app.command()
def replay(
    log: Annotated[
        Path,
        typer.Argument(
            help="Leg log: .csv or .csv.gz (t,dl1..dl6,vl1..vl6,f1..f6; vl1..vl6 may be absent), .mcap, .mf4, candump, .blf, .asc, .trc or LCM event log."
        ),
    ],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml).")],
    out: Annotated[Path, typer.Option(help="Estimates to write (.csv), one row per tick.")],
    estimator: Annotated[Estimator | None, typer.Option(help="Instead of the platform file's.")] = None,
    prior: Annotated[Prior | None, typer.Option(help="Start covariance, instead of the platform file's.")] = None,
    tare: Annotated[Path | None, typer.Option(help="File of hexload tare, made with the same platform file.")] = None,
    rig: Annotated[
        Path | None, typer.Option(help="File of hexload commission, made with the same platform file.")
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
    view: Annotated[bool, typer.Option("--view", help="Then play it in the browser: hexload view.")] = False,
    commanded: Annotated[
        Path | None,
        typer.Option(
            help="Motion that was commanded (.csv: t,x,y,z,roll,pitch,yaw, as of hexload excite): is each leg the one that it is taken for?"
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
    with output.said(as_json, quiet):
        keep((log, platform, tare, rig, commanded), (out, bodies, report, trace))
        result = replay_log(log, platform, estimator, prior, out, tare, bodies, report, trace, rig, way_in, commanded)
        print_summary(result, out, bodies, report, trace)
    if as_json:
        output.print_json(
            figures(result) | {"files": {"estimates": out, "bodies": bodies, "page": report, "trace": trace}}
        )
    if view:
        _view_replay(platform, log, result)
    if not is_believed(result):
        raise typer.Exit(EXIT_IMPLAUSIBLE_INPUT)


@app.command()
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

    with output.said(as_json, quiet):
        keep((log, platform, estimates), (out,))
        rows, remarks = verb.convert(log, out, columns or (), resample, platform, estimates, unchecked)
        for remark in remarks:
            print(f"log:       {remark}")
        print(f"written:   {out}, {rows} rows")
    if as_json:
        output.print_json({"log": out, "rows": rows, "remarks": remarks})


@app.command()
def tare(
    log: Annotated[
        Path, typer.Argument(help="Leg log of the empty platform, in motion; formats as of hexload replay.")
    ],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml).")],
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

    with output.said(as_json, quiet):
        keep((log, platform), (out,))
        found = make_tare(log, platform, out, largest_offset, WayIn(columns or (), resample, unchecked))
        print_summary(found, out)
    if as_json:
        output.print_json(figures(found) | {"file": out})


@app.command("commission")
def commission_verb(
    log: Annotated[
        Path, typer.Argument(help="Leg log of the empty platform, in motion; formats as of hexload replay.")
    ],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml).")],
    out: Annotated[Path, typer.Option(help="Rig file to write (.toml), for hexload replay --rig.")],
    reference: Annotated[
        Path | None,
        typer.Option(
            help="Leg log with a known mass on the platform, moving: tells the force sensors' common gain and how friction "
            "grows with force."
        ),
    ] = None,
    reference_mass: Annotated[float | None, typer.Option(min=1.0, help="That mass, kg.")] = None,
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
    force: Annotated[bool, typer.Option("--force", help="Replace rig file and page.")] = False,
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
    from hexload.estimation.commission import Wish, commission
    from hexload.estimation.input_check import WayIn

    way_in = WayIn(columns or (), resample, unchecked)
    wish = Wish(log, platform, out, reference, reference_mass, loaded, largest_offset, report, way_in)
    with output.said(as_json, quiet):
        found = commission(wish)
        print_summary(found, out)
        if report is not None:
            print(f"page:      {report}")
    if as_json:
        output.print_json(found | {"file": out, "page": report})


@app.command()
def export(
    rig: Annotated[Path, typer.Argument(help="Rig file of hexload commission (.toml).")],
    platform: Annotated[Path, typer.Option(help="Platform file (.toml) that it was made with.")],
    out: Annotated[Path, typer.Option(help="C header to write (NAME.h); the constant in it is called NAME.")],
    tick: Annotated[
        float | None, typer.Option(help="Sampling period of the controller, s.", show_default="the platform file's")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the header.")] = False,
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

    with output.said(as_json, quiet):
        keep((rig, platform), (out,))
        name = write_header(rig, platform, out, tick, force)
        print(f"header:    {out}")
        print(f'use:       #include "{out.name}", then hexload_init(&estimator, &{name})')
    if as_json:
        output.print_json({"file": out, "constant": name})


@app.command()
def excite(
    platform: Annotated[Path, typer.Option(help="Platform file (.toml).")],
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
        typer.Option(help="Of an unloaded leg, m/s.", show_default="actuators.leg_speed_m_s of the platform file"),
    ] = None,
    leg_force: Annotated[
        float | None,
        typer.Option(help="Of a leg at standstill, N.", show_default="actuators.leg_force_n of the platform file"),
    ] = None,
    speed_sum: Annotated[
        float | None,
        typer.Option(
            help="Of six legs at a time, m/s: what pump or supply feeds.",
            show_default="actuators.speed_sum_m_s of the platform file",
        ),
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(help="Expected load, kg.", show_default="the platform file's known mass, or twice the platform's"),
    ] = None,
    mass_max: Annotated[
        float | None,
        typer.Option(help="Heaviest load that may be on the platform, kg.", show_default="1.5 times the expected one"),
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(help="Of its centre of mass over the platform, m.", show_default="3/4 of the hinges' radius"),
    ] = None,
    empty: Annotated[
        bool,
        typer.Option("--empty", help="No load, for hexload commission: the platform's own parameters are looked for."),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the random starts; the same seed gives the same motion.")] = 1,
    starts: Annotated[int, typer.Option(min=1, help="Searches, each from another random motion.")] = 4,
    iterations: Annotated[
        int, typer.Option(min=1, help="Steps of the best search at most; the others take a quarter.")
    ] = 60,
    sines: Annotated[int, typer.Option(min=2, max=30, help="Frequencies in each of the six coordinates.")] = 8,
    frequency_max: Annotated[float, typer.Option(help="Highest of them, Hz; the servo's bandwidth.")] = 2.5,
    tilt_max: Annotated[float, typer.Option(help="Of the platform's normal against the vertical, deg.")] = 30.0,
    condition_max: Annotated[
        float | None,
        typer.Option(
            help="Of the Jacobian, Frobenius, moments by the hinges' radius; 1 at best.",
            show_default="3 times that of home",
        ),
    ] = None,
    distance_min: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="Of that Jacobian to a singular one, 1 / |J^-1|.", show_default="0.3 of that of home"
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace trajectory and summary.")] = False,
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
    # Thousands of products of small matrices: threads of numpy's library would wait for each other at twice the cost.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from hexload.cli import excite as verb
    from hexload.cli import output
    from hexload.cli.kept_inputs import keep, refuse_existing

    wish = verb.Wish(
        platform,
        duration,
        scenario,
        mass,
        height,
        seed,
        starts,
        iterations,
        sines,
        frequency_max,
        mass_max,
        (leg_speed, leg_force, speed_sum),
        tilt_max,
        condition_max,
        distance_min,
        empty,
    )
    with output.said(as_json, quiet):
        keep((platform,), (out, verb.summary_of(out)))
        refuse_existing((out, verb.summary_of(out)), force)
        found = verb.design(wish, out)
        verb.print_summary(found, wish, out)
    if as_json:
        print(verb.summary_of(out).read_text(encoding="utf-8"), end="")


platform_app = typer.Typer(
    name="platform", help="Platform files: a new one for your machine, and what is wrong in one.", no_args_is_help=True
)
app.add_typer(platform_app)


@platform_app.command("new")
def platform_new(
    out: Annotated[Path, typer.Option(help="Platform file to write (.toml), with comments.")],
    platform_radius: Annotated[str | None, typer.Option(help="Of the circle of the platform's hinges.")] = None,
    platform_angle: Annotated[
        str | None,
        typer.Option(
            help="Half the angle between the hinges of a pair, base pairs around 0, 120, 240 deg, platform pairs 60 deg further; or the six hinges' angles."
        ),
    ] = None,
    platform_hinges: Annotated[
        str | None,
        typer.Option(help="Instead of radius and angle: x, y, z of the six hinges, or a file (.csv) of them."),
    ] = None,
    base_radius: Annotated[str | None, typer.Option(help="The same of the base.")] = None,
    base_angle: Annotated[str | None, typer.Option(help="The same of the base.")] = None,
    base_hinges: Annotated[str | None, typer.Option(help="The same of the base.")] = None,
    leg_length: Annotated[
        str | None, typer.Option(help="Of the legs at home, between hinge centres: one number, or six.")
    ] = None,
    home_height: Annotated[
        str | None, typer.Option(help="Instead: of the platform's origin over the base's, at home.")
    ] = None,
    stroke: Annotated[
        str | None, typer.Option(help="Shortest and longest displacement of a leg from home; one number: both ways.")
    ] = None,
    leg_range: Annotated[str | None, typer.Option(help="Instead: shortest and longest length of a leg.")] = None,
    mass: Annotated[
        str | None, typer.Option(help="Of the empty platform, with what of the legs moves with it.")
    ] = None,
    com: Annotated[
        str | None, typer.Option(help="Its centre of mass, x, y, z in platform axes.", show_default="0, 0, 0")
    ] = None,
    inertia: Annotated[
        str | None,
        typer.Option(
            help="Its inertia about the platform's origin: xx, yy, zz[, xy, xz, yz].", show_default="of a disc"
        ),
    ] = None,
    displacement_sigma: Annotated[str | None, typer.Option(help="Noise of a leg's displacement sensor.")] = None,
    velocity_sigma: Annotated[str | None, typer.Option(help="Noise of a leg's velocity sensor, or none.")] = None,
    force_sigma: Annotated[str | None, typer.Option(help="Noise of a leg's force sensor.")] = None,
    leg_speed: Annotated[str | None, typer.Option(help="Of an unloaded leg; for hexload excite.")] = None,
    leg_force: Annotated[str | None, typer.Option(help="Of a leg at standstill; for hexload excite.")] = None,
    speed_sum: Annotated[str | None, typer.Option(help="Of six legs at a time; for hexload excite.")] = None,
    load: Annotated[str | None, typer.Option(help="Mass of the load, when it is known.")] = None,
    gravity: Annotated[str | None, typer.Option(show_default="9.81")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Writes the platform file of your machine from radii and angles, or lists of hinges, and the legs at home.

    Numbers may have a unit (400mm, 15deg, 5kN); of one without, a guess is made and told. What is missing is asked for, on a terminal.
    The file is then checked like by hexload platform check. Exit status: 0; 2 for something that is refused, and nothing is written; 3 for a
    file with something implausible in it.

    Example:  hexload platform new --out mine.toml --platform-radius 400mm --platform-angle 15 --base-radius 600mm --base-angle 10 --leg-length 874mm --stroke 300mm --mass 100 --displacement-sigma 20um --velocity-sigma none --force-sigma 5
    """
    mine = ("out", "force", "as_json", "quiet")
    given = {name.replace("_", "-"): text for name, text in locals().items() if name not in mine and name != "mine"}
    from hexload.cli import output, platform_check, platform_new

    guesses, checked = platform_new.new(given, out, force)
    with output.said(as_json, quiet):
        platform_new.print_new(guesses, out)
        platform_check.print_findings(checked)
    if as_json:
        output.print_json({"file": out, "guesses": guesses} | platform_check.figures(checked))
    if checked.findings:
        raise typer.Exit(EXIT_IMPLAUSIBLE_INPUT)


@platform_app.command("check")
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

    with output.said(as_json, quiet):
        checked = check(platform)
        verb.print_checked(checked)
        if report is not None:
            verb.write_page(checked, report)
            print(f"page:      {report}")
    if as_json:
        output.print_json(verb.figures(checked))
    if checked.findings:
        raise typer.Exit(EXIT_IMPLAUSIBLE_INPUT)


key_app = typer.Typer(
    name="key", help="The key of a controller and of those who command it: new.", no_args_is_help=True
)
app.add_typer(key_app)


@key_app.callback()
def key_verb() -> None:
    """The key of a controller and of those who command it: new."""


@key_app.command("new")
def key_new(file: Annotated[Path, typer.Argument(help="File to write, for its owner alone.")]) -> None:
    """Writes a new key file: 32 random hexadecimal digits, mode 0600.

    A controller that has it (hexload_ecu --key, at build HEXLOAD_KEY_FILE) carries out the commands of who has it too (sim,
    view: --key), and no others. Copy it to their computers on a safe way.

    Example:  hexload key new platform.key
    """
    from hexload.io.key_file import new_key

    new_key(file)
    print(file)


@app.command("view")
def view_verb(
    recorded: Annotated[
        Path | None,
        typer.Argument(
            help="Run directory, or a log as of hexload replay with --platform. Without: live, --bus or --lcm."
        ),
    ] = None,
    platform: Annotated[Path | None, typer.Option(help="Platform file (.toml): of a log, of a live machine.")] = None,
    bus: Annotated[
        str | None,
        typer.Option(help="Listen on: socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT, slcan:DEVICE."),
    ] = None,
    profile: Annotated[Profile | None, typer.Option(help="Frames of the bus.", show_default="fd")] = None,
    lcm: Annotated[str | None, typer.Option(help="Listen on LCM: its URL, or default.")] = None,
    estimator: Annotated[Estimator | None, typer.Option(help="Of a log: instead of the platform file's.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Of a log: file of hexload commission.")] = None,
    key: Annotated[
        Path | None, typer.Option(help="Key file of the controller on the bus, for the buttons (hexload key new).")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Of the page, on 127.0.0.1; the next free one is taken.")
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
    verb.show_live(platform, bus, profile, _lcm_url(lcm), port, key)


@app.command()
def watch(
    bus: Annotated[
        str | None,
        typer.Option(help="Listen on: socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT, slcan:DEVICE."),
    ] = None,
    profile: Annotated[Profile | None, typer.Option(help="Frames of the bus.", show_default="fd")] = None,
    lcm: Annotated[str | None, typer.Option(help="Listen on LCM: its URL, or default.")] = None,
    platform: Annotated[
        Path | None,
        typer.Option(help="Platform file (.toml): tick, and the known mass that the paper's filter goes with."),
    ] = None,
    key: Annotated[
        Path | None, typer.Option(help="Key file of the controller on the bus: are the codes of its answers its own?")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="A JSON line four times a second instead, with the events since the last.")
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
    verb.watch(bus, profile, _lcm_url(lcm), machine, as_json, patience if once else None, key_bytes)


def _lcm_url(name: str | None) -> str | None:
    """Of lcm, lcm:URL, default or URL."""
    from hexload.view.lcm_listener import DEFAULT_URL

    if name is None:
        return None
    return DEFAULT_URL if name in ("lcm", "default") else name.removeprefix("lcm:")


def _view_run(directory: Path) -> None:
    from hexload.view import verb

    verb.show(*verb.recording_of(directory, None, None, None))


def _view_replay(platform: Path, log: Path, result: dict) -> None:
    from hexload.platform import Platform
    from hexload.view import verb
    from hexload.view.recorded import recording_of_replay

    verb.show(Platform.of(platform), recording_of_replay(log.name, result))


def _view_simulation(
    platform: Path,
    bus: str | None,
    profile: Profile | None,
    publish: str | None,
    key: Path | None,
    run: Callable[[], Path],
) -> None:
    """Live while it runs; then its recording, with a time slider."""
    from hexload.view import verb

    on = None if bus == "inproc" else bus
    with verb.live_page(platform, on, profile, _lcm_url(publish), key_file=key) as page:
        verb.tell(page)
        verb.wait_for_browser(page)
        directory = run()
        print(directory, flush=True)
        page.play(verb.recording_of(directory, None, None, None)[1])
        page.wait()


@app.command()
def report(
    runs: Annotated[list[Path], typer.Argument(help="One or several run directories.", metavar="RUN_DIR...")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Page to write (.html).", show_default="RUN_DIR/report.html; of several: build/runs/report.html"
        ),
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(help="Write its upper part as a picture (.png) too; needs chromium.")
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


@app.command()
def campaign(
    classes: Annotated[
        str | None,
        typer.Option(
            help="Classes of cases, with commas between them, or all. A wrong one is answered with their names.",
            show_default="multisine,paper,paper_rest,work",
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Cases of each class.")] = 48,
    seed_base: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Seed of the first case of each class; the others count on from it.",
            show_default="the date of the clone's last commit, so that no figure is of seeds used in development",
        ),
    ] = None,
    duration: Annotated[float, typer.Option(help="Seconds of each case.")] = 10.0,
    tick: Annotated[float, typer.Option(help="Sampling period of sensors and controller, s.")] = 1e-3,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the campaign; one that is there goes on.", show_default="build/runs/campaign"),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Scheduler of a Dask cluster, tls://HOST:PORT; it needs the three options after it.",
            show_default="all cores of this machine",
        ),
    ] = None,
    tls_ca: Annotated[Path | None, typer.Option(help="Certificates that the cluster's are checked with, PEM.")] = None,
    tls_cert: Annotated[Path | None, typer.Option(help="This machine's certificate for the cluster, PEM.")] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Its key, PEM.")] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Keep the run directory of each case, on the machine that ran it.")
    ] = False,
    restart: Annotated[bool, typer.Option("--restart", help="Do the cases again that are done.")] = False,
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


@app.command()
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
        typer.Option(help="Some of multisine, paper, work, pick_up; with commas between.", show_default="all"),
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="Some of momentum, momentum_effects, paper; with commas between.",
            show_default="all; with --quick momentum",
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(min=1, max=1000, help="Seeds of each fault, size and motion.", show_default="3; with --quick 1"),
    ] = None,
    seed_base: Annotated[
        int | None,
        typer.Option(min=0, help="The first seed.", show_default="the date of the clone's last commit"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the campaign; one that is there goes on.", show_default="build/runs/faults"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One size of each fault, one seed, one estimator.")] = False,
    restart: Annotated[bool, typer.Option("--restart", help="Do the cases again that are done.")] = False,
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
            kind, motion, estimator, runs, choose_seeds(seed_base), quick, rig, name_causes, own_machine
        )
        print(verb.run_faults(settings, folder, restart))
    if as_json:
        print((folder / "summary.json").read_text(encoding="utf-8"), end="")


@app.command()
def bridge(
    bus: Annotated[
        str,
        typer.Option(
            help="Bus to listen on: socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT, slcan:DEVICE."
        ),
    ],
    profile: Annotated[Profile | None, typer.Option(help="Frames of the bus.", show_default="fd")] = None,
    lcm: Annotated[str | None, typer.Option(help="LCM's URL.", show_default="udpm://239.255.76.67:7667?ttl=0")] = None,
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


def main() -> None:
    """Runs a verb; a refusal ends with one line on stderr and the status of its kind, as does what cannot be printed."""
    status = _run_verb()
    try:
        if sys.stdout is not None:  # as it is when the verb was started with none
            sys.stdout.flush()
    except OSError as error:
        status = status or _output_lost(error)
    sys.exit(status)


def _join_lines(verbs: typer.Typer) -> None:
    """Of help texts: typer would break paragraphs where the source does, and once more at the edge of the terminal."""
    for verb in verbs.registered_commands:
        paragraphs = inspect.cleandoc(verb.callback.__doc__ or "").split("\n\n")
        verb.help = "\n\n".join(paragraph.replace("\n", " ") for paragraph in paragraphs)
    for group in verbs.registered_groups:
        _join_lines(group.typer_instance)


def _run_verb() -> int:
    _join_lines(app)
    try:
        return app(prog_name="hexload", standalone_mode=False) or 0
    except (InputError, ToolFailed) as error:
        if str(error):
            print(f"hexload: {error}", file=sys.stderr)
        return error.exit_code
    except typer.TyperException as error:  # a wrong option or argument
        if error.format_message():  # none of a verb without arguments, which has shown its help
            print(f"hexload: {error.format_message()} (see hexload --help)", file=sys.stderr)
        return 2
    except (typer.Abort, KeyboardInterrupt):
        return 130
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EPIPE, errno.EIO) or error.filename is not None:
            raise
        return _output_lost(error)


def _output_lost(error: OSError) -> int:
    """What is still to be written goes nowhere, else Python would try, and complain, once more at its end."""
    print(f"hexload: standard output cannot be written: {error.strerror}", file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 1
