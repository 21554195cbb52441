"""`--out DIR --force` of the simulator, as a user types it: what is no run directory survives, byte for byte."""

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hexload import project
from hexload.errors import InputError
from hexload.io.atomic_file import replaced_when_done
from hexload.io.run_directory import read_run
from hexload.io.run_files import ADDED_FILES, FILES

PATIENCE_S = 60.0


def simulate(out, folder: Path, *options) -> subprocess.CompletedProcess:
    scenario = project.SCENARIOS / "paper_clean.toml"
    command = [project.simulator(), scenario, "--duration", "0.05", "--quiet", "--out", out, *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture
def work(tmp_path) -> Path:
    """A working directory with a user's files, some of them named like a run's."""
    folder = tmp_path / "home" / "work"
    (folder / "thesis").mkdir(parents=True)
    (folder / "notes.txt").write_text("mine")
    (folder / "thesis" / "log.csv").write_text("t,x\n0,1\n")
    (folder / "thesis" / "meta.json").write_text('{"name": "thesis"}')
    (folder / "result").write_text("a file")
    return folder


@pytest.mark.parametrize(
    ("out", "found"),
    [
        (".", "the working directory"),
        ("./", "the working directory"),
        ("thesis/..", "the working directory"),
        ("..", "a folder above the working directory"),
        ("/", "a folder above the working directory"),
        ("thesis", "a meta.json that is not of a run"),
        ("thesis/", "a meta.json that is not of a run"),
        ("result", "a file"),
    ],
)
def test_what_is_no_run_directory_survives_force(work, out, found):
    # GIVEN a user's files
    before = contents(work.parent)
    # WHEN a run is to take the place of one of these WHEN it is forced
    result = simulate(out, work, "--force")
    # THEN it is refused in one line that says what was found, and every file is as it was
    assert result.returncode == 2
    assert f": found {found}, expected a run directory" in result.stderr
    assert result.stderr.count("\n") == 1
    # which names the files that Python's verbs take for a run's, too
    assert set(result.stderr.partition("beside it only ")[2].partition("), ")[0].split(", ")) == {*FILES, *ADDED_FILES}
    assert contents(work.parent) == before


def test_the_home_folder_survives_force(work, monkeypatch):
    # GIVEN a home folder that is not the working directory WHEN a run is to take its place THEN it is refused
    monkeypatch.setenv("HOME", str(work / "thesis"))
    result = simulate(work / "thesis", work.parent, "--force")
    assert result.returncode == 2
    assert "found the home folder" in result.stderr


def test_a_slash_at_the_end_of_the_name_keeps_the_run(work):
    # GIVEN a name with a slash at its end, for a new run and for one to be replaced
    for options in ((), ("--force",), ("--force", "--seed", "7")):
        # WHEN it runs
        result = simulate("run/", work, *options)
        # THEN the run is there, whole
        assert result.returncode == 0, result.stderr
        run = read_run(work / "run")
        assert sorted(path.name for path in run.directory.iterdir()) == sorted(FILES)
    assert run.meta["seed"] == 7


def test_without_force_a_run_stays(work):
    # GIVEN a run WHEN another one is to take its place without force THEN it is refused and the first one stays
    simulate("run", work)
    before = contents(work)
    result = simulate("run", work, "--seed", "7")
    assert result.returncode == 2
    assert "run: exists already; --force replaces it" in result.stderr
    assert contents(work) == before


def test_runs_that_take_each_others_place_at_the_same_time_are_all_done(work):
    # GIVEN a target, and again and again a dozen runs of it that begin and end together
    scenario = project.SCENARIOS / "paper_clean.toml"
    command = [project.simulator(), scenario, "--duration", "0.02", "--quiet", "--force", "--out", "run"]
    for _ in range(10):
        started = [subprocess.Popen(command, cwd=work, stderr=subprocess.PIPE, text=True) for _ in range(12)]
        # WHEN each replaces what is there THEN none is refused, nor finds its own folder gone
        ended = [(process.communicate()[1], process.returncode) for process in started]
        assert ended == [("", 0)] * len(started)
    # AND the last one is there, whole, with nothing left beside it
    assert sorted(path.name for path in read_run(work / "run").directory.iterdir()) == sorted(FILES)
    assert not list(work.glob(".*.partial*"))


def test_what_a_killed_run_left_is_deleted_by_the_next_and_a_running_ones_is_not(work):
    # GIVEN a run that was killed, one that goes on, a user's folder with such a name, and another target's leftovers
    scenario = project.SCENARIOS / "paper_clean.toml"
    command = [project.simulator(), scenario, "--duration", "1000", "--quiet", "--out"]
    names = {"killed": "run", "running": "run", "other": "run.1"}
    started = {name: subprocess.Popen([*command, target], cwd=work) for name, target in names.items()}
    try:
        folders = {name: _folder_of(process, work) for name, process in started.items()}
        for name in ("killed", "other"):
            started[name].kill()
            started[name].wait()
        mine = work / ".run.12.0.partial"
        mine.mkdir()
        (mine / "notes.txt").write_text("mine")
        # WHEN the next run of the same target is done
        assert simulate("run", work).returncode == 0
        # THEN only the killed run's folder is gone
        assert not folders["killed"].exists()
        assert folders["running"].exists() and folders["other"].exists()
        assert (mine / "notes.txt").read_text() == "mine"
    finally:
        for process in started.values():
            process.kill()
            process.wait()


def _folder_of(process: subprocess.Popen, work: Path) -> Path:
    """The folder that a run works in, once its log is there."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        for folder in work.glob(f".*.{process.pid}.*.partial"):
            if (folder / "log.csv").exists():
                return folder
        time.sleep(0.01)
    pytest.fail("the run does not begin")


def test_what_is_no_file_is_written_to_and_not_replaced(tmp_path):
    # GIVEN a pipe, as /dev/null is a device, for a file to be written WHEN it is opened THEN it is the pipe itself
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with replaced_when_done(pipe) as opened:
        assert opened == pipe
    assert pipe.is_fifo()


def test_a_file_is_on_the_disk_before_it_takes_the_others_place(tmp_path, monkeypatch):
    # GIVEN a file that is to be replaced
    path = tmp_path / "estimates.csv"
    path.write_text("old")
    synced = []
    fsync = os.fsync

    def recorded(descriptor):
        synced.append((os.readlink(f"/proc/self/fd/{descriptor}"), path.read_text()))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", recorded)
    # WHEN it is THEN the new one's bytes go to the disk while the old one is there, and the folder's after
    with replaced_when_done(path) as temporary:
        temporary.write_text("new")
    assert synced == [(str(temporary), "old"), (str(tmp_path), "new")]


def test_a_disk_that_does_not_take_the_bytes_leaves_the_old_file(tmp_path, monkeypatch):
    # GIVEN a disk that says only at the end that it is full WHEN a file is to be replaced THEN the old one stays
    path = tmp_path / "estimates.csv"
    path.write_text("old")

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="estimates.csv: cannot be written, No space left on device"):
        with replaced_when_done(path) as temporary:
            temporary.write_text("new")
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


# Standard output that is full


def full_output(*command) -> subprocess.CompletedProcess:
    with open("/dev/full", "w") as full:
        words = [str(word) for word in command]
        return subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)


def test_a_program_whose_output_is_lost_says_so_and_its_status_too(tmp_path):
    # GIVEN each program of the host side, and a verb that prints little, and one that prints much
    hexload = (sys.executable, "-m", "hexload_dev")
    build = project.build_directory()
    scenario = project.SCENARIOS / "paper_clean.toml"
    commands = [
        (project.simulator(), scenario, "--duration", "0.05", "--out", tmp_path / "run"),
        (project.simulator(), "--help"),
        (project.controller(), "--help"),
        (build / "host_sim" / "hexload_bridge", "--help"),
        (*hexload, "--version"),
        (*hexload, "faults", "--list"),
    ]
    for command in commands:
        # WHEN it writes to a disk that is full THEN it says so in one line, with a status
        result = full_output(*command)
        assert result.returncode == 1, (command, result.stderr)
        assert result.stderr.endswith("standard output cannot be written: No space left on device\n"), result.stderr
        assert "Traceback" not in result.stderr and "Exception ignored" not in result.stderr
    # and the run is there, whole
    assert read_run(tmp_path / "run").meta["seed"] is not None


def test_a_run_is_on_the_disk_before_it_takes_its_name(tmp_path):
    # GIVEN a run WHEN the system's calls are watched THEN each of its files is synced, then renamed, then the folder synced
    script = _watcher(tmp_path)
    environment = os.environ | {"LD_PRELOAD": str(script), "HEXLOAD_WATCH": str(tmp_path / "calls")}
    scenario = project.SCENARIOS / "paper_clean.toml"
    command = [project.simulator(), scenario, "--duration", "0.05", "--quiet", "--out", tmp_path / "run"]
    subprocess.run(command, env=environment, check=True)
    calls = (tmp_path / "calls").read_text().splitlines()
    renamed = calls.index("rename run")
    assert set(calls[:renamed]) >= {f"fsync {name}" for name in FILES}
    assert calls[renamed + 1] == f"fsync {tmp_path.name}"


WATCHER = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void tell(const char* call, const char* path) {
    char copy[4096];
    FILE* file = fopen(getenv("HEXLOAD_WATCH"), "a");
    snprintf(copy, sizeof copy, "%s", path);
    fprintf(file, "%s %s\n", call, basename(copy));
    fclose(file);
}

int fsync(int descriptor) {
    char link[64], path[4096] = {0};
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    (void)!readlink(link, path, sizeof path - 1);
    tell("fsync", path);
    return 0;
}

int rename(const char* from, const char* to) {
    int (*real)(const char*, const char*) = (int (*)(const char*, const char*))dlsym(RTLD_NEXT, "rename");
    int status = real(from, to);
    if (status == 0) {
        tell("rename", to);
    }
    return status;
}
"""


def _watcher(folder: Path) -> Path:
    (folder / "watcher.c").write_text(WATCHER)
    command = ["cc", "-shared", "-fPIC", "-o", folder / "watcher.so", folder / "watcher.c", "-ldl"]
    subprocess.run(command, check=True)
    return folder / "watcher.so"


@pytest.mark.parametrize("duration", ["nan", "-nan", "inf", "0", "1e9"])
def test_a_duration_that_no_run_has_leaves_the_run_that_is_there(work, duration):
    # GIVEN a run directory WHEN another one of no duration is to replace it THEN that is refused before anything is touched
    assert simulate("run", work).returncode == 0
    before = contents(work)
    refused = simulate("run", work, "--force", "--duration", duration)
    assert refused.returncode == 2
    assert "--duration" in refused.stderr or duration in refused.stderr
    assert contents(work) == before
