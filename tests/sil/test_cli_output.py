"""What verbs print: with --json figures for programs and nothing else, with --quiet nothing, and a path on one line."""

import dataclasses
import inspect
import json
import os
import subprocess

import numpy as np
import pytest
import typer

from hexload import project
from hexload.cli.app import app
from hexload.errors import InputError
from hexload.estimation.load_summary import digits_of
from hexload.io.log_columns import COLUMNS
from hexload.io.log_file import read_log
from hexload.simulation import sim
from hexload.theory.bound import THETA_NAMES
from hexload_dev import build, cli, vm

DATA = project.ROOT / "tests" / "data"
UNKNOWN = DATA / "unknown_load.toml"
FIGURES = {
    "demo", "sim", "replay", "convert", "tare", "commission", "excite", "export", "campaign", "faults", "soak", "bench", "doctor",
    "watch",
}  # fmt: skip


@pytest.fixture
def hexload(capfd):
    """A verb in this process: what it printed, on stdout and stderr."""

    def call(*words):
        try:
            app([str(word) for word in words], prog_name="hexload", standalone_mode=False)
        except typer.Exit as end:
            assert end.exit_code in (0, 3)
        return capfd.readouterr()

    return call


@pytest.fixture(scope="module")
def short_log(tmp_path_factory):
    """Two seconds of a recorded log, as CSV; in a folder with a long name."""
    folder = tmp_path_factory.mktemp(
        "a_folder_whose_name_alone_is_wider_than_the_eighty_columns_of_a_terminal_is_no_rarity"
    )
    log = read_log(DATA / "multisine_eccentric.csv.gz").rows(slice(0, 2000))
    rows = np.column_stack([log.t_s, log.displacement_m, log.velocity_m_s, log.force_n])
    np.savetxt(folder / "log.csv", rows, fmt="%.9g", delimiter=",", header=",".join(COLUMNS), comments="")
    return folder / "log.csv"


def replay(log):
    return "replay", log, "--platform", UNKNOWN, "--out", log.parent / "estimates.csv"


VERBS = {
    "replay": replay,
    "convert": lambda log: ("convert", log, log.parent / "again.csv"),
    "platform check": lambda log: ("platform", "check", UNKNOWN),
    "sim": lambda log: ("sim", "multisine", "--duration", "0.5", "--out", log.parent / "run", "--force"),
}


@pytest.mark.parametrize("verb", VERBS)
def test_json_is_all_that_is_printed_and_quiet_prints_nothing(hexload, short_log, verb):
    # GIVEN a verb that prints figures WHEN it is called with --json THEN stdout is one object, AND stderr is empty
    words = VERBS[verb](short_log)
    said = hexload(*words, "--json")
    assert isinstance(json.loads(said.out), dict) and said.err == ""
    # and WHEN with --quiet THEN nothing is printed, but the run directory, whose name sim chooses
    path = f"{short_log.parent / 'run'}\n" if verb == "sim" else ""
    assert hexload(*words, "--quiet") == (path, "")


def test_the_figures_of_a_replay_are_those_of_its_summary(hexload, short_log):
    # GIVEN a replay WHEN its figures are printed, and its summary
    figures = json.loads(hexload(*replay(short_log), "--json").out)
    summary = hexload(*replay(short_log)).out
    # THEN the ten parameters, the verdict and the files are the same
    assert list(figures["parameters"]) == list(THETA_NAMES)
    mass = figures["parameters"]["m"]
    assert f"{mass['value']:.{digits_of(mass['sigma'], 4)}f}" in summary
    assert f"verdict:   {figures['verdict']} after" in summary
    # and a path stands on one line, however long
    assert f"estimates: {figures['files']['estimates']}\n" in summary


def test_every_verb_that_prints_figures_has_the_option_json():
    named = {command.name or command.callback.__name__: command.callback for command in app.registered_commands}
    with_option = {name for name, call in named.items() if "as_json" in inspect.signature(call).parameters}
    assert with_option == FIGURES and cli.main


def test_a_build_counts_its_steps_on_a_terminal(monkeypatch, capfd, tmp_path):
    # GIVEN a terminal, and a program that talks like ninja
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    program = ["sh", "-c", "echo '[1/120] a'; echo '[37/120] b'; exit 1"]
    # WHEN it runs as a stage of a build, and fails
    with pytest.raises(build.ToolFailed, match="building host failed\n\\[1/120\\] a\n\\[37/120\\] b"):
        build._stage("building host", program, tmp_path / "log")
    # THEN one line has counted
    assert capfd.readouterr().err == (
        "[hexload] building host ...\r[hexload] building host ... [1/120]\r[hexload] building host ... [37/120]\n"
    )


def test_doctor_needs_nothing_set_up(tmp_path):
    # GIVEN a Python without the packages of the project WHEN doctor is run THEN it answers, as JSON too
    environment = os.environ | {"PYTHONPATH": str(project.ROOT / "tools" / "python"), "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["/usr/bin/python3", "-I", "-c", (
        "import sys; sys.path.insert(0, sys.argv[1]); sys.modules['rich'] = None; from hexload_dev import doctor;"
        "doctor.run_doctor(); doctor.run_doctor(True)"
    ), environment["PYTHONPATH"]]  # fmt: skip
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert result.returncode == 0, result.stderr
    text, _, figures = result.stdout.partition("\n{\n")
    assert text.startswith("AF_CAN socket: ") and len(json.loads("{" + figures)["rows"]) > 5
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "scenario, fits",
    {
        "paper": None, "paper_clean": None, "paper_run_in": None,
        "multisine": "momentum", "work": "momentum", "load_change": "momentum", "friction": "momentum_effects",
        "faults": "momentum_effects",
        "rig": None, "small_platform": None,  # their platform files' own is momentum
    }.items(),
)  # fmt: skip
def test_each_scenario_runs_with_an_estimator_that_fits_it(scenario, fits):
    # GIVEN a scenario of the repository, whose platform file has the paper's estimator
    # WHEN an estimator is looked for THEN one that knows of its load and its friction is taken, with the reason
    found = sim.fitting_estimator(sim.resolve_scenario(scenario))
    assert (found and found[0]) == fits
    assert fits is None or "paper" in found[1]


def test_each_wish_for_a_run_is_an_option_of_the_simulator():
    # GIVEN what can be asked for WHEN its fields are read THEN each is handed on, but for those that choose files and programs
    fields = {field.name for field in dataclasses.fields(sim.SimRequest)}
    assert fields - {"scenario", "out", "external_controller"} == {*sim.OF_BOTH, *sim.OF_SIMULATOR}
    # and a value follows its option, a flag stands alone, and what is not given is left out
    request = sim.SimRequest(DATA, duration=0.0, bus="udp_multicast:239.0.0.1", real_time=True, answer_timeout=2.0)
    bus = ("--bus", "udp_multicast:239.0.0.1")
    assert request.simulator_options() == (*bus, "--duration", "0.0", "--answer-timeout", "2.0", "--real-time")
    assert request.controller_options() == (*bus, "--real-time-priority")


@pytest.mark.parametrize("told", [False, True])
def test_a_momentum_run_starts_from_nothing_unless_told_otherwise(hexload, tmp_path, told):
    # GIVEN an empty platform whose file knows of a load of 500 kg, and where told, that the estimate starts from it
    platform = (project.SCENARIOS / "platforms" / "paper.toml").read_text()
    (tmp_path / "platform.toml").write_text(platform + "from_known_mass = true\n" * told)
    scenario = project.SCENARIOS.joinpath("load_change.toml").read_text()
    (tmp_path / "run.toml").write_text(scenario.replace("platforms/paper.toml", "platform.toml"))
    # WHEN the momentum filter runs THEN it says whether it was given that mass, and only then tells of another load
    said = hexload("sim", tmp_path / "run.toml", "--duration", 1, "--out", tmp_path / "run").out
    assert ("given beforehand: the load weighs 500 kg" in said) == told
    assert ("another load detected" in said) == told


def test_a_run_of_a_load_that_is_not_the_filters_says_what_mends_it(hexload, tmp_path):
    # GIVEN a load off the z axis and the paper's filter, as somebody asked for WHEN it runs
    words = ("sim", "multisine", "--estimator", "paper", "--duration", 3, "--out", tmp_path / "run")
    lines = hexload(*words).out.splitlines()
    # THEN the line before the path names the estimator that would do
    assert {"  verdict: misfit", "  verdict: inconsistent"} & set(lines)
    assert lines[-2].startswith("  mend: ") and "--estimator momentum" in lines[-2]
    assert lines[-1] == str(tmp_path / "run")


def test_runs_of_the_virtual_machine_come_home(tmp_path):
    # GIVEN what a guest has left, and an older run of the same name WHEN it is brought home
    for folder in ("out/runs/paper-1", "home/paper-1", "home/other-1"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "out/runs/paper-1/meta.json").write_text("new")
    (tmp_path / "home/paper-1/report.html").touch()
    brought = vm.bring_home(tmp_path / "out" / "runs", tmp_path / "home")
    # THEN it is in place of the older one, and the rest stays
    assert brought == [tmp_path / "home" / "paper-1"]
    assert [path.name for path in brought[0].iterdir()] == ["meta.json"]
    assert (tmp_path / "home" / "other-1").is_dir() and not (tmp_path / "out/runs/paper-1").exists()
    # and the guest is told where to write
    assert vm.guest_environment({})["HEXLOAD_RUNS"] == "/out/runs"


def test_a_run_of_the_virtual_machine_deletes_nothing_but_a_run(tmp_path):
    # GIVEN two runs that a guest has left, and a user's file where one of them is to lie WHEN they are brought home
    for folder in ("out/runs/paper-1", "out/runs/work-1", "home/work-1"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "home/work-1/notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"work-1: found notes.txt in it, expected nothing but a run; the guest's run"):
        vm.bring_home(tmp_path / "out" / "runs", tmp_path / "home")
    # THEN all is where it was
    assert (tmp_path / "home/work-1/notes.txt").read_text() == "mine"
    assert (tmp_path / "out/runs/work-1").is_dir() and (tmp_path / "out/runs/paper-1").is_dir()
