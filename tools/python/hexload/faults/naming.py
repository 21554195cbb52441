"""Which cause the diagnosis of a faulty log names first, and whether it is the true one."""

from dataclasses import dataclass

import numpy as np

from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.diagnose import diagnose
from hexload.diagnosis.machine import machine_of
from hexload.errors import InputError
from hexload.estimation.arrays import leg_log
from hexload.faults.kinds import KINDS
from hexload.faults.recording import Recording, channels_of
from hexload.platform import Platform

RIGHT, OTHER, NOTHING, INDISTINGUISHABLE, REFUSED = "right", "other", "nothing", "cannot be distinguished", "refused"

# Of each kind of fault the causes that name it; the same defects for each channel.
_OF_CHANNEL = {
    "stuck": (Defect.STUCK,),
    "dead": (Defect.DEAD,),
    "loose": (Defect.LOOSE,),
    "negated": (Defect.SIGN,),
    "drifting": (Defect.DRIFT,),
    "bias": (Defect.ZERO,),
    "bias_all": (Defect.ZERO,),
    "zero_step": (Defect.ZERO, Defect.DRIFT, Defect.ZERO_STEP),
    "zero_pulse": (Defect.PULSE,),
    "wander": (Defect.DRIFT, Defect.ZERO),
    "spikes": (Defect.SPIKES,),
    "noise": (Defect.NOISE,),
    "bursts": (Defect.BURSTS,),
    "hum": (Defect.HUM,),
    "saturated": (Defect.SATURATED,),
    "bent": (Defect.CURVE, Defect.GAIN),
    "quantised": (Defect.STEPS,),
    "swapped": (Defect.SWAPPED,),
    "unit": (Defect.UNIT,),
    "gain": (Defect.GAIN,),
    "gain_step": (Defect.GAIN, Defect.GAIN_STEP),
    "gain_all": (Defect.GAIN,),
    "late": (Defect.LATE,),
    "late_leg": (Defect.LATE,),
    "low_pass": (Defect.LATE,),
    "held": (Defect.HELD, Defect.LATE),
    "nan": (Defect.MISSING,),
}
_OTHERS = {
    "renumbered": (Cause(Defect.LEGS_RENUMBERED), Cause(Defect.LEGS_MIRRORED)),
    "mirrored": (Cause(Defect.LEGS_MIRRORED),),
    "exchanged_legs": (Cause(Defect.LEGS_EXCHANGED),),
    "displacement_backlash": (Cause(Defect.LATE, Channel.DISPLACEMENT),),
    "force_crosstalk": (Cause(Defect.CROSSTALK, Channel.FORCE),),
    "velocity_differentiated": (Cause(Defect.DERIVED, Channel.VELOCITY),),
    "stated_noise": (Cause(Defect.STATED_NOISE),),
    "clock_jump": (Cause(Defect.CLOCK_JUMPED), Cause(Defect.MISSING, Channel.SAMPLES)),
    "held": (Cause(Defect.HELD, Channel.SAMPLES), Cause(Defect.REPEATED, Channel.SAMPLES)),
    "slow_sampling": (Cause(Defect.SAMPLING),),
    "lost": (Cause(Defect.MISSING, Channel.SAMPLES),),
    "lost_stretch": (Cause(Defect.MISSING, Channel.SAMPLES),),
    "lost_bursts": (Cause(Defect.MISSING, Channel.SAMPLES),),
    "repeated": (Cause(Defect.REPEATED, Channel.SAMPLES),),
    "shuffled_values": (Cause(Defect.JITTER),),
    "frozen": (Cause(Defect.FROZEN, Channel.SAMPLES),),
    "one_hinge": (Cause(Defect.ONE_HINGE), Cause(Defect.HINGES)),
    "hinge_circle": (Cause(Defect.HINGE_CIRCLE), Cause(Defect.HINGES)),
    "home_length": (Cause(Defect.ZERO, Channel.DISPLACEMENT), Cause(Defect.HINGES)),
    "leg_mass": (Cause(Defect.LEG_MASS),),
    "coulomb": (Cause(Defect.DRY_FRICTION),),
    "viscous": (Cause(Defect.VISCOUS_FRICTION),),
    "stribeck": (Cause(Defect.DRY_FRICTION),),
    "lugre": (Cause(Defect.DRY_FRICTION),),
    "friction_growing": (Cause(Defect.GROWING_FRICTION), Cause(Defect.DRY_FRICTION)),
    "friction_warming_up": (Cause(Defect.DRY_FRICTION),),
    "hinge_friction": (Cause(Defect.HINGE_FRICTION), Cause(Defect.DRY_FRICTION)),
    "pendulum": (Cause(Defect.NOT_RIGID),),
    "sloshing": (Cause(Defect.NOT_RIGID),),
    "soft_mount": (Cause(Defect.NOT_RIGID),),
    "shaking_base": (Cause(Defect.SHAKING_BASE),),
    "external_force": (Cause(Defect.EXTERNAL_FORCE),),
    "contact": (Cause(Defect.PUSH),),
    "end_stop": (Cause(Defect.END_STOP), Cause(Defect.PUSH)),
    "rotor": (Cause(Defect.SPINNING_PART),),
    "wind": (Cause(Defect.EXTERNAL_FORCE), Cause(Defect.PUSH)),
    "sliding": (Cause(Defect.LOAD_RAMP), Cause(Defect.LOAD_CHANGE)),
    "leaking": (Cause(Defect.LOAD_RAMP), Cause(Defect.LOAD_CHANGE)),
    "falling": (Cause(Defect.LOAD_CHANGE),),
    "two_changes": (Cause(Defect.LOAD_CHANGE),),
    "displacement_periodic": (Cause(Defect.PERIODIC, Channel.DISPLACEMENT),),
    "force_hysteresis": (Cause(Defect.HYSTERESIS, Channel.FORCE),),
    "jitter": (Cause(Defect.JITTER),),
    "clock": (Cause(Defect.CLOCK),),
    "hinges": (Cause(Defect.HINGES),),
    "gravity": (Cause(Defect.GRAVITY),),
    "tilt": (Cause(Defect.TILT),),
    "elastic_legs": (Cause(Defect.ELASTIC_LEGS),),
    "hoses": (Cause(Defect.HOSES),),
}
# Every load explains them.
_UNTOLD = ("force_gain_all", "platform_mass", "platform_centre", "platform_inertia", "known_mass")
_REFUSED = ("doubled", "shuffled")  # by the reader, with the line


@dataclass(frozen=True)
class Named:
    cause: str  # the first; empty: none
    sentence: str
    outcome: str  # RIGHT, OTHER, NOTHING, INDISTINGUISHABLE, REFUSED


def causes_of(kind: str) -> tuple[Cause, ...]:
    """Those that name a kind of fault; empty: none can."""
    if kind in _UNTOLD or kind in _REFUSED:
        return ()
    fault = KINDS[kind]
    if fault.channel:
        return tuple(Cause(defect, Channel(fault.channel)) for defect in _OF_CHANNEL[fault.of_channel])
    return _OTHERS.get(kind, ())


def name_cause(faulty: Recording, base: Recording, kind: str) -> Named:
    """`base`: without the fault. Legs count: of a fault of one leg, that leg must be among those that are named."""
    expected = causes_of(kind)
    machine = machine_of(Platform.of(faulty.platform).native())
    try:
        log = leg_log(faulty.log.t_s, *channels_of(faulty.log))
    except InputError as refused:
        return Named("", str(refused), REFUSED)
    diagnosis = diagnose(log, machine, [load.at_s for load in base.loads[1:]])
    unreported = [each for each in diagnosis.load_changes if not each.is_reported]
    found = [*diagnosis.findings, *unreported]
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
