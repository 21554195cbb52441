"""The loop of two programs on a bus, records of what is on it, and a stand-in for either program."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from bus_frames import BY_ID, PROFILES, Frame, Signals, decode, encode_command, from_message, read_candump, to_message
from hexload import project
from hexload.io.python_can import can

SCENARIO = project.SCENARIOS / "paper.toml"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PATIENCE_S = 120.0
PATIENT = ("--answer-timeout", "60")  # of a simulator whose controller may wait for a processor
SLOW_MACHINE = ("--sample-timeout-ms", "60000")  # of a controller whose simulator may
PAPER_S = {"fd": 5, "classic": 1}  # of the paper's scenario, by profile: in fd until it has converged
PAPER_TICKS = {profile: 1000 * seconds + 1 for profile, seconds in PAPER_S.items()}  # both ends
SHORT_S = 0.5  # of the scenario, where it need not converge
SHORT_TICKS = round(1000 * SHORT_S) + 1
NOTHING_COMES_S = 1.0  # that long is waited for what may not come
RECORDER_BUFFER_BYTES = 8 << 20
OPEN = "--without-authentication"  # but for test_20_keys.py
MARK = "1FFFFFFF"  # an extended identifier, which is none of the contract's
ONLY_MARK = f"{MARK}:DFFFFFFF"


@dataclass(frozen=True)
class Controller:
    """A kind of controller that the tests can be run with; both take the options of hexload_ecu."""

    name: str
    command: tuple[str | Path, ...]
    profiles: tuple[str, ...]  # that it speaks; the first one unless it is told otherwise
    keeps_up: bool  # with frames that come at another's pace; QEMU ends when its receive FIFO overflows
    hold: signal.Signals  # its time stands still
    go_on: signal.Signals

    @classmethod
    def linux(cls) -> "Controller":
        return cls("linux", (project.controller(), OPEN), PROFILES, True, signal.SIGSTOP, signal.SIGCONT)

    @classmethod
    def linux_separate(cls) -> "Controller":
        """With the arithmetic of a processor that rounds a b + c twice."""
        ecu = project.controller()
        return replace(cls.linux(), command=(ecu.with_name(f"{ecu.name}_separate"), OPEN))

    @classmethod
    def zynqmp_r5(cls) -> "Controller":
        command = (sys.executable, "-m", "hexload_dev.zynqmp_r5", OPEN)
        return cls("zynqmp_r5", command, ("classic",), False, signal.SIGUSR1, signal.SIGUSR2)


@dataclass(frozen=True)
class Recording:
    """A run over the bus and every frame of it."""

    frames: list[Frame]
    candump: Path
    directory: Path  # the simulator's run directory
    output: str  # what the simulator printed

    @property
    def meta(self) -> dict:
        return read_meta(self.directory)


class Loop:
    """Starts programs on one bus; the fixture behind `start` ends them.

    `place`: more options of the controller, where there is room for one only.
    """

    def __init__(self, start: Callable, kind: Controller, place: tuple, simulator: Path, interface: str):
        self._start, self._kind, self._place = start, kind, place
        self._simulator, self.interface = simulator, interface
        self.bus = f"socketcan:{interface}"

    def controller(self, *options, platform: Path = PLATFORM):
        """A controller, ready."""
        program = self._start(*self._kind.command, "--bus", self.bus, "--platform", platform, *self._place, *options)
        program.wait_for("ready on")
        return program

    def second_controller(self, *options, bus: str | None = None):
        """Another controller, just started."""
        return self._start(*self._kind.command, "--bus", bus or self.bus, "--platform", PLATFORM, *options)

    def hold(self, controller) -> None:
        """It does nothing until it is told to go on."""
        controller.process.send_signal(self._kind.hold)

    def go_on(self, controller) -> None:
        controller.process.send_signal(self._kind.go_on)

    def simulation(self, directory: Path, *options, scenario: Path = SCENARIO):
        own = (
            scenario,
            "--out",
            directory,
            "--bus",
            self.bus,
            "--any-configuration",
        )  # controllers have rigs of their own
        patient = PATIENT if "--lockstep" in options and PATIENT[0] not in options else ()
        return self._start(self._simulator, *own, *patient, *options)

    def recorder(self, *filters: str):
        """A candump that listens; `filters`, as candump has them, say which frames are recorded: none, all."""
        channel = ",".join((self.interface, *filters, *((ONLY_MARK,) if filters else ())))
        program = self._start("candump", "-L", "-d", "-r", RECORDER_BUFFER_BYTES, channel)
        self._mark_until_seen(program, 0)  # before it listens, marks are lost
        return program

    def finish(self, recorder) -> list[Frame]:
        """What was on the bus until now."""
        self._mark_until_seen(recorder, recorder.log.stat().st_size)
        recorder.interrupt()
        return read_candump(recorder.log)

    def _mark_until_seen(self, recorder, beyond_byte: int) -> None:
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            subprocess.run(["cansend", self.interface, f"{MARK}#"], check=True)
            for _ in range(10):
                time.sleep(0.01)
                with recorder.log.open("rb") as log:
                    log.seek(beyond_byte)
                    if MARK.encode() in log.read():
                        return
        pytest.fail(f"{recorder.title}: does not record")

    def record(
        self,
        directory: Path,
        profile: str,
        *options,
        scenario: Path = SCENARIO,
        platform: Path = PLATFORM,
        rig: Path | None = None,
    ) -> Recording:
        """A run in lockstep with a fresh controller, from beginning to end."""
        of_rig = () if rig is None else ("--rig", rig)
        controller = self.controller("--profile", profile, *of_rig, platform=platform)
        recorder = self.recorder()
        simulation = self.simulation(directory, "--lockstep", "--profile", profile, *options, scenario=scenario)
        assert simulation.wait(10 * PATIENCE_S) == 0, simulation.output
        frames = self.finish(recorder)
        controller.interrupt()
        return Recording(frames, recorder.log, directory, simulation.output)


class Peer:
    """A participant in Python: simulator, controller, or neither."""

    def __init__(self, interface: str):
        self.can = can.Bus(interface="socketcan", channel=interface, fd=True)
        self._counter = itertools.count(1)

    def send(self, frames: Frame | Iterable[Frame]) -> None:
        for frame in [frames] if isinstance(frames, Frame) else frames:
            self.can.send(to_message(frame), timeout=PATIENCE_S)

    def receive(self, *names: str, patience_s: float = PATIENCE_S) -> Frame | None:
        """The next frame of one of these names; None when none comes."""
        until = time.monotonic() + patience_s
        while (left := until - time.monotonic()) > 0:
            message = self.can.recv(left)
            if message is not None and not message.is_extended_id and message.arbitration_id in BY_ID:
                if (frame := from_message(message)).name in names:
                    return frame
        return None

    def signals(self, *names: str, where: Callable[[Signals], bool] = lambda signals: True) -> dict[str, float]:
        """Of the next frame of one of these names for which `where` holds."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            frame = self.receive(*names)
            if frame is not None and where(decode(frame)):
                return decode(frame).values
        pytest.fail(f"no such frame on the bus: {', '.join(names)}")

    def command(self, command: str | int, argument: float = 0.0) -> dict[str, float]:
        """Sends a command and returns the signals of its acknowledge."""
        counter = next(self._counter) % 16
        self.send(encode_command(command, counter, argument))
        return self.signals("Acknowledge", where=lambda signals: signals.values["sequence"] == counter)

    def status(self, signal: str) -> float:
        """A signal of the controller's status, from a page that was written after this call."""
        self.discard()
        return self.signals("ControllerStatus", where=lambda signals: signal in signals.values)[signal]

    @contextmanager
    def hearing(self, *names: str) -> Iterator[None]:
        """In the block frames of these names alone are received: Python is too slow for all of a run."""
        identifiers = [message.frame_id for message in BY_ID.values() if message.name in names]
        self.can.set_filters([{"can_id": identifier, "can_mask": 0x7FF} for identifier in identifiers])
        try:
            yield
        finally:
            self.can.set_filters(None)

    def discard(self) -> None:
        """Forgets what has come."""
        while self.can.recv(0) is not None:
            pass

    def ask(self, sample: Iterable[Frame], answer_frames: int) -> list[Frame]:
        """Sends a sample and returns as many frames of its answer."""
        self.send(sample)
        return [self.answer() for _ in range(answer_frames)]

    def answer(self) -> Frame:
        frame = self.receive("EstimateFd", "SigmaFd", "LoadFd", "LoadSigmaFd", "HealthFd", "AnswerPage")
        assert frame is not None, "the controller does not answer"
        return frame


@contextmanager
def one_processor() -> Iterator[None]:
    """Programs that are started in the block share one processor."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def read_meta(directory: Path) -> dict:
    return json.loads((directory / "meta.json").read_text())


def estimates(directory: Path) -> list[str]:
    """The lines of a run's estimates, without the header."""
    return (directory / "estimates.csv").read_text().splitlines()[1:]


def interface_state(interface: str, state: str) -> None:
    """Sets the interface up or down; needs the right to."""
    subprocess.run(["ip", "link", "set", interface, state], check=True)
