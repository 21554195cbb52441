"""Listens to LCM's channels of lcm_types, and sends commands there."""

import random
import threading

import lcm
import numpy as np

from hexload import project
from hexload.theory.bound import THETA_NAMES
from hexload.view.frame import Estimate
from hexload.view.live import MONITOR, SESSIONS, Live, Triple, paper_truth, theta_of_load

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
LOAD = len(THETA_NAMES)  # parameters at most; what follows is of the machine
WAIT_MS = 50
QUEUE = 4000  # messages of a channel: seconds of them
LOOK_EACH_S = 0.02  # what comes closer than that is counted; the newest of each channel is decoded
SEQUENCE = slice(8, 16)  # of a message's bytes, after the type's fingerprint


def url_of(name: str) -> str:
    """Of lcm, lcm:URL, default or URL."""
    return DEFAULT_URL if name in ("lcm", "default") else name.removeprefix("lcm:")


class LcmListener:
    """Feeds `live` until `close`. Raises ToolFailed or RuntimeError when there is no such LCM."""

    def __init__(self, live: Live, url: str = DEFAULT_URL, truth_alone: bool = False):
        project.ensure_built("hexload_lcm_python", "hexload_native")
        self._live, self._native = live, project.native_module()
        self._lcm = lcm.LCM(url)
        self._sender = lcm.LCM(url)  # of another thread
        self._newest: dict[str, bytes] = {}
        self._last_sample: int | None = None
        self._session = random.randrange(SESSIONS)
        self._commands = self._plant_commands = 0
        self._estimate: Estimate | None = None
        self._types = {}
        self._wanted = ("load_truth_t",) if truth_alone else tuple(self._takers())
        for name in self._wanted:
            take = self._takers()[name]
            self._types[name] = project.message_type(name)
            handler = self._now(name, take) if name in ("load_change_t", "acknowledge_t") else self._later(name)
            self._lcm.subscribe("HEXLOAD_" + name.removesuffix("_t").upper(), handler).set_queue_capacity(QUEUE)
        self._command_type = project.message_type("command_t")
        self._plant_type = project.message_type("plant_command_t")
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _takers(self) -> dict:
        """In the order in which they are looked at."""
        return {
            "leg_sample_t": lambda message: self._live.sample(message.tick, message.displacement_m, message.force_n),
            "load_truth_t": self._take_truth,
            "estimate_t": self._take_estimate,
            "health_t": self._take_health,
            "bus_statistics_t": self._take_bus,
            "load_change_t": lambda message: self._live.load_changed(message.tick),
            "acknowledge_t": lambda message: self._live.event(f"controller: {message.result}, {message.state}"),
        }

    def _now(self, name: str, take):
        return lambda _, data: self._decoded(name, data, take)

    def _later(self, name: str):
        def keep(_: str, data: bytes) -> None:
            self._newest[name] = data
            if name == "leg_sample_t":
                self._count(int.from_bytes(data[SEQUENCE], "big"))

        return keep

    def _count(self, sequence: int) -> None:
        last, self._last_sample = self._last_sample, sequence
        self._live.count("samples")
        if last is not None and sequence > last + 1:
            self._live.count("samples lost between LCM and this page", sequence - last - 1)

    def _listen(self) -> None:
        while not self._ended.is_set():
            self._lcm.handle_timeout(WAIT_MS)
            while self._lcm.handle_timeout(0) > 0 and not self._ended.is_set():
                pass
            newest, self._newest = self._newest, {}
            for name, take in self._takers().items():
                if name in newest:
                    self._decoded(name, newest[name], take)
            self._ended.wait(LOOK_EACH_S)

    def _decoded(self, name: str, data: bytes, take) -> None:
        try:
            message = self._types[name].decode(data)
        except ValueError:
            self._live.count(f"messages of another {name}")
            return
        take(message)

    def _take_truth(self, message) -> None:
        theta = theta_of_load(self._native, message.mass_kg, message.com_m, message.inertia_kg_m2)
        self._live.truth(theta, paper_truth(message.com_m[2], message.inertia_kg_m2))

    def _take_estimate(self, message) -> None:
        self._estimate = Estimate(
            tuple(message.name[:LOAD]),
            np.array(message.value[:LOAD]),
            np.array(message.sigma[:LOAD]),
            message.verdict,
            tuple(message.parameter_verdict[:LOAD]),
        )

    def _take_health(self, message) -> None:
        fault = "" if message.fault == "no fault" else f", fault: {message.fault}"
        lines = [f"controller {message.state}{fault}, sample {message.status}"]
        lines += [words for words in (message.health, message.input_fault) if words]
        lines.append(f"{message.samples_missing} samples missing, {message.samples_refused} refused")
        self._live.answer(self._estimate, tuple(lines))

    def _take_bus(self, message) -> None:
        self._live.remark(
            (
                f"{message.bus}: {100 * message.load_1:.0f} % load, {100 * message.peak_load_1:.0f} % at most",
                f"{message.controller_overruns} periods overrun, {message.samples_incomplete} samples incomplete",
            )
        )

    def send(self, kind: int, number: int, argument: float) -> None:
        """A command to the controller."""
        message = self._command_type()
        message.sequence, message.kind, message.id, message.argument = self._commands, kind, number, argument
        message.source, message.session = MONITOR, self._session
        self._commands += 1
        self._sender.publish("HEXLOAD_COMMAND", message.encode())

    def set_load(self, mass_kg: float, com_m: Triple, moments_kg_m2: Triple) -> None:
        """Asks the simulator to put this load on; `moments_kg_m2` about its centre of mass."""
        message = self._plant_type()
        message.kind = self._plant_type.SET_LOAD
        message.mass_kg, message.com_m = mass_kg, list(com_m)
        message.inertia_kg_m2 = [*moments_kg_m2, 0.0, 0.0, 0.0] if mass_kg > 0.0 else [0.0] * 6
        self._ask_plant(message, f"load of {mass_kg:g} kg")

    def set_sensor_fault(self, leg: int, force_offset_n: float, velocity_negated: bool) -> None:
        """Asks the simulator to give leg 1 to 6 these faults instead of those that it has."""
        message = self._plant_type()
        message.kind, message.leg = self._plant_type.SENSOR_FAULT, leg
        message.force_offset_n, message.velocity_negated = force_offset_n, velocity_negated
        velocity = ", velocity negated" if velocity_negated else ""
        self._ask_plant(message, f"leg {leg}: force {force_offset_n:+g} N{velocity}")

    def _ask_plant(self, message, words: str) -> None:
        message.sequence = self._plant_commands
        self._plant_commands += 1
        self._sender.publish("HEXLOAD_PLANT_COMMAND", message.encode())
        self._live.event(f"sent to the simulator: {words}")

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
