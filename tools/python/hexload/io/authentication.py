"""Commands to a controller with a key and the codes of its answers, as firmware/bus/authentication.h and answer_code.h have
them: AES-CMAC of the package cryptography."""

import hmac
import struct
import threading
import time
from collections import deque
from collections.abc import Callable

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

COMMAND, COMMAND_MAC, ANSWER_MAC, CHALLENGE = 0x010, 0x011, 0x107, 0x111
START = 1  # the command
ANSWER_CODES = 4  # beside the pacing, in START
ASK = 6  # the command challenge
DATA_ID = 0x484C0000  # of a frame: this and its identifier
CODE_BYTES = 8
PATIENCE_S = 1.0  # that a command waits for its challenge: later it would surprise


def kind_of(command: bytes) -> int:
    """What the eight bytes of a Command command."""
    return command[1] >> 4


def code_of(key: bytes, nonce: bytes, command: bytes) -> bytes:
    """What CommandMac has for the eight bytes of a Command."""
    return code_over(key, COMMAND_MAC, nonce, command)


def code_over(key: bytes, identifier: int, nonce: bytes, data: bytes) -> bytes:
    """What a frame of this identifier has as a code for `data`."""
    mac = CMAC(AES(key))
    mac.update(struct.pack("<I", DATA_ID + identifier) + nonce + data)
    return mac.finalize()[:CODE_BYTES]


class Authenticator:
    """Sends commands one after the other, each when the controller has told its nonce. From any thread.

    `send(identifier, data)` puts a frame on the bus; `ask()` the command challenge; `give_up(data)` is told the frame of a
    command that is not sent, since no challenge came in time.
    """

    def __init__(
        self,
        key: bytes,
        send: Callable[[int, bytes], None],
        ask: Callable[[], None],
        give_up: Callable[[bytes], None],
    ):
        self._key, self._send, self._ask, self._give_up = key, send, ask, give_up
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

    def expire(self) -> None:
        """Gives up commands that have waited for too long. To be called every now and then: a controller without a key
        tells no challenge."""
        with self._lock:
            self._give_up_late()

    def _give_up_late(self) -> None:
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            self._give_up(self._waiting.popleft()[2])

    def _send_next(self) -> None:
        self._give_up_late()
        if self._waiting:
            _, identifier, data = self._waiting.popleft()
            code = code_of(self._key, self._nonce, data)
            self._nonce = None
            self._send(identifier, data)
            self._send(COMMAND_MAC, code)


class AnswerCodes:
    """Of a run that is listened to: are its answers the controller's? Knows the run's nonce once it has heard the START."""

    def __init__(self, key: bytes, profile: str):
        self._key = key
        self._ticks, self._step, self._frame_bytes = (16, 1, 1) if profile == "fd" else (64, 2, 16)
        self._challenge: bytes | None = None
        self._command = b""
        self._start: tuple[bytes, bool] | None = None  # that waits for its acknowledge: nonce, has codes
        self._nonce: bytes | None = None  # of a run whose answers have codes
        self._begin()

    def _begin(self) -> None:
        self._frames, self._first_tick, self._next_tick, self._is_whole = [], 0, 0, False
        self.unproven = 0  # times 16 or 64 ticks that have begun since the last code

    @property
    def is_on(self) -> bool:
        """Whether this run's answers must have codes."""
        return self._nonce is not None

    def hear(self, identifier: int, data: bytes) -> None:
        """A frame Challenge, Command or CommandMac, from whomever."""
        if identifier == CHALLENGE:
            self._challenge = data
        elif identifier == COMMAND:
            self._command = data
        elif identifier == COMMAND_MAC and self._challenge is not None and len(self._command) == CODE_BYTES:
            if hmac.compare_digest(code_of(self._key, self._challenge, self._command), data):
                is_start = kind_of(self._command) == START
                self._start = (self._challenge, bool(self._command[4] & ANSWER_CODES)) if is_start else None

    def started(self) -> None:
        """A START was acknowledged as carried out."""
        if self._start is not None:
            nonce, has_codes = self._start
            self._nonce = nonce if has_codes else None
            self._begin()

    def add(self, data: bytes, ends_answer: bool, tick: int, is_in_order: bool = True) -> None:
        """A frame of an answer that was taken. `ends_answer`: the answer is whole with it, in the classic profile each page.
        `is_in_order`: those of its answer before it have come too; a code counts frames in their order."""
        first_tick = tick - tick % self._ticks
        if not self._frames or first_tick != self._first_tick:
            self._frames, self._first_tick, self._next_tick, self._is_whole = [], first_tick, first_tick, True
            self.unproven += 1
        self._frames.append(data.ljust(self._frame_bytes, b"\0"))
        self._is_whole = self._is_whole and is_in_order
        if ends_answer:
            self._is_whole = self._is_whole and tick == self._next_tick
            self._next_tick = tick + self._step

    def matches(self, code: bytes) -> bool | None:
        """Whether a code AnswerMac is that of the answers since the last one; None: frames were lost, so it cannot tell."""
        tells = bool(self._frames) and self._is_whole and self._next_tick == self._first_tick + self._ticks
        data = struct.pack("<I", self._first_tick) + b"".join(self._frames)
        if self._nonce is not None and hmac.compare_digest(code_over(self._key, ANSWER_MAC, self._nonce, data), code):
            self._frames, self.unproven = [], 0
            return True
        return False if tells else None
