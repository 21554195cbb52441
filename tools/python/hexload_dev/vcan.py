"""Whether this machine's own kernel has the CAN interface that the tests need. Only the standard library is used:
tools/hexload asks with `python -m hexload_dev.vcan` (status 0: yes) before anything else is set up."""

import os
import socket
import sys
from dataclasses import dataclass
from pathlib import Path

INTERFACE = "vcan0"
FD_MTU = 72  # sizeof(struct canfd_frame): the interface takes classic and FD frames
ARPHRD_CAN = 280  # net/if_arp.h
NETWORK = Path("/sys/class/net")
IFF_UP = 1


@dataclass(frozen=True)
class Interface:
    name: str
    up: bool
    mtu: int
    queue_length: int  # frames that wait for the adapter; beyond it the kernel refuses with ENOBUFS

    @property
    def usable(self) -> bool:
        return self.up and self.mtu >= FD_MTU


def has_af_can() -> bool:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    return True


def can_interfaces(network: Path = NETWORK) -> list[Interface]:
    found = []
    for folder in sorted(network.glob("*")):
        if int((folder / "type").read_text()) == ARPHRD_CAN:
            flags, mtu, length = ((folder / name).read_text() for name in ("flags", "mtu", "tx_queue_len"))
            found.append(Interface(folder.name, bool(int(flags, 16) & IFF_UP), int(mtu), int(length)))
    return found


def ready() -> bool:
    """True when the CAN tests can run on this kernel."""
    return has_af_can() and any(i.name == INTERFACE and i.usable for i in can_interfaces())


def required() -> bool:
    """True when a CAN test that cannot run has failed: HEXLOAD_REQUIRE_VCAN=1; without that variable, CI=true."""
    return os.environ.get("HEXLOAD_REQUIRE_VCAN", os.environ.get("CI", "")).lower() not in ("", "0", "false")


if __name__ == "__main__":
    sys.exit(0 if ready() else 1)
