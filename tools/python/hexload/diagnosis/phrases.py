"""Sentences of the causes that the bank has chosen."""

from dataclasses import replace

import numpy as np

from hexload.diagnosis.bank import Selected
from hexload.diagnosis.finding import LEGS, Finding, legs_in_words, plain
from hexload.diagnosis.search import Change

COMMISSION = "commission the machine (hexload commission), then replay with --rig"
COMMISSION_AGAIN = "commission the machine again: it is not as its rig file says"
CALIBRATE = "calibrate the sensor, or commission the machine"
ALL = tuple(range(LEGS))
HARMLESS = 0.5  # of a force sensor's sigma, rms
BELOW_NOISE = "small beside the force sensors' noise"
COVERED = "too small to matter: sigma covers what it does to the load"
LARGE = 0.25  # of the largest leg's size, from which a leg is named
NEGATED, DEAD = -0.5, 0.3  # gains of a force sensor: below the first its sign is wrong, below the second it is dead


def finding_of(selected: Selected, alternatives: tuple[str, ...], force_sigma_n: float) -> Finding:
    cause, words, mend, size, unit, legs = _worded(selected)
    is_harmless = selected.rms_n < HARMLESS * force_sigma_n
    return Finding(
        cause,
        words,
        BELOW_NOISE if is_harmless else mend,
        legs,
        size,
        unit,
        selected.sigmas,
        selected.rms_n,
        float(selected.shift[0]),
        selected.share,
        alternatives,
        shift=tuple(map(float, selected.shift)),
        until_s=selected.family.end,
        is_harmless=is_harmless,
    )


def of_one_force(leg: int, gain: float, has_gain: bool) -> Finding:
    """Of the sensor of one leg (from 0) beside what the other five need: its gain, and whether it follows that at all."""
    who, five = legs_in_words((leg,)), "what the other five legs need"
    wiring = "check the wiring of its force sensor"
    if has_gain and gain < NEGATED:
        return Finding("force sign", f"{who}: force has the wrong sign", wiring, (leg,), gain - 1.0, is_input=True)
    if has_gain and abs(1e3 * gain - 1.0) < 0.1:
        words = f"{who}: force is a thousandth of {five}, as in kN"
        return Finding("force unit", words, "check its unit (N)", (leg,), gain - 1.0, is_input=True)
    if abs(gain) < DEAD:
        words = f"{who}: force is next to nothing beside {five}"
        return Finding("force dead", words, wiring, (leg,), gain - 1.0, is_input=True)
    if has_gain:
        percent = plain(100.0 * abs(gain - 1.0))
        words = f"residual of {who} follows its force: gain of its force sensor off by about {percent} %"
        return Finding("force gain", words, CALIBRATE, (leg,), gain - 1.0)
    return Finding("force wrong", f"{who}: force is not {five}", wiring, (leg,), is_input=True)


def of_commissioned(finding: Finding) -> Finding:
    """Of a machine that has a rig file, whose hinges, gravity and friction count."""
    mend = finding.mend.replace(COMMISSION, COMMISSION_AGAIN).replace(
        "or commission the machine", "or commission it again"
    )
    if finding.is_input:
        return replace(finding, mend=mend)
    return replace(finding, words=finding.words.replace("the platform file", "the rig file"), mend=mend)


def with_velocities(finding: Finding) -> Finding:
    """Velocities agree with displacements in time, so what is late or early beside them are the forces."""
    if finding.cause != "displacement late" or finding.legs not in ((), ALL):
        return finding
    words = f"all force channels are {plain(1e3 * abs(finding.size))} ms {'late' if finding.size < 0 else 'early'}"
    return replace(finding, cause="force late", words=words, size=-finding.size)


def change_in_words(change: Change, is_reported: bool) -> Finding:
    mass = float(change.theta[0])
    words = f"another load from {change.at_s:.2f} s on, {plain(abs(mass), 3)} kg {'more' if mass > 0 else 'less'}"
    return Finding(
        "load change",
        words if is_reported else f"{words}, which the estimator has not reported",
        "" if is_reported else "replay what follows by itself",
        size=mass,
        unit="kg",
        sigmas=float(np.sqrt(change.score)),
    )


def _worded(s: Selected) -> tuple[str, str, str, float, str, tuple[int, ...]]:
    sizes, legs, worst = _by_leg(s)
    if s.family.cause in _OF_LEGS:
        return _of_legs(s, sizes, legs, worst)
    at = s.family.detail
    first = float(s.size[0])
    tilt_rad = float(np.hypot(*s.size[:2])) if len(s.size) > 1 else 0.0
    percent = 100.0 * first
    table = {
        "hinge friction": (
            f"the residual follows the turning of the hinges: friction of about {plain(first)} N m in each",
            COMMISSION,
            first,
            "N m",
        ),
        "tilt": (
            f"the residual follows the platform's attitude: the base is {plain(np.degrees(tilt_rad))} degrees off level",
            f"level it, or {COMMISSION}",
            tilt_rad,
            "rad",
        ),
        "gravity": (
            f"weight and inertia do not agree by {plain(abs(percent))} %: gravity of the platform file, or the clock, is off",
            "check gravity_m_s2 and the sampling period",
            first,
            "",
        ),
        "force crosstalk": (
            f"forces follow those of the neighbouring legs: each shows about {plain(100.0 * np.max(np.abs(s.size)))} % of the next one's",
            "look at cables and amplifiers, or at bending in the mounts of the sensors",
            float(np.max(np.abs(s.size))),
            "",
        ),
        "spinning part": (
            f"the residual follows the platform's turning across it: something in the load spins, with about {plain(np.linalg.norm(s.size))} N m s",
            "stop it, or let no load change count while it runs",
            float(np.linalg.norm(s.size)),
            "N m s",
        ),
        "elastic legs": (
            f"the residual follows the second derivative of the legs' forces: legs give, by about {plain(1e8 / max(abs(first), 1e-9))} N/m each",
            "look at their mounts and hinges",
            1e8 / max(abs(first), 1e-9),
            "N/m",
        ),
        "force pulse": (
            f"{legs_in_words(s.family.legs)}: zero of its force sensor off by about {plain(abs(first))} N from about {at:.2f} to {s.family.end:.2f} s",
            "look at the sensor and its cable",
            at,
            "s",
        ),
        "force zero step": (
            f"{legs_in_words(s.family.legs)}: zero of its force sensor jumps by about {plain(abs(first))} N at about {at:.1f} s",
            CALIBRATE,
            first,
            "N",
        ),
        "force gain step": (
            f"{legs_in_words(s.family.legs)}: gain of its force sensor jumps by about {plain(abs(percent))} % at about {at:.1f} s",
            CALIBRATE,
            first,
            "",
        ),
        "leg mass": (
            "the residual follows the swing of the legs: they have a mass that counts",
            COMMISSION,
            first,
            "kg m²",
        ),
        "hoses": (
            f"the residual follows the platform's position: something pulls it back with about {plain(np.max(np.abs(s.size)))} N/m, as hoses do",
            "take them off, or lead them along",
            float(np.max(np.abs(s.size))),
            "N/m",
        ),
        "external force": (
            "a constant force from outside acts on the platform",
            "look for what touches or pulls it",
            s.rms_n,
            "N",
        ),
        "load ramp": (
            f"the load changes steadily from about {at:.1f} s on",
            "look for a leak; estimates hold for one load",
            first,
            "1/s",
        ),
        "not rigid": (
            f"a part of the load swings by itself at {plain(at)} Hz: it is not rigid (sloshing, pendulum, soft mount)",
            "fasten it; until then only its mass and its centre at rest hold",
            at,
            "Hz",
        ),
        "shaking base": (f"the base shakes at {at:.2f} Hz", "look at the floor and at machines near by", at, "Hz"),
        "end stop": (
            f"at the end of the way towards {np.degrees(at):.0f} degrees something pushes back",
            "look for what is in the way",
            at,
            "rad",
        ),
        "push": (
            f"something pushes from about {at:.2f} to {s.family.end:.2f} s: a contact, or another passing event",
            "look for what touches it",
            at,
            "s",
        ),
        "one hinge": (
            f"the {'platform' if at else 'base'} hinge of {legs_in_words(s.family.legs)} is about {plain(1e3 * np.linalg.norm(s.size))} mm off its place in the platform file",
            "measure it, or commission the machine",
            float(np.linalg.norm(s.size)),
            "m",
        ),
        "hinge circle": (
            f"the circle of the {'platform' if at else 'base'} hinges is {plain(abs(percent))} % {'larger' if first > 0 else 'smaller'} than in the platform file",
            "measure it, or commission the machine",
            first,
            "",
        ),
        "hinges": (
            "the hinges are not where the platform file has them",
            "measure them, or commission the machine",
            float("nan"),
            "",
        ),
    }
    words, mend, size, unit = table[s.family.cause]
    return s.family.cause, words, mend, size, unit, s.family.legs


def _by_leg(s: Selected) -> tuple[np.ndarray, tuple[int, ...], float]:
    """Sizes of the legs, those that count, and the largest."""
    sizes = np.zeros(LEGS)
    if not s.family.legs:
        sizes[:] = s.size[0]
        return sizes, (), float(s.size[0])
    for leg, size in zip(s.family.legs[:LEGS], s.size[:LEGS]):
        sizes[leg] = size
    if s.family.cause == "force gain" and len(s.family.legs) == LEGS:
        sizes -= np.median(sizes)  # what all have in common is a load of another size
    worst = float(sizes[np.abs(sizes).argmax()])
    return sizes, tuple(np.flatnonzero(np.abs(sizes) > LARGE * abs(worst)).tolist()), worst


# Cause -> what the residual shows, what it is, factor and unit, what to do.
_OF_LEGS = {
    "dry friction": ("follows the sign of {its} speed", "friction of about {size} N", 1.0, "N", COMMISSION),
    "viscous friction": ("follows {its} speed", "viscous friction of about {size} N s/m", 1.0, "N s/m", COMMISSION),
    "growing friction": (
        "follows the sign of {its} speed times {its} force",
        "friction of about {size} % of the force",
        100.0,
        "",
        COMMISSION,
    ),
    "force zero": ("is constant", "zero of {its} force sensor off by about {size} N", 1.0, "N", CALIBRATE),
    "force drift": (
        "grows with time",
        "zero of {its} force sensor drifting by about {size} N/s",
        1.0,
        "N/s",
        CALIBRATE,
    ),
    "force gain": ("follows {its} force", "gain of {its} force sensor off by about {size} %", 100.0, "", CALIBRATE),
    "force curve": (
        "follows the square of {its} force",
        "{its} force sensor not straight, by about {size} % of the largest force",
        100.0,
        "",
        "calibrate it over its whole range",
    ),
    "force hysteresis": (
        "lags behind {its} force",
        "hysteresis of {its} force sensor of about {size} N",
        1.0,
        "N",
        "commission the machine, or take a sensor with less",
    ),
    "force late": (
        "follows the change of {its} force",
        "force late by about {size} ms",
        1e3,
        "s",
        "commission the delay, or look at its filter",
    ),
    "displacement zero": (
        "follows a shift of {its} length",
        "length at home, or zero of {its} displacement, off by about {size} mm",
        1e3,
        "m",
        "calibrate it, or commission the machine",
    ),
    "displacement gain": (
        "follows a stretch of {its} length",
        "gain of {its} displacement off by about {size} %",
        100.0,
        "",
        CALIBRATE,
    ),
    "displacement drift": (
        "follows a growing shift of {its} length",
        "displacement drifting by about {size} mm/s",
        1e3,
        "m/s",
        CALIBRATE,
    ),
    "displacement late": (
        "follows the change of {its} motion",
        "displacement late by about {size} ms, or force early",
        1e3,
        "s",
        "commission the delay, or look at its filter",
    ),
}


OPPOSITE = {"late": "early", "early": "late"}


def _of_legs(s: Selected, sizes: np.ndarray, legs: tuple[int, ...], worst: float):
    shows, what, factor, unit, mend = _OF_LEGS[s.family.cause]
    cause = s.family.cause
    their = "its" if len(legs) == 1 else "their"
    named = factor * np.abs(sizes[list(legs)] if legs else sizes[:1])
    low, high = float(named.min()), float(named.max())
    size = plain(high) if high < 1.15 * low or len(named) == 1 else f"{plain(low)} to {plain(high)}"
    if worst < 0.0:
        what = " ".join(OPPOSITE.get(word, word) for word in what.split(" "))
    if len(legs) != 1:
        for one, more in (("follows", "follow"), ("is ", "are "), ("grows", "grow"), ("lags", "lag")):
            shows = shows.replace(one, more)
        what = what.replace("length at home, or zero of", "lengths at home, or zeros of").replace("sensor", "sensors")
        what = what.replace("zero of", "zeros of") if what.startswith("zero") else what
        shows = shows.replace("speed", "speeds").replace("{its} force", "{its} forces")
    who = f"residual of {legs_in_words(legs)}" if len(legs) == 1 else f"residuals of {legs_in_words(legs)}"
    words = f"{who} {shows.format(its=their)}: {what.format(its=their, size=size)}"
    return cause, words, mend, worst, unit, legs
