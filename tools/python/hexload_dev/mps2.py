"""The controller on an emulated Cortex-M7: hexload_mps2_an500 in QEMU, its serial line as SLCAN on a local TCP port."""

import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hexload.errors import ToolFailed
from hexload_dev import target
from hexload_dev.boot_options import boot_options
from hexload_dev.sandbox import QEMU_SANDBOX

PRESET = target.CORTEX_M7["-O2"]
PROGRAM = "hexload_mps2_an500"
READY_LIMIT_S = 60.0  # it listens for a quarter of a second; the rest is a busy machine
BOOT_OPTIONS_ADDRESS = 0x203FF000  # as its linker script has it
STATUS_FRAME = b"\rt1208"  # ControllerStatus of hexload.dbc


@dataclass(frozen=True)
class Controller:
    process: subprocess.Popen
    port: int

    @property
    def bus(self) -> str:
        """As hexload_sim names it."""
        return f"slcan:127.0.0.1:{self.port}"

    @property
    def python_can_channel(self) -> str:
        """For python-can's interface slcan."""
        return f"socket://127.0.0.1:{self.port}"


def program(preset: str = PRESET, name: str = PROGRAM) -> Path:
    return target.directory(preset) / "firmware" / "ports" / "mps2_an500" / name


@contextmanager
def running_mps2(
    folder: Path, preset: str = PRESET, options: tuple[str, ...] = (), config: bytes = b"", name: str = PROGRAM
) -> Iterator[Controller]:
    """Starts the emulated controller, waits until it speaks, ends it at the end; it also ends when this process does.

    QEMU's own words are in `folder`. `options`: further ones of QEMU. `config`: of native.config_bytes(), instead of the
    paper's machine. `name`: of the program. One peer at a time: the next is served when the
    last has gone. Raises ToolFailed when the controller does not get ready.
    """
    log = folder / "qemu.log"
    (folder / "boot_options").write_bytes(boot_options(config))
    loader = f"loader,file={folder}/boot_options,addr={BOOT_OPTIONS_ADDRESS:#x},force-raw=on"
    with socket.create_server(("127.0.0.1", 0)) as server, log.open("wb") as output:
        # The multiplexer has a buffer: without it QEMU's two threads take turns for each byte, half as fast.
        line = f"socket,id=line,fd={server.fileno()},server=on,wait=off,nodelay=on,mux=on"
        process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", *command(preset, name), "-chardev", line, "-serial", "chardev:line",
             "-device", loader, *options],
            stdin=subprocess.DEVNULL, stdout=output, stderr=output, pass_fds=[server.fileno()],
        )  # fmt: skip
        controller = Controller(process, server.getsockname()[1])
    try:
        _await_status(controller, log)
        yield controller
    finally:
        process.kill()
        process.wait()


def command(preset: str, name: str = PROGRAM) -> list[str]:
    machine = ["qemu-system-arm", *QEMU_SANDBOX, *"-machine mps2-an500 -display none -monitor none".split()]
    return [*machine, "-semihosting-config", "enable=on,target=native", "-kernel", str(program(preset, name))]


def _await_status(controller: Controller, log: Path) -> None:
    """Until a page of the controller's status is on the line."""
    until = time.monotonic() + READY_LIMIT_S
    seen = b""
    try:
        with socket.create_connection(("127.0.0.1", controller.port), READY_LIMIT_S) as line:
            while STATUS_FRAME not in seen:
                line.settimeout(max(until - time.monotonic(), 0.001))
                received = line.recv(4096)
                if not received:
                    raise ConnectionResetError
                seen = (seen + received)[-1024:]
    except TimeoutError:
        raise ToolFailed(f"{PROGRAM}: not ready after {READY_LIMIT_S:g} s") from None
    except ConnectionError:
        reason = log.read_text(errors="replace").strip() or "it says no reason"
        raise ToolFailed(f"{PROGRAM}: QEMU has ended: {reason}") from None
