"""`hexload vm` as its user meets it: output, exit status, files, limits, and what is left when it is stopped."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from hexload.errors import InputError, ToolFailed
from hexload_dev import vm

PATIENCE_S = 240.0  # one boot takes 3 s on an idle machine


def command_line(out, *arguments):
    return [sys.executable, "-m", "hexload_dev", "vm", "--out", str(out), *map(str, arguments)]


def run(out, *arguments, **options):
    return subprocess.run(command_line(out, *arguments), capture_output=True, timeout=PATIENCE_S, **options)


def machines(out):
    """Ids of the processes that a guest consists of: the console is everyone's output."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            output = (folder / "fd" / "1").readlink()
        except OSError:
            continue  # it has just ended, or has no output
        if output == out / "console.log":
            found.append(int(folder.name))
    return found


def wait_until(condition, otherwise):
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until, otherwise
        time.sleep(0.05)


def assert_machine_ends(out):
    wait_until(lambda: not machines(out), "the machine outlived the command that started it")


@contextmanager
def started(out, *arguments):
    """The verb in the background, its output a pipe; whatever happens, nothing is left of it."""
    with subprocess.Popen(command_line(out, *arguments), stdout=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def test_arguments_streams_and_exit_status_go_through_unchanged(tmp_path):
    # GIVEN arguments with everything that a shell might touch
    arguments = ["a b", "it's", '$HOME "x"', "", "*", "back\\slash", "two\nlines", "-v", "Größe"]
    script = 'printf "<%s>\\n" "$@"; cat; echo here >&2; exit 7'
    # WHEN they are printed in the guest, which has an empty input
    result = run(tmp_path, "--", "sh", "-c", script, "name", *arguments, input=b"not for the guest")
    # THEN they come back as they were, stdout and stderr apart, with the exit status
    assert result.stdout.decode() == "".join(f"<{word}>\n" for word in arguments)
    assert result.stderr == b"here\n"
    assert result.returncode == 7


def test_a_command_ended_by_a_signal_has_the_shells_status(tmp_path):
    # GIVEN closed standard streams, whose numbers must not go to the machine's ports
    words = command_line(tmp_path, "sh", "-c", "kill -SEGV $$")
    # WHEN the command dies of SIGSEGV THEN the status is 128 + 11
    result = subprocess.run(
        ["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", *words], capture_output=True, timeout=PATIENCE_S
    )
    assert result.returncode == 128 + signal.SIGSEGV


def test_a_command_that_does_not_exist_has_status_127(tmp_path):
    result = run(tmp_path, "no-such-program", "--help")
    assert result.returncode == 127
    assert b"no-such-program: not found" in result.stderr


def test_files_in_out_stay_and_others_vanish_and_environment_and_folder_go_along(tmp_path):
    # GIVEN a folder of the caller's and two variables, one of them hexload's
    here = tmp_path / "some folder"
    here.mkdir()
    out = tmp_path / "out"
    environment = os.environ | {"HEXLOAD_GREETING": "good 'day'", "UNRELATED": "x"}
    # WHEN the command writes there and to /out
    script = 'echo "$HEXLOAD_GREETING/$UNRELATED/$HEXLOAD_VM" >/out/said; touch lost && ls'
    result = run(out, "--", "sh", "-c", script, cwd=here, env=environment)
    # THEN it saw both of its files, and only that in /out is left
    assert (result.returncode, result.stdout) == (0, b"lost\n")
    assert (out / "said").read_text() == "good 'day'//1\n"
    assert list(here.iterdir()) == []


def test_no_output_is_lost_on_a_slow_reader_and_what_runs_on_is_ended(tmp_path):
    # GIVEN more output than the buffers on its way hold, and a program that keeps the output open
    data = bytes(range(256)) * 4000
    (tmp_path / "data").write_bytes(data)
    script = f"sleep 1000 & cat {tmp_path}/data; echo >/out/done"
    with started(tmp_path, "sh", "-c", script) as process:
        # WHEN it is read in two parts, the second one long after the command has ended
        first = process.stdout.read(len(data) - 200_000)
        wait_until((tmp_path / "done").exists, "COMMAND has not ended")
        time.sleep(2)
        second = process.stdout.read()
        # THEN it is complete
        assert first + second == data
        assert process.wait(PATIENCE_S) == 0


def test_output_comes_while_the_command_runs_and_ctrl_c_ends_the_machine(tmp_path):
    # GIVEN a command that says a word and goes on
    with subprocess.Popen(
        command_line(tmp_path, "sh", "-c", "echo first; sleep 1000"), stdout=subprocess.PIPE
    ) as process:
        # WHEN the word has come, while it runs
        assert process.stdout.readline() == b"first\n"
        assert machines(tmp_path)
        # WHEN the user presses Ctrl-C
        process.send_signal(signal.SIGINT)
        # THEN the status says so and no machine is left
        assert process.wait(PATIENCE_S) == 130
    assert_machine_ends(tmp_path)


def test_the_machine_dies_with_the_process_that_started_it(tmp_path):
    # GIVEN a guest with a program that waits and one that computes
    script = "sh -c 'while true; do true; done' & echo first; sleep 1000"
    with subprocess.Popen(command_line(tmp_path, "sh", "-c", script), stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"first\n"
        # WHEN its parent is killed in a way that no program can handle
        process.kill()
    # THEN none of them is left on this machine
    assert_machine_ends(tmp_path)


def test_a_command_that_takes_too_long_is_stopped_and_named(tmp_path):
    result = run(tmp_path, "--timeout", "2", "--", "sleep", "1000")
    assert result.returncode == 124
    assert "stopped after --timeout 2 s: sleep 1000" in result.stderr.decode()
    assert f"console log:  {tmp_path}/console.log" in result.stderr.decode()


def test_a_kernel_panic_is_reported_with_the_command_and_the_log(tmp_path):
    # GIVEN a command that crashes the guest's kernel beside a program that computes
    script = "sh -c 'while true; do true; done' & echo c >/proc/sysrq-trigger; sleep 1000"
    # WHEN it runs THEN the cause is named, and nothing is left on this machine
    result = run(tmp_path, "--", "sh", "-c", script)
    assert_machine_ends(tmp_path)
    words = result.stderr.decode()
    assert result.returncode == 125
    assert "the guest died before it ended: sh -c" in words
    assert "Kernel panic - not syncing: sysrq triggered crash" in words
    assert f"console log:  {tmp_path}/console.log" in words


def test_a_guest_out_of_memory_is_told_how_to_get_more(tmp_path):
    # GIVEN 256 MiB WHEN the command wants a GiB THEN it is killed and the option that helps is named
    greedy = "echo 1 >/proc/sys/vm/overcommit_memory; exec dd if=/dev/zero of=/dev/null bs=1G count=1"
    result = run(tmp_path, "--memory", "256", "--", "sh", "-c", greedy)
    assert result.returncode == 128 + signal.SIGKILL
    assert (
        "the guest's 256 MiB were not enough, try --memory 512 (Out of memory: Killed process" in result.stderr.decode()
    )


def test_a_missing_kernel_is_named_with_its_remedy(tmp_path, monkeypatch):
    # GIVEN a build folder without a kernel WHEN a guest is wanted THEN what is missing and what mends it are said
    monkeypatch.setattr(vm, "IMAGE", tmp_path)
    with pytest.raises(ToolFailed, match=rf"found no {tmp_path}/linux.*tools/hexload vm puts them in place"):
        vm.run_in_guest(["true"])


def test_an_out_that_cannot_be_a_folder_is_refused(tmp_path):
    # GIVEN a file WHEN it is given as the folder of /out THEN it is named
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out .*file: found no folder that can be used"):
        vm.run_in_guest(["true"], vm.GuestOptions(out=tmp_path / "file"))
