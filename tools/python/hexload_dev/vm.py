"""`hexload vm`: runs a command in a small virtual machine whose kernel has SocketCAN.

The distribution's stock kernel under QEMU. The guest's root file system is the machine's own, read-only, below a layer
in memory; tools/vm/init and tools/vm/run are its two scripts. Output and exit status come back by virtio ports.
"""

import hashlib
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
from hexload_dev.sandbox import QEMU_SANDBOX

SCRIPTS = project.ROOT / "tools" / "vm"
IMAGE = project.BUILD / "deps" / "vm"  # kernel, modules/ in loading order: put there by tools/hexload
DEFAULT_OUT = project.BUILD / "vm"
QEMU = "qemu-system-x86_64"
BUSYBOX = Path("/bin/busybox")
BOOT_LIMIT_S = 120  # 2.5 s on an idle machine
TIMED_OUT = 124  # as timeout(1)
DIED = 125

# Environment that goes along. HEXLOAD_BUILD_DIR tells launcher and verbs in the guest to use that build as it is.
RUNS = "runs"  # in the guest's /out: run directories of verbs that were not told where
PASSED_NAMES = ("PATH", "HOME", "PYTHONPATH", "PYTHONPYCACHEPREFIX", "CI", "LANG", "TERM", "COLUMNS", "NO_COLOR")
PASSED_PREFIXES = ("HEXLOAD_", "LC_", "LCM_")


@dataclass(frozen=True)
class GuestOptions:
    """What the guest is given. `timeout_s` counts from the moment at which COMMAND starts."""

    out: Path = DEFAULT_OUT
    memory_mib: int = 1024
    cpus: int = 2
    timeout_s: float | None = None
    kvm: bool = False

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
    initramfs = ensure_initramfs()
    _make_out(options.out)
    with tempfile.TemporaryDirectory(prefix="hexload-vm-") as job:
        _write_job(Path(job), command)
        status = _Guest(command, options, initramfs, Path(job)).run()
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
    """The caller may have closed some of them; their numbers must not go to the machine's ports."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)


def missing_pieces() -> list[str]:
    """What keeps the virtual machine from starting here; empty: nothing."""
    if platform.machine() != "x86_64":
        return [f"x86_64 processor (but {platform.machine()})"]
    programs = [name for name in (QEMU, "cpio", "setpriv") if not shutil.which(name)]
    files = [str(path) for path in (BUSYBOX, IMAGE / "vmlinux", IMAGE / "modules") if not path.exists()]
    return programs + files


def ensure_initramfs() -> Path:
    """The guest's first file system: busybox, the modules and tools/vm/init. Made anew when one of them has changed."""
    target = IMAGE / "initramfs.cpio"
    parts = [(SCRIPTS / "init", "init"), (BUSYBOX, "bin/busybox")]
    parts += [(module, f"modules/{module.name}") for module in sorted((IMAGE / "modules").iterdir())]
    digest = hashlib.sha256()
    for source, name in parts:
        digest.update(name.encode() + source.read_bytes())
    stamp = IMAGE / "initramfs.stamp"
    if target.exists() and stamp.exists() and stamp.read_text() == digest.hexdigest():
        return target
    with tempfile.TemporaryDirectory(dir=IMAGE) as folder:
        for source, name in parts:
            (Path(folder) / name).parent.mkdir(exist_ok=True)
            shutil.copyfile(source, Path(folder) / name)
            (Path(folder) / name).chmod(0o755)
        names = "\0".join(["bin", "modules", *(name for _, name in parts)])
        archive = Path(folder) / "archive"
        with archive.open("wb") as output:
            pack = ["cpio", "--quiet", "--create", "--null", "--format=newc", "--owner=0:0"]
            subprocess.run(pack, cwd=folder, input=names.encode(), stdout=output, check=True)
        archive.replace(target)
    stamp.write_text(digest.hexdigest())
    return target


def _make_out(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: found no folder that can be used ({error.strerror}), expected one") from error
    if "," in str(out):
        raise InputError(f"--out {out}: found a comma in the name, which QEMU's options do not allow")


def guest_environment(environment: dict[str, str]) -> dict[str, str]:
    passed = {k: v for k, v in environment.items() if k in PASSED_NAMES or k.startswith(PASSED_PREFIXES)}
    own = {"HEXLOAD_BUILD_DIR": str(project.build_directory()), "HEXLOAD_VM": "1", "HEXLOAD_ARTEFACTS": "/out"}
    own["HEXLOAD_RUNS"] = f"/out/{RUNS}"
    return passed | own


def _write_job(job: Path, command: list[str]) -> None:
    shutil.copyfile(SCRIPTS / "run", job / "run")
    exports = [f"export {name}={shlex.quote(value)}" for name, value in guest_environment(dict(os.environ)).items()]
    lines = [*exports, f"cd {shlex.quote(os.getcwd())} || exit 127", f"exec {shlex.join(command)}", ""]
    (job / "command").write_text("\n".join(lines))


class _Guest:
    """One run of QEMU: the three ports are socket pairs, the console and QEMU's own words are files."""

    def __init__(self, command: list[str], options: GuestOptions, initramfs: Path, job: Path):
        self.command, self.options = shlex.join(command), options
        self.status: int | None = None
        self.left_bytes: list[int] | None = None  # of output and errors, when COMMAND has ended
        self.handed_on = [0, 0]  # likewise
        self.started = time.monotonic()
        self.ready: float | None = None  # when COMMAND started
        self.control = b""
        pairs = [socket.socketpair() for _ in range(3)]
        self.ports = [ours for ours, _ in pairs]
        theirs = [socket_ for _, socket_ in pairs]
        arguments = qemu_arguments(options, initramfs, job, [socket_.fileno() for socket_ in theirs])
        self.qemu_log = job / "qemu.log"
        with self.qemu_log.open("wb") as log:
            self.process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=[socket_.fileno() for socket_ in theirs],
                start_new_session=True,  # Ctrl-C reaches us alone, and we end QEMU
            )
        for socket_ in theirs:
            socket_.close()

    def run(self) -> int:
        try:
            self._pump()
        except BrokenPipeError:  # whoever read our output has gone
            raise ToolFailed(exit_code=141) from None
        finally:
            self.process.kill()
            self.process.wait()
            for port in self.ports:
                port.close()
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
        """Hands the ports' bytes on until COMMAND has ended and all that it wrote is there, or until QEMU has ended."""
        handlers = (self._counted(0, _writer(1)), self._counted(1, _writer(2)), self._take_control)
        with selectors.DefaultSelector() as selector:
            for port, handler in zip(self.ports, handlers, strict=True):
                port.setblocking(False)
                selector.register(port, selectors.EVENT_READ, handler)
            while self._expects_more() and selector.get_map():
                for key, _ in selector.select(self._seconds_left()):
                    if not _hand_on(key.fileobj, key.data):
                        selector.unregister(key.fileobj)

    def _counted(self, port: int, write: Callable[[bytes], None]) -> Callable[[bytes], None]:
        def take(data: bytes) -> None:
            self.handed_on[port] += len(data)
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
        panic = self._console_line("Kernel panic") or self._console_line("hexload vm: ")
        cause = panic or self.qemu_log.read_text(errors="replace").strip() or "no reason on its console"
        return f"vm: the guest died {during}\n  {cause}\n  console log:  {self.options.console_log}"

    def _console_line(self, text: str) -> str | None:
        if not self.options.console_log.exists():
            return None
        lines = self.options.console_log.read_text(errors="replace").splitlines()
        return next((re.sub(r"^\[ *[\d.]+\] ", "", line).strip() for line in lines if text in line), None)


def _writer(descriptor: int) -> Callable[[bytes], None]:
    def write(data: bytes) -> None:
        while data:
            data = data[os.write(descriptor, data) :]

    return write


def _hand_on(port: socket.socket, handler: Callable[[bytes], None]) -> bool:
    """False: nothing there now, or the other end has closed."""
    try:
        data = port.recv(1 << 16)
    except (BlockingIOError, ConnectionResetError):
        return False
    if data:
        handler(data)
    return bool(data)


def qemu_arguments(options: GuestOptions, initramfs: Path, job: Path, ports: list[int]) -> list[str]:
    """`ports`: file descriptors of COMMAND's stdout, stderr, and the control channel."""
    kernel_words = "console=ttyS0 loglevel=4 panic=-1 mitigations=off tsc=reliable clocksource=tsc rdinit=/init"
    arguments = [QEMU, *QEMU_SANDBOX]
    arguments += ["-nodefaults", "-no-user-config", "-no-reboot", "-display", "none", "-nic", "none"]
    arguments += ["-accel", "kvm", "-cpu", "host"] if options.kvm else ["-accel", "tcg,thread=multi", "-cpu", "max"]
    arguments += ["-m", str(options.memory_mib), "-smp", str(options.cpus)]
    arguments += ["-kernel", str(IMAGE / "vmlinux"), "-initrd", str(initramfs), "-append", kernel_words]
    arguments += ["-serial", f"file:{options.console_log}"]
    for tag, path, access in (
        ("root", "/", ",readonly=on"),
        ("job", job, ",readonly=on"),
        ("out", options.out.resolve(), ""),
    ):
        share = f"local,path={path},mount_tag={tag},security_model=none,multidevs=remap{access}"
        arguments += ["-virtfs", share]
    arguments += ["-device", "virtio-serial-pci"]
    for number, descriptor in enumerate(ports, start=1):
        arguments += ["-chardev", f"socket,id=port{number},fd={descriptor}"]
        arguments += ["-device", f"virtserialport,nr={number},chardev=port{number},name=hexload.{number}"]
    return arguments
