"""Which cause the diagnosis of a faulty log names first, and whether it is the true one."""

from dataclasses import dataclass

import numpy as np

from hexload.diagnosis.diagnose import diagnose
from hexload.diagnosis.machine import machine_of
from hexload.errors import InputError
from hexload.estimation.arrays import leg_log
from hexload.faults.kinds import KINDS
from hexload.faults.recording import CHANNELS, Recording, channels_of
from hexload.platform import Platform

RIGHT, OTHER, NOTHING, INDISTINGUISHABLE, REFUSED = "right", "other", "nothing", "cannot be distinguished", "refused"

# Kinds whose causes have other names than their own; of channels with the channel's name before.
_OF_CHANNEL = {
    "negated": ("sign",),
    "drifting": ("drift",),
    "zero_step": ("zero", "drift", "zero step"),
    "zero_pulse": ("pulse",),
    "gain_step": ("gain", "gain step"),
    "wander": ("drift", "zero"),
    "bent": ("curve", "gain"),
    "bias": ("zero",),
    "bias_all": ("zero",),
    "quantised": ("steps",),
    "gain_all": ("gain",),
    "late_leg": ("late",),
    "low_pass": ("late",),
    "held": ("held", "late"),
    "nan": ("missing",),
}
_OTHERS = {
    "renumbered": ("legs renumbered", "legs mirrored"),
    "mirrored": ("legs mirrored",),
    "exchanged_legs": ("legs exchanged",),
    "displacement_backlash": ("displacement late",),
    "force_crosstalk": ("force crosstalk",),
    "velocity_differentiated": ("velocity derived",),
    "stated_noise": ("stated noise",),
    "clock_jump": ("clock jumped", "samples missing"),
    "held": ("samples held", "samples repeated"),
    "slow_sampling": ("sampling",),
    "lost": ("samples missing",),
    "lost_stretch": ("samples missing",),
    "lost_bursts": ("samples missing",),
    "repeated": ("samples repeated",),
    "shuffled_values": ("samples shuffled", "jitter"),
    "frozen": ("samples frozen",),
    "one_hinge": ("one hinge", "hinges"),
    "hinge_circle": ("hinge circle", "hinges"),
    "home_length": ("displacement zero", "hinges"),
    "leg_mass": ("leg mass",),
    "coulomb": ("dry friction",),
    "viscous": ("viscous friction",),
    "stribeck": ("dry friction",),
    "lugre": ("dry friction",),
    "friction_growing": ("growing friction", "dry friction"),
    "friction_warming_up": ("dry friction",),
    "hinge_friction": ("hinge friction", "dry friction"),
    "pendulum": ("not rigid",),
    "sloshing": ("not rigid",),
    "soft_mount": ("not rigid",),
    "shaking_base": ("shaking base",),
    "external_force": ("external force",),
    "contact": ("push",),
    "end_stop": ("end stop", "push"),
    "rotor": ("spinning part",),
    "wind": ("external force", "push"),
    "sliding": ("load ramp", "load change"),
    "leaking": ("load ramp", "load change"),
    "falling": ("load change",),
    "two_changes": ("load change",),
}
# Every load explains them.
_UNTOLD = ("force_gain_all", "platform_mass", "platform_centre", "platform_inertia", "known_mass")
_REFUSED = ("doubled", "shuffled", "velocity_nan")  # by the reader, with the line


@dataclass(frozen=True)
class Named:
    cause: str  # the first; empty: none
    sentence: str
    outcome: str  # RIGHT, OTHER, NOTHING, INDISTINGUISHABLE, REFUSED


def causes_of(kind: str) -> tuple[str, ...]:
    """Keys of the findings that name a kind of fault; empty: none can."""
    if kind in _UNTOLD or kind in _REFUSED:
        return ()
    channel, _, name = kind.partition("_")
    if kind not in _OTHERS and channel in CHANNELS:
        return tuple(f"{channel} {word}" for word in _OF_CHANNEL.get(name, (name,)))
    return _OTHERS.get(kind, (kind.replace("_", " "),))


def name_cause(faulty: Recording, base: Recording, kind: str) -> Named:
    """`base`: without the fault. Legs count: of a fault of one leg, that leg must be among those that are named."""
    expected = causes_of(kind)
    machine = machine_of(Platform.of(faulty.platform).native())
    try:
        log = leg_log(faulty.log.t_s, *channels_of(faulty.log))
    except InputError as refused:
        return Named("", str(refused), REFUSED)
    diagnosis = diagnose(log, machine, [load.at_s for load in base.loads[1:]])
    reported = [each for each in diagnosis.load_changes if "has not reported" in each.words]
    found = [*diagnosis.findings, *reported]
    if not found:
        return Named("", "", INDISTINGUISHABLE if _is_indistinguishable(kind, diagnosis.indistinguishable) else NOTHING)
    first = found[0]
    is_right = first.cause in expected and _has_leg(first.legs, faulty, base)
    return Named(first.cause, first.sentence, RIGHT if is_right else OTHER)


def _is_indistinguishable(kind: str, numberings: int) -> bool:
    return kind == "none" or not causes_of(kind) or (kind in ("renumbered", "mirrored") and numberings > 0)


def _has_leg(legs: tuple[int, ...], faulty: Recording, base: Recording) -> bool:
    touched = set()
    for one, other in zip(channels_of(faulty.log), channels_of(base.log)):
        if one.shape != other.shape:
            return True
        touched |= set(np.flatnonzero(((one != other) & ~(np.isnan(one) & np.isnan(other))).any(axis=0)).tolist())
    return len(touched) != 1 or not legs or bool(touched & set(legs))


assert set(_OTHERS) <= set(KINDS) and {*_UNTOLD, *_REFUSED} <= set(KINDS)
