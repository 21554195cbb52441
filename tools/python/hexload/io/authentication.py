"""Commands to a controller with a key, as firmware/bus/authentication.h has them: AES-CMAC of the package cryptography."""

import struct
import threading
import time
from collections import deque
from collections.abc import Callable

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

COMMAND_MAC, CHALLENGE = 0x011, 0x111
ASK = 6  # the command challenge
DATA_ID = 0x484C0000  # of a frame: this and its identifier
CODE_BYTES = 8
PATIENCE_S = 1.0  # that a command waits for its challenge: later it would surprise


def code_of(key: bytes, nonce: bytes, command: bytes) -> bytes:
    """What CommandMac has for the eight bytes of a Command."""
    mac = CMAC(AES(key))
    mac.update(struct.pack("<I", DATA_ID + COMMAND_MAC) + nonce + command)
    return mac.finalize()[:CODE_BYTES]


class Authenticator:
    """Sends commands one after the other, each when the controller has told its nonce. From any thread.

    `send(identifier, data)` puts a frame on the bus; `ask()` the command challenge.
    """

    def __init__(self, key: bytes, send: Callable[[int, bytes], None], ask: Callable[[], None]):
        self._key, self._send, self._ask = key, send, ask
        self._nonce: bytes | None = None
        self._waiting: deque[tuple[float, int, bytes]] = deque()
        self._lock = threading.Lock()

    def command(self, identifier: int, data: bytes) -> None:
        """A frame Command."""
        with self._lock:
            self._waiting.append((time.monotonic() + PATIENCE_S, identifier, data))
            if self._nonce is None:
                self._ask()
            else:
                self._send_next()

    def challenge(self, nonce: bytes) -> None:
        """Of a frame Challenge."""
        with self._lock:
            self._nonce = nonce
            self._send_next()

    def _send_next(self) -> None:
        while self._waiting:
            until, identifier, data = self._waiting.popleft()
            if time.monotonic() < until:
                code = code_of(self._key, self._nonce, data)
                self._nonce = None
                self._send(identifier, data)
                self._send(COMMAND_MAC, code)
                return
