"""`hexload vm`: runs a command in a small virtual machine whose kernel has SocketCAN.

The distribution's own user-mode Linux: a kernel that runs as a process of the user's, its programs on the processor
itself, so that it needs neither rights nor hardware virtualisation. It has one processor. The guest's root file system
is the machine's own, read-only, below a layer in memory; tools/vm/init and tools/vm/run are its two scripts. Output and
exit status come back by serial lines. COMMAND is no better kept in than any other program that the user starts.
"""

import os
import platform
import re
import selectors
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload.io.run_files import ADDED_FILES, FILES
from hexload_dev import build

SCRIPTS = project.ROOT / "tools" / "vm"
IMAGE = project.BUILD / "deps" / "vm"  # linux, the kernel, and modules/ in loading order: put there by tools/hexload
DEFAULT_OUT = project.BUILD / "vm"
PROGRAMS = ("setpriv", "insmod", "ip", "stty")  # the guest's are the machine's
# The kernel's programs are processes of this machine, which it traces: were it killed alone, one that runs would run on,
# outside. So all of its process group, which it makes itself, is killed: when we say so or have died, and when it ends.
GUARD = ("setpriv", "--pdeathsig", "TERM", "sh", "-c", "trap 'kill -KILL -${!:-0} 0' TERM EXIT; \"$@\" & wait", "sh")
SHARED_MEMORY = Path("/dev/shm")
BOOT_LIMIT_S = 120  # 1.5 s on an idle machine
TIMED_OUT = 124  # as timeout(1)
DIED = 125

SYSTEM_PATH = os.environ.get("PATH", os.defpath) + ":/usr/sbin:/sbin"  # as tools/vm/init has it

# Environment that goes along. HEXLOAD_BUILD_DIR tells launcher and verbs in the guest to use that build as it is.
RUNS = "runs"  # in the guest's /out: run directories of verbs that were not told where
PASSED_NAMES = ("PATH", "HOME", "PYTHONPATH", "PYTHONPYCACHEPREFIX", "CI", "LANG", "TERM", "COLUMNS", "NO_COLOR")
PASSED_PREFIXES = ("HEXLOAD_", "LC_", "LCM_")


@dataclass(frozen=True)
class GuestOptions:
    """What the guest is given. `timeout_s` counts from the moment at which COMMAND starts."""

    out: Path = DEFAULT_OUT
    memory_mib: int = 1024
    timeout_s: float | None = None

    @property
    def console_log(self) -> Path:
        return self.out / "console.log"


def run_in_guest(command: list[str], options: GuestOptions = GuestOptions()) -> int:
    """Builds what the verbs need, boots, runs `command`, and returns its exit status."""
    build.ensure_built(*project.PROGRAMS)
    missing = missing_pieces()
    if missing:
        raise ToolFailed(
            f"vm: found no {', no '.join(missing)} (tools/hexload vm puts them in place, tools/hexload doctor explains)"
        )
    _fill_standard_streams()
    _make_out(options.out)
    with tempfile.TemporaryDirectory(prefix="hexload-vm-") as job:
        _write_job(Path(job), command, options.out)
        status = _Guest(command, options, Path(job)).run()
    for directory in bring_home(options.out / RUNS, project.RUNS):
        print(f"[hexload] brought home: {directory}", file=sys.stderr, flush=True)
    return status


def bring_home(runs: Path, home: Path) -> list[Path]:
    """What verbs in the guest have written without --out, instead of a run that lay there under the same name.

    Raises InputError where something else lies there, before anything is moved.
    """
    directories = sorted(runs.iterdir()) if runs.is_dir() else []
    targets = [home / directory.name for directory in directories]
    for directory, target in zip(directories, targets, strict=True):
        if (found := _foreign_content(target)) is not None:
            raise InputError(
                f"{target}: found {found}, expected nothing but a run; the guest's run stays in {directory}"
            )
    home.mkdir(parents=True, exist_ok=True)
    for directory, target in zip(directories, targets, strict=True):
        shutil.rmtree(target, ignore_errors=True)
        shutil.move(directory, target)
    return targets


def _foreign_content(target: Path) -> str | None:
    """What is no part of a run directory; None: nothing, or there is nothing at all."""
    if not target.is_dir() or target.is_symlink():
        return "no folder" if target.exists() or target.is_symlink() else None
    foreign = sorted(path.name for path in target.iterdir() if path.name not in FILES + ADDED_FILES or path.is_dir())
    return f"{foreign[0]} in it" if foreign else None


def _fill_standard_streams() -> None:
    """The caller may have closed some of them; their numbers must not go to the machine's lines."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)


def missing_pieces() -> list[str]:
    """What keeps the virtual machine from starting here; empty: nothing."""
    if platform.machine() != "x86_64":
        return [f"x86_64 processor (but {platform.machine()})"]
    programs = [name for name in PROGRAMS if not shutil.which(name, path=SYSTEM_PATH)]
    return programs + [str(path) for path in (IMAGE / "linux", IMAGE / "modules") if not path.exists()]


def _make_out(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: found no folder that can be used ({error.strerror}), expected one") from error
    if "," in str(out):
        raise InputError(f"--out {out}: found a comma in the name, which the guest's mount does not allow")


def guest_environment(environment: dict[str, str]) -> dict[str, str]:
    passed = {k: v for k, v in environment.items() if k in PASSED_NAMES or k.startswith(PASSED_PREFIXES)}
    own = {"HEXLOAD_BUILD_DIR": str(project.build_directory()), "HEXLOAD_VM": "1", "HEXLOAD_ARTEFACTS": "/out"}
    own["HEXLOAD_RUNS"] = f"/out/{RUNS}"
    return passed | own


def _write_job(job: Path, command: list[str], out: Path) -> None:
    """The folder that the guest's first program finds itself in."""
    for script in ("init", "run"):
        shutil.copy(SCRIPTS / script, job / script)
    (job / "modules").symlink_to(IMAGE / "modules")
    (job / "out").symlink_to(out.resolve())
    (job / "layer").mkdir()
    exports = [f"export {name}={shlex.quote(value)}" for name, value in guest_environment(dict(os.environ)).items()]
    lines = [*exports, f"cd {shlex.quote(os.getcwd())} || exit 127", f"exec {shlex.join(command)}", ""]
    (job / "command").write_text("\n".join(lines))


class _Guest:
    """One run of the kernel: its three serial lines are socket pairs, its console is a file."""

    def __init__(self, command: list[str], options: GuestOptions, job: Path):
        self.command, self.options = shlex.join(command), options
        self.status: int | None = None
        self.left_bytes: list[int] | None = None  # of output and errors, when COMMAND has ended
        self.handed_on = [0, 0]  # likewise
        self.started = time.monotonic()
        self.ready: float | None = None  # when COMMAND started
        self.control = b""
        pairs = [socket.socketpair() for _ in range(3)]
        self.lines = [ours for ours, _ in pairs]
        theirs = [socket_ for _, socket_ in pairs]
        with options.console_log.open("wb") as console:
            self.process = subprocess.Popen(
                [*GUARD, *kernel_arguments(options, job, [end.fileno() for end in theirs])],
                stdin=subprocess.DEVNULL,
                stdout=console,
                stderr=console,
                cwd=job,  # a kernel that panics leaves its core there
                env=os.environ | {"TMPDIR": str(_memory_folder(options.memory_mib, job))},
                pass_fds=[end.fileno() for end in theirs],
                start_new_session=True,  # Ctrl-C reaches us alone, and we end the machine
            )
        for end in theirs:
            end.close()

    def run(self) -> int:
        try:
            self._pump()
        except BrokenPipeError:  # whoever read our output has gone
            raise ToolFailed(exit_code=141) from None
        finally:
            self.process.terminate()
            self.process.wait()
            for line in self.lines:
                line.close()
        if self.status is None:
            raise ToolFailed(self._why_it_died(), exit_code=DIED)
        out_of_memory = self._console_line("Out of memory: ")
        if out_of_memory and self.status:
            advice = (
                f"the guest's {self.options.memory_mib} MiB were not enough, try --memory {2 * self.options.memory_mib}"
            )
            print(f"hexload: vm: {advice} ({out_of_memory})", file=sys.stderr)
        return self.status

    def _pump(self) -> None:
        """Hands the lines' bytes on until COMMAND has ended and all that it wrote is there, or until the kernel has."""
        handlers = (self._counted(0, _writer(1)), self._counted(1, _writer(2)), self._take_control)
        with selectors.DefaultSelector() as selector:
            for line, handler in zip(self.lines, handlers, strict=True):
                line.setblocking(False)
                selector.register(line, selectors.EVENT_READ, handler)
            while self._expects_more() and selector.get_map():
                for key, _ in selector.select(self._seconds_left()):
                    if not _hand_on(key.fileobj, key.data):
                        selector.unregister(key.fileobj)

    def _counted(self, line: int, write: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def take(data: bytes) -> None:
            self.handed_on[line] += len(data)
            write(data)

        return take

    def _expects_more(self) -> bool:
        return self.left_bytes is None or any(
            here < all_ for here, all_ in zip(self.handed_on, self.left_bytes, strict=True)
        )

    def _take_control(self, data: bytes) -> None:
        self.control += data
        *lines, self.control = self.control.split(b"\n")
        for line in lines:
            word, *rest = line.decode().split()
            if word == "ready":
                self.ready = time.monotonic()
                if os.isatty(2):
                    print(f"[hexload] guest up after {self.ready - self.started:.1f} s", file=sys.stderr, flush=True)
            elif word == "exit":
                self.status, *self.left_bytes = (int(number) for number in rest)

    def _seconds_left(self) -> float | None:
        """Until the limit that counts now; raises when it has passed."""
        now = time.monotonic()
        console = f"  console log:  {self.options.console_log}"
        if self.ready is None:
            if now > self.started + BOOT_LIMIT_S:
                raise ToolFailed(f"vm: the guest was not up within {BOOT_LIMIT_S} s\n{console}", exit_code=DIED)
            return self.started + BOOT_LIMIT_S - now + 0.01
        if self.options.timeout_s is None:
            return None
        left = self.ready + self.options.timeout_s - now
        if left < 0:
            words = f"vm: stopped after --timeout {self.options.timeout_s:g} s: {self.command}\n{console}"
            raise ToolFailed(words, exit_code=TIMED_OUT)
        return left + 0.01

    def _why_it_died(self) -> str:
        during = f"before it ended: {self.command}" if self.ready else "before it was up"
        said = ("hexload vm: ", "Kernel panic", "")  # the surest first
        cause = next(filter(None, map(self._console_line, said)), "no reason on its console")
        return f"vm: the guest died {during}\n  {cause}\n  console log:  {self.options.console_log}"

    def _console_line(self, text: str) -> str | None:
        """The last one with `text` in it, without the time before it."""
        lines = self.options.console_log.read_text(errors="replace").splitlines()
        found = [line for line in lines if text in line and line.strip()]
        return re.sub(r"^\[ *[\d.]+\] ", "", found[-1]).strip() if found else None


def _writer(descriptor: int) -> Callable[[bytes], None]:
    def write(data: bytes) -> None:
        while data:
            data = data[os.write(descriptor, data) :]

    return write


def _hand_on(line: socket.socket, handler: Callable[[bytes], None]) -> bool:
    """False: nothing there now, or the other end has closed."""
    try:
        data = line.recv(1 << 16)
    except (BlockingIOError, ConnectionResetError):
        return False
    if data:
        handler(data)
    return bool(data)


def _memory_folder(memory_mib: int, job: Path) -> Path:
    """For the guest's memory, a file that is mapped to be run: a container's shared memory is often too small or forbids it."""
    if not SHARED_MEMORY.is_dir():
        return job
    found = os.statvfs(SHARED_MEMORY)
    is_fit = found.f_bavail * found.f_frsize >= memory_mib << 20 and not found.f_flag & os.ST_NOEXEC
    return SHARED_MEMORY if is_fit else job


def kernel_arguments(options: GuestOptions, job: Path, lines: list[int]) -> list[str]:
    """`lines`: file descriptors of COMMAND's stdout, stderr, and the control channel."""
    arguments = [str(IMAGE / "linux"), f"mem={options.memory_mib}M", f"uml_dir={job}", "loglevel=4", "panic=-1"]
    arguments += ["root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", f'init="{job}/init"']
    arguments += ["console=tty0", "con0=null,fd:1", "con=null", "ssl=null"]
    return arguments + [f"ssl{number}=fd:{descriptor}" for number, descriptor in enumerate(lines)]
