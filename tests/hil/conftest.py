"""Fixtures of the loop's tests: the bus, programs that are always ended, and a folder for what a test leaves behind."""

import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from free_port import free_port
from hexload import project
from hexload_dev import vcan, zynqmp_r5
from loop import PAPER_S, SHORT_S, Controller, Loop, Peer, Recording

# A generous limit for what takes milliseconds on an idle machine: the processor may be shared.
PATIENCE_S = 120.0
OUTPUT_TAIL_LINES = 60

CONTROLLERS = {"linux": Controller.linux, "zynqmp_r5": Controller.zynqmp_r5}

# What a controller cannot have, with the reason; tests with the mark needs(KEY) are deselected for it.
LACKS = {
    "linux": {
        "emulator": "hexload_ecu runs on this processor",
    },
    "zynqmp_r5": {
        "fd": "its CAN controller has no FD frames",
        "real time": "emulated, it takes some hundred ticks a second: frames by the clock are too many for it",
        "bus state": "QEMU does not tell the CAN controller that the interface is down",
        "fused multiply-add": "it rounds twice where this process rounds once: test_14 compares it with one that rounds twice too",
        "process": "the test has no controller, or is of hexload_ecu's own options: hil_vcan runs it",
    },
}
PROFILE_PARAMETERS = ("profile", "spoken", "over_bus", "run")  # names of parameters that say the controller's profile
DESELECTED = pytest.StashKey[dict[str, int]]()


def pytest_addoption(parser):
    parser.addoption("--controller", choices=tuple(CONTROLLERS), default="linux", help="which one is on the bus")


def pytest_configure(config):
    config.addinivalue_line("markers", "vcan: needs vcan0; runs on this kernel or in the virtual machine")
    config.addinivalue_line("markers", "apart: it keeps to the clock, and runs with nothing beside it")
    config.addinivalue_line("markers", "needs(what): a controller that has this; see LACKS in tests/hil/conftest.py")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """Deselects what the chosen controller lacks, and counts it by reason."""
    lacks = LACKS[config.getoption("--controller")]
    kept, reasons = [], {}
    for item in items:
        missing = next((need for need in _needs(item) if need in lacks), None)
        if missing is None:
            kept.append(item)
        else:
            reasons.setdefault(lacks[missing], []).append(item)
    config.stash[DESELECTED] = {reason: len(found) for reason, found in reasons.items()}
    config.hook.pytest_deselected(items=[item for found in reasons.values() for item in found])
    items[:] = kept


def _needs(item) -> Iterator[str]:
    yield from (mark.args[0] for mark in item.iter_markers("needs"))
    parameters = item.callspec.params if hasattr(item, "callspec") else {}
    if any(parameters.get(name) == "fd" for name in PROFILE_PARAMETERS):
        yield "fd"


def pytest_terminal_summary(terminalreporter, config):
    for reason, count in config.stash.get(DESELECTED, {}).items():
        terminalreporter.write_line(f"--controller {config.getoption('--controller')}: {count} deselected: {reason}")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """A failure shows what the programs said; a skip is a failure, as an untested bus is no tested bus."""
    report = yield
    if report.failed:
        for program in getattr(item, "programs", []):
            report.sections.append((f"{program.title}, kept as {program.log.name}", program.tail()))
    if report.skipped:
        report.outcome, report.longrepr = "failed", f"skipped, which counts as failed here: {report.longrepr}"
    return report


class Program:
    """A running program, its stdout and stderr in a file."""

    def __init__(self, command: list, log: Path):
        self.title = " ".join([Path(command[0]).name, *map(str, command[1:])])
        self.log = log
        with log.open("wb") as output:
            self.process = subprocess.Popen(
                [str(word) for word in command], stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
            )

    @property
    def output(self) -> str:
        return self.log.read_text(errors="replace")

    def tail(self) -> str:
        return "\n".join(self.output.splitlines()[-OUTPUT_TAIL_LINES:])

    def has_ended(self) -> bool:
        return self.process.poll() is not None

    def wait_for(self, pattern: str, patience_s: float = PATIENCE_S) -> re.Match:
        """Waits until the output matches `pattern` (a regular expression); fails when the program ends before."""
        until = time.monotonic() + patience_s
        while True:
            ended = self.has_ended()
            match = re.search(pattern, self.output, re.MULTILINE)
            if match:
                return match
            if ended or time.monotonic() > until:
                how = f"ended with status {self.process.returncode}" if ended else f"was silent for {patience_s:g} s"
                pytest.fail(f"{self.title}: {how}, expected the output {pattern!r}")
            time.sleep(0.01)

    def wait(self, patience_s: float = PATIENCE_S) -> int:
        """The exit status; negative: the signal that ended it."""
        try:
            return self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            pytest.fail(f"{self.title}: still running after {patience_s:g} s, expected its end")

    def interrupt(self) -> int:
        """As Ctrl-C does; returns the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.wait()

    def end(self) -> None:
        """Ends it, whatever it does."""
        self.process.terminate()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@pytest.fixture
def artefacts(request, tmp_path) -> Path:
    """A folder of the test's own that is kept: under build/artefacts, and in the virtual machine under /out."""
    kept = os.environ.get("HEXLOAD_ARTEFACTS")
    folder = Path(kept) / re.sub(r"[^\w.-]+", "_", request.node.name) if kept else tmp_path / "artefacts"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture
def start(request, tmp_path, artefacts):
    """start(program, *arguments) -> Program. All are ended with the test, the last one first; their output is kept."""
    request.node.programs = programs = []
    # Not straight into the artefacts: from the guest each line would be a round trip to the host.
    with ended_programs(tmp_path, programs) as starter:
        yield starter
    for program in programs:
        shutil.copy(program.log, artefacts)


@contextmanager
def ended_programs(folder: Path, programs: list[Program]) -> Iterator[Callable[..., Program]]:
    """Programs that end with the block, the last one first; their output is in `folder`."""

    def starter(*command) -> Program:
        programs.append(Program(list(command), folder / f"{len(programs)}-{Path(command[0]).name}.log"))
        return programs[-1]

    try:
        yield starter
    finally:
        for program in reversed(programs):
            program.end()


@pytest.fixture(scope="session")
def can_interface() -> str:
    """The name of a CAN interface that is up and takes FD frames."""
    if not vcan.ready():
        pytest.fail(
            f"found no usable {vcan.INTERFACE}, expected one that is up with mtu {vcan.FD_MTU}: tools/hexload doctor"
        )
    return vcan.INTERFACE


@pytest.fixture(scope="session")
def ecu() -> Path:
    return project.controller()


@pytest.fixture(scope="session")
def kind(request) -> Controller:
    """The controller that was chosen."""
    return CONTROLLERS[request.config.getoption("--controller")]()


@pytest.fixture(scope="session")
def any_profile(kind) -> str:
    """For tests that are not of the profile."""
    return kind.profiles[0]


@pytest.fixture(scope="session")
def place(kind, can_interface) -> Iterator[tuple]:
    """Options that let one controller after the other use the same emulator, which takes seconds to start."""
    if kind.name == "linux":
        yield ()
    else:
        with zynqmp_r5.running_board(can_interface) as folder:
            yield ("--board", folder)


@pytest.fixture(scope="session")
def make_loop(kind, place, simulator, can_interface) -> Callable[..., Loop]:
    """make_loop(start): the chosen controller with the simulator."""
    return lambda start: Loop(start, kind, place, simulator, can_interface)


@pytest.fixture
def free_bus() -> str:
    """A UDP multicast bus on a port that nobody has."""
    return f"udp_multicast:239.74.163.2:{free_port()}"


@pytest.fixture(scope="session")
def simulator() -> Path:
    return project.simulator()


@pytest.fixture(scope="session")
def bridge() -> Path:
    return project.build_directory() / "host_sim" / "hexload_bridge"


@pytest.fixture
def loop(start, make_loop) -> Loop:
    return make_loop(start)


@pytest.fixture(scope="module")
def in_module(tmp_path_factory, make_loop) -> Iterator[Loop]:
    """A loop for fixtures whose result all tests of a module share."""
    with ended_programs(tmp_path_factory.mktemp("programs"), []) as starter:
        yield make_loop(starter)


@pytest.fixture(scope="session")
def peers() -> list[Peer]:
    """Those that are on the bus now."""
    return []


@pytest.fixture
def peer(can_interface, peers) -> Iterator[Peer]:
    peer = Peer(can_interface)
    peers.append(peer)
    yield peer
    peers.remove(peer)
    peer.can.shutdown()


@pytest.fixture(scope="session")
def record(tmp_path_factory, make_loop, peers) -> Callable[..., Recording]:
    """record(profile, *options): a run in lockstep; the same profile and options again give the same recording.

    The first test that asks for a recording makes it; what its own peer hears of that is forgotten.
    """
    recordings: dict[tuple, Recording] = {}

    def recorder(*options) -> Recording:
        if options not in recordings:
            folder = tmp_path_factory.mktemp("recording")
            with ended_programs(folder, []) as starter:
                recordings[options] = make_loop(starter).record(folder / "run", *options)
            for peer in peers:
                peer.discard()
        return recordings[options]

    return recorder


@pytest.fixture(scope="session")
def paper_run(record) -> Callable[[str], Recording]:
    """paper_run(profile): the beginning of the paper's scenario."""
    return lambda profile: record(profile, "--duration", PAPER_S[profile])


@pytest.fixture(scope="session")
def short_run(record) -> Callable[[str], Recording]:
    """short_run(profile): its first half second."""
    return lambda profile: record(profile, "--duration", SHORT_S)
