"""Subscribers to our LCM channels, and URLs that no other test uses.

None of them judges by the clock: a run waits for its listener, and all that was sent has come when a mark sent later has.
"""

import select
import subprocess
import time
from collections import defaultdict
from collections.abc import Callable

import lcm

from free_port import free_port
from hexload import project

TYPES = (
    "leg_sample_t",
    "platform_state_t",
    "load_truth_t",
    "wrench_t",
    "estimate_t",
    "health_t",
    "bus_statistics_t",
    "command_t",
    "acknowledge_t",
    "load_change_t",
)
MARK = "MARK"  # a channel of the listener's own
PATIENCE_S = 240.0  # a run takes seconds; a busy machine may take many times as long as an idle one


def private_url() -> str:
    """LCM's group on a port of our own, for messages that stay within this computer."""
    return f"udpm://239.255.76.67:{free_port()}?ttl=0"


class Listener:
    """Collects the decoded messages of every channel, in the order of their arrival."""

    def __init__(self, url: str):
        self.lcm = lcm.LCM(url)
        self.messages = defaultdict(list)  # by type
        for name in TYPES:
            channel = "HEXLOAD_" + name.removesuffix("_t").upper()
            subscription = self.lcm.subscribe(channel, lambda _, data, name=name: self._take(name, data))
            subscription.set_queue_capacity(0)  # no limit
        self._marks_sent = self._mark_seen = 0
        self.lcm.subscribe(MARK, self._see_mark)

    def _take(self, name: str, data: bytes) -> None:
        self.messages[name].append(project.message_type(name).decode(data))

    def _see_mark(self, _: str, data: bytes) -> None:
        self._mark_seen = int(data)

    def listen_until(self, is_over: Callable[[], bool]) -> None:
        """Until `is_over()`, and all has come that was sent before."""
        until = time.monotonic() + PATIENCE_S
        while not is_over():
            self.lcm.handle_timeout(50)
            assert time.monotonic() < until, f"still running after {PATIENCE_S:g} s"
        self._hear_all()

    def hear_what_is_there(self) -> None:
        while self.lcm.handle_timeout(0) > 0:
            pass

    def _hear_all(self) -> None:
        """All that was sent until now: messages come in the order in which they were sent."""
        first = self._marks_sent + 1
        again = time.monotonic()
        until = again + PATIENCE_S
        while self._mark_seen < first:
            now = time.monotonic()
            assert now < until, f"no message came back within {PATIENCE_S:g} s"
            if now >= again:
                self._marks_sent += 1
                self.lcm.publish(MARK, str(self._marks_sent).encode())
                again = now + 1
            self.lcm.handle_timeout(50)


class Controller(Listener):
    """A controller in Python. It acknowledges commands and answers a sample when all that was told of the tick before has
    come: the simulator, in lockstep, is never faster than this listener."""

    def __init__(self, url: str, told_per_tick: tuple[str, ...] = ()):
        super().__init__(url)
        self._told_per_tick = told_per_tick
        self._answered = 0
        self._acknowledged = 0

    def run_with(self, process: subprocess.Popen) -> None:
        """Until the simulator has ended."""
        until = time.monotonic() + PATIENCE_S
        while process.poll() is None:
            self.lcm.handle_timeout(50)
            if len(self.messages["command_t"]) > self._acknowledged:
                self._acknowledge()
            samples = len(self.messages["leg_sample_t"])
            told = min((len(self.messages[name]) for name in self._told_per_tick), default=self._answered)
            if samples > self._answered and told >= self._answered:
                self._answer()
            assert time.monotonic() < until, f"still running after {PATIENCE_S:g} s"
        self._hear_all()

    def _publish(self, name: str, message, number: int) -> None:
        message.sequence = number
        self.lcm.publish(f"HEXLOAD_{name}", message.encode())

    def _acknowledge(self) -> None:
        command = self.messages["command_t"][self._acknowledged]
        reply = project.message_type("acknowledge_t")()
        reply.kind, reply.id, reply.done = command.kind, command.id, True
        reply.source, reply.session = command.source, command.session
        reply.result, reply.state, reply.fault = "done", "armed", "no fault"
        self._publish("ACKNOWLEDGE", reply, self._acknowledged)
        self._acknowledged += 1

    def _answer(self) -> None:
        estimate, health = project.message_type("estimate_t")(), project.message_type("health_t")()
        estimate.tick = health.tick = self.messages["leg_sample_t"][self._answered].tick
        estimate.filter, estimate.count, estimate.name = "paper", 4, ["dz", "Ixx", "Iyy", "Izz"]
        estimate.value = estimate.sigma = [1.0, 2.0, 3.0, 4.0]
        estimate.own_sigma = [0.0] * 4
        estimate.parameter_verdict, estimate.verdict = ["converging"] * 4, "converging"
        health.state, health.fault, health.status = "estimating", "no fault", "ok"
        self._publish("ESTIMATE", estimate, self._answered)
        self._publish("HEALTH", health, self._answered)
        self._answered += 1


class Relay(Listener):
    """Between a simulator on an LCM of its own, `simulators`, and a controller on `controllers`, whose messages it collects.
    It hands messages on as they are, so that in lockstep neither is ever faster than this listener."""

    def __init__(self, simulators: str, controllers: str):
        super().__init__(controllers)
        self.simulators = simulators
        self._simulators = lcm.LCM(simulators)
        for name in ("LEG_SAMPLE", "COMMAND"):
            self._simulators.subscribe(f"HEXLOAD_{name}", self.lcm.publish).set_queue_capacity(0)
        for name in ("LOAD_CHANGE", "ESTIMATE", "HEALTH", "ACKNOWLEDGE"):
            self.lcm.subscribe(f"HEXLOAD_{name}", self._simulators.publish).set_queue_capacity(0)

    def run_with(self, process: subprocess.Popen) -> None:
        """Until the simulator has ended."""
        until = time.monotonic() + PATIENCE_S
        while process.poll() is None:
            select.select([self._simulators, self.lcm], [], [], 0.05)
            while self._simulators.handle_timeout(0) > 0:
                pass
            self.hear_what_is_there()
            assert time.monotonic() < until, f"still running after {PATIENCE_S:g} s"
        self._hear_all()
