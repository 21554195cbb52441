"""The list of faults: what is wrong, in which sizes, and what a user should read."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hexload.faults import load_faults as load
from hexload.faults import machine_faults as machine
from hexload.faults import sensor_faults as sensor
from hexload.faults import timing_faults as timing
from hexload.faults.recording import Recording
from hexload.io.log_file import CHANNEL_KEYS

ESTIMATORS = ("momentum", "momentum_effects", "paper")
NONE = "none"
PASSING = (
    *(f"{channel}_{word}" for channel in CHANNEL_KEYS for word in ("stuck", "dead", "loose", "saturated")),
    *(f"{channel}_{word}" for channel in CHANNEL_KEYS for word in ("zero_step", "zero_pulse", "gain_step", "wander")),
    *("clock_jump", "known_mass", "contact", "wind"),
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
    channel: str = ""  # that has it; empty: none alone
    of_channel: str = ""  # its name without the channel's

    @property
    def is_fault(self) -> bool:
        return self.name != NONE

    @property
    def is_of_velocity(self) -> bool:
        """No machine without velocity sensors has it."""
        return self.name.startswith("velocity_")

    @property
    def changes_truth(self) -> bool:
        """The load itself changes."""
        return self.group == _CHANGING

    @property
    def estimators(self) -> tuple[str, ...]:
        """That can have it: one of them alone is given the load's mass."""
        return ("paper",) if self.name == "known_mass" else ESTIMATORS

    @property
    def is_of_machine(self) -> bool:
        """The empty machine has it too, when it is commissioned: it is no matter of the load, of a moment, or of a link
        that loses rows, whose logs commissioning refuses with their line."""
        return self.name not in PASSING and self.group not in (_SOFT, _CHANGING, "rows")

    def size_in_words(self, size: float) -> str:
        if size == REST_S and self.unit == "s":
            return "to the end"
        if self.sizes == (1.0,) and not self.unit:
            return ""  # it is there or not
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
    wander: tuple[float, ...]  # unit after a second


_DISPLACEMENT = _Channel(
    "displacement",
    "m",
    (2e-5, 2e-4),
    (2e-4, 2e-3),
    (2e-5, 2e-4),
    (2e-4, 2e-3),
    (2e-5, 2e-4),
    (1e3, 1e2, 39.37),
    (2e-5, 2e-4),
)
_VELOCITY = _Channel(
    "velocity", "m/s", (2e-4, 2e-3), (0.02, 0.2), (5e-3, 2e-2), (1e-3, 1e-2), (2e-3, 2e-2), (1e3, 60.0), (5e-4, 2e-3)
)
_FORCE = _Channel(
    "force",
    "N",
    (1.0, 10.0),
    (100.0, 1000.0),
    (10.0, 100.0),
    (10.0, 100.0),
    (10.0, 100.0),
    (1e-3, 0.10197, 0.2248),
    (5.0, 20.0),
)


_STUCK, _BIAS = "stuck, dead, negated", "bias and drift"
_LEG = "leg N, {name} sensor"
_LASTING_S, _GAINS, _LATE_S = (0.3, 3.0, REST_S), (0.003, 0.02, 0.1), (2e-4, 2e-3, 2e-2)
# Name, group, what is wrong, sizes (or which of the channel's), unit, what should be read, function.
_OF_CHANNELS = (
    ("stuck", _STUCK, "one leg shows its last value", _LASTING_S, "s", f"{_LEG}: stuck", sensor.stuck),
    ("dead", _STUCK, "one leg shows zero", _LASTING_S, "s", f"{_LEG}: dead", sensor.dead),
    ("loose", _STUCK, "one leg's plug is loose", (5e-3, 5e-2), "s at a time", f"{_LEG}: loose", sensor.loose),
    ("negated", _STUCK, "one leg has the wrong sign", (1.0,), "", f"{_LEG}: sign", sensor.negated),
    ("drifting", _BIAS, "one leg's zero drifts", "drift", "{unit}/s", f"{_LEG}: zero", sensor.drift),
    ("bias", _BIAS, "one leg's zero is off", "bias", "{unit}", f"{_LEG}: zero", sensor.bias_one),
    ("bias_all", _BIAS, "all zeros are off alike", "bias", "{unit}", "zero of {name} channels", sensor.bias_all),
    ("zero_step", _BIAS, "one leg's zero jumps", "bias", "{unit}", f"{_LEG}: zero", sensor.zero_step),
    (
        "zero_pulse",
        _BIAS,
        "one leg's zero is off for half a second",
        "bias",
        "{unit}",
        f"{_LEG}: zero",
        sensor.zero_pulse,
    ),
    ("wander", _BIAS, "all zeros wander", "wander", "{unit} in a second", "zero of {name} channels", sensor.wander),
    ("spikes", "noise", "single wrong values of one leg", "spike", "{unit}", f"{_LEG}: spikes", sensor.spikes),
    ("noise", "noise", "noise is not the stated one", (0.25, 2.0, 4.0), "x", "noise of {name} channels", sensor.noise),
    ("bursts", "noise", "bursts of noise", (5.0, 20.0), "x", "noise of {name} channels", sensor.bursts),
    ("hum", "noise", "50 Hz on all legs", "hum", "{unit}", "hum in {name} channels", sensor.hum),
    ("saturated", "range", "one leg ends early", (0.9, 0.6), "of the reach", f"{_LEG}: saturated", sensor.saturated),
    ("bent", "range", "one leg's scale is bent", (5e-3, 3e-2), "of the largest", f"{_LEG}: linearity", sensor.bent),
    ("quantised", "range", "all legs in steps", "step", "{unit}", "steps of {name} channels", sensor.quantised),
    (
        "swapped",
        "wiring",
        "two legs' plugs exchanged",
        (1.0, 3.0),
        "legs apart",
        "{name}: N, M swapped",
        sensor.swapped,
    ),
    ("unit", "units", "another unit", "units", "per SI unit", "unit of {name} channels", sensor.unit),
    ("gain", "gains", "one leg's gain", _GAINS, "", f"{_LEG}: gain", sensor.gain_one),
    ("gain_step", "gains", "one leg's gain jumps", (0.01, 0.05), "", f"{_LEG}: gain", sensor.gain_step),
    ("gain_all", "gains", "all gains alike", _GAINS, "", "gain of {name} channels", sensor.gain_all),
    ("late", "timing", "all legs late", _LATE_S, "s", "{name} channels late", timing.late),
    ("late_leg", "timing", "one leg late", _LATE_S, "s", f"{_LEG}: late", timing.late_leg),
    ("low_pass", "timing", "all legs filtered", (200.0, 50.0, 10.0), "Hz", "{name} channels late", timing.low_pass),
    ("held", "timing", "all legs held", (2.0, 10.0), "ticks", "{name} channels held", timing.held_channel),
    ("nan", "rows", "one leg is no number at times", (0.001, 0.05), "of the rows", f"{_LEG}: none", sensor.not_numbers),
)


def _of_channel(channel: _Channel) -> list[Kind]:
    assert channel.name in CHANNEL_KEYS
    kinds = []
    for name, group, says, sizes, unit, words, apply in _OF_CHANNELS:
        own = getattr(channel, sizes) if isinstance(sizes, str) else sizes
        unit, words = (text.format(name=channel.name, unit=channel.unit) for text in (unit, words))
        fault = partial(apply, channel=channel.name)
        kinds.append(Kind(f"{channel.name}_{name}", group, says, own, unit, words, fault, channel.name, name))
    return kinds


_PLATFORM, _SOFT, _OUTSIDE = "platform, gravity", "loads that are not rigid", "forces from outside"
_CHANGING = "loads that change"
_OTHERS = (
    (
        "renumbered",
        "wiring",
        "legs counted from another one",
        (1.0, 2.0, 3.0),
        "further",
        "legs renumbered",
        sensor.renumbered,
    ),
    ("mirrored", "wiring", "legs counted the other way round", (1.0,), "", "legs mirrored", sensor.mirrored),
    (
        "exchanged_legs",
        "wiring",
        "two legs exchanged in all channels",
        (1.0, 3.0),
        "legs apart",
        "legs N and M swapped",
        sensor.exchanged_legs,
    ),
    (
        "displacement_periodic",
        "range",
        "displacements are off with each turn of a screw",
        (2e-5, 1e-4),
        "m",
        "displacement channels: linearity",
        sensor.periodic,
    ),
    (
        "displacement_backlash",
        "range",
        "all displacement sensors have play",
        (1e-4, 5e-4),
        "m",
        "displacement channels late",
        sensor.backlash,
    ),
    (
        "force_hysteresis",
        "range",
        "all force sensors have hysteresis",
        (1e-3, 5e-3),
        "of the largest",
        "hysteresis of force channels",
        sensor.hysteresis,
    ),
    (
        "force_crosstalk",
        "gains",
        "each force shows some of the next leg's",
        (5e-3, 3e-2),
        "",
        "gain of force channels",
        sensor.crosstalk,
    ),
    (
        "stated_noise",
        "noise",
        "sensor sigmas of the platform file",
        (0.33, 3.0),
        "x",
        "stated noise",
        sensor.stated_noise,
    ),
    (
        "velocity_differentiated",
        "timing",
        "velocities are differences of the displacements",
        (200.0, 30.0),
        "Hz",
        "velocities made of displacements",
        timing.differentiated,
    ),
    ("jitter", "timing", "rows not of the time they tell", (1e-4, 5e-4), "s", "jitter of the samples", timing.jitter),
    ("clock", "timing", "the clock is wrong", (0.003, 0.02, 0.1), "", "clock", timing.clock),
    ("clock_jump", "timing", "the clock jumps ahead", (0.02, 1.0), "s", "clock jumped", timing.clock_jump),
    ("held", "timing", "all channels held for some ticks", (2.0, 5.0, 20.0), "ticks", "samples held", timing.held),
    (
        "slow_sampling",
        "timing",
        "fewer rows, with their times",
        (2.0, 5.0, 20.0),
        "ticks",
        "sampling rate",
        timing.slow_sampling,
    ),
    ("lost", "rows", "rows lost", (0.01, 0.2), "of the rows", "samples missing", timing.lost),
    ("lost_stretch", "rows", "a stretch without rows", (0.1, 2.0), "s", "samples missing", timing.lost_stretch),
    ("lost_bursts", "rows", "rows lost in bursts", (3e-3, 3e-2), "s", "samples missing", timing.lost_bursts),
    ("doubled", "rows", "rows twice, with their times", (0.01, 0.5), "of the rows", "samples doubled", timing.doubled),
    ("repeated", "rows", "old values under new times", (0.01, 0.2), "of the rows", "samples repeated", timing.repeated),
    (
        "shuffled",
        "rows",
        "rows out of order, with their times",
        (0.01, 0.2),
        "of the rows",
        "samples shuffled",
        timing.shuffled,
    ),
    (
        "shuffled_values",
        "rows",
        "values out of order, times in order",
        (0.01, 0.2),
        "of the rows",
        "samples shuffled",
        timing.shuffled_values,
    ),
    ("frozen", "rows", "values frozen, times go on", (0.05, 0.5, REST_S), "s", "samples frozen", timing.frozen),
    ("hinges", "hinges", "all hinges off", (3e-4, 1e-3, 3e-3), "m, one sigma", "hinges", machine.hinges),
    ("one_hinge", "hinges", "one hinge off", (1e-3, 5e-3), "m", "hinge of leg N", machine.one_hinge),
    ("hinge_circle", "hinges", "circle of the platform's hinges", (0.003, 0.02), "", "hinges", machine.hinge_circle),
    ("home_length", "hinges", "length of all legs at home", (1e-3, 5e-3), "m", "home length", machine.home_length),
    (
        "platform_mass",
        _PLATFORM,
        "mass of the platform",
        (0.01, 0.05, 0.2),
        "",
        "platform's mass",
        machine.platform_mass,
    ),
    (
        "platform_centre",
        _PLATFORM,
        "the platform's centre of mass",
        (2e-3, 1e-2, 5e-2),
        "m",
        "platform's centre",
        machine.platform_centre,
    ),
    (
        "platform_inertia",
        _PLATFORM,
        "inertia of the platform",
        (0.05, 0.2, 0.5),
        "",
        "platform's inertia",
        machine.platform_inertia,
    ),
    ("known_mass", _PLATFORM, "the load's mass as given", (0.005, 0.05), "", "given mass", machine.known_mass),
    ("gravity", _PLATFORM, "g of the platform file", (0.001, 0.01), "", "gravity", machine.gravity),
    ("tilt", "tilt", "base off level", (0.002, 0.006, 0.02), "rad", "base off level", machine.tilt),
    ("leg_mass", "leg mass", "legs with mass", (2.0, 6.0, 20.0), "kg each", "mass of the legs", machine.leg_mass),
    ("elastic_legs", "leg mass", "legs that give", (5e7, 1e7), "N/m", "stiffness of the legs", machine.elastic_legs),
    ("coulomb", "friction", "dry friction", (10.0, 60.0), "N", "friction", machine.coulomb),
    ("viscous", "friction", "viscous friction", (50.0, 300.0), "N s/m", "friction", machine.viscous),
    ("stribeck", "friction", "dry friction with breakaway", (10.0, 60.0), "N", "friction", machine.stribeck),
    ("lugre", "friction", "bristle friction with breakaway", (10.0, 60.0), "N", "friction", machine.lugre),
    (
        "friction_growing",
        "friction",
        "dry friction that grows with force",
        (0.003, 0.02),
        "N/N",
        "friction",
        machine.growing_with_force,
    ),
    (
        "friction_warming_up",
        "friction",
        "dry friction, halved when warm",
        (20.0, 80.0),
        "N",
        "friction",
        machine.warming_up,
    ),
    (
        "hinge_friction",
        "friction",
        "dry friction in the hinges",
        (2.0, 10.0),
        "N m",
        "friction",
        machine.hinge_friction,
    ),
    ("pendulum", _SOFT, "a part of the load swings", (0.02, 0.1, 0.3), "of its mass", "load not rigid", load.pendulum),
    ("sloshing", _SOFT, "a part of the load sloshes", (0.02, 0.1, 0.3), "of its mass", "load not rigid", load.sloshing),
    ("soft_mount", _SOFT, "the load stands on rubber", (20.0, 8.0, 4.0), "Hz", "load not rigid", load.soft_mount),
    ("rotor", _SOFT, "something in the load spins", (5.0, 50.0), "N m s", "load not rigid", load.rotor),
    ("shaking_base", _OUTSIDE, "the floor shakes", (0.02, 0.1, 0.5), "m/s²", "base shakes", load.shaking_base),
    ("external_force", _OUTSIDE, "a constant force", (10.0, 50.0, 250.0), "N", "external force", load.external_force),
    ("contact", _OUTSIDE, "a push of half a second", (20.0, 100.0, 500.0), "N", "contact", load.contact),
    ("end_stop", _OUTSIDE, "something in the way", (50.0, 500.0), "N", "contact", load.end_stop),
    ("wind", _OUTSIDE, "gusts of wind", (10.0, 60.0), "N", "external force", load.wind),
    ("hoses", _OUTSIDE, "hoses pull back", (50.0, 500.0), "N/m", "external force", load.hoses),
    ("sliding", _CHANGING, "the load slides", (0.01, 0.1), "m", "load changes", load.sliding),
    ("leaking", _CHANGING, "the load leaks", (0.2, 2.0, 10.0), "kg/s", "load changes", load.leaking),
    (
        "falling",
        _CHANGING,
        "a part of the load falls off",
        (0.01, 0.1, 0.5),
        "of the load",
        "load changed",
        load.falling,
    ),
    (
        "two_changes",
        _CHANGING,
        "two changes of the load at once",
        (0.05, 0.1, 0.2),
        "s apart",
        "load changed",
        load.two_changes,
    ),
)


def _all() -> dict[str, Kind]:
    clean = Kind(NONE, NONE, "nothing is wrong", (0.0,), "", "", _nothing)
    of_channels = [kind for channel in (_DISPLACEMENT, _VELOCITY, _FORCE) for kind in _of_channel(channel)]
    kinds = [clean, *of_channels, *(Kind(*row) for row in _OTHERS)]
    kinds.sort(key=lambda kind: GROUPS.index(kind.group))
    return {kind.name: kind for kind in kinds}


GROUPS = (
    NONE,
    _STUCK,
    "wiring",
    "units",
    _BIAS,
    "gains",
    "range",
    "noise",
    "timing",
    "rows",
    "hinges",
    _PLATFORM,
    "tilt",
    "leg mass",
    "friction",
    _SOFT,
    _OUTSIDE,
    _CHANGING,
)
KINDS = _all()
