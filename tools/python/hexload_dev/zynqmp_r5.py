"""`python -m hexload_dev.zynqmp_r5`: the Cortex-R5F controller under QEMU on a SocketCAN interface.

It takes the options of hexload_ecu that this controller can honour, says what hexload_ecu would say (ready, states,
faults), and ends as it does. The controller's own words come by its UART, its states by the bus. SIGUSR1 holds the
board's time, SIGUSR2 lets it go on.

QEMU takes a second to start: with --board a launcher uses one that runs already, and begins with the reset button.

It is for lockstep: emulated, the controller takes some hundred samples a second. QEMU 7.2 ends when the receive FIFO
overflows while the controller reads a frame from it.
"""

import argparse
import contextlib
import ctypes
import json
import os
import selectors
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload_dev.boot_options import boot_options
from hexload_dev.sandbox import QEMU_SANDBOX

NAME = "hexload_zynqmp_r5"
PRESET = "target-cortex-r5f"
QEMU = "qemu-system-aarch64"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"  # hexload_config_default() is this machine, with tolerances
SAMPLE_TIMEOUT_MS = range(5, 60001)
TICK_S = 1e-3
READY_LIMIT_S = 60.0
START_LIMIT_S = 60.0  # of QEMU
CAN_FRAME = struct.Struct("=IB3x8s")  # linux/can.h
STANDARD_DATA = 0xDFFFFFFF  # mask: eleven bits of identifier, no extended or remote frame
PR_SET_PDEATHSIG = 1  # sys/prctl.h
IFF_UP = 1  # net/if.h
MEMORY = "256M"

# Exit statuses: those of hexload_ecu, and one more.
BAD_INPUT, SECOND_CONTROLLER, NO_BUS, SYSTEM, STOPPED = 2, 3, 4, 5, 6

# As firmware/ports/zynqmp_r5's linker script has it.
BOOT_OPTIONS_ADDRESS = 0x2F000

# Of firmware/bus/hexload.dbc.
ACKNOWLEDGE, CONTROLLER_STATUS = 0x110, 0x120
STATES = ("idle", "armed", "estimating", "converged", "fault")
TICK_PAGE = 1
FAULTS = {
    1: "the samples are silent since tick {next}: is the simulator still running? Its next RESET and START begin anew",
    2: "samples refused in a row, the last good one at tick {last}: check the sensors and the platform file",
    3: "samples of the profile fd are on the bus, this controller speaks classic: start the simulator with --profile classic",
    4: "a second controller is on the bus: stop one of the two",
    5: "the bus is down, last tick {last}: waiting for it",
    6: "samples of two sources are on the bus, or of one that began anew without START: those from elsewhere are refused, the last good one was at tick {last}; stop one of the two",
}


def program() -> Path:
    """The controller's image. HEXLOAD_ZYNQMP_R5 names another one."""
    default = project.preset_directory(PRESET) / "firmware" / "ports" / "zynqmp_r5" / NAME
    return Path(os.environ.get("HEXLOAD_ZYNQMP_R5", default))


def qemu_arguments(image: Path, interface: str, folder: Path) -> list[str]:
    """`folder` gets the sockets qmp and uart, and the memory as a file. The machine waits for the monitor's word."""
    words = [QEMU, *QEMU_SANDBOX]
    words += ["-machine", "xlnx-zcu102,canbus0=bus,memory-backend=memory", "-smp", "5", "-m", MEMORY, "-S"]
    words += ["-object", f"memory-backend-file,id=memory,size={MEMORY},mem-path={folder}/memory,share=on"]
    words += ["-nodefaults", "-no-user-config", "-display", "none", "-audiodev", "none,id=none", "-nic", "none"]
    words += ["-global", "xlnx-zynqmp.boot-cpu=rpu-cpu[0]", "-device", f"loader,file={image},cpu-num=4"]
    words += ["-object", "can-bus,id=bus", "-object", f"can-host-socketcan,id=host,if={interface},canbus=bus"]
    words += ["-chardev", f"socket,id=qmp,path={folder}/qmp,server=on,wait=off", "-mon", "chardev=qmp,mode=control"]
    words += ["-chardev", f"socket,id=uart,path={folder}/uart,server=on,wait=off", "-serial", "chardev:uart"]
    return words


@contextlib.contextmanager
def running_board(interface: str) -> Iterator[Path]:
    """QEMU, which waits for a launcher. It ends with the block, and with this process."""
    if not program().exists():
        raise InputError(f"found no {program()}: build the preset {PRESET}")
    if shutil.which(QEMU) is None:
        raise InputError(f"found no {QEMU}: install the package qemu-system-arm")
    with tempfile.TemporaryDirectory(prefix="hexload-board-") as name:
        folder = Path(name)
        with (folder / "log").open("wb") as log:
            command = ["setpriv", "--pdeathsig", "KILL", *qemu_arguments(program(), interface, folder)]
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
            )
        try:
            until = time.monotonic() + START_LIMIT_S
            while not _listens(folder / "uart"):  # the last one that it opens
                if process.poll() is not None or time.monotonic() > until:
                    raise ToolFailed(f"{QEMU} does not start\n{_log_of(folder)}", SYSTEM)
                time.sleep(0.02)
            yield folder
        finally:
            process.kill()
            process.wait()


def _listens(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        return probe.connect_ex(str(path)) == 0


def _log_of(folder: Path) -> str:
    """What QEMU said."""
    log = folder / "log"
    return log.read_text(errors="replace").strip() if log.exists() else ""


class Board:
    """A running QEMU by its monitor and its UART."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._monitor_socket, self.uart = socket.socket(socket.AF_UNIX), socket.socket(socket.AF_UNIX)
        try:
            self._monitor_socket.connect(str(folder / "qmp"))
        except OSError as error:
            raise ToolFailed(f"{folder}: no emulator there ({error.strerror})\n{_log_of(folder)}", SYSTEM) from None
        self._monitor = self._monitor_socket.makefile("rw")
        self._read()  # the greeting
        self._execute("qmp_capabilities")
        self.uart.connect(str(folder / "uart"))

    def start(self, boot_options: bytes) -> None:
        """From reset. The first R5 runs, and no other processor of the board."""
        core = {"path": "/machine/soc/rpu-cluster/rpu-cpu[0]", "property": "start-powered-off", "value": False}
        self.hold()
        self._execute("qom-set", core)
        self._let_others_go_first()
        self._write_boot_options(boot_options)
        self._execute("system_reset", until_event="RESET")  # only asked for: it comes when it comes
        self.go_on()

    def _let_others_go_first(self) -> None:
        """The controller polls without end, in a thread that holds QEMU's lock for most of its time. On one processor the
        thread that brings it frames would hardly ever find that free, were it not taken in at once when it wakes."""
        for processor in self._execute("query-cpus-fast"):
            os.sched_setscheduler(processor["thread-id"], os.SCHED_IDLE, os.sched_param(0))

    def hold(self) -> None:
        self._execute("stop")

    def go_on(self) -> None:
        self._execute("cont")

    def release(self) -> None:
        """What is left is held, and silent."""
        with contextlib.suppress(OSError, ToolFailed):  # it may have ended
            self.hold()
        self._monitor.close()
        self._monitor_socket.close()
        self.uart.close()

    def _write_boot_options(self, options: bytes) -> None:
        with (self._folder / "memory").open("r+b") as memory:
            memory.seek(BOOT_OPTIONS_ADDRESS)
            memory.write(options)

    def _execute(self, command: str, arguments: dict | None = None, until_event: str | None = None) -> Any:
        """Returns the answer when it has come, and the event, in either order."""
        self._monitor.write(json.dumps({"execute": command, "arguments": arguments or {}}) + "\n")
        self._monitor.flush()
        awaited = {"return"} | ({until_event} if until_event else set())
        answer = None
        while awaited:
            message = self._read()
            if "error" in message:
                raise ToolFailed(f"{QEMU}: {command}: {message['error']['desc']}", exit_code=SYSTEM)
            awaited -= {*message, message.get("event")}
            answer = message.get("return", answer)
        return answer

    def _read(self) -> dict:
        line = self._monitor.readline()
        if not line:
            raise self.ended()
        return json.loads(line)

    def ended(self) -> ToolFailed:
        return ToolFailed(f"{QEMU} has ended\n{_log_of(self._folder)}", SYSTEM)


class Report:
    """What the controller's frames say, in the words of hexload_ecu; a change of state is said once."""

    def __init__(self, is_quiet: bool):
        self._is_quiet = is_quiet
        self._said = (0, 0)  # state, fault

    def take(self, identifier: int, data: bytes) -> str | None:
        """A line to say, if any."""
        if identifier == ACKNOWLEDGE:
            state, fault, page = data[5] & 15, data[5] >> 4, None
        else:
            state, fault, page = data[2] & 15, data[2] >> 4, data[1] >> 4
        if (state, fault) == self._said or state >= len(STATES):
            return None
        tick = int.from_bytes(data[3:7], "little") if page == TICK_PAGE else None
        if "{" in FAULTS.get(fault, "") and tick is None:
            return None  # soon told
        was_fault = self._said[1]
        self._said = (state, fault)
        if fault:
            return "fault: " + FAULTS.get(fault, "unknown").format(last=tick, next=(tick or 0) + 1)
        return None if self._is_quiet and not was_fault else STATES[state]


class Session:
    """One run of the launcher: the board, the bus, and the signals."""

    def __init__(self, interface: str, options_in_memory: bytes, is_quiet: bool, board: Board, bus: socket.socket):
        self._name, self._boot_options = f"socketcan:{interface}", options_in_memory
        self._board, self._bus = board, bus
        self._report = Report(is_quiet)
        self._is_active = self._is_ready = False
        self._words = b""

    def run(self) -> int:
        """Returns the exit status."""
        with _signals() as signals, selectors.DefaultSelector() as selector:
            for source in (self._bus, self._board.uart, signals):
                selector.register(source, selectors.EVENT_READ)
            self._board.start(self._boot_options)
            while True:
                ready = [key.fileobj for key, _ in selector.select(None if self._is_ready else READY_LIMIT_S)]
                if not ready:
                    raise ToolFailed(f"not ready after {READY_LIMIT_S:g} s without a word", exit_code=SYSTEM)
                if signals in ready and self._obey(signals.recv(16)):
                    return 0
                if self._board.uart in ready:
                    self._hear()
                if self._bus in ready:
                    self._watch()

    def _obey(self, numbers: bytes) -> bool:
        """Whether it is to end."""
        for number in numbers:
            if number == signal.SIGUSR1:
                self._board.hold()
            elif number == signal.SIGUSR2:
                self._board.go_on()
            else:
                return True
        return False

    def _hear(self) -> None:
        data = self._board.uart.recv(4096)
        if not data:
            raise self._board.ended()
        *lines, self._words = (self._words + data).split(b"\n")
        for line in lines:
            if line == b"active":
                self._is_active = True
            elif line.startswith(b"silent"):
                text = "a second controller: another one is on the bus already; stop it first"
                raise ToolFailed(f"{self._name}: {text}", exit_code=SECOND_CONTROLLER)
            else:
                raise ToolFailed(f"the controller has stopped: {line.decode(errors='replace')}", exit_code=STOPPED)

    def _watch(self) -> None:
        try:
            identifier, length, data = CAN_FRAME.unpack(self._bus.recv(CAN_FRAME.size))
        except OSError:  # the bus has gone down, or has come again
            return
        if not self._is_active or length != 8:
            return
        if not self._is_ready and identifier == CONTROLLER_STATUS:
            self._is_ready = True
            say(f"ready on {self._name}, profile classic")
        if line := self._report.take(identifier, data):
            say(line)


def say(line: str) -> None:
    print(f"{NAME}: {line}", flush=True)


@contextlib.contextmanager
def _signals() -> Iterator[socket.socket]:
    """Their numbers can be read from the socket."""
    reader, writer = socket.socketpair()
    with reader, writer:
        writer.setblocking(False)
        signal.set_wakeup_fd(writer.fileno())
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2):
            signal.signal(number, lambda *_: None)
        yield reader
        signal.set_wakeup_fd(-1)


def _open_bus(interface: str) -> socket.socket:
    """A listener to the frames that tell the controller's state."""
    try:
        flags = int((Path("/sys/class/net") / interface / "flags").read_text(), 16)
    except OSError:
        text = f"socketcan:{interface}: found no interface {interface}, expected one that is up"
        raise ToolFailed(text, exit_code=NO_BUS) from None
    if not flags & IFF_UP:
        text = f"socketcan:{interface}: found the interface down, expected it up: ip link set {interface} up"
        raise ToolFailed(text, exit_code=NO_BUS)
    filters = b"".join(struct.pack("=II", identifier, STANDARD_DATA) for identifier in (ACKNOWLEDGE, CONTROLLER_STATUS))
    try:
        bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, filters)
        bus.bind((interface,))
    except OSError as error:
        raise ToolFailed(f"socketcan:{interface}: {error.strerror}", exit_code=NO_BUS) from error
    return bus


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME,
        description="The load identifying controller on an emulated Cortex-R5F with its CAN controller.",
        epilog="Exit status: 0 ended by SIGINT or SIGTERM, 2 bad option or file, 3 another controller was heard on the "
        "bus before this one spoke, 4 the bus cannot be opened, 5 the emulator failed, 6 the processor stopped.",
    )
    parser.add_argument("--bus", required=True, help="socketcan:INTERFACE")
    parser.add_argument(
        "--platform",
        type=Path,
        required=True,
        help="platform file: the paper's is built in, another one is written to memory",
    )
    parser.add_argument("--rig", type=Path, help="rig file of hexload commission")
    parser.add_argument("--profile", default="classic", help="frames of the bus: classic, the only one it has")
    parser.add_argument("--sample-timeout-ms", type=int, help="silence of the samples in real time that is a fault")
    parser.add_argument(
        "--without-authentication", action="store_true", help="carry out commands of anybody on the bus; must be given"
    )
    parser.add_argument(
        "--die-with-parent", action="store_true", help="end when the process that started this one ends"
    )
    parser.add_argument("--board", type=Path, help="folder of an emulator that runs already; default: one of its own")
    parser.add_argument("--quiet", action="store_true", help="print the ready line and faults only")
    return parser


def _check(options: argparse.Namespace) -> str:
    """Refuses what this controller cannot do; returns the interface."""
    transport, _, interface = options.bus.partition(":")
    if transport != "socketcan" or not interface:
        raise InputError(
            f"--bus: found '{options.bus}', expected socketcan:INTERFACE: its CAN controller is a real one"
        )
    if options.profile != "classic":
        raise InputError(
            f"--profile: found '{options.profile}', expected classic: this CAN controller has no FD frames"
        )
    if not options.without_authentication:
        raise InputError("--bus: found no --without-authentication, expected it: the emulated controller has no key")
    timeout = options.sample_timeout_ms
    if timeout is not None and timeout not in SAMPLE_TIMEOUT_MS:
        raise InputError(f"--sample-timeout-ms: found {timeout}, expected 5..60000")
    return interface


def boot_options_of(options: argparse.Namespace) -> bytes:
    """Of the command line. Raises InputError."""
    config = b"" if options.rig is None and _is_built_in(options.platform) else _config_of(options)
    return boot_options(config, options.sample_timeout_ms or 0)


def _config_of(options: argparse.Namespace) -> bytes:
    native = project.native_module()
    try:
        platform = native.load_platform(str(options.platform))
        if options.rig is not None:
            platform = native.with_rig(platform, str(options.rig))
        return native.config_bytes(platform, TICK_S)
    except ValueError as error:
        raise InputError(str(error)) from None


def _is_built_in(file: Path) -> bool:
    """The estimator is the simulator's choice, and the momentum filter's platform file needs no mass of the load."""
    try:
        platform = tomllib.loads(file.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"--platform {file}: found no platform file ({error})") from error
    built_in = tomllib.loads(PLATFORM.read_text())
    del built_in["tolerances"]  # none: the simulated machine is exact; without the table it is the firmware's default
    load = platform.get("load", {}) or built_in["load"]
    return platform | {"load": load, "estimator": built_in["estimator"]} == built_in


def _run(options: argparse.Namespace) -> int:
    interface = _check(options)
    options_in_memory = boot_options_of(options)
    with contextlib.ExitStack() as stack:
        bus = stack.enter_context(_open_bus(interface))
        board = Board(options.board or stack.enter_context(running_board(interface)))
        stack.callback(board.release)
        return Session(interface, options_in_memory, options.quiet, board, bus).run()


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    if options.die_with_parent:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    for number in (signal.SIGINT, signal.SIGTERM):  # until the session takes them
        signal.signal(number, lambda *_: sys.exit(0))
    try:
        return _run(options)
    except (InputError, ToolFailed) as error:
        print(f"{NAME}: {error}", file=sys.stderr, flush=True)
        return error.exit_code


if __name__ == "__main__":
    sys.exit(main())
