"""Listens on a CAN bus through python-can, with the firmware's own codec, and sends commands there."""

import random
import threading

import numpy as np

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload.io.authentication import (
    ANSWER_MAC,
    ASK,
    CHALLENGE,
    PATIENCE_S,
    START,
    AnswerCodes,
    Authenticator,
    kind_of,
)
from hexload.io.python_can import can, cantools
from hexload.io.run_directory import PAPER_PARAMETERS
from hexload.theory.bound import THETA_NAMES
from hexload.view.frame import Estimate
from hexload.view.live import KINDS, MONITOR, SESSIONS, Live

WAIT_S = 0.05
PROFILES = ("fd", "classic")
OTHER = "frame of another kind"  # of the codec
TAKEN = ("ok", "more frames needed")
DONE = 0  # of an acknowledge
ESTIMATES = (2, 3)  # states in which answers have an estimate of the run
FRAMES_REFUSED = 1 << 15  # health bit
UNPROVEN = 4  # times 16 or 64 ticks without a code of the answers: no accident


def open_bus(name: str, profile: str) -> can.BusABC:
    """A bus by the name that simulator and controller take. Raises InputError for a name, ToolFailed for a bus."""
    kind, _, place = name.partition(":")
    options = {}
    if kind == "udp_multicast":
        place, _, port = place.partition(":")
        options = {"hop_limit": 0} | ({"port": int(port)} if port else {})  # no frame leaves this computer
    elif kind == "slcan":
        kind, place = "slcan", place if place.startswith("/") else f"socket://{place}"
    elif kind != "socketcan":
        raise InputError(
            f"--bus: found {name}, expected socketcan:INTERFACE, udp_multicast:GROUP[:PORT] or slcan:PLACE"
        )
    try:
        return can.Bus(interface=kind, channel=place, **options, **({} if kind == "slcan" else {"fd": profile == "fd"}))
    except (can.CanError, OSError, ValueError) as error:
        raise ToolFailed(f"{name}: found no such bus ({error})") from None


class Words:
    """What codes of an answer and of an acknowledge mean, by the bus contract."""

    def __init__(self) -> None:
        contract = cantools.database.load_file(project.bus_contract())
        health, acknowledge = (contract.get_message_by_name(name) for name in ("HealthFd", "Acknowledge"))
        self.verdicts = {
            code: str(word).replace(" ", "_") for code, word in health.get_signal_by_name("verdict").choices.items()
        }
        self.states = health.get_signal_by_name("state").choices
        self.faults = health.get_signal_by_name("fault").choices
        self.results = acknowledge.get_signal_by_name("result").choices


class BusListener:
    """Feeds `live` until `close`. Raises InputError for a name, ToolFailed where there is no such bus or no codec."""

    def __init__(self, live: Live, name: str, profile: str = "fd", key: bytes | None = None):
        project.ensure_built("hexload_native")
        codec = getattr(project.native_module(), "bus", None)
        if codec is None:
            raise ToolFailed(
                "--bus: found no bus codec in this installed package, expected a clone and its tools/hexload"
            )
        self._session = random.randrange(SESSIONS)
        self._live, self._codec, self._words = live, codec, Words()
        self._bus = open_bus(name, profile)
        self._answers = codec.AnswerAssembly(profile)
        self._pages = profile == "classic"
        self._tick = 0
        self._codes = None if key is None else AnswerCodes(key, profile)
        self._is_told = False  # that answers are another's
        self._refuses = False  # the controller, frames
        self._authenticator = None if key is None else Authenticator(key, self._put, self._ask, self._tell_given_up)
        self._readers = (
            (codec.SampleAssembly(profile).add, self._take_sample),
            (self._read_answer, self._take_answer),
            (codec.decode_acknowledge, self._take_acknowledge),
            (codec.decode_load_change, lambda change: self._live.load_changed(change["tick"])),
            (codec.decode_status, lambda status: None),  # for what is wrong with them
        )
        self._readers_of: dict[int, tuple] = {}  # by identifier
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while not self._ended.is_set():
            if self._authenticator is not None:
                self._authenticator.expire()
            try:
                message = self._bus.recv(WAIT_S)
            except can.CanError as error:
                self._live.event(f"bus: {error}")
                self._ended.wait(1.0)
                continue
            if message is not None and not (
                message.is_extended_id or message.is_error_frame or message.is_remote_frame
            ):
                self._take((message.arbitration_id, message.is_fd, bytes(message.data)))

    def _take(self, frame: tuple) -> None:
        """To the readers whose frame it is: what a reader calls another's is not offered to it again."""
        identifier = frame[0]
        if identifier == CHALLENGE and self._authenticator is not None:
            self._authenticator.challenge(frame[2])
        if self._codes is not None:
            self._codes.hear(identifier, frame[2])
            if identifier == ANSWER_MAC and self._codes.is_on:
                self._take_answer_code(frame[2])
                return
        mine = self._readers_of.setdefault(identifier, self._readers)
        for reader in mine:
            read, take = reader
            status, fields = read(frame)
            if status == OTHER:
                self._readers_of[identifier] = tuple(
                    kept for kept in self._readers_of[identifier] if kept is not reader
                )
            elif status not in TAKEN:
                self._live.count(f"frames refused: {status}")
            elif fields is not None:
                take(fields)

    def _take_sample(self, sample: dict) -> None:
        missing = sample["tick"] - self._tick - 1
        if 0 < missing and self._tick > 0:
            self._live.count("samples missing: lost on the bus, or on the way to this page", missing)
        self._tick = sample["tick"]
        self._live.count("samples")
        self._live.sample(sample["tick"], sample["displacement_m"], sample["force_n"])

    def _read_answer(self, frame: tuple) -> tuple:
        status, answer = self._answers.add(frame, self._tick)
        if status in TAKEN and self._codes is not None and self._codes.is_on:
            is_in_order = self._pages or self._answers.is_in_order
            self._codes.add(frame[2], answer is not None or self._pages, self._answers.answered_tick, is_in_order)
            if self._codes.unproven > UNPROVEN and answer is not None and answer["state"] in ESTIMATES:
                self._tell_false("they have no codes of its key")
        return status, answer

    def _take_answer_code(self, code: bytes) -> None:
        matches = self._codes.matches(code)
        if matches:
            self._is_told = False
            self._live.count("codes of answers that are of the controller's key")
        elif matches is None:
            self._live.count("codes of answers not checked: frames were lost")
        else:
            self._tell_false("their code is not of its key")

    def _tell_false(self, why: str) -> None:
        self._live.count(f"times answers were not the controller's: {why}")
        if not self._is_told:
            self._live.event(f"answers are not the controller's: {why}; somebody else answers in its place")
        self._is_told = True

    def _take_answer(self, answer: dict) -> None:
        names = THETA_NAMES if answer["filter"] == 1 else PAPER_PARAMETERS
        verdicts = tuple(self._words.verdicts[code] for code in answer["parameter_verdict"])
        value, sigma = np.array(answer["value"]), np.array(answer["sigma"])
        estimate = Estimate(tuple(names), value, sigma, self._words.verdicts[answer["verdict"]], verdicts)
        refuses = bool(answer["health"] & FRAMES_REFUSED)
        if refuses and not self._refuses:
            self._live.event("controller refuses frames: damaged, another's, or samples lack the code of its key")
        self._refuses = refuses
        fault = "" if answer["fault"] == 0 else f", fault: {self._words.faults[answer['fault']]}"
        self._live.answer(
            estimate,
            (f"controller {self._words.states[answer['state']]}{fault}", f"{answer['refused']} samples refused"),
        )

    def _take_acknowledge(self, fields: dict) -> None:
        if self._codes is not None and fields["kind"] == START and fields["result"] == DONE:
            self._codes.started()
        self._live.event(f"controller: {self._words.results[fields['result']]}, {self._words.states[fields['state']]}")

    def send(self, kind: int, number: int, argument: float) -> None:
        """A command to the controller."""
        identifier, _, data = self._codec.encode_command(kind, number, argument, MONITOR, self._session)
        put = self._put if self._authenticator is None else self._authenticator.command
        put(identifier, data)

    def _ask(self) -> None:
        identifier, _, data = self._codec.encode_command(ASK, 0, 0.0, MONITOR, self._session)
        self._put(identifier, data)

    def _tell_given_up(self, data: bytes) -> None:
        word = next(word for word, kind in KINDS.items() if kind == kind_of(data))
        self._live.event(f"given up: {word}: no controller with a key has told a challenge within {PATIENCE_S:g} s")

    def _put(self, identifier: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data), timeout=WAIT_S)

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._bus.shutdown()
        self._readers, self._readers_of = (), {}  # of the native module, which is gone before buttons are
