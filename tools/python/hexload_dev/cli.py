"""The command line of a clone: the verbs of hexload.cli, for which it builds what they need, and the developers' own."""

from pathlib import Path
from typing import Annotated

import typer

from hexload import project
from hexload.cli.app import app, main
from hexload.cli.options import AsJson, Quiet
from hexload_dev import build

project.build_with(build.ensure_built)


@app.command()
def test(
    preset: Annotated[list[str] | None, typer.Option(help="Only this build preset; may be repeated.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only the preset host.")] = False,
    regex: Annotated[
        str | None, typer.Option("-R", "--regex", help="Only tests whose name matches, with all that they print.")
    ] = None,
    label: Annotated[
        str | None,
        typer.Option(
            "-L",
            "--label",
            help="Only tests of this kind: unit, install, properties, crosscheck, sil, hil, target, budget, static or fuzz; a regex.",
        ),
    ] = None,
) -> None:
    """Builds and runs every test; the last line reads 'N passed, N failed'.

    The CAN tests run on this kernel when vcan0 is up with mtu 72, else in the virtual machine (hexload vm). A machine that
    can have neither skips them and says so; with HEXLOAD_REQUIRE_VCAN=1, or CI=true, that is a failure. Results are in
    build/junit, what the CAN and LCM tests leave behind is in build/artefacts.

    In less than a minute, with what it builds:  hexload test --quick -L unit

    Example:  hexload test --quick -R kinematics
    """
    from hexload_dev import test as verb

    raise typer.Exit(verb.run_tests(["host"] if quick else preset, regex, label))


@app.command()
def soak(
    scenario: Annotated[
        str, typer.Argument(help="Name of a scenario in host_sim/scenarios, or a .toml file, with one load throughout.")
    ] = "work",
    hours: Annotated[
        float,
        typer.Option(min=0.017, help="Simulated time; the first minute, in which the filter settles, is not judged."),
    ] = 8.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of noise, trajectory and faults.")] = 1,
    faults: Annotated[
        bool,
        typer.Option(
            "--faults",
            help="Random faults of sensors, of loads and of a bus between simulator and controller, in lockstep; other runs "
            "than the scenario's.",
        ),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="With --faults: a folder, with which the same command goes on.")
    ] = None,
    restart: Annotated[bool, typer.Option("--restart", help="With --faults: does again what is done already.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Runs hours of simulated motion through the momentum estimator and looks for drift: covariance, false events, errors.

    Faster than real time, in one process, in constant memory, without files. Status 1 when something is found. With --faults:
    a look at each second, by outcome; status 1 when an estimate was wrong with a good verdict and no fault of a sensor was
    there before: by the bus alone.

    Example:  hexload soak --hours 8

    Example:  hexload soak --faults --hours 24
    """
    from hexload.cli import output
    from hexload.simulation import sim
    from hexload_dev import soak as verb

    with output.told(as_json, quiet) as figures:
        if faults:
            from hexload_dev import bus_soak

            settings = bus_soak.SoakSettings(hours, seed)
            figures.update(bus_soak.run_soak(settings, out or bus_soak.DEFAULT_OUT, restart))
        else:
            figures.update(verb.run_soak(sim.resolve_scenario(scenario), hours, seed))
    raise typer.Exit(1 if figures["found"] else 0)


@app.command()
def coverage() -> None:
    """Runs the unit tests with clang's counters: lines, branches and conditions (MC/DC) of the firmware, file by file.

    Status 1 when more or less is left out than tests/unit/uncovered.toml says, which has the reasons.

    Example:  hexload coverage
    """
    from hexload_dev import coverage as verb

    raise typer.Exit(verb.run_coverage())


@app.command("check-cpp")
def check_cpp() -> None:
    """Runs clang-tidy over the C++: simulator, transports, Linux port, platform files, LCM types, the Python module.

    With the checks of host_sim/.clang-tidy, which has the reasons of those that are off; some minutes. Status 1 when something
    is found. The firmware's C has its own in the tests.

    Example:  hexload check-cpp
    """
    from hexload_dev import check_cpp as verb

    raise typer.Exit(verb.run_check())


@app.command()
def mutate(
    count: Annotated[int, typer.Option(min=1, help="Size of the sample.")] = 150,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sample.")] = 1,
    file: Annotated[str | None, typer.Option(help="Only sources with this in their name.")] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Mutants that are tried at once.", show_default="processors")
    ] = None,
) -> None:
    """Puts small faults into the firmware, one at a time, and says which of them no unit test notices.

    Kill rate by file, and the survivors as they differ from the source; status 1 when there is one that
    tests/unit/accepted_mutants.toml has not. What was found is kept in build/mutation: the same sample goes on where it was
    stopped, and with new tests only survivors are tried again.

    Example:  hexload mutate --count 50 --file load_monitor
    """
    from hexload_dev import mutate as verb

    raise typer.Exit(verb.run_mutate(count, seed, file, jobs))


@app.command()
def fuzz(
    target: Annotated[list[str] | None, typer.Option(help="Only this one of tests/fuzz; may be repeated.")] = None,
    runs: Annotated[
        int, typer.Option(min=1, help="Inputs for each target; of logs, which are slower, a hundredth.")
    ] = 100_000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the inputs.")] = 1,
) -> None:
    """Runs clang's fuzzer, with both sanitizers, on what reads from outside and on every estimator's tick.

    Promises are checked beside crashes: estimates are finite, no sigma is below zero, what is refused changes nothing.
    Inputs that led somewhere new are in build/fuzz, and what breaks a promise in build/fuzz/findings; then status 1.

    Example:  hexload fuzz --target estimators --runs 1000000
    """
    from hexload_dev import fuzz as verb

    raise typer.Exit(verb.run_fuzz(target, runs, seed))


@app.command()
def bench(as_json: AsJson = False) -> None:
    """Measures the simulator's speed beside MuJoCo's, and the firmware's instructions and memory on a Cortex-M7.

    The controller is emulated; its instructions are counted stage by stage, and beside those of other filters. Writes a page with
    all of it, build/runs/bench/report.html.

    Example:  hexload bench
    """
    from hexload.cli import output
    from hexload_dev import bench as verb

    with output.told(as_json, False) as figures:
        figures.update(verb.run_bench())


@app.command()
def spy(
    url: Annotated[
        str, typer.Option(help="LCM's URL; the default stays within this computer.")
    ] = "udpm://239.255.76.67:7667?ttl=0",
) -> None:
    """Opens lcm-spy with hexload's types, so that it decodes what simulator, controller and bridge publish.

    A double click on a channel opens it, one on a number draws it. Without a screen: xvfb-run -a tools/hexload spy.

    Example:  hexload spy & hexload sim paper --real-time --publish lcm
    """
    from hexload_dev import spy as verb

    verb.run_spy(url)


@app.command(context_settings={"allow_interspersed_args": False})
def vm(
    command: Annotated[list[str], typer.Argument(help="Command and its arguments.", metavar="-- COMMAND...")],
    out: Annotated[
        Path | None, typer.Option(help="Folder that the guest sees as /out.", show_default="build/vm")
    ] = None,
    memory: Annotated[
        int, typer.Option(min=256, help="Memory of the machine, MiB; half of it is the room for files.")
    ] = 1024,
    timeout: Annotated[
        float | None, typer.Option(min=0, help="Seconds that COMMAND may take; then the status is 124.")
    ] = None,
) -> None:
    """Runs COMMAND in a small virtual machine whose kernel has CAN: vcan0 is up, for classic and FD frames.

    For machines without AF_CAN (containers, CI runners, WSL2). COMMAND runs as root, in the current folder, on the
    machine's own files; its output and exit status are passed on, its input is empty. What it writes vanishes, except in
    /out and in build/runs. HEXLOAD_*, LCM_*, PYTHONPATH, PATH and CI are passed on; HEXLOAD_VM=1 and HEXLOAD_ARTEFACTS=/out are set. The only
    network is loopback, with multicast for LCM. The guest's console is in console.log in the folder of --out. It is no sandbox: COMMAND may
    do what its user may.

    Example:  hexload vm -- sh -c 'candump -n 1 vcan0 & sleep 1; cansend vcan0 123#11'
    """
    from hexload_dev import vm as verb

    options = verb.GuestOptions(out or verb.DEFAULT_OUT, memory, timeout)
    raise typer.Exit(verb.run_in_guest(command, options))


@app.command()
def doctor(as_json: AsJson = False) -> None:
    """Says what this machine can do of what the tests need (CAN, multicast, LCM spy, real time), and how to mend the rest.

    Status 0 when `hexload test` has all that it needs, directly or in the virtual machine; else 1. Changes nothing: it installs no
    package and leaves no file, also in a fresh clone.

    Example:  hexload doctor
    """
    from hexload_dev import doctor as verb

    raise typer.Exit(verb.run_doctor(as_json))


@app.command()
def lock(
    upgrade: Annotated[bool, typer.Option("--upgrade", help="Take the newest versions.")] = False,
) -> None:
    """Writes tools/python/requirements.lock anew: every Python package that set-up installs, with version and hashes.

    Example:  hexload lock --upgrade
    """
    from hexload_dev import lock as verb

    print(f"{verb.run_lock(upgrade)} packages in {verb.LOCK.relative_to(project.ROOT)}")


@app.command()
def sbom(
    out: Annotated[Path, typer.Option(help="File to write.")] = project.BUILD / "sbom.json",
) -> None:
    """Writes what hexload is made with as CycloneDX: Python packages, Debian packages and fetched sources, with versions,
    licences and hashes.

    Example:  hexload sbom --out hexload.cdx.json
    """
    from hexload_dev import sbom as verb

    print(f"{verb.write(out)} components in {out}")


@app.command(hidden=True)
def bus_document() -> None:
    """Writes firmware/bus/README.md anew from hexload.dbc, after a change of the CAN contract.

    Example:  hexload bus-document
    """
    from hexload_dev import bus_document as verb

    print(verb.write_document())


__all__ = ["main"]
