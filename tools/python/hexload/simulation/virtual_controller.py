"""The controller as a child process: hexload_ecu, from its ready line to its end."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hexload import project
from hexload.errors import ToolFailed

READY = "ready on"
READY_LIMIT_S = 30  # it listens for a quarter of a second; the rest is a busy machine
END_LIMIT_S = 5
# Its statuses for a second controller and for a bus that cannot be opened, in hexload_sim's code.
AS_SIMULATOR = {3: 5, 4: 6}


@contextmanager
def running_controller(platform: Path, options: tuple[str, ...]) -> Iterator[subprocess.Popen]:
    """Starts hexload_ecu, waits until it is ready, and ends it at the end; it also ends when this process does.

    Its faults go to stderr. Raises ToolFailed when it does not get ready.
    """
    command = [project.controller(), "--platform", platform, "--die-with-parent", "--quiet", *options]
    # A group of its own: Ctrl-C ends the simulator, which still asks it for its last answers.
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, process_group=0)
    ready = threading.Event()
    reader = threading.Thread(target=_pass_on, args=(process, ready), daemon=True)
    reader.start()
    try:
        if not ready.wait(READY_LIMIT_S):
            raise ToolFailed(f"hexload_ecu: not ready after {READY_LIMIT_S} s")
        if process.poll() is not None:
            raise ToolFailed(exit_code=AS_SIMULATOR.get(process.returncode, process.returncode))
        yield process
    finally:
        process.terminate()
        try:
            process.wait(END_LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join()


def _pass_on(process: subprocess.Popen, ready: threading.Event) -> None:
    for line in process.stdout:
        if READY in line:
            ready.set()
        else:
            print(line, end="", file=sys.stderr, flush=True)
    process.wait()
    ready.set()  # it will not get ready any more: whoever waits finds it ended
