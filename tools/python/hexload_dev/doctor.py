"""`hexload doctor`: what this machine can do of what the tests need, and the command that mends each thing missing.

`look` asks the machine; `diagnose` judges what was found and is a pure function of it.
"""

import json
import os
import platform
import re
import resource
import secrets
import shutil
import signal
import socket
import struct
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from hexload_dev import vcan, vm

MULTICAST_GROUP = "239.255.76.67"  # LCM's
MULTICAST_WAIT_S = 1.0
CAP_NET_ADMIN, CAP_IPC_LOCK, CAP_SYS_NICE = 12, 14, 23  # linux/capability.h
LOCKED_MEMORY_BYTES = 64 << 20  # room for hexload_sim, hexload_ecu and their libraries
REALTIME_PRIORITY = 50
QUEUE_LENGTH = 100  # frames; 100 ms of the FD profile

OK, MISSING, NOT_NEEDED = "ok", "missing", "not needed here"


@dataclass(frozen=True)
class Found:
    """What there is on this machine."""

    af_can: bool = False
    kernel_modules: bool = False  # the running kernel's vcan module lies ready
    interfaces: tuple[vcan.Interface, ...] = ()
    multicast_error: str | None = "not tried"  # None: a datagram to LCM's group came back
    programs: Mapping[str, bool] = field(default_factory=dict)
    display: str = ""
    vm_missing: tuple[str, ...] = ()  # pieces that keep `hexload vm` from starting
    is_root: bool = False
    capabilities: int = 0  # bit mask
    realtime_limit: int = 0  # RLIMIT_RTPRIO
    memlock_limit_bytes: int = 0  # RLIMIT_MEMLOCK; negative: no limit
    kernel: str = ""  # as `uname -r` has it

    def has(self, *programs: str) -> bool:
        return all(self.programs.get(name, False) for name in programs)

    def can(self, capability: int) -> bool:
        return bool(self.capabilities >> capability & 1)


@dataclass(frozen=True)
class Row:
    capability: str
    state: str
    found: str
    reason: str  # why it matters
    command: str = ""  # mends it; empty when nothing is to be mended
    tests_need_it: bool = False


PROGRAMS = ("java", "javac", "jar", "Xvfb", "candump", "canplayer", "ip", "insmod")


def look() -> Found:
    return Found(
        af_can=vcan.has_af_can(),
        kernel_modules=_has_vcan_module(),
        interfaces=tuple(vcan.can_interfaces()),
        multicast_error=multicast_error(),
        programs={name: shutil.which(name, path=vm.SYSTEM_PATH) is not None for name in PROGRAMS},
        display=os.environ.get("DISPLAY", ""),
        vm_missing=tuple(vm.missing_pieces()),
        is_root=os.geteuid() == 0,
        capabilities=_effective_capabilities(),
        realtime_limit=resource.getrlimit(resource.RLIMIT_RTPRIO)[0],
        memlock_limit_bytes=resource.getrlimit(resource.RLIMIT_MEMLOCK)[0],
        kernel=platform.release(),
    )


def _has_vcan_module() -> bool:
    folder = Path("/lib/modules") / platform.release()
    return any(folder.glob("kernel/drivers/net/can/vcan.ko*"))


def _effective_capabilities() -> int:
    match = re.search(r"^CapEff:\s*([0-9a-f]+)", Path("/proc/self/status").read_text(), re.MULTILINE)
    return int(match[1], 16) if match else 0


def multicast_error(group: str = MULTICAST_GROUP) -> str | None:
    """Sends a datagram of TTL 0 to `group`, as LCM does, on a free port and waits for it: None when it came back."""
    token = secrets.token_bytes(16)
    try:
        udp = (socket.AF_INET, socket.SOCK_DGRAM)
        with socket.socket(*udp) as receiver, socket.socket(*udp) as sender:
            receiver.bind(("", 0))
            membership = struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton("0.0.0.0"))
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            receiver.settimeout(MULTICAST_WAIT_S)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            sender.sendto(token, (group, receiver.getsockname()[1]))
            while receiver.recv(64) != token:
                pass
    except TimeoutError:
        return f"a datagram to {group} did not come back within {MULTICAST_WAIT_S:g} s"
    except OSError as error:
        return error.strerror or str(error)
    return None


def diagnose(found: Found) -> list[Row]:
    return [*_can_rows(found), *_vm_rows(found), *_lcm_rows(found), *_realtime_rows(found)]


def fit_for_tests(found: Found) -> bool:
    """Everything that `hexload test` needs is there; for CAN, this kernel's vcan0 or the virtual machine."""
    bus = _vcan0_usable(found) or not found.vm_missing
    return bus and all(row.state == OK for row in diagnose(found) if row.tests_need_it)


def _vcan0(found: Found) -> vcan.Interface | None:
    return next((i for i in found.interfaces if i.name == vcan.INTERFACE), None)


def _vcan0_usable(found: Found) -> bool:
    interface = _vcan0(found)
    return found.af_can and interface is not None and interface.usable


def _as_root(found: Found, *commands: str) -> str:
    return " && ".join(command if found.is_root else f"sudo {command}" for command in commands)


def _row(
    capability: str, ok: bool, found: str, reason: str, command: str, *, needed: bool = True, tests: bool = False
) -> Row:
    state = OK if ok else MISSING if needed else NOT_NEEDED
    return Row(capability, state, found, reason, command if state == MISSING else "", tests and needed)


def _kernel_command(found: Found) -> str:
    if found.kernel_modules:
        return _as_root(found, "modprobe -a can can-raw vcan")
    if re.search(r"-(generic|aws|azure|gcp)$", found.kernel):  # Ubuntu keeps CAN apart from its smaller kernels
        return _as_root(found, f"apt-get install linux-modules-extra-{found.kernel}", "modprobe -a can can-raw vcan")
    if "-cloud-" in found.kernel:
        return _as_root(found, f"apt-get install linux-image-{found.kernel.rpartition('-')[2]}", "reboot")
    return "tools/hexload vm -- COMMAND  (this kernel has no CAN; the virtual machine's has)"


def _can_rows(found: Found) -> list[Row]:
    return [
        *_kernel_rows(found),
        *_interface_rows(found),
        _row(
            "can-utils",
            found.has("candump", "canplayer", "ip"),
            _which(found, "candump", "canplayer", "ip"),
            "recording and playing bus logs",
            _as_root(found, "apt-get install can-utils iproute2"),
            tests=True,
        ),
    ]


def _kernel_rows(found: Found) -> list[Row]:
    interface, kernel = _vcan0(found), _kernel_command(found)
    return [
        _row(
            "AF_CAN socket",
            found.af_can,
            "opens" if found.af_can else f"not in kernel {found.kernel}",
            "SocketCAN: vcan, real adapters",
            kernel,
        ),
        _row(
            "vcan module",
            interface is not None or found.kernel_modules,
            "there" if interface or found.kernel_modules else "none",
            "makes vcan0",
            kernel,
        ),
    ]


def _interface_rows(found: Found) -> list[Row]:
    state, mend = _vcan0_state(found)
    usable, admin = _vcan0_usable(found), found.can(CAP_NET_ADMIN)
    short = [i for i in found.interfaces if i.queue_length < QUEUE_LENGTH]
    return [
        _row(
            "vcan0",
            usable,
            state,
            "the bus of simulator, controller and tests; mtu 72 lets FD frames through",
            mend if found.af_can else _kernel_command(found),
        ),
        _row(
            "right to make interfaces",
            admin,
            "CAP_NET_ADMIN" if admin else "no CAP_NET_ADMIN",
            "adding vcan0, setting bit rates",
            "sudo -v  (then the commands of the other rows)",
            needed=found.af_can and not usable,
        ),
        _row(
            "txqueuelen",
            bool(found.interfaces) and not short,
            ", ".join(f"{i.name}: {i.queue_length}" for i in found.interfaces) or "no CAN interface",
            "a full queue refuses frames (ENOBUFS)",
            _as_root(found, *(f"ip link set {i.name} txqueuelen 1000" for i in short)),
            needed=bool(short),
        ),
    ]


def _vcan0_state(found: Found) -> tuple[str, str]:
    """In words, and the commands that make it usable."""
    interface, up = _vcan0(found), f"ip link set {vcan.INTERFACE} mtu {vcan.FD_MTU} up"
    if interface is None:
        return "no such interface", _as_root(found, f"ip link add {vcan.INTERFACE} type vcan", up)
    down = (f"ip link set {vcan.INTERFACE} down",) if interface.up else ()  # the mtu of a running vcan is fixed
    return f"{'up' if interface.up else 'down'}, mtu {interface.mtu}", _as_root(found, *down, up)


def _which(found: Found, *programs: str) -> str:
    lacking = [name for name in programs if not found.has(name)]
    return f"no {', no '.join(lacking)}" if lacking else ", ".join(programs)


def _vm_rows(found: Found) -> list[Row]:
    needed = not _vcan0_usable(found)
    others = [piece for piece in found.vm_missing if piece != "insmod"]
    reason = "where the kernel has no CAN, the CAN tests run in a virtual machine"
    return [
        _row(
            "kmod",
            found.has("insmod"),
            _which(found, "insmod"),
            reason,
            _as_root(found, "apt-get install kmod"),
            needed=needed,
        ),
        _row(
            "kernel for the virtual machine",
            not others,
            "none: " + ", ".join(others) if others else "there",
            reason,
            "tools/hexload vm -- true",
            needed=needed,
        ),
    ]


def _lcm_rows(found: Found) -> list[Row]:
    java = ("java", "javac", "jar")
    display = bool(found.display) or found.has("Xvfb")
    return [
        _row(
            "multicast",
            found.multicast_error is None,
            found.multicast_error or "a datagram of TTL 0 came back",
            "LCM; CAN over udp_multicast",
            _as_root(found, "ip link set lo multicast on", "ip route add 224.0.0.0/4 dev lo"),
            tests=True,
        ),
        _row(
            "JDK",
            found.has(*java),
            _which(found, *java),
            "lcm-spy and the types that it decodes",
            _as_root(found, "apt-get install default-jdk-headless default-jre"),
            tests=True,
        ),
        _row(
            "display for lcm-spy",
            display,
            f"DISPLAY={found.display}" if found.display else _which(found, "Xvfb"),
            "lcm-spy has a window",
            _as_root(found, "apt-get install xvfb"),
            tests=True,
        ),
    ]


def _realtime_rows(found: Found) -> list[Row]:
    priority = found.can(CAP_SYS_NICE) or found.realtime_limit >= REALTIME_PRIORITY
    unlimited = found.can(CAP_IPC_LOCK) or found.memlock_limit_bytes < 0
    locked = unlimited or found.memlock_limit_bytes >= LOCKED_MEMORY_BYTES
    memory = "no limit" if unlimited else f"at most {found.memlock_limit_bytes >> 20} MiB"

    def limit(words: str) -> str:
        return f'echo "$USER - {words}" | sudo tee -a /etc/security/limits.d/hexload.conf  (then log in again)'

    return [
        _row(
            "real-time priority",
            priority,
            "SCHED_FIFO" if priority else f"rtprio at most {found.realtime_limit}",
            "late ticks in real-time mode are fewer",
            limit(f"rtprio {REALTIME_PRIORITY}"),
        ),
        _row(
            "locked memory",
            locked,
            memory,
            "no page fault delays a tick in real-time mode",
            limit(f"memlock {LOCKED_MEMORY_BYTES >> 10}"),
        ),
    ]


def run_doctor(as_json: bool = False) -> int:
    found = look()
    rows = diagnose(found)
    fit = fit_for_tests(found)
    if as_json:
        print(json.dumps({"is_fit": fit, "rows": [asdict(row) for row in rows]}, indent=2))
        return 0 if fit else 1
    _print_table(rows)
    for row in rows:
        if row.command:
            print(f"{row.capability}:\n    {row.command}")
    place = "on this kernel" if _vcan0_usable(found) else "in the virtual machine"
    print(
        f"hexload test has all that it needs; the CAN tests run {place}"
        if fit
        else "hexload test lacks something, see above"
    )
    return 0 if fit else 1


def _print_table(rows: list[Row]) -> None:
    """Plain lines before rich is installed: doctor installs nothing."""
    try:
        from rich.console import Console
        from rich.table import Table
    except ModuleNotFoundError:
        for row in rows:
            print(f"{row.capability}: {row.state}; {row.found}; {row.reason}")
        return
    table = Table("capability", "state", "found", "why it matters")
    for row in rows:
        table.add_row(row.capability, row.state, row.found, row.reason, style="bold" if row.state == MISSING else None)
    Console().print(table)


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # a reader that has enough, as head has, ends it without a word
    sys.exit(run_doctor("--json" in sys.argv[1:]))
