"""A participant on a controller's serial line: python-can's slcan, with cantools for the signals."""

import itertools
import os
import socket
import time

from hexload import project
from hexload.io.python_can import can
from hexload_dev.bus_document import load_contract

PATIENCE_S = 60.0
LOCKSTEP = 1.0  # argument of START
START, SELECT_FILTER = 1, 4
FILTERS = ("paper", "momentum")  # in the order of their codes
ANSWER_PERIOD = 2  # ticks

CONTRACT = load_contract()


class Peer:
    def __init__(self, channel: str):
        self._can = can.Bus(interface="slcan", channel=channel, sleep_after_open=0)
        # Else the kernel keeps each frame until the one before it has been acknowledged, 40 ms later.
        with socket.socket(fileno=os.dup(self._can.fileno())) as line:
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._codec = project.native_module().bus
        self._sequence = itertools.count(1)

    def __enter__(self) -> "Peer":
        return self

    def __exit__(self, *_) -> None:
        self._can.shutdown()

    def receive(self, name: str) -> bytes:
        """The data of the next frame of this name."""
        identifier = CONTRACT.get_message_by_name(name).frame_id
        until = time.monotonic() + PATIENCE_S
        while (left := until - time.monotonic()) > 0:
            message = self._can.recv(left)
            if message is not None and message.arbitration_id == identifier:
                return bytes(message.data)
        raise AssertionError(f"no {name} within {PATIENCE_S:g} s")

    def status(self) -> dict[str, float]:
        """The signals of the next page of the controller's status."""
        return decode("ControllerStatus", self.receive("ControllerStatus"))

    def start(self, filter_name: str) -> list[dict[str, float]]:
        """Selects the filter, starts the controller in lockstep and returns the signals of both acknowledges."""
        acknowledges = []
        for command, argument in ((SELECT_FILTER, float(FILTERS.index(filter_name))), (START, LOCKSTEP)):
            self._send(self._codec.encode_command(command, next(self._sequence), argument))
            acknowledges.append(decode("Acknowledge", self.receive("Acknowledge")))
        return acknowledges

    def ask(self, sample) -> bytes | None:
        """Sends a sample's classic frames; the data of its answer's page, None for a tick without one."""
        tick = int(sample["tick"])
        legs = (sample[name].tolist() for name in ("displacement_m", "velocity_m_s", "force_n"))
        frames, saturated = self._codec.encode_sample("classic", tick, *legs)
        assert saturated == 0
        for frame in frames:
            self._send(frame)
        return self.receive("AnswerPage") if tick % ANSWER_PERIOD == 0 else None

    def _send(self, frame: tuple[int, bool, bytes]) -> None:
        identifier, _, data = frame
        self._can.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data), timeout=PATIENCE_S)


def decode(name: str, data: bytes) -> dict[str, float]:
    """Numbers, also of codes."""
    return CONTRACT.get_message_by_name(name).decode(data, decode_choices=False)
