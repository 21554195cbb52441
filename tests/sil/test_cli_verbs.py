"""The command line as a user meets it: help, refusals with status 2 and one line, nothing half written."""

import os
import signal
import subprocess
import sys
import time
import tomllib
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from forked_command import ENVIRONMENT, hexload
from hexload import project
from hexload.cli.app import app
from hexload.errors import InputError
from hexload.io.log_file import COLUMNS
from hexload.io.run_directory import read_run
from hexload.simulation.sim import known_scenarios, resolve_scenario
from hexload.view import verb as view
from synthetic_run import PLATFORM_TOML

VERBS = (
    "demo",
    "test",
    "sim",
    "replay",
    "tare",
    "excite",
    "report",
    "campaign",
    "faults",
    "bench",
    "soak",
    "vm",
    "doctor",
)
GOOD_LOG = "\n".join([",".join(COLUMNS), *(f"{k / 1000}" + ",0" * 12 + ",1070" * 6 for k in range(20)), ""])


def started(*arguments, environment=None):
    """The command line from its start."""
    return subprocess.run(
        [sys.executable, "-m", "hexload_dev", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=os.environ | ENVIRONMENT | (environment or {}),
    )


def assert_refused(result, *expected):
    """Status 2, and on stderr one line with all of `expected`."""
    assert result.returncode == 2, result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    for words in expected:
        assert words in result.stderr


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(GOOD_LOG)
    return path


@pytest.fixture
def platform(tmp_path):
    path = tmp_path / "platform.toml"
    path.write_text(PLATFORM_TOML)
    return path


def test_help_names_every_verb():
    result = started("--help")
    assert result.returncode == 0
    assert all(verb in result.stdout for verb in VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_the_help_of_each_verb_has_an_example(verb):
    result = hexload(verb, "--help")
    assert result.returncode == 0
    assert f"Example:  hexload {verb}" in result.stdout


@pytest.mark.parametrize(
    ("verb", "default"),
    [
        ("sim", "build/runs/NAME-SEED"),
        ("campaign", "multisine,paper,paper_rest,work"),
        ("faults", "build/runs/faults"),
        ("vm", "build/vm"),
    ],
)
def test_help_tells_what_is_taken_where_nothing_is_said(verb, default):
    # GIVEN an option whose default is not a value but found out WHEN help is asked for THEN it is told
    assert f"[default: ({default})]" in hexload(verb, "--help").stdout


@pytest.mark.parametrize("verb", ["new", "check"])
def test_the_help_of_the_platform_verbs_has_an_example(verb):
    result = hexload("platform", verb, "--help")
    assert result.returncode == 0
    assert f"Example:  hexload platform {verb}" in result.stdout


def test_the_version_is_the_projects():
    # GIVEN the version that the package is built with WHEN it is asked for THEN it is told, in one line
    described = tomllib.loads((project.ROOT / "pyproject.toml").read_text())
    result = started("--version")
    assert (result.returncode, result.stdout) == (0, f"hexload {described['project']['version']}\n")


def test_a_shell_is_told_how_verbs_and_options_go_on():
    # GIVEN what bash asks of a command WHEN a verb or an option has been begun THEN it is completed
    for words, expected in (("hexload comm", "commission"), ("hexload excite --leg-s", "--leg-speed")):
        asked = {"COMP_WORDS": words, "COMP_CWORD": str(words.count(" ")), "_HEXLOAD_COMPLETE": "complete_bash"}
        result = started(environment=asked)
        assert result.stdout.split() == [expected]


def test_without_a_verb_help_is_shown_and_nothing_else():
    result = started()
    assert (result.returncode, result.stderr) == (2, "")


def test_an_unknown_verb_is_refused():
    assert_refused(started("identify"), "No such command 'identify'")


def test_an_unknown_option_is_refused():
    assert_refused(hexload("sim", "paper", "--noise", "3"), "No such option", "--noise")


def test_an_option_of_the_wrong_type_is_refused():
    assert_refused(hexload("sim", "paper", "--seed", "many"), "'--seed'")


def test_an_unknown_scenario_is_refused_and_the_known_ones_are_listed():
    # GIVEN a name that no scenario has WHEN it is to be simulated THEN all names are offered
    assert_refused(hexload("sim", "papper"), "unknown scenario 'papper'", ", ".join(known_scenarios()), "paper")


def test_a_scenario_file_that_does_not_exist_is_refused():
    assert_refused(hexload("sim", "nowhere/x.toml"), "nowhere/x.toml: found no such file, expected a scenario")


def test_a_scenario_is_found_by_name_from_any_folder(tmp_path, monkeypatch):
    # GIVEN a working folder outside of the project
    monkeypatch.chdir(tmp_path)
    # WHEN a name is resolved THEN it is the project's scenario
    assert resolve_scenario("paper") == project.SCENARIOS / "paper.toml"


def test_sim_says_what_the_estimator_was_given_of_the_load_and_where_it_is_not_true(tmp_path):
    # GIVEN a scenario whose platform begins empty, and a platform file that knows of a load of 500 kg
    # WHEN it runs until this load has come, but not the next
    result = started("sim", "load_change", "--estimator", "paper", "--duration", 8.5, "--out", tmp_path / "run")
    # THEN the summary tells the mass, the key, and the time in which there is another load
    assert result.returncode == 0, result.stderr
    assert "given beforehand: the load weighs 500 kg (load.known_mass_kg of paper.toml)" in result.stdout
    assert result.stdout.count("not true:") == 1
    assert "not true: from 0 s on it weighs 0 kg" in result.stdout


def test_ctrl_c_leaves_a_run_directory_of_what_there_was(tmp_path):
    # GIVEN a run of an hour that has come some way
    out = tmp_path / "run"
    command = [sys.executable, "-m", "hexload_dev", "sim", "work", "--duration", "3600", "--out", str(out)]
    started = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 60.0
    while not any(path.stat().st_size > 1e5 for path in tmp_path.rglob("log.csv")):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    # WHEN Ctrl-C reaches it, as from a terminal the whole group
    os.killpg(started.pid, signal.SIGINT)
    text, errors = started.communicate(timeout=60.0)
    # THEN the status is a shell's, and the folder is one of a shorter run, which can be read
    assert started.returncode == 130, errors
    run = read_run(out)
    assert f"written to {out}" in text
    assert f"interrupted after {run.meta['duration_s']:g} s" in errors
    assert len(run.log.t_s) == run.meta["rows"] == round(1e3 * run.meta["duration_s"]) + 1 < 3.6e6
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_scenario_with_an_unknown_key_is_refused_by_the_simulator(tmp_path):
    # GIVEN a copy of the paper's scenario with a key that does not exist
    scenario = tmp_path / "scenario.toml"
    text = (project.SCENARIOS / "paper.toml").read_text()
    scenario.write_text(text.replace("[simulation]", "[simulation]\nspeed = 2"))
    # WHEN it is simulated THEN file and key are named, and no run directory appears
    result = hexload("sim", scenario, "--out", tmp_path / "run")
    assert_refused(result, str(scenario), "speed")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("there", ["mine.toml", "mine.html", "mine.csv", "mine.json"])
def test_what_took_long_to_get_is_not_overwritten_without_force(platform, tmp_path, there):
    # GIVEN an earlier rig file or its page, an earlier motion or its summary, and a log
    earlier, log = tmp_path / there, tmp_path / "log.csv"
    earlier.write_text("earlier")
    log.write_text("no log")
    if there in ("mine.toml", "mine.html"):
        words = ("commission", log, "--out", tmp_path / "mine.toml", "--report", tmp_path / "mine.html")
    else:
        words = ("excite", "--duration", 0.1, "--out", tmp_path / "mine.csv")
    # WHEN the verb is to write there THEN it is refused before anything is read, and nothing is lost
    result = hexload(*words, "--platform", platform)
    assert (result.returncode, result.stderr) == (
        2,
        f"hexload: {earlier}: found it already there, expected a new file, or --force to replace it\n",
    )
    # AND with --force it goes on, here to its next refusal, and leaves what it has not replaced
    if there in ("mine.html", "mine.json"):
        return
    forced = hexload(*words, "--platform", platform, "--force")
    assert forced.returncode == 2 and "already there" not in forced.stderr
    assert earlier.read_text() == "earlier" and log.read_text() == "no log"


def test_the_address_of_a_live_page_is_told_when_all_that_it_shows_is_built(monkeypatch):
    # GIVEN a fresh clone, in which a build takes its time WHEN a run is to be shown live
    done = []
    monkeypatch.setattr(project, "ensure_built", lambda *targets: done.extend(targets))
    monkeypatch.setattr(view, "live_page", lambda *_, **__: nullcontext(SimpleNamespace(play=id, wait=lambda: None)))
    monkeypatch.setattr(view, "tell", lambda page: done.append("told"))
    monkeypatch.setattr(view, "wait_for_browser", lambda page: None)
    monkeypatch.setattr(view, "recording_of", lambda *_: (None, None))
    monkeypatch.setattr("hexload.simulation.sim.run_simulation", lambda *_: Path("run"))
    app(["sim", "multisine", "--real-time", "--view"], prog_name="hexload", standalone_mode=False)
    # THEN simulator and controller are built before the address is told
    assert set(done[: done.index("told")]) >= {"hexload_sim_app", "hexload_ecu"}


def test_a_run_directory_is_not_overwritten_without_force(tmp_path):
    # GIVEN a folder with a file in it
    out = tmp_path / "run"
    out.mkdir()
    (out / "mine.txt").write_text("keep")
    # WHEN a run is to be written there THEN it is refused and the folder is as it was
    result = hexload("sim", "paper", "--duration", "0.05", "--out", out)
    assert_refused(result, str(out))
    assert [path.name for path in out.iterdir()] == ["mine.txt"]


def test_replay_needs_a_platform_file(log, tmp_path):
    assert_refused(hexload("replay", log, "--out", tmp_path / "e.csv"), "Missing option", "--platform")


def test_replay_refuses_a_missing_log(platform, tmp_path):
    result = hexload("replay", tmp_path / "no.csv", "--platform", platform, "--out", tmp_path / "e.csv")
    assert_refused(result, f"{tmp_path}/no.csv: found no such file, expected a log (.csv or .csv.gz)")


def test_replay_refuses_an_estimator_that_does_not_exist(log, platform, tmp_path):
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "e.csv", "--estimator", "magic")
    assert_refused(result, "'--estimator'", "magic", "paper")


def test_replay_refuses_a_prior_that_does_not_exist(log, platform, tmp_path):
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "e.csv", "--prior", "none")
    assert_refused(result, "'--prior'", "none", "safe", "printed")


def test_replay_refuses_a_platform_file_that_does_not_exist(log, tmp_path):
    result = hexload("replay", log, "--platform", tmp_path / "no.toml", "--out", tmp_path / "e.csv")
    assert_refused(result, f"{tmp_path}/no.toml")


@pytest.mark.parametrize(
    ("good", "bad", "named"),
    [
        ("mass_kg = 100.0", "mass = 100.0", "mass"),
        ("mass_kg = 100.0", "mass_kg = -1.0", "mass_kg"),
        ("stroke_m = [-0.3, 0.3]", "stroke_m = [0.3, -0.3]", "stroke_m"),
        ("home_leg_length_m = 0.8741", "home_leg_length_m = 0.1", "home_leg_length_m"),
        ("gravity_m_s2 = 9.81", "gravity_m_s2 = nan", "gravity_m_s2"),
        ("force_sigma_n = 5.0", "force_sigma_n = 'five'", "force_sigma_n"),
        ("[environment]", "[weather]", "environment"),
        ("[environment]", "[weather]\n[environment]", "weather"),
    ],
)
def test_replay_refuses_a_wrong_platform_file_and_names_file_and_key(log, platform, tmp_path, good, bad, named):
    # GIVEN a platform file with one thing wrong
    platform.write_text(PLATFORM_TOML.replace(good, bad))
    # WHEN a log is replayed THEN the message names file and key, and no output appears
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "e.csv")
    assert_refused(result, str(platform), named)
    assert not (tmp_path / "e.csv").exists()


def test_a_refused_replay_leaves_an_older_output_as_it_was(log, platform, tmp_path):
    # GIVEN an older output, and a log whose last row is cut
    out = tmp_path / "e.csv"
    out.write_text("earlier")
    log.write_text(GOOD_LOG[: len(GOOD_LOG) - 30])
    # WHEN it is replayed THEN it is refused, the output is untouched and nothing lies beside it
    assert_refused(hexload("replay", log, "--platform", platform, "--out", out), f"{log}: line 21: found")
    assert out.read_text() == "earlier"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["e.csv", "log.csv", "platform.toml"]


def test_replay_into_a_folder_that_does_not_exist_is_refused(log, platform, tmp_path):
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "no" / "e.csv")
    assert_refused(result, "found no folder", "expected an existing one")


def test_a_log_whose_rows_are_off_the_sampling_grid_is_refused(log, platform, tmp_path):
    # GIVEN a log of 1 ms steps with one row half a tick late
    log.write_text(GOOD_LOG.replace("\n0.015,", "\n0.0155,"))
    # WHEN it is replayed THEN the message names the log and the time
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "e.csv")
    assert_refused(result, f"{log} with {platform}: t: found 0.0155")


def test_a_log_with_missing_ticks_is_replayed(log, platform, tmp_path):
    # GIVEN a platform at rest at home whose log lacks three ticks
    log.write_text("\n".join(line for line in GOOD_LOG.split("\n") if line[:5] not in ("0.005", "0.006", "0.011")))
    # WHEN it is replayed THEN each row has its estimate
    result = hexload("replay", log, "--platform", platform, "--out", tmp_path / "e.csv")
    assert result.returncode == 0, result.stderr
    assert len((tmp_path / "e.csv").read_text().splitlines()) == 1 + 17


def test_report_refuses_a_folder_that_is_no_run(tmp_path):
    assert_refused(hexload("report", tmp_path), f"{tmp_path}: found no scenario.toml, expected the files")


def test_report_refuses_a_run_that_does_not_exist(tmp_path):
    assert_refused(hexload("report", tmp_path / "no"), f"{tmp_path}/no: found no such folder, expected a run directory")


def test_test_refuses_an_unknown_preset():
    assert_refused(hexload("test", "--preset", "fast"), "--preset: found 'fast', expected one of: host, asan-ubsan")


@pytest.mark.parametrize(
    "call",
    [
        "replay log.csv --platform platform.toml --out platform.toml",
        "replay log.csv --platform platform.toml --out ./log.csv",
        "replay log.csv --platform platform.toml --out a.csv --report platform.toml",
        "commission log.csv --platform platform.toml --out platform.toml",
        "tare log.csv --platform platform.toml --out log.csv",
        "convert log.csv log.csv",
        "export platform.toml --platform log.csv --out log.csv",
        "excite --platform platform.toml --out platform.toml --duration 5",
    ],
)
def test_no_verb_writes_over_what_it_reads(tmp_path, monkeypatch, call):
    # GIVEN files of the user WHEN an output has the name of one THEN it is refused and all is as it was
    monkeypatch.chdir(tmp_path)
    files = {"log.csv": "a log", "platform.toml": "a machine"}
    for name, text in files.items():
        Path(name).write_text(text)
    with pytest.raises(InputError, match="found a file that this call reads, expected another name"):
        app(call.split(), standalone_mode=False)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == files
