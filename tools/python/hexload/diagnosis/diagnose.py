"""One log, one machine: the ranked list of what is wrong, in words and numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis import channels, kinematics, one_force, passing, phrases, repeating, sensors, wiring
from hexload.diagnosis.bank import Bank
from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.dynamics import Dynamics, Machine, TooShort, dynamics_of
from hexload.diagnosis.finding import Finding, plain
from hexload.diagnosis.record import Record, record_of
from hexload.diagnosis.search import explain
from hexload.io.log_file import LegLog

GROSS = 30.0  # misfit from which the wiring is looked at
CLEARLY = 0.01  # of it, that another wiring of the forces leaves, and no other cause need be looked for
PARTS = 3  # of the record, that are looked at by themselves
REWIRED = 0.2  # of the misfit, that another wiring, or other forces of one leg, leave at most
BETTER = 0.5  # of what is left with every other cause: the forces are to blame where with theirs no more is
LIGHT = 0.9  # of the empty platform's mass: less is no load
MINOR = (Defect.SAMPLING, Defect.NOISE, Defect.STATED_NOISE, Defect.HUM, Defect.MISSING, Defect.REPEATED)
UNEVEN = (
    Cause(Defect.STEPS, Channel.DISPLACEMENT),
    Cause(Defect.HUM, Channel.DISPLACEMENT),
    Cause(Defect.HUM, Channel.VELOCITY),
)  # look like errors that repeat
RIG_SIGMAS = 3.0
REPORTED_S = 0.2  # between a change here and an estimator's

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Diagnosis:
    findings: tuple[Finding, ...]  # the most likely cause first; empty: nothing is wrong that the log can tell
    load_changes: tuple[Finding, ...]
    misfit: float  # mean square of what a free load leaves of the forces, in the sensors' noise; nan: not known
    left: float  # the same with the causes
    indistinguishable: int  # numberings of the legs that this machine cannot tell from the right one

    @property
    def cause(self) -> Finding | None:
        """The most likely one that does harm."""
        return next((finding for finding in self.findings if not finding.is_harmless), None)

    def beside(self, sigma: Array, is_fit: bool, has_rig: bool = False) -> "Diagnosis":
        """The same with what is small judged by what it does to the load, beside the published sigmas; where the estimator finds no
        mismatch (`is_fit`) so is every cause but a wrong input. With a rig file the sigmas have what commissioning has left of
        the same constants, so that three of them are nothing new. Where it finds one, and the log shows nothing larger, the
        first of what is small is what there is to mend."""
        most = RIG_SIGMAS if has_rig else 1.0
        findings = [_beside(each, most, sigma, is_fit) for each in self.findings]
        first = next((k for k, each in enumerate(findings) if each.why_harmless), None)
        if not is_fit and first is not None and all(each.is_harmless for each in findings):
            findings[first] = _harmful(findings[first], "the one misfit that is found")
        return replace(self, findings=tuple(findings))

    @property
    def input_words(self) -> str:
        """Of the first that makes the input unfit for any estimate."""
        return next((finding.sentence for finding in self.findings if finding.is_input), "")


def diagnose(
    log: LegLog, machine: Machine, reported_changes_s: Sequence[float] = (), shown: LegLog | None = None
) -> Diagnosis:
    """`reported_changes_s`: when an estimator has detected another load. `shown`: what the sensors have shown, where `log` is
    without what a rig file says of them. A log that is too short has no findings."""
    indistinguishable = len(wiring.indistinguishable(machine.geometry))
    try:
        record = record_of(log)
        record = record if shown is None else replace(record, raw=record_of(shown).raw)
    except ValueError:
        return Diagnosis((), (), np.nan, np.nan, indistinguishable)
    of_channels = list(channels.look_at(record, machine))
    stated, machine = machine, channels.with_own_noise(record, machine)
    minor = [each for each in of_channels if each.cause.defect in MINOR and not _is_much(each)]
    major = [each for each in of_channels if each not in minor]
    if any(each.is_input or each.cause.defect == Defect.FROZEN for each in major):  # no motion to compare forces with
        return Diagnosis((*major, *minor), (), np.nan, np.nan, indistinguishable)
    is_even = all(each.cause not in UNEVEN for each in of_channels)
    of_sensors, record = _sensors(record, stated, is_even)
    major, of_sensors = _of_one_source(major, of_sensors)
    found = _forces(record, machine, reported_changes_s)
    if record.velocity_m_s is not None:
        found = replace(found, findings=tuple(phrases.with_velocities(each) for each in found.findings))
    scaled = [each.cause.channel for each in of_sensors if each.cause.defect == Defect.UNIT]
    minor = [each for each in minor if each.cause.channel not in scaled]
    findings = sorted((*major, *of_sensors, *found.findings, *minor), key=lambda each: not each.is_input)
    return replace(found, findings=tuple(findings), indistinguishable=indistinguishable)


def _of_one_source(major: list[Finding], of_sensors: list[Finding]) -> tuple[list[Finding], list[Finding]]:
    """Velocities that are made of displacements are late by the filter that makes them, which is one cause."""
    late = [each for each in of_sensors if each.cause == Cause(Defect.LATE, Channel.VELOCITY)]
    if not late or all(each.cause != channels.DERIVED for each in major):
        return major, of_sensors
    is_input = any(each.is_input for each in late)
    major = [
        replace(each, is_input=each.is_input or is_input) if each.cause == channels.DERIVED else each for each in major
    ]
    return major, [each for each in of_sensors if each not in late]


def _beside(finding: Finding, most: float, sigma: Array, is_fit: bool) -> Finding:
    """`most`: sigmas that cover a shift."""
    if not finding.shift or not (finding.is_harmless or is_fit):
        return finding
    worst = float(np.max(np.abs(finding.shift) / sigma[: len(finding.shift)]))
    if worst <= most:
        return replace(finding, why_harmless=phrases.COVERED, is_harmless=True)
    return _harmful(finding, f"it moves the load by {worst:.1f} sigmas") if finding.is_harmless else finding


def _harmful(finding: Finding, why: str) -> Finding:
    """Of what is small."""
    mend = f"{phrases.BELOW_NOISE}, but {why}: {finding.mend}"
    return replace(finding, mend=mend, is_harmless=False, why_harmless="")


def _is_much(finding: Finding) -> bool:
    return finding.cause.defect == Defect.MISSING and finding.size > 0.1


def _sensors(record: Record, machine: Machine, is_even: bool) -> tuple[list[Finding], Record]:
    """Of displacements and velocities beside each other. Errors of displacements that jump or repeat are looked for where
    coarse steps or a hum of either channel are not taken for them (`is_even`)."""
    findings: list[Finding] = []
    for take_out in (repeating.take_out, passing.take_out) if is_even else ():
        found, record = take_out(record, machine)
        findings += found
    smooth = kinematics.smooth_of(record)
    if smooth is None or (compared := kinematics.compare(record, smooth, machine)) is None:
        return findings, record
    checked = sensors.check(record, compared, machine, lambda other: wiring.misfit(other, machine))
    return findings + checked.findings, checked.record


def _forces(record: Record, machine: Machine, reported_s: Sequence[float]) -> Diagnosis:
    try:
        d = dynamics_of(record, machine)
    except TooShort:
        return Diagnosis((), (), np.nan, np.nan, 0)
    except ValueError:
        finding = _no_pose(record, machine)
        return Diagnosis((finding,), (), np.nan, np.nan, 0)
    bank = Bank(d, [np.ones(len(d.smooth.t_s))])
    misfit = bank.left / bank.rows
    parts = [record, *_ends(record)] if misfit > GROSS else []
    wirings = [found for part in parts if (found := _best_wiring(part, machine)) is not None]
    for best in wirings:
        if best.left < CLEARLY * best.own:
            return Diagnosis((phrases.rewired(best),), (), misfit, best.left, 0)
    if bank.theta()[0, 0] < LIGHT * machine.own_theta[0]:
        return Diagnosis((_light(d, bank),), (), misfit, np.nan, 0)
    found = explain(d, reported_s)
    if misfit > GROSS and (other := _other_forces(d, wirings, misfit, found.left, reported_s)) is not None:
        return other
    if found.left > GROSS:
        for part in parts[1:]:
            if (other := _one_force(part, machine)) is not None:
                return other
            if (legs := _legs_rewired(part, machine, found.left)) is not None:
                return Diagnosis((phrases.rewired(legs),), (), misfit, legs.left, 0)
    pairs = zip(found.selected, found.alternatives, strict=True)
    causes = [phrases.finding_of(*pair, machine) for pair in pairs]
    changes = [
        phrases.change_in_words(change, any(abs(change.at_s - reported) < REPORTED_S for reported in reported_s))
        for change in found.changes
    ]
    return Diagnosis(tuple(causes), tuple(changes), found.misfit, found.left, 0)


def _light(d: Dynamics, bank: Bank) -> Finding:
    """Of legs that carry less than the empty platform: by one of them that is to blame alone, or by all."""
    one = one_force.corrected(d)
    if one.left < REWIRED * bank.left / bank.rows:
        return one.finding
    words = f"the legs carry {plain(bank.theta()[0, 0], 3)} kg, less than the empty platform"
    return Finding(Cause(Defect.UNIT, Channel.FORCE), words, "check the forces' unit (N) and sign", is_input=True)


def _other_forces(
    d: Dynamics, wirings: list[wiring.Rewired], misfit: float, left: float, reported_s: Sequence[float]
) -> Diagnosis | None:
    """Their wiring, or one leg's force, is to blame where with another all other causes together leave much less than with the
    log's own: `left`."""
    candidates = []
    for best in wirings:
        if best.left < REWIRED * best.own:
            force_n = d.record.force_n[:, np.argsort(best.order)] * np.take(best.signs, np.argsort(best.order))
            candidates.append((phrases.rewired(best), replace(d.record, force_n=force_n)))
    one = one_force.corrected(d)
    if one.left < REWIRED * misfit:
        candidates.append((one.finding, one.record))
    best_left, finding = BETTER * left, None
    for each, record in candidates:
        other = explain(dynamics_of(record, d.machine), reported_s).left
        if other < best_left:
            best_left, finding = other, each
    return None if finding is None else Diagnosis((finding,), (), misfit, best_left, 0)


def _one_force(part: Record, machine: Machine) -> Diagnosis | None:
    """As _other_forces() of a part with a load of its own."""
    try:
        d = dynamics_of(part, machine)
    except ValueError:  # too short, or of no pose
        return None
    bank = Bank(d, [np.ones(len(d.smooth.t_s))])
    return _other_forces(d, [], bank.left / bank.rows, explain(d).left, ())


def _ends(record: Record) -> list[Record]:
    """First and last part: a load that changes in mid-run is one load in each."""
    rows = len(record.t_s) // PARTS
    parts = []
    for inside in (slice(0, rows), slice(len(record.t_s) - rows, None)):
        names = ("t_s", "displacement_m", "force_n", "is_known")
        parts.append(replace(record, **{name: getattr(record, name)[inside] for name in names}))
    return parts


def _best_wiring(record: Record, machine: Machine) -> wiring.Rewired | None:
    try:
        d = dynamics_of(record, machine)
    except ValueError:
        return None
    bank = Bank(d, [np.ones(len(d.smooth.t_s))])
    return wiring.best_forces(bank) if bank.left > GROSS * bank.rows else None


def _legs_rewired(record: Record, machine: Machine, left: float) -> wiring.Rewired | None:
    best = wiring.best_legs(record, machine)
    return best if best is not None and best.left < REWIRED * min(best.own, left) else None


def _no_pose(record: Record, machine: Machine) -> Finding:
    reach = float(np.ptp(record.displacement_m, axis=0).max())
    if reach > 1.5 * float(machine.geometry.home_leg_length_m.mean()):
        words = f"displacements reach over {plain(reach, 3)} m, more than a leg is long"
        return Finding(Cause(Defect.UNIT, Channel.DISPLACEMENT), words, "check their unit (m)", is_input=True)
    if (finding := _pose_sign(record, machine)) is not None:
        return finding
    words = "displacements are those of no pose of this machine"
    return Finding(
        Cause(Defect.NO_POSE),
        words,
        "check their order, signs and zeros, and [geometry] of the platform file",
        is_input=True,
    )


def _pose_sign(record: Record, machine: Machine) -> Finding | None:
    for leg in range(6):
        flip = np.where(np.arange(6) == leg, -1.0, 1.0)
        if wiring.misfit(replace(record, displacement_m=record.displacement_m * flip), machine) < np.inf:
            words = f"leg {leg + 1}: displacement has the wrong sign"
            return Finding(
                Cause(Defect.SIGN, Channel.DISPLACEMENT),
                words,
                "check the wiring of its displacement sensor",
                (leg,),
                is_input=True,
            )
    return None
