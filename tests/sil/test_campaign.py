"""hexload campaign as a user meets it: the same numbers each time, going on where it stopped, on clusters too."""

import importlib
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from distributed import Client, LocalCluster, Security
from rich import box
from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.campaign import schedule, terminal, verb
from hexload.campaign.cases import LARGEST_BIAS_N, TARE_S, Case, draw
from hexload.campaign.store import Settings
from hexload.errors import InputError, ToolFailed
from hexload.io.log_file import read_log

CASES = "hexload.campaign.cases"
SHORT_S = 1.0
TWO = Settings(("multisine",), 2, 1, SHORT_S)
PATIENCE_S = 60.0
LOCAL = {"processes": True, "protocol": "tls", "dashboard_address": "127.0.0.1:0"}


@pytest.fixture(scope="module")
def identity(tmp_path_factory):
    """A certificate that is its own authority, and its key."""
    folder = tmp_path_factory.mktemp("identity")
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=hexload".split()
    subprocess.run(["openssl", *options, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    return certificate, key


@pytest.fixture(scope="module")
def security(identity):
    """What scheduler, workers and clients show each other."""
    certificate, key = map(str, identity)
    roles = ("scheduler", "worker", "client")
    files = {f"tls_{role}_{part}": file for role in roles for part, file in (("cert", certificate), ("key", key))}
    return Security(tls_ca_file=certificate, require_encryption=True, **files)


@pytest.fixture(scope="module")
def dask_cluster(security):
    with LocalCluster(n_workers=1, threads_per_worker=1, **LOCAL, security=security) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def cluster(dask_cluster, identity):
    """The same as the verb's options name it."""
    certificate, key = identity
    return schedule.cluster_of(dask_cluster.scheduler_address, certificate, certificate, key)


@pytest.fixture(scope="module")
def finished(cluster, tmp_path_factory):
    """The folder of a campaign of two cases."""
    folder = tmp_path_factory.mktemp("campaigns") / "two"
    verb.run_campaign(TWO, folder, cluster, keep=False, restart=False)
    return folder


@pytest.fixture
def copy(finished, tmp_path):
    subprocess.run(["cp", "-rp", finished, tmp_path / "copy"], check=True)
    return tmp_path / "copy"


def command(*arguments):
    return [sys.executable, "-m", "hexload_dev", "campaign", *map(str, arguments)]


def refusal(*arguments):
    """The one line on stderr of a command that is refused with status 2."""
    result = subprocess.run(command(*arguments), capture_output=True, text=True)
    assert result.returncode == 2, result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    return result.stderr


def contents(folder, pattern="cases/*.json"):
    return {path.name: path.read_bytes() for path in folder.glob(pattern)}


def test_the_same_command_gives_the_same_numbers_with_and_without_a_cluster(finished, dask_cluster, tmp_path):
    # GIVEN a campaign that ran on a cluster, by its scheduler's address
    with Client(dask_cluster) as client:
        loaded = client.run(lambda: "hexload.campaign.one_case" in __import__("sys").modules)
    assert any(loaded.values())
    # WHEN the same runs on this machine's own cores THEN cases and summary are the same, byte by byte
    out = tmp_path / "own"
    options = ("--classes", "multisine", "--runs", 2, "--seed-base", 1, "--duration", SHORT_S, "--out", out)
    result = subprocess.run(command(*options), capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-1] == str(out / "report.html")
    assert contents(out) == contents(finished)
    assert sorted(contents(out)) == ["multisine-1.json", "multisine-2.json"]
    assert contents(out, "summary.json") == contents(finished, "summary.json")


def test_a_case_is_the_same_in_whatever_campaign(finished, cluster, tmp_path):
    # GIVEN a case of a finished campaign WHEN it is the first of another one, beside another class
    settings = Settings(("standstill", "multisine"), 1, 2, SHORT_S)
    verb.run_campaign(settings, tmp_path / "other", cluster, keep=True, restart=False)
    # THEN its numbers are the same, and with --keep its files are there
    assert contents(tmp_path / "other")["multisine-2.json"] == contents(finished)["multisine-2.json"]
    assert (tmp_path / "other" / "runs" / "multisine-2" / "log.csv").is_file()
    assert not (finished / "runs").exists()


def test_biased_sensors_and_friction_are_found_with_the_load(cluster, tmp_path):
    # GIVEN a class whose machines have both WHEN two cases run
    settings = Settings(("multisine_actuator_effects",), 2, 1, SHORT_S)
    page = verb.run_campaign(settings, tmp_path / "out", cluster, keep=False, restart=False)
    # THEN the controller's filter is the one that knows of them, and stands before the one that does not and the rivals
    results = [json.loads(text) for text in contents(tmp_path / "out").values()]
    for result in results:
        assert result["controller"] == "momentum_effects"
        assert list(result["estimators"])[:3] == ["momentum_effects", "momentum", "paper"]
        assert len(result["estimators"]) == 8
        # AND a second tells of the Coulomb friction, of which 200 N were thought possible; errors are as the bound says
        error, limit = (np.array(result["effects"][name])[6:12] for name in ("error", "bound"))
        assert (limit < 0.02 * 200.0).all()
        assert (np.abs(error) < 5 * limit).all()
    # AND each seed has biases of its own, within the class's limits
    biases = [draw(Case("multisine_actuator_effects", seed, SHORT_S)).effects.bias_n for seed in (1, 2)]
    assert not np.array_equal(*biases)
    assert np.abs(biases).max() <= LARGEST_BIAS_N
    # AND the page tells of both filters and of the machine
    text = page.read_text()
    for words in ("Force biases and friction", "momentum filter with bias and friction", "Coulomb friction, N"):
        assert words in text


def test_legs_with_mass_are_tared(cluster, tmp_path):
    # GIVEN a class whose legs have mass, which the platform file does not know WHEN a case runs
    settings = Settings(("multisine_leg_mass",), 1, 1, SHORT_S)
    page = verb.run_campaign(settings, tmp_path / "out", cluster, keep=False, restart=False)
    # THEN the controller's filter has a tare; without it a part of the legs' 18 kg is in the load
    (result,) = (json.loads(text) for text in contents(tmp_path / "out").values())
    assert result["controller"] == "momentum_tared"
    with_tare, without = (result["estimators"][name]["error"][0] for name in ("momentum_tared", "momentum"))
    assert 5.0 < without < 8.0
    assert abs(with_tare) < 0.1 * without
    assert "momentum filter with tare" in page.read_text()


def test_a_campaign_goes_on_with_what_is_missing(copy, cluster, capsys):
    # GIVEN a finished campaign of two runs
    before = {path.name: path.stat().st_mtime_ns for path in (copy / "cases").iterdir()}
    # WHEN it is wanted with three THEN this is said, the two are left as they are and one is added
    three = Settings(("multisine",), 3, 1, SHORT_S)
    verb.run_campaign(three, copy, cluster, keep=False, restart=False)
    said = capsys.readouterr().err
    assert "has changed: runs was 2, is 3" in said
    assert "2 of 3 cases are done already, 1 to go" in said
    after = {path.name: path.stat().st_mtime_ns for path in (copy / "cases").iterdir()}
    assert after == before | {"multisine-3.json": after["multisine-3.json"]}


def test_an_interrupted_result_is_done_again(copy, finished, cluster, capsys):
    # GIVEN a campaign one of whose results is cut off
    path = copy / "cases" / "multisine-1.json"
    path.write_bytes(path.read_bytes()[:700])
    # WHEN it goes on THEN this is said, and the numbers are those of before
    verb.run_campaign(TWO, copy, cluster, keep=False, restart=False)
    assert f"{path}: done again, as it is not whole" in capsys.readouterr().err
    assert contents(copy) == contents(finished)


def test_results_of_another_duration_are_done_again(copy, cluster, capsys):
    # GIVEN a finished campaign WHEN one of another duration is wanted in its folder THEN results are replaced, and said
    settings = Settings(("multisine",), 1, 1, 1.1)
    verb.run_campaign(settings, copy, cluster, keep=False, restart=False)
    said = capsys.readouterr().err
    assert "duration_s was 1.0, is 1.1" in said and "multisine-1.json: done again" in said
    assert json.loads(contents(copy)["multisine-1.json"])["case"]["duration_s"] == 1.1


def test_results_of_another_version_are_refused_until_a_restart(copy, finished, cluster):
    # GIVEN a campaign that an older version of the code has begun
    settings = json.loads((copy / "campaign.json").read_text())
    (copy / "campaign.json").write_text(json.dumps(settings | {"code": "0123"}))
    # WHEN it is to go on THEN it is refused, both versions are named and nothing is touched
    with pytest.raises(InputError, match=f"found results of code 0123, expected {settings['code']}.*--restart"):
        verb.run_campaign(TWO, copy, cluster, keep=False, restart=False)
    assert contents(copy) == contents(finished)
    # WHEN it is to start anew THEN it does
    one = Settings(("multisine",), 1, 1, SHORT_S)
    verb.run_campaign(one, copy, cluster, keep=False, restart=True)
    assert list(contents(copy)) == ["multisine-1.json"]


def test_an_interrupted_campaign_leaves_whole_results(tmp_path):
    # GIVEN a campaign of more cases than can be done at once
    options = ("--classes", "multisine", "--runs", 200, "--duration", SHORT_S, "--out", tmp_path / "long")
    process = subprocess.Popen(command(*options), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        deadline = time.monotonic() + PATIENCE_S
        while not contents(tmp_path / "long") and process.poll() is None:
            assert time.monotonic() < deadline, "no case was done"
            time.sleep(0.02)
        # WHEN Ctrl-C is pressed after the first
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    # THEN it ends as interrupted programs do, says how to go on, without a traceback, and what is there is whole
    assert process.returncode == 130, said
    assert "of 200 cases were done; the same command goes on" in " ".join(said.split())
    assert "Traceback" not in said
    done = contents(tmp_path / "long")
    assert 0 < len(done) < 200
    assert all("estimators" in json.loads(text) for text in done.values())
    assert not list((tmp_path / "long").rglob("*.part"))


def test_an_address_without_a_scheduler_is_refused(identity, tmp_path):
    # GIVEN a port on which nobody listens
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tls://127.0.0.1:{free.getsockname()[1]}"
    # WHEN it is given as the scheduler THEN the address is named and what was expected there
    certificate, key = identity
    files = ("--tls-ca", certificate, "--tls-cert", certificate, "--tls-key", key)
    said = refusal("--scheduler", address, *files, "--runs", 1, "--out", tmp_path / "out")
    assert f"--scheduler: found no scheduler at {address}" in said and "dask scheduler" in said


@pytest.mark.parametrize(
    ("address", "ca", "words"),
    [
        ("tcp://127.0.0.1:8786", "certificate", "--scheduler: found tcp://127.0.0.1:8786, expected tls://HOST:PORT"),
        ("nowhere://x", "certificate", "--scheduler: found nowhere://x, expected tls://HOST:PORT"),
        ("tls://127.0.0.1:8786", None, "--tls-ca: found nothing, expected a PEM file"),
        ("tls://127.0.0.1:8786", "missing", "--tls-ca: found no file .*missing, expected a PEM file"),
        (None, "certificate", "--tls-ca: found no --scheduler, expected one"),
    ],
)
def test_a_cluster_is_reached_over_tls_with_a_certificate_or_not_at_all(identity, address, ca, words):
    # GIVEN an address or a file that will not do WHEN they are given THEN the option is named
    certificate, key = identity
    file = {"certificate": certificate, "missing": certificate.with_name("missing"), None: None}[ca]
    with pytest.raises(InputError, match=words):
        schedule.cluster_of(address, file, certificate, key)


def test_a_certificate_of_another_authority_is_refused(dask_cluster, identity, tmp_path):
    # GIVEN a stranger's certificate WHEN it is shown to the cluster THEN there is no way in
    stranger, key = tmp_path / "stranger.pem", tmp_path / "key.pem"
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=stranger".split()
    subprocess.run(["openssl", *options, "-keyout", key, "-out", stranger], check=True, capture_output=True)
    other = schedule.cluster_of(dask_cluster.scheduler_address, identity[0], stranger, key)
    with pytest.raises(InputError, match="--scheduler: found no scheduler at"):
        with schedule.connected(other):
            pass


def test_a_scheduler_without_workers_is_told(identity, security, monkeypatch):
    # GIVEN a scheduler that has no workers WHEN connected THEN the message says how to start one
    certificate, key = identity
    with LocalCluster(n_workers=0, **LOCAL | {"processes": False}, security=security) as empty:
        there = schedule.cluster_of(empty.scheduler_address, certificate, certificate, key)
        with pytest.raises(ToolFailed, match="has no workers: start some with `dask worker"):
            with schedule.connected(there):
                pass
        # WHEN they have gone in the course of a campaign, for longer than a while THEN that is said, too
        monkeypatch.setattr(schedule, "NO_WORKERS_S", 0.5)
        has_workers = schedule._Remote.has_workers
        monkeypatch.setattr(schedule._Remote, "has_workers", lambda self: True)
        with schedule.connected(there) as place:
            monkeypatch.setattr(schedule._Remote, "has_workers", has_workers)
            with pytest.raises(ToolFailed, match="has had no workers for 0.5 s: start some; the same command goes on"):
                next(schedule.results(place, draw, [Case("paper", 1, SHORT_S)], "", None))


def test_on_this_machine_cases_run_in_processes_that_listen_nowhere():
    # GIVEN cases without a cluster WHEN they run
    before = listening_ports(None, None)["ports"]
    with schedule.connected(None) as place:
        ((_, result),) = schedule.results(place, listening_ports, [Case("paper", 1, SHORT_S)], "", None)
        meanwhile = listening_ports(None, None)["ports"]
    # THEN the process is another one, and neither it nor this one has another port that somebody could reach
    assert result["process"] != os.getpid()
    assert result["ports"] == [] and meanwhile == before


def listening_ports(_case, _folder):
    """Local addresses of this process's TCP sockets that listen."""
    ours = {os.readlink(link) for link in Path("/proc/self/fd").iterdir() if link.exists() or link.is_symlink()}
    lines = [
        line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/self/net/{name}").read_text().splitlines()
    ]
    ports = [words[1] for words in lines if words[3] == "0A" and f"socket:[{words[9]}]" in ours]
    return {"code": "", "process": os.getpid(), "ports": ports}


def test_a_case_that_fails_is_named(cluster, tmp_path):
    # GIVEN a case that cannot be run, here for its class, which the worker does not know
    settings = Settings(("unheard_of",), 1, 7, SHORT_S)
    # WHEN they run THEN the case and the reason are told
    with pytest.raises(ToolFailed, match="case unheard_of-7: KeyError: 'unheard_of'"):
        verb.run_campaign(settings, tmp_path / "out", cluster, keep=False, restart=False)


def test_a_case_whose_tare_is_refused_has_failed_and_the_campaign_goes_on(cluster, dask_cluster, tmp_path, capsys):
    # GIVEN a campaign one of whose cases has a tare of 0.1 s, which tells too little, on a cluster
    out = tmp_path / "out"
    settings = Settings(("multisine", "multisine_leg_mass"), 1, 1, SHORT_S)
    with Client(dask_cluster) as client:
        client.run(lambda: setattr(importlib.import_module(CASES), "TARE_S", 0.3))
    try:
        # WHEN it runs THEN it ends, with the numbers of the other case
        page = verb.run_campaign(settings, out, cluster, keep=True, restart=False)
    finally:
        with Client(dask_cluster) as client:
            client.run(lambda: setattr(importlib.import_module(CASES), "TARE_S", TARE_S))
    told = capsys.readouterr().out
    good, bad = (json.loads(contents(out)[f"{name}-1.json"]) for name in settings.classes)
    assert "estimators" in good
    # AND the reason is stored, with no path of the machine that it ran on, in the table and on the page
    assert bad["failure"].startswith("tare_run/log.csv: found verdict")
    assert "failed: multisine_leg_mass-1: tare_run/log.csv: found verdict" in " ".join(told.split())
    row = next(line for line in told.splitlines() if line.split()[:1] == ["multisine_leg_mass"])
    assert row.split()[1] == "0" and "1" in row.split()[2:]
    assert "Cases without numbers" in page.read_text() and "tare_run/log.csv: found verdict" in page.read_text()
    summary = {entry["name"]: entry for entry in json.loads((out / "summary.json").read_text())}
    assert summary["multisine"]["failed"] == []
    assert [case["name"] for case in summary["multisine_leg_mass"]["failed"]] == ["multisine_leg_mass-1"]
    # AND its files are kept as those of others, and it is done: the same command does nothing again
    assert (out / "runs" / "multisine_leg_mass-1" / "log.csv").is_file()
    before = contents(out)
    verb.run_campaign(settings, out, cluster, keep=True, restart=False)
    assert "2 of 2 cases are done already, 0 to go" in capsys.readouterr().err
    assert contents(out) == before


def test_seeds_are_fresh_with_every_commit_and_can_be_repeated(tmp_path, monkeypatch, capsys):
    # GIVEN a clone with one commit WHEN no seeds are asked for THEN they are the commit's date, and that is said
    git = ["git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
    date = {"GIT_COMMITTER_DATE": "1700000000 +0000", "PATH": os.environ["PATH"]}
    subprocess.run([*git, "commit", "--quiet", "--allow-empty", "--message", "x"], check=True, env=date)
    monkeypatch.setattr(project, "ROOT", tmp_path)
    assert verb.choose_seeds(None) == 1700000000
    assert "--seed-base 1700000000 repeats" in capsys.readouterr().out
    # AND seeds that are asked for are taken
    assert verb.choose_seeds(7) == 7


def test_without_a_commit_seeds_must_be_given(tmp_path, monkeypatch):
    # GIVEN a folder that is no clone, as of an installed package WHEN no seeds are asked for THEN it is refused
    monkeypatch.setattr(project, "ROOT", tmp_path)
    with pytest.raises(InputError, match="--seed-base: found no commit"):
        verb.choose_seeds(None)


@pytest.mark.parametrize("name", ["paper", "work_drop", "rig_work"])
def test_servos_are_drawn_from_sluggish_to_stiff_and_stable(name):
    # GIVEN 200 cases of a class WHEN their servos are compared
    servos = [draw(Case(name, seed, SHORT_S)).scenario["controller"] for seed in range(200)]
    # THEN feed-forward, proportional and integral gain come from all of their ranges; the ends are missed by chance in
    # (1 - 0.05)^200 = 4e-5 of all choices of seeds
    forward, proportional, integral, feedback = (
        np.array([servo[key] for servo in servos])
        for key in ("velocity_feedforward", "proportional_1_m", "integral_1_m_s", "pressure_feedback_1_n")
    )
    assert forward.min() < 0.05 and 0.95 < forward.max() <= 1.0
    assert 5.0 <= proportional.min() < 5.8 and 25.0 < proportional.max() <= 35.0
    assert integral.min() < 2.0 and 25.0 < integral.max() <= 35.0
    # AND all are stable: the proportional gain stays below that of Routh's criterion
    assert (proportional <= 0.71 * 5.7e6 * feedback).all()


def test_an_unknown_class_is_refused(tmp_path):
    said = refusal("--classes", "multisine,swing", "--out", tmp_path / "out")
    assert "--classes: found 'swing', expected all, or some of: multisine, paper" in said
    assert not (tmp_path / "out").exists()


def test_a_duration_that_is_too_short_is_refused(tmp_path):
    with pytest.raises(InputError, match="--duration: found 0.01 s, expected 1 to 3600 s"):
        verb.run_campaign(Settings(("work",), 1, 1, 0.01), tmp_path / "out", None, keep=False, restart=False)
    assert not (tmp_path / "out").exists()


def test_a_folder_with_other_files_is_refused(tmp_path):
    # GIVEN a folder with a file of somebody else WHEN it is to be the campaign's THEN it is refused and left as it is
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(InputError, match=f"{tmp_path}: found other files and no campaign.json"):
        verb.run_campaign(TWO, tmp_path, None, keep=False, restart=False)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_page_is_whole_and_loads_nothing(finished):
    # GIVEN the page of a finished campaign WHEN read THEN classes and methods have their place, no tag has an address
    page = (finished / "report.html").read_text()
    for words in ("instrumental variables", "Alarms of a changed load", 'id="nees-figure"', 'id="class-multisine"'):
        assert words in page
    markup = re.sub(r"<script\b[^>]*>.*?</script>", "", page, flags=re.DOTALL)
    assert "src=" not in markup and "<link" not in page


def test_the_page_plays_the_run_of_each_class_that_ended_farthest_off(finished):
    # GIVEN two cases of which one ended farther off its bound
    results = [json.loads(text) for text in contents(finished).values()]
    off = {
        result["case"]["seed"]: np.mean(
            (np.array(result["estimators"]["momentum"]["error"]) / np.array(result["bound"])) ** 2
        )
        for result in results
    }
    # WHEN the page is read
    page = (finished / "report.html").read_text()
    # THEN it names that one and has its motion, with the true load and the one that its filter found
    worst = max(off, key=off.get)
    assert f"The run that ended farthest off, seed {worst}: {np.sqrt(off[worst]):.1f} bounds" in page
    moving = json.loads(re.search(r'id="multisine-motion".*?<script type="application/json">(.*?)</script>', page)[1])
    assert moving["duration"] == pytest.approx(SHORT_S) and moving["true"]["v"] and moving["estimated"]["v"]
    found = next(result for result in results if result["case"]["seed"] == worst)
    mass_kg = found["theta"][0] + found["estimators"]["momentum"]["error"][0]
    assert moving["words"][-1].startswith(f"m = {mass_kg:.2f} ±")


def test_replay_tells_the_covariance_of_the_momentum_filter(tmp_path):
    # GIVEN a recorded log
    data = project.ROOT / "tests" / "data"
    log = read_log(data / "multisine_eccentric.csv.gz")
    legs = [part.astype(np.float32).astype(float) for part in (log.displacement_m, log.velocity_m_s, log.force_n)]
    native = project.native_module()

    def replay(estimator):
        platform = native.load_platform(str(data / "paper_load.toml"))
        return native.replay(platform, estimator, None, log.t_s, *legs, str(tmp_path / "estimates.csv"))

    # WHEN the momentum filter replays it THEN its covariance is symmetric, definite and has the sigmas of the last row
    result = replay("momentum")
    covariance = result["covariance"]
    assert covariance.shape == (10, 10)
    assert np.array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance / np.outer(result["sigma"][-1], result["sigma"][-1])).min() > 0
    assert np.sqrt(covariance.diagonal()) == pytest.approx(result["sigma"][-1], rel=1e-6)
    # and the paper's filter, which has other states, tells none
    assert "covariance" not in replay("paper")


def test_a_table_that_is_wider_than_the_terminal_is_shown_in_parts_with_every_letter():
    # GIVEN a table of 7 columns that takes 132 letters
    table = Table(title="title", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for k in range(7):
        table.add_column(f"column {k}", no_wrap=True)
    for row in range(2):
        table.add_row(*(f"row {row}, column {k} long" for k in range(7)))
    # WHEN it is printed on 80 letters
    text = io.StringIO()
    narrow = Console(width=80, file=text)
    parts = terminal.in_parts(table, narrow.width)
    narrow.print(*parts)
    # THEN no cell is cut, and each part has the first column; on a wide terminal it is one table
    printed = text.getvalue()
    assert "…" not in printed
    assert all(f"row {row}, column {k} long" in printed for row in range(2) for k in range(7))
    assert printed.count("column 0 long") == 2 * len(parts) > 2
    assert terminal.in_parts(table, 200) == [table]
