"""`hexload watch` on a bus: JSON lines for scripts, a view for people that q ends, and a word when nobody answers."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time

from hexload import project
from hexload.theory.bound import THETA_NAMES
from hexload.view.listening import listened_to
from loop import OPEN
from test_34_view import PATIENCE_S, send_samples, wait_until, words_of

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
WATCH = (sys.executable, "-m", "hexload_dev", "watch")


def read_until(terminal, wanted):
    """What the program behind a terminal has drawn."""
    until, text = time.monotonic() + PATIENCE_S, ""
    while not re.search(wanted, text):
        assert time.monotonic() < until, text
        text += os.read(terminal, 65536).decode(errors="replace")
    return text


def test_a_controller_is_watched_by_a_script_and_by_a_person(start, ecu, free_bus):
    # GIVEN a controller on a bus, a script that reads JSON lines, and a person at a terminal
    program = start(ecu, OPEN, "--bus", free_bus, "--platform", PLATFORM, "--estimator", "momentum")
    program.wait_for("ready on")
    terminal, end = pty.openpty()
    person = subprocess.Popen([*WATCH, "--bus", free_bus], stdin=end, stdout=end, stderr=end)
    script = subprocess.Popen([*WATCH, "--bus", free_bus, "--json"], stdout=subprocess.PIPE, text=True)
    os.close(end)
    try:
        assert json.loads(script.stdout.readline())["verdict"] is None
        read_until(terminal, "no estimate yet")
        # WHEN the controller is started and gets samples
        with listened_to(free_bus, "fd", None) as live:
            live.command("start")
            wait_until(lambda: "controller: done, armed" in words_of(live), "the acknowledge")
        send_samples(free_bus, "fd", ticks=400)
        # THEN a line has the ten parameters with sigma and verdict, in SI units, and the acknowledge among the events
        lines = [json.loads(script.stdout.readline())]
        while lines[-1]["verdict"] is None:
            lines.append(json.loads(script.stdout.readline()))
        assert list(lines[-1]["parameters"]) == list(THETA_NAMES)
        assert lines[-1]["parameters"]["m"]["sigma"] > 0.0
        assert "controller: done, armed" in [event["words"] for line in lines for event in line["events"]]
        # and the terminal has them too, until q
        text = read_until(terminal, "Iyz")
        assert "verdict" in text and "samples" in text
        os.write(terminal, b"q")
        assert person.wait(PATIENCE_S) == 0
        # and Ctrl-C ends the script's
        script.send_signal(signal.SIGINT)
        assert script.wait(PATIENCE_S) == 130
    finally:
        person.kill()
        script.kill()
        script.stdout.close()
        os.close(terminal)


def test_a_silent_bus_ends_a_single_look_with_a_word(free_bus):
    # GIVEN a bus without a controller WHEN a single answer is wanted THEN the status is 1 and the reason is told
    command = [*WATCH, "--bus", free_bus, "--once", "--patience", "0.3"]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 1 and result.stdout == ""
    assert "found no estimate within 0.3 s (silent)" in result.stderr and result.stderr.count("\n") == 1
