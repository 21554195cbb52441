"""A machine in operation as a source: what has come last on LCM and on a CAN bus, and commands to its controller.

Listeners run in threads of their own and keep the newest of each kind; how often anybody looks makes no difference to them.
"""

import itertools
import math
import threading
import time
from collections import Counter, deque
from types import ModuleType
from typing import Protocol

import numpy as np

from hexload.theory.bound import THETA_NAMES
from hexload.view.frame import EVENTS, Curves, Estimate, Event, Frame, Health, History, Truth

Triple = tuple[float, float, float]
RATE_S = 1.0  # over which samples per second are counted
NOTE_S = 0.05  # between the points of a curve
COMMAND_NUMBERS = 256
MONITOR, SESSIONS = 2, 4096  # the bus contract's kind of source that a page is; each has one of so many numbers
KINDS = {"start": 1, "stop": 2, "reset": 3, "select filter": 4, "set known mass": 5, "challenge": 6}


class Sender(Protocol):
    def __call__(self, kind: int, number: int, argument: float) -> None: ...


class Plant(Protocol):
    def set_load(self, mass_kg: float, com_m: Triple, moments_kg_m2: Triple) -> None: ...

    def set_sensor_fault(self, leg: int, force_offset_n: float, velocity_negated: bool) -> None: ...


class Live:
    """Listeners call `sample`, `answer`, `truth`, `event` and `count`; the page asks for the rest."""

    def __init__(self, title: str, tick_s: float = 1e-3):
        self.title = title
        self._tick_s = tick_s
        self.force_range_n = (0.0, 0.0)  # grows with what comes
        self.sender: Sender | None = None
        self.plant: Plant | None = None  # a simulator that takes commands
        self._lock = threading.Lock()
        self._tick = 0
        self._legs: tuple | None = None
        self._estimate: Estimate | None = None
        self._truth_theta: np.ndarray | None = None
        self._truth_paper: np.ndarray | None = None
        self._events: deque[Event] = deque(maxlen=EVENTS)
        self.event_count = 0  # with those that are no longer kept
        self._load_changes_s: list[float] = []
        self._counts: Counter = Counter()
        self._state: tuple[str, ...] = ()
        self._remarks: tuple[str, ...] = ()
        self._history = History()
        self._noted_s = 0.0
        self._numbers = itertools.cycle(range(COMMAND_NUMBERS))
        self._rate = (time.monotonic(), 0, 0.0)
        self._heard_s = 0.0
        self._sampled_s = -math.inf

    # What listeners have heard.

    def sample(self, tick: int, displacement_m, force_n) -> None:
        with self._lock:
            if tick < self._tick:  # another run
                self._load_changes_s, self._truth_theta, self._truth_paper = [], None, None
            now = time.monotonic()
            if now - self._sampled_s >= RATE_S:  # they are counted from the first on, without the silence before it
                self._rate = (now, self._counts["samples"], 0.0)
            self._tick, self._heard_s, self._sampled_s = tick, now, now
            self._legs = (np.asarray(displacement_m, float), np.asarray(force_n, float))

    def answer(self, estimate: Estimate | None, state: tuple[str, ...]) -> None:
        with self._lock:
            if estimate is not None and self._estimate is not None and estimate.verdict != self._estimate.verdict:
                words = f"verdict: {estimate.verdict.replace('_', ' ')}"
                self._tell(words)
            self._estimate = estimate or self._estimate
            self._state, self._heard_s = state, time.monotonic()

    def truth(self, theta: np.ndarray, paper: np.ndarray) -> None:
        with self._lock:
            self._truth_theta, self._truth_paper = theta, paper

    def load_changed(self, tick: int) -> None:
        with self._lock:
            self._load_changes_s.append(tick * self._tick_s)
            self._tell("another load detected", tick)

    def event(self, words: str) -> None:
        with self._lock:
            self._tell(words)

    def _tell(self, words: str, tick: int | None = None) -> None:
        self._events.append(Event((self._tick if tick is None else tick) * self._tick_s, words))
        self.event_count += 1

    def count(self, what: str, number: int = 1) -> None:
        self._counts[what] += number

    def remark(self, remarks: tuple[str, ...]) -> None:
        """What else is known of bus and controller."""
        with self._lock:
            self._remarks = remarks

    # What the page asks for.

    def frame(self) -> Frame:
        with self._lock:
            legs = self._legs or (None, None)
            frame = Frame(self._tick * self._tick_s, *legs, self._estimate, self._truth())
            now = time.monotonic()
            if now - self._noted_s >= NOTE_S:
                self._history.note(frame)
                self._noted_s = now
            return frame

    def _truth(self) -> Truth | None:
        if self._truth_theta is None:
            return None
        is_paper = self._estimate is not None and self._estimate.names[0] == "dz"
        count = len(THETA_NAMES) if self._estimate is None else len(self._estimate.names)
        value = np.full(count, np.nan)
        known = self._truth_paper if is_paper else self._truth_theta[:count]
        value[: len(known)] = known
        return Truth(self._truth_theta, value)

    def curves(self) -> Curves | None:
        with self._lock:
            return self._history.curves(tuple(self._load_changes_s))

    def events(self) -> list[Event]:
        with self._lock:
            return list(self._events)

    def rate(self) -> float:
        """Samples per second; 0 when nothing was heard for a second."""
        with self._lock:
            now = time.monotonic()
            since, count, rate = self._rate
            if now - since >= RATE_S:
                rate = (self._counts["samples"] - count) / (now - since)
                self._rate = (now, self._counts["samples"], rate)
            return rate if now - self._heard_s < RATE_S else 0.0

    def health(self) -> Health:
        rate = self.rate()
        with self._lock:
            silent_s = time.monotonic() - self._heard_s
            lines = [
                f"{rate:.0f} samples/s"
                if silent_s < RATE_S
                else "silent" + f" for {silent_s:.0f} s" * (self._heard_s > 0)
            ]
            lines += self._state
            lines += [f"{number} {what}" for what, number in self._counts.items() if number and what != "samples"]
            return Health((*lines, *self._remarks))

    # Commands.

    def command(self, word: str, argument: float = 0.0) -> None:
        """To the controller; its acknowledge becomes an event."""
        if self.sender is None:
            return
        self.sender(KINDS[word], next(self._numbers), argument)
        self.event(f"sent: {word}" + (f" {argument:g}" if argument else ""))

    def start_anew(self, *before: tuple[str, float]) -> None:
        """Stops the controller, gives it commands that it takes when idle, and starts it in its real-time pacing."""
        for word, argument in (("stop", 0.0), *before, ("start", 0.0)):
            self.command(word, argument)


def paper_truth(com_z_m: float, inertia_com_kg_m2) -> np.ndarray:
    return np.array([com_z_m, *inertia_com_kg_m2[:3]])


def theta_of_load(native: ModuleType, mass_kg: float, com_m, entries) -> np.ndarray:
    """`entries`: Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the centre of mass."""
    xx, yy, zz, xy, xz, yz = entries
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return native.Load(mass_kg, np.asarray(com_m, float), tensor).theta
