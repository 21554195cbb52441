"""Subscribers to our LCM channels, and URLs that no other test uses."""

import socket
import subprocess
import time
from collections import defaultdict

import lcm

from hexload_tools import project

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


def private_url() -> str:
    """LCM's group on a port of our own, for messages that stay within this computer."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return f"udpm://239.255.76.67:{probe.getsockname()[1]}?ttl=0"


class Listener:
    """Collects the decoded messages of every channel, in the order of their arrival."""

    def __init__(self, url: str):
        self.lcm = lcm.LCM(url)
        self.messages = defaultdict(list)  # by type
        for name in TYPES:
            channel = "HEXLOAD_" + name.removesuffix("_t").upper()
            subscription = self.lcm.subscribe(channel, lambda _, data, name=name: self._take(name, data))
            subscription.set_queue_capacity(0)  # no limit

    def _take(self, name: str, data: bytes) -> None:
        self.messages[name].append(project.message_type(name).decode(data))

    def listen_until(self, is_over, patience_s: float = 60.0, quiet_s: float = 0.3) -> None:
        """Until `is_over()` and nothing has come for `quiet_s`."""
        until = time.monotonic() + patience_s
        while True:
            came = self.lcm.handle_timeout(int(1000 * quiet_s)) > 0
            if not came and is_over():
                return
            assert time.monotonic() < until, f"still running after {patience_s:g} s"


class Controller(Listener):
    """A controller in Python. It acknowledges commands and answers a sample when all that was told of the tick before has
    come: the simulator, in lockstep, is never faster than this listener."""

    def __init__(self, url: str, told_per_tick: tuple[str, ...] = ()):
        super().__init__(url)
        self._told_per_tick = told_per_tick
        self._answered = 0
        self._acknowledged = 0

    def run_with(self, process: subprocess.Popen, patience_s: float = 60.0) -> None:
        """Until the simulator has ended."""
        until = time.monotonic() + patience_s
        while process.poll() is None:
            self.lcm.handle_timeout(50)
            if len(self.messages["command_t"]) > self._acknowledged:
                self._acknowledge()
            samples = len(self.messages["leg_sample_t"])
            told = min((len(self.messages[name]) for name in self._told_per_tick), default=self._answered)
            if samples > self._answered and told >= self._answered:
                self._answer()
            assert time.monotonic() < until, f"still running after {patience_s:g} s"
        self.listen_until(lambda: True)

    def _publish(self, name: str, message, number: int) -> None:
        message.sequence = number
        self.lcm.publish(f"HEXLOAD_{name}", message.encode())

    def _acknowledge(self) -> None:
        command = self.messages["command_t"][self._acknowledged]
        reply = project.message_type("acknowledge_t")()
        reply.kind, reply.id, reply.done = command.kind, command.id, True
        reply.result, reply.state, reply.fault = "done", "armed", "no fault"
        self._publish("ACKNOWLEDGE", reply, self._acknowledged)
        self._acknowledged += 1

    def _answer(self) -> None:
        estimate, health = project.message_type("estimate_t")(), project.message_type("health_t")()
        estimate.tick = health.tick = self.messages["leg_sample_t"][self._answered].tick
        estimate.filter, estimate.count, estimate.name = "paper", 4, ["dz", "Ixx", "Iyy", "Izz"]
        estimate.value = estimate.sigma = [1.0, 2.0, 3.0, 4.0]
        estimate.parameter_verdict, estimate.verdict = ["converging"] * 4, "converging"
        health.state, health.fault, health.status = "estimating", "no fault", "ok"
        self._publish("ESTIMATE", estimate, self._answered)
        self._publish("HEALTH", health, self._answered)
        self._answered += 1
