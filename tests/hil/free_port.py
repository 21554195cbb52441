"""A UDP port for one test."""

import random
import socket

PORTS = range(20_000, 32_000)  # below those that the kernel gives to sockets that ask for none, which come and go


def free_port() -> int:
    """One that nobody has. Out of the kernel's own range, nobody gets it by chance before it is bound."""
    while True:
        port = random.SystemRandom().choice(PORTS)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", port))
            except OSError:
                continue
        return port
