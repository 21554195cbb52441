"""What a source tells the page: one `Frame` at a time, and what it remembers for the curves."""

from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CURVE_POINTS = 400  # of one curve: more than its pixels
EVENTS = 200  # that are kept
SIGMAS = 3.0  # that are drawn and told


@dataclass(frozen=True)
class Estimate:
    """Of the load's parameters, SI units: theta of the momentum filters, or the paper's four."""

    names: tuple[str, ...]
    value: Array
    sigma: Array
    verdict: str  # the worst of the parameters'
    parameter_verdict: tuple[str, ...] = ()  # empty: the source has it for the whole estimate alone


@dataclass(frozen=True)
class Truth:
    """The load that the simulator carries: theta about O_A, and the numbers that the estimate's names mean."""

    theta: Array
    value: Array


@dataclass(frozen=True)
class Frame:
    """One instant. None: not known."""

    t_s: float
    displacement_m: Array | None = None  # (6,)
    force_n: Array | None = None  # (6,)
    estimate: Estimate | None = None
    truth: Truth | None = None


@dataclass(frozen=True)
class Curves:
    """What was estimated until now: t (n,), the others (n, parameters). Truth is nan where it is not known."""

    names: tuple[str, ...]
    t_s: Array
    value: Array
    sigma: Array
    truth: Array
    load_changes_s: tuple[float, ...]  # detected


@dataclass(frozen=True)
class Event:
    t_s: float
    words: str


@dataclass(frozen=True)
class Health:
    """How source, bus and controller are: lines of plain words, the most important first."""

    lines: tuple[str, ...]


class Source(Protocol):
    """Where frames come from. A source never waits for the page."""

    title: str
    force_range_n: tuple[float, float]  # of the legs, for the colours

    def frame(self) -> Frame:
        """The newest, or the one at the time that the page has chosen."""

    def curves(self) -> Curves | None: ...

    def events(self) -> list[Event]: ...

    def health(self) -> Health: ...


@dataclass
class History:
    """The curves of a live source: a window of frames, thinned out by whoever calls `note`."""

    window: deque = field(default_factory=lambda: deque(maxlen=CURVE_POINTS))

    def note(self, frame: Frame) -> None:
        if frame.estimate is None:
            return
        last = self.window[-1] if self.window else None
        if last is not None and (last.estimate.names != frame.estimate.names or frame.t_s < last.t_s):
            self.window.clear()  # another filter, or another run
        self.window.append(frame)

    def curves(self, load_changes_s: tuple[float, ...]) -> Curves | None:
        frames = list(self.window)
        if len(frames) < 2:
            return None
        names = frames[0].estimate.names
        unknown = np.full(len(names), np.nan)
        return Curves(
            names,
            np.array([frame.t_s for frame in frames]),
            np.array([frame.estimate.value for frame in frames]),
            np.array([frame.estimate.sigma for frame in frames]),
            np.array([unknown if frame.truth is None else frame.truth.value for frame in frames]),
            tuple(t_s for t_s in load_changes_s if frames[0].t_s <= t_s <= frames[-1].t_s),
        )
