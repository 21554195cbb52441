"""The list of faults: what is wrong, in which sizes, and what a user should read."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hexload.faults import load_faults as load
from hexload.faults import machine_faults as machine
from hexload.faults import sensor_faults as sensor
from hexload.faults import timing_faults as timing
from hexload.faults.recording import CHANNELS, Recording

ESTIMATORS = ("momentum", "momentum_effects", "paper")
NONE = "none"
PASSING = (
    *(f"{channel}_{word}" for channel in CHANNELS for word in ("stuck", "dead", "saturated")),
    *("clock_jump", "lost_stretch", "frozen", "known_mass", "contact"),
)
REST_S = sensor.REST_S


@dataclass(frozen=True)
class Kind:
    name: str
    group: str
    says: str  # what is wrong
    sizes: tuple[float, ...]  # from small to large
    unit: str
    words: str  # what a user should read
    apply: Callable[[Recording, float, np.random.Generator], Recording]
    changes_truth: bool = False  # the load itself changes
    estimators: tuple[str, ...] = ESTIMATORS

    @property
    def is_fault(self) -> bool:
        return self.name != NONE

    @property
    def is_of_machine(self) -> bool:
        """The empty machine has it too, when it is commissioned; it is neither a matter of the load nor of a moment."""
        return self.name not in PASSING and self.group not in ("loads that are not rigid", "loads that change")

    def size_in_words(self, size: float) -> str:
        if size == REST_S:
            return "to the end"
        return f"{size:g} {self.unit}".rstrip()


def _nothing(recording: Recording, _size: float, _random: np.random.Generator) -> Recording:
    return recording


@dataclass(frozen=True)
class _Channel:
    name: str
    unit: str
    drift: tuple[float, ...]  # unit / s
    spike: tuple[float, ...]
    step: tuple[float, ...]  # of a converter
    bias: tuple[float, ...]
    hum: tuple[float, ...]
    units: tuple[float, ...]  # readings per SI unit


_DISPLACEMENT = _Channel(
    "displacement", "m", (2e-5, 2e-4), (2e-4, 2e-3), (2e-5, 2e-4), (2e-4, 2e-3), (2e-5, 2e-4), (1e3, 1e2, 39.37)
)
_VELOCITY = _Channel(
    "velocity", "m/s", (2e-4, 2e-3), (0.02, 0.2), (5e-3, 2e-2), (1e-3, 1e-2), (2e-3, 2e-2), (1e3, 60.0)
)
_FORCE = _Channel(
    "force", "N", (1.0, 10.0), (100.0, 1000.0), (10.0, 100.0), (10.0, 100.0), (10.0, 100.0), (1e-3, 0.10197, 0.2248)
)


def _of_channel(channel: _Channel) -> list[Kind]:
    name, unit = channel.name, channel.unit
    assert name in CHANNELS

    def kind(word: str, group: str, says: str, sizes: tuple, of: str, words: str, apply: Callable) -> Kind:
        return Kind(f"{name}_{word}", group, says, sizes, of, words, partial(apply, channel=name))

    leg = f"leg N, {name} sensor"
    rest = (0.3, 3.0, REST_S)
    return [
        kind("stuck", "stuck, dead, negated", "one leg shows its last value", rest, "s", f"{leg}: stuck", sensor.stuck),
        kind("dead", "stuck, dead, negated", "one leg shows zero", rest, "s", f"{leg}: dead", sensor.dead),
        kind(
            "negated", "stuck, dead, negated", "one leg has the wrong sign", (1.0,), "", f"{leg}: sign", sensor.negated
        ),
        kind(
            "drifting",
            "bias and drift",
            "one leg's zero drifts",
            channel.drift,
            f"{unit}/s",
            f"{leg}: zero",
            sensor.drift,
        ),
        kind("bias", "bias and drift", "one leg's zero is off", channel.bias, unit, f"{leg}: zero", sensor.bias_one),
        kind(
            "bias_all",
            "bias and drift",
            "all zeros are off alike",
            channel.bias,
            unit,
            f"zero of {name}s",
            sensor.bias_all,
        ),
        kind("spikes", "noise", "single wrong values of one leg", channel.spike, unit, f"{leg}: spikes", sensor.spikes),
        kind(
            "noise",
            "noise",
            "all noise is another than stated",
            (0.25, 2.0, 4.0),
            "x",
            f"noise of {name}s",
            sensor.noise,
        ),
        kind("hum", "noise", "50 Hz on all legs", channel.hum, unit, f"hum in {name}s", sensor.hum),
        kind(
            "saturated",
            "range",
            "one leg's converter ends early",
            (0.9, 0.6),
            "of the reach",
            f"{leg}: saturated",
            sensor.saturated,
        ),
        kind(
            "quantised", "range", "all legs in coarse steps", channel.step, unit, f"steps of {name}s", sensor.quantised
        ),
        kind(
            "swapped",
            "wiring",
            "two legs' plugs exchanged",
            (1.0, 3.0),
            "legs apart",
            f"legs N and M: {name} swapped",
            sensor.swapped,
        ),
        kind("unit", "units", "another unit", channel.units, "per SI unit", f"unit of {name}s", sensor.unit),
        kind("gain", "gains", "one leg's gain", (0.003, 0.02, 0.1), "", f"{leg}: gain", sensor.gain_one),
        kind("gain_all", "gains", "all gains alike", (0.003, 0.02, 0.1), "", f"gain of {name}s", sensor.gain_all),
        kind("late", "timing", "all legs late", (2e-4, 2e-3, 2e-2), "s", f"{name}s late", timing.late),
        kind("late_leg", "timing", "one leg late", (2e-4, 2e-3, 2e-2), "s", f"{leg}: late", timing.late_leg),
        kind("low_pass", "timing", "all legs filtered", (200.0, 50.0, 10.0), "Hz", f"{name}s late", timing.low_pass),
        kind(
            "held", "timing", "all legs held for some ticks", (2.0, 10.0), "ticks", f"{name}s held", timing.held_channel
        ),
        kind(
            "nan",
            "rows",
            "one leg is not a number now and then",
            (0.001, 0.05),
            "of the rows",
            f"{leg}: no number",
            sensor.not_numbers,
        ),
    ]


def _wiring_and_time() -> list[Kind]:
    wiring, time, rows = "wiring", "timing", "rows"
    return [
        Kind(
            "renumbered",
            wiring,
            "legs counted from another one, in all channels",
            (1.0, 2.0, 3.0),
            "further",
            "legs renumbered",
            sensor.renumbered,
        ),
        Kind(
            "mirrored",
            wiring,
            "legs counted the other way round, in all channels",
            (1.0,),
            "",
            "legs mirrored",
            sensor.mirrored,
        ),
        Kind(
            "exchanged_legs",
            wiring,
            "two legs exchanged in all channels",
            (1.0, 3.0),
            "legs apart",
            "legs N and M swapped",
            sensor.exchanged_legs,
        ),
        Kind(
            "stated_noise",
            "noise",
            "sensor sigmas of the platform file",
            (0.33, 3.0),
            "x",
            "stated noise",
            sensor.stated_noise,
        ),
        Kind(
            "jitter",
            time,
            "rows read at other times than they tell",
            (1e-4, 5e-4),
            "s",
            "jitter of the samples",
            timing.jitter,
        ),
        Kind("clock", time, "the clock is wrong", (0.003, 0.02, 0.1), "", "clock", timing.clock),
        Kind("clock_jump", time, "the clock jumps ahead", (0.02, 1.0), "s", "clock jumped", timing.clock_jump),
        Kind("held", time, "all channels held for some ticks", (2.0, 5.0, 20.0), "ticks", "samples held", timing.held),
        Kind(
            "slow_sampling",
            time,
            "fewer rows, with their times",
            (2.0, 5.0, 20.0),
            "ticks",
            "sampling rate",
            timing.slow_sampling,
        ),
        Kind("lost", rows, "rows lost", (0.01, 0.2), "of the rows", "samples missing", timing.lost),
        Kind("lost_stretch", rows, "a stretch without rows", (0.1, 2.0), "s", "samples missing", timing.lost_stretch),
        Kind(
            "doubled",
            rows,
            "rows twice, with their times",
            (0.01, 0.5),
            "of the rows",
            "samples doubled",
            timing.doubled,
        ),
        Kind(
            "repeated",
            rows,
            "old values under new times",
            (0.01, 0.2),
            "of the rows",
            "samples repeated",
            timing.repeated,
        ),
        Kind(
            "shuffled",
            rows,
            "neighbouring rows exchanged, with their times",
            (0.01, 0.2),
            "of the rows",
            "samples out of order",
            timing.shuffled,
        ),
        Kind(
            "shuffled_values",
            rows,
            "neighbouring rows exchanged, times in order",
            (0.01, 0.2),
            "of the rows",
            "samples out of order",
            timing.shuffled_values,
        ),
        Kind(
            "frozen",
            rows,
            "all channels frozen under times that go on",
            (0.05, 0.5, REST_S),
            "s",
            "samples frozen",
            timing.frozen,
        ),
    ]


def _machines() -> list[Kind]:
    shape, mass, rub = "hinges", "platform, gravity", "friction"
    return [
        Kind("hinges", shape, "all hinges off", (3e-4, 1e-3, 3e-3), "m, one sigma", "hinges", machine.hinges),
        Kind("one_hinge", shape, "one hinge off", (1e-3, 5e-3), "m", "hinge of leg N", machine.one_hinge),
        Kind(
            "hinge_circle", shape, "circle of the platform's hinges", (0.003, 0.02), "", "hinges", machine.hinge_circle
        ),
        Kind("home_length", shape, "length of all legs at home", (1e-3, 5e-3), "m", "home length", machine.home_length),
        Kind(
            "platform_mass",
            mass,
            "mass of the platform",
            (0.01, 0.05, 0.2),
            "",
            "platform's mass",
            machine.platform_mass,
        ),
        Kind(
            "platform_centre",
            mass,
            "centre of mass of the platform",
            (2e-3, 1e-2, 5e-2),
            "m",
            "platform's centre of mass",
            machine.platform_centre,
        ),
        Kind(
            "platform_inertia",
            mass,
            "inertia of the platform",
            (0.05, 0.2, 0.5),
            "",
            "platform's inertia",
            machine.platform_inertia,
        ),
        Kind(
            "known_mass",
            mass,
            "the load's mass as given",
            (0.005, 0.05),
            "",
            "given mass",
            machine.known_mass,
            estimators=("paper",),
        ),
        Kind("gravity", mass, "g of the platform file", (0.001, 0.01), "", "gravity", machine.gravity),
        Kind("tilt", "tilt", "base off level", (0.002, 0.006, 0.02), "rad", "base off level", machine.tilt),
        Kind(
            "leg_mass", "leg mass", "legs with mass", (2.0, 6.0, 20.0), "kg each", "mass of the legs", machine.leg_mass
        ),
        Kind("coulomb", rub, "dry friction", (10.0, 60.0), "N", "friction", machine.coulomb),
        Kind("viscous", rub, "viscous friction", (50.0, 300.0), "N s/m", "friction", machine.viscous),
        Kind("stribeck", rub, "dry friction with breakaway", (10.0, 60.0), "N", "friction", machine.stribeck),
        Kind("lugre", rub, "bristle friction with breakaway", (10.0, 60.0), "N", "friction", machine.lugre),
        Kind(
            "friction_growing",
            rub,
            "dry friction that grows with the force",
            (0.003, 0.02),
            "N/N",
            "friction",
            machine.growing_with_force,
        ),
        Kind(
            "friction_warming_up",
            rub,
            "dry friction that halves as the oil gets warm",
            (20.0, 80.0),
            "N",
            "friction",
            machine.warming_up,
        ),
        Kind(
            "hinge_friction", rub, "dry friction in the hinges", (2.0, 10.0), "N m", "friction", machine.hinge_friction
        ),
    ]


def _loads() -> list[Kind]:
    soft, outside, falling = "loads that are not rigid", "forces from outside", "loads that change"
    return [
        Kind(
            "pendulum",
            soft,
            "a part of the load swings",
            (0.02, 0.1, 0.3),
            "of its mass",
            "load not rigid",
            load.pendulum,
        ),
        Kind(
            "sloshing",
            soft,
            "a part of the load sloshes",
            (0.02, 0.1, 0.3),
            "of its mass",
            "load not rigid",
            load.sloshing,
        ),
        Kind(
            "soft_mount", soft, "the load stands on rubber", (20.0, 8.0, 4.0), "Hz", "load not rigid", load.soft_mount
        ),
        Kind("shaking_base", outside, "the floor shakes", (0.02, 0.1, 0.5), "m/s²", "base shakes", load.shaking_base),
        Kind(
            "external_force",
            outside,
            "a constant force",
            (10.0, 50.0, 250.0),
            "N",
            "external force",
            load.external_force,
        ),
        Kind("contact", outside, "a push of half a second", (20.0, 100.0, 500.0), "N", "contact", load.contact),
        Kind("end_stop", outside, "something in the way", (50.0, 500.0), "N", "contact", load.end_stop),
        Kind("hoses", outside, "hoses pull back", (50.0, 500.0), "N/m", "external force", load.hoses),
        Kind("leaking", falling, "the load leaks", (0.2, 2.0, 10.0), "kg/s", "load changes", load.leaking, True),
        Kind(
            "falling",
            falling,
            "a part of the load falls off",
            (0.01, 0.1, 0.5),
            "of the load",
            "load changed",
            load.falling,
            True,
        ),
        Kind(
            "two_changes",
            falling,
            "two changes of the load at once",
            (0.05, 0.1, 0.2),
            "s apart",
            "load changed",
            load.two_changes,
            True,
        ),
    ]


def _all() -> dict[str, Kind]:
    clean = Kind(NONE, NONE, "nothing is wrong", (0.0,), "", "", _nothing)
    of_channels = [kind for channel in (_DISPLACEMENT, _VELOCITY, _FORCE) for kind in _of_channel(channel)]
    kinds = [clean, *of_channels, *_wiring_and_time(), *_machines(), *_loads()]
    kinds.sort(key=lambda kind: GROUPS.index(kind.group))
    return {kind.name: kind for kind in kinds}


GROUPS = (
    NONE,
    "stuck, dead, negated",
    "wiring",
    "units",
    "bias and drift",
    "gains",
    "range",
    "noise",
    "timing",
    "rows",
    "hinges",
    "platform, gravity",
    "tilt",
    "leg mass",
    "friction",
    "loads that are not rigid",
    "forces from outside",
    "loads that change",
)
KINDS = _all()
