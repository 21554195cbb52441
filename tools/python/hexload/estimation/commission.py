"""`hexload commission`: what one machine is like beyond its platform file, from a run of the empty platform.

The regression is in rig_regression.py; here stand what is known beforehand, what is refused, and the words.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hexload.errors import InputError
from hexload.estimation import rig_file, rig_model, rig_regression
from hexload.estimation.commissioning_run import (
    DOUBT,
    VELOCITY_HZ,
    Run,
    refuse_derived,
    refuse_held,
    refuse_late_forces,
    refuse_still,
    refuse_velocities,
    run_of,
    slow_motion,
)
from hexload.estimation.common_gain import common_factor, tangent_at, with_common_gain
from hexload.estimation.firmware_run import load_platform, native_firmware
from hexload.estimation.input_check import WayIn, checked_log
from hexload.estimation.rig_model import LEGS, Geometry
from hexload.estimation.rig_regression import GROUPS, SLICES, UNKNOWNS, UNTOLD, Found, Start
from hexload.io.atomic_file import replaced_or_none, replaced_when_done
from hexload.io.toml_document import guessed_in_words, read_toml
from hexload.theory.bound import TENSOR, THETA_NAMES, unit_of
from hexload.theory.tolerances import DEFAULTS, GRANTED_SIGMAS, common_gain_of

Array = NDArray[np.float64]
Result = TypeVar("Result")

TOLERANCES = {  # groups of unknowns by the key of their tolerance
    "gain": "force_gain",
    "hinges": "hinge_m",
    "offset": "force_offset_n",
    "tilt": "tilt_rad",
    "growth": "friction_growth",
}
DELAY_SIGMA_S = 1e-3
MECHANISMS = ("leg_mass", "coulomb", "stribeck", "viscous")  # groups that are none unless they stand out of the noise
DECLARED = ("growth", "offset", "delay", "gain", "hinges", "unlike_legs")  # groups with a tolerance
TOLD_SHARE = 1e-6
UNSURE_SHARE = 0.05  # of the platform's own scale: beyond, the motion tells too little
UNEXPLAINED_SHARE = 0.2  # of the forces' own changes
KEPT_SHARE = 0.7  # of the declared tolerance: a run that leaves more has told nothing
AS_DECLARED = "no more known than declared"
NONE = "none: nothing of it stands out of the noise"
LOAD_SHARES = (0.5, 3.0)  # of the platform's mass: loads whose errors are looked at
LEAST_DELAY_TICKS = 0.1
UNLIKE_SHARE = 0.2  # one sigma, of a leg's mass: valves and hoses, or a rod of another make; alike ones stay so
REFERENCE_SIGMAS = 5.0  # of gains and weighing: a reference mass that is further off is another one
HELD_UP = {  # groups of which an empty run tells in part, so that the rest stands on the tolerance: in words, unit
    "gain": ("force gains", ""),
    "hinges": ("hinges", " m"),
}


@dataclass(frozen=True)
class Wish:
    log: Path
    platform: Path
    out: Path
    reference: Path | None = None
    reference_mass_kg: float | None = None
    loaded: bool = False
    largest_offset: float = 0.75
    report: Path | None = None
    way_in: WayIn = WayIn()


@dataclass(frozen=True)
class StatedMachine:
    """What the platform file says, and within which tolerances."""

    platform_file: Path
    geometry: Geometry
    theta: Array
    gravity_m_s2: float
    tolerances: dict[str, float]
    common_gain: float  # tolerance of the gains' mean, with gravity
    platform_mass: float  # tolerance, a share
    force_delay_s: float
    velocity_delay_s: float

    @property
    def scale(self) -> Array:
        """What a parameter of the platform is compared with: its mass, that at the hinges, its mean moment of inertia."""
        radius_m = np.linalg.norm(self.geometry.platform_hinges_m, axis=1).mean()
        return np.repeat([self.theta[0], self.theta[0] * radius_m, self.theta[4:7].mean()], [1, 3, 6])


def commission(wish: Wish) -> dict:
    """Writes the rig file and returns what print_summary() needs. Raises InputError."""
    native = native_firmware()
    platform = load_platform(native, wish.platform)
    machine = _machine(platform, wish.platform)
    if (wish.reference is None) != (wish.reference_mass_kg is None):
        raise InputError("--reference: found it without --reference-mass or the other way round, expected both or none")
    if wish.report is not None and wish.report.absolute() == wish.out.absolute():
        raise InputError(f"{wish.report}: found the same file for --out and --report, expected two")
    run = run_of(checked_log(native, wish.log, platform, wish.way_in, None if wish.loaded else 0.0), wish.log)
    refuse_still(run)
    if not wish.way_in.is_unchecked:
        refuse_held(run)
        refuse_derived(run, platform.displacement_sigma_m)
        refuse_velocities(run)
    if wish.report is not None:
        import hexload.report.commission_page  # noqa: F401 - a package that is missing is told before the run
    with replaced_when_done(wish.out) as temporary, replaced_or_none(wish.report) as page:
        found, whole = _fit(run, machine, _start(machine))
        _refuse(run, machine, found, wish)
        if not wish.way_in.is_unchecked:
            refuse_late_forces(run, found)
            _refuse_undeclared(run, machine, found)
        found, words = _with_common_gain(native, platform, wish, machine, found, whole)
        delay_s = _velocity_delay(run, machine)
        rig, sigma = _tables(found, machine, delay_s, wish.loaded)
        source = {
            "empty_log": wish.log.name,
            "reference_log": "" if wish.reference is None else wish.reference.name,
            "duration_s": float(run.log.t_s[-1] - run.log.t_s[0]),
            "residual_n": found.residual_n,
        }
        temporary.write_text(
            rig_file.document(rig, sigma, source, _directions(run, found, machine, wish.loaded), platform),
            encoding="utf-8",
        )
        _refuse_unusable(native, rig_file.platform_with_rig(temporary, native, platform), run)
        if page is not None:
            _write_page(page, run, found, machine, words, source, platform)
    part = SLICES["stiffness"]  # N/m along x, y, z, N m/rad about them
    pull = {"pull_home": found.value[part], "pull_home_sigma": np.sqrt(np.diag(found.covariance)[part])}
    return {"rig": rig, "sigma": sigma, "words": words, **{key: each.tolist() for key, each in pull.items()}, **source}


def _refuse_unusable(native, machine, run: Run) -> None:
    """What the firmware would refuse: what holds an empty platform back as a damper does looks like forces that are late."""
    try:
        native.config_bytes(machine, machine.tick_s)
    except ValueError as error:
        raise InputError(
            f"{run.name}: found a rig that no controller takes: {error}; does something else than the legs hold the platform, "
            "a damper, a rope or a hose?"
        ) from None


def _write_page(
    page: Path,
    run: Run,
    found: Found,
    machine: StatedMachine,
    words: dict[str, str],
    source: dict[str, str | float],
    platform,
) -> None:
    from hexload.report.commission_page import render  # draws; commissioning without a page needs none of it

    start = _start(machine, found)
    stated = start.value.copy()
    stated[SLICES["theta"]] = machine.theta
    log = run.log
    before, after = (
        rig_regression.explain(run.seen.record, log, machine.geometry, machine.gravity_m_s2, value, found.law)
        for value in (stated, found.value)
    )
    masses = rig_model.leg_masses(machine.geometry, found.value[SLICES["theta"]])
    per_acceleration = np.sqrt(np.sum(masses**2, axis=1))
    root_period = np.sqrt(2.0 * np.median(np.diff(log.t_s)))

    def noise_n(hz: Array) -> Array:
        accelerations = (2.0 * np.pi * hz[:, None]) ** 2 * platform.displacement_sigma_m * per_acceleration
        return root_period * np.hypot(platform.force_sigma_n, accelerations)

    stated_start = replace(start, value=stated)
    text = render(stated_start, found, words, (before, after), source, machine.platform_file.name, noise_n)
    page.write_text(text, encoding="utf-8")


def _machine(platform, path: Path) -> StatedMachine:
    table = read_toml(path)
    declared = table.get("tolerances", {})
    tolerances = {group: declared.get(key, DEFAULTS[key]) for group, key in TOLERANCES.items()}
    return StatedMachine(
        path,
        Geometry(
            np.array(platform.base_hinges_m), np.array(platform.platform_hinges_m), np.array(platform.home_leg_length_m)
        ),
        np.array(platform.theta),
        platform.gravity_m_s2,
        tolerances,
        declared.get("force_gain_common", common_gain_of(tolerances["gain"])),
        declared.get("platform_mass", DEFAULTS["platform_mass"]),
        platform.force_delay_s,
        platform.velocity_delay_s,
    )


def _start(machine: StatedMachine, found: Found | None = None) -> Start:
    """`found`: what legs weigh tells by how much they may differ, and something may pull the platform home; None: not
    yet."""
    value, sigma = np.zeros(UNKNOWNS), np.full(UNKNOWNS, np.inf)
    sigma[SLICES["stiffness"]] = 0.0 if found is None else np.inf
    for name, tolerance in machine.tolerances.items():
        sigma[SLICES[name]] = tolerance
    value[SLICES["delay"]], sigma[SLICES["delay"]] = machine.force_delay_s, DELAY_SIGMA_S
    leg_mass = np.zeros(3) if found is None else found.value[SLICES["leg_mass"]]
    return _with_unlike_legs(Start(value, sigma), leg_mass)


def _fit(run: Run, machine: StatedMachine, start: Start) -> tuple[Found, Found]:
    """With all groups; without those of a mechanism that does not stand out of the noise; with legs that may differ; with
    what pulls home; then with those that are as declared held there. Their tolerances count on in the covariance. The other
    is the fit in which none is held."""
    whole = _regress(run, machine, start)
    whole, start = _fit_without_noise(run, machine, whole, start, MECHANISMS)
    whole, start = _fit_of_unlike_legs(run, machine, whole, start)
    whole, start = _fit_with_stiffness(run, machine, whole, start)
    fewer, _ = _fit_without_noise(run, machine, whole, start, DECLARED)
    return replace(fewer, covariance=whole.covariance, noise_covariance=whole.noise_covariance), whole


def _fit_of_unlike_legs(run: Run, machine: StatedMachine, found: Found, start: Start) -> tuple[Found, Start]:
    """Legs may differ by a share of the mass that they are found to have."""
    apart = _with_unlike_legs(start, found.value[SLICES["leg_mass"]])
    if np.array_equal(apart.sigma, start.sigma):
        return found, start
    return _regress(run, machine, apart, found), apart


def _fit_with_stiffness(run: Run, machine: StatedMachine, found: Found, start: Start) -> tuple[Found, Start]:
    """Asks for what pulls the platform home, as hoses do, where the residual has a sign of it; nothing pulls if it does not
    stand out of the noise, or pushes: that is another fault. The legs' weight pushes nearly so, and the two may cancel:
    legs are asked for anew."""
    part = SLICES["stiffness"]
    score = _naming_the_run(
        run,
        machine,
        lambda: rig_regression.score(run.seen, machine.geometry, machine.gravity_m_s2, start, found, "stiffness"),
    )
    if score < chi2.ppf(1.0 - DOUBT, GROUPS["stiffness"]):
        return found, start
    sigma = start.sigma.copy()
    sigma[part] = sigma[SLICES["leg_mass"]] = np.inf
    asked = replace(start, sigma=sigma)
    pulled = _regress(run, machine, asked, found)
    pull, of_pull = pulled.value[part], np.sqrt(np.diag(pulled.noise_covariance)[part])
    if not _stands_out(pulled, "stiffness", asked) or (pull < -GRANTED_SIGMAS * of_pull).any():
        return found, start
    return _fit_of_unlike_legs(run, machine, *_fit_without_noise(run, machine, pulled, asked, MECHANISMS))


def _with_unlike_legs(start: Start, leg_mass: Array) -> Start:
    """Cylinder and rod of each leg may be lighter or heavier than those of all, by UNLIKE_SHARE of what these are."""
    inertia, slide, tilting = leg_mass
    rod, cylinder = slide / 2.0, tilting + slide / 2.0  # first moments
    sigma = start.sigma.copy()
    sigma[SLICES["unlike_legs"]] = UNLIKE_SHARE * np.tile(np.abs([inertia, slide, np.hypot(rod, cylinder)]), LEGS)
    return replace(start, sigma=sigma)


def _fit_without_noise(
    run: Run, machine: StatedMachine, found: Found, start: Start, names: tuple[str, ...]
) -> tuple[Found, Start]:
    none = {name for name in names if not _stands_out(found, name, start)}
    if (found.value[SLICES["leg_mass"]][:2] < 0.0).any():
        none |= {"leg_mass"} & set(names)  # no leg has less than none: that is another fault
    if "coulomb" in none:
        none.add("stribeck")  # a part of dry friction alone is none
    fewer, held = _fit_holding(run, machine, found, start, none)
    if "coulomb" in none and _stands_out(
        fewer, "growth", held
    ):  # there is some, and an empty run hardly says of which kind
        return _fit_holding(run, machine, found, start, none - {"coulomb"})
    return fewer, held


def _fit_holding(run: Run, machine: StatedMachine, found: Found, start: Start, none: set[str]) -> tuple[Found, Start]:
    """The fit in which these groups are as the prior says."""
    if not none:
        return found, start
    sigma = start.sigma.copy()
    for name in none:
        sigma[SLICES[name]] = 0.0
    fewer = replace(start, sigma=sigma)
    return _regress(run, machine, fewer, found), fewer


def _regress(run: Run, machine: StatedMachine, start: Start, near: Found | None = None) -> Found:
    return _naming_the_run(
        run,
        machine,
        lambda: rig_regression.fit(run.seen, machine.geometry, machine.gravity_m_s2, start, near),
    )


def _naming_the_run(run: Run, machine: StatedMachine, regression: Callable[[], Result]) -> Result:
    """Of a regression that finds a fault of its run: whose it is."""
    try:
        return regression()
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError(
            f"{run.name} with {machine.platform_file}: found {error}, expected a run of this machine"
        ) from None


def _stands_out(found: Found, name: str, start: Start) -> bool:
    """Whether the group differs from its prior by more than noise alone makes it."""
    part = SLICES[name]
    covariance = found.noise_covariance[part, part]
    if not np.any(covariance):
        return False
    change = found.value[part] - np.where(np.isfinite(start.value[part]), start.value[part], 0.0)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    told = values > TOLD_SHARE * values.max()  # along the others the run says nothing, and the prior stays
    square = np.sum((vectors[:, told].T @ (change / scale)) ** 2 / values[told])
    return bool(square > chi2.ppf(1.0 - DOUBT, np.count_nonzero(told)))


def _refuse(run: Run, machine: StatedMachine, found: Found, wish: Wish) -> None:
    sigma = np.sqrt(np.diag(found.covariance))
    _refuse_residual(run, found)
    _refuse_pushing(run, found)
    theta = SLICES["theta"]
    unsure = sigma[theta] / (UNSURE_SHARE * machine.scale)
    if unsure.max() > 1.0:
        k = int(np.argmax(unsure))
        raise InputError(
            f"{run.name}: found {THETA_NAMES[k]} with a sigma of {sigma[k]:.3g} {unit_of(THETA_NAMES[k])}, expected "
            f"{UNSURE_SHARE * machine.scale[k]:.3g} at most: a longer or livelier motion of all six axes"
        )
    if wish.loaded:
        return
    excess = (np.abs(found.value[theta] - machine.theta) - GRANTED_SIGMAS * sigma[theta]) / machine.scale
    k = int(np.argmax(excess))
    if excess[k] > wish.largest_offset:
        raise InputError(
            f"{run.name}: the platform seems to carry a load: found {THETA_NAMES[k]} = {found.value[k]:.4g} "
            f"{unit_of(THETA_NAMES[k])}, expected {machine.theta[k]:.4g} +- "
            f"{wish.largest_offset * machine.scale[k]:.4g} of the empty platform with its legs "
            f"(--largest-offset allows more, --loaded takes the platform file's){_guessed(machine.platform_file)}"
        )


def _guessed(platform_file: Path) -> str:
    words = guessed_in_words(platform_file, rig_file.MACHINE_KEYS["platform"])
    return f"; {words}: the first suspect" if words else ""


def _refuse_residual(run: Run, found: Found) -> None:
    """Forces that the model does not explain: another machine, or a load that comes or goes."""
    spread_n = float(np.std(run.log.force_n - run.log.force_n.mean(axis=0)))
    left_n = float(np.sqrt(np.mean(found.residuals_n**2)))
    if left_n > UNEXPLAINED_SHARE * spread_n:
        worst = found.t_s[int(np.argmax(np.abs(found.residuals_n).max(axis=1)))]
        leg = int(np.argmax(np.mean(found.residuals_n**2, axis=0)))
        raise InputError(
            f"{run.name}: found {left_n:.3g} N (rms) of the legs' {spread_n:.3g} N that no platform on these legs "
            f"takes, most in leg {leg + 1}, largest at {worst:.3f} s; expected {UNEXPLAINED_SHARE * spread_n:.3g} N at most: "
            "a load that comes or goes, something that touches the platform, or legs that are not those of the platform file"
        )


def _refuse_pushing(run: Run, found: Found) -> None:
    """Friction that drives, of one leg or of all together, is motion or force of the wrong sign. Before how sure the load
    is: such a run leaves that open, too."""
    part = SLICES["coulomb"]
    sums = np.vstack([np.eye(LEGS), np.full(LEGS, 1.0 / LEGS)])  # each leg, and their mean
    rubbing = sums @ found.value[part]
    most = rubbing + GRANTED_SIGMAS * np.sqrt(np.einsum("ij,jk,ik->i", sums, found.covariance[part, part], sums))
    k = int(np.argmin(most))
    if most[k] < 0.0:
        raise InputError(
            f"{run.name}: found friction of {rubbing[k]:.3g} N that pushes {f'leg {k + 1}' if k < LEGS else 'the legs'}, "
            "expected one that brakes: the sign of forces or displacements is not that of the platform file"
        )


def _refuse_undeclared(run: Run, machine: StatedMachine, found: Found) -> None:
    """Where what the run tells of a group is beyond its tolerance, what it does not tell may be, too, and no sigma has
    that. Of normal errors of the declared size the estimate differs from what is stated by less than they do."""
    for name, (words, unit) in HELD_UP.items():
        tolerance, off = machine.tolerances[name], found.value[SLICES[name]]
        limit = np.sqrt(chi2.ppf(1.0 - DOUBT, len(off)) / len(off))
        rms = float(np.sqrt(np.mean(off**2)))
        if rms > limit * tolerance:
            raise InputError(
                f"{run.name} with {machine.platform_file}: found {words} {rms:.2g}{unit} (rms) off what is stated, expected "
                f"{limit * tolerance:.2g}{unit} at most by [tolerances] {TOLERANCES[name]} = {tolerance:g}: check the "
                "hinges of the platform file, the scales of forces and displacements, what pushes the platform beside its legs, "
                "as a rope does, and heavy rods between force sensor and hinge (no model has these); "
                "or state the tolerance that they have (--unchecked: go on as it is)"
            )


def _identifiability(found: Found, start: Start) -> dict[str, str]:
    """What the run says of each group."""
    sigma = np.sqrt(np.diag(found.covariance))
    words = {}
    for name, part in SLICES.items():
        prior = start.sigma[part]
        if not np.any(found.covariance[part, part]):
            words[name] = NONE
        elif np.isfinite(prior).all() and (sigma[part] > KEPT_SHARE * prior).all():
            words[name] = AS_DECLARED
        elif np.isfinite(prior).all() and (sigma[part] > KEPT_SHARE * prior).any():
            words[name] = f"found in part, the rest {AS_DECLARED}"
        else:
            words[name] = "found" if _stands_out(found, name, start) else "as declared"
        if name in UNTOLD and words[name].startswith("found"):
            words[name] += "; no controller takes it off, sigmas hold it on motions about home"
    return words


def _with_common_gain(
    native: ModuleType, platform, wish: Wish, machine: StatedMachine, found: Found, whole: Found
) -> tuple[Found, dict[str, str]]:
    """`found` with what is open of the gain that all force sensors have in common, or as the reference run tells it, and
    what is said of each group."""
    off = None if wish.loaded else _undeclared_factor(machine, found)
    machine = machine if off is None else replace(machine, common_gain=abs(off))
    covariance = with_common_gain(found.covariance, machine.common_gain)
    if wish.reference is not None:
        loaded = checked_log(native, wish.reference, platform, wish.way_in, wish.reference_mass_kg)
        whole = replace(whole, covariance=covariance)
        found = _with_reference(whole, machine, run_of(loaded, wish.reference), wish.reference_mass_kg)
        return found, _identifiability(found, _start(machine, found))
    found = replace(found, covariance=covariance)
    words = _identifiability(found, _start(machine, found))
    if off is not None:
        words["gain"] += (
            f"; all masses are {100.0 * off:+.1f} % off what is stated, by the platform or by all force sensors alike: "
            "--reference tells which, until then sigmas hold both"
        )
    return found, words


def _undeclared_factor(machine: StatedMachine, found: Found) -> float | None:
    """Of all masses: the platform's or the force sensors'."""
    theta = SLICES["theta"]
    factor = common_factor(machine.theta, found.value[theta], found.covariance[theta, theta])
    is_declared = factor is None or abs(factor) < max(GRANTED_SIGMAS * machine.common_gain, machine.platform_mass)
    return None if is_declared else factor


def _with_reference(found: Found, machine: StatedMachine, run: Run, mass_kg: float) -> Found:
    """What an empty run leaves to the declared tolerances: the common gain, as a known mass weighs 1 + g times itself, and
    friction's growth, as legs that carry more rub more. What the empty run says of g and all masses
    is a curve: the second fit takes its tangent at the g of the first."""
    _refuse_mass(found, machine, run, mass_kg)

    def fit(empty: Found) -> Found:
        return rig_regression.fit_loaded(run.seen, machine.geometry, machine.gravity_m_s2, empty, mass_kg)

    def fit_twice() -> Found:
        before, after = (1.0 + each.value[SLICES["gain"]].mean() for each in (found, fit(found)))
        return fit(tangent_at(after / before - 1.0, found))

    return _naming_the_run(run, machine, fit_twice)


def _refuse_mass(found: Found, machine: StatedMachine, run: Run, mass_kg: float) -> None:
    """Another mass than that, or one that comes or goes."""
    sigma = np.zeros(UNKNOWNS)
    sigma[SLICES["theta"]] = np.inf
    loaded = _regress(
        run, machine, Start(found.value, sigma), replace(found, hinge_rows=(None, None))
    )  # all else is held
    _refuse_residual(run, loaded)
    weighed_kg = loaded.value[0] - found.value[0]
    tolerance = max(machine.tolerances["gain"], machine.common_gain)
    of_ratio = np.sqrt(loaded.covariance[0, 0]) / mass_kg
    if abs(weighed_kg / mass_kg - 1.0) > REFERENCE_SIGMAS * np.hypot(tolerance, of_ratio):
        raise InputError(
            f"{run.name}: found a load of {weighed_kg:.4g} kg, expected --reference-mass {mass_kg:g} kg within "
            f"{REFERENCE_SIGMAS:g} times the force gains' tolerance of {tolerance:g}"
        )


def _velocity_delay(run: Run, machine: StatedMachine) -> float:
    """v shown = d' - delay d'' of the displacements, by least squares over all legs; what is not three sigmas off the
    platform file's stays."""
    if not run.log.has_velocity:
        return 0.0
    _, speed, rate, shown = slow_motion(run)
    late = speed - shown
    delay_s = float(np.sum(rate * late) / np.sum(rate**2))
    left = late - delay_s * rate
    of_delay = np.sqrt(np.mean(left**2) / np.sum(rate**2) / (2.0 * VELOCITY_HZ * run.dt_s))
    is_stated = abs(delay_s - machine.velocity_delay_s) < max(GRANTED_SIGMAS * of_delay, LEAST_DELAY_TICKS * run.dt_s)
    return machine.velocity_delay_s if is_stated else max(0.0, delay_s)


def _tables(found: Found, machine: StatedMachine, velocity_delay_s: float, loaded: bool) -> tuple[dict, dict]:
    """[rig] and [sigma]."""
    deviation = np.sqrt(np.diag(found.covariance))

    def group(name: str) -> tuple[Array, Array]:
        return found.value[SLICES[name]], deviation[SLICES[name]]

    theta, of_theta = (machine.theta, np.zeros(10)) if loaded else group("theta")
    hinges, of_hinges = group("hinges")
    legs, of_legs = group("leg_mass")
    coulomb = np.maximum(found.value[SLICES["coulomb"]], 0.0)
    shifts, of_shifts = hinges.reshape(2, LEGS, 3), of_hinges.reshape(2, LEGS, 3)
    gravity = rig_model.gravity_vector(machine.gravity_m_s2, found.value[SLICES["tilt"]])
    pairs = {
        "base_hinges_m": (machine.geometry.base_hinges_m + shifts[0], of_shifts[0]),
        "platform_hinges_m": (machine.geometry.platform_hinges_m + shifts[1], of_shifts[1]),
        "mass_kg": (theta[0], of_theta[0]),
        "com_m": (theta[1:4] / theta[0], of_theta[1:4] / theta[0]),
        "inertia_kg_m2": (theta[4:], of_theta[4:]),
        "gravity_m_s2": (gravity, machine.gravity_m_s2 * np.append(group("tilt")[1], 0.0)),
        "leg_inertia_kg_m2": (legs[0], of_legs[0]),
        "leg_slide_kg_m": (legs[1], of_legs[1]),
        "leg_tilt_kg_m": (legs[2], of_legs[2]),
        "coulomb_n": (coulomb, group("coulomb")[1]),
        "stribeck_n": (np.maximum(group("stribeck")[0], -coulomb), group("stribeck")[1]),
        "growth_n_n": (np.maximum(group("growth")[0], 0.0), group("growth")[1]),
        "viscous_n_s_m": (np.maximum(group("viscous")[0], 0.0), group("viscous")[1]),
        "force_offset_n": group("offset"),
        "force_gain": group("gain"),
        "force_delay_s": (max(0.0, group("delay")[0][0]), group("delay")[1][0]),
    }
    rig = {key: value for key, (value, _) in pairs.items()} | {
        "stribeck_speed_m_s": found.law.stribeck_speed_m_s,
        "reversal_speed_m_s": found.law.reversal_speed_m_s,
        "presliding_m": found.law.presliding_m,
        "velocity_delay_s": velocity_delay_s,
    }
    return rig, {key: np.asarray(sigma).tolist() for key, (_, sigma) in pairs.items()}


def _directions(run: Run, found: Found, machine: StatedMachine, loaded: bool) -> list[dict]:
    """[[direction]]: for loads of half and three times the platform's mass, at its hinges' radius above and beside."""
    geometry = machine.geometry
    radius_m = np.linalg.norm(geometry.platform_hinges_m, axis=1).mean()
    loads = tuple(_nominal_load(share * machine.theta[0], radius_m) for share in LOAD_SHARES)
    ways = rig_regression.open_directions(run.seen, geometry, machine.gravity_m_s2, found, loads, machine.scale)
    return [_direction(way, machine, loaded) for way in ways]


def _nominal_load(mass_kg: float, radius_m: float) -> Array:
    """A cube of half the radius, beside the middle and above it."""
    com = np.array([0.25, 0.25, 0.5]) * radius_m
    own = mass_kg * radius_m**2 / 24.0
    tensor = own * np.eye(3) + mass_kg * (com @ com * np.eye(3) - np.outer(com, com))
    return np.concatenate([[mass_kg], mass_kg * com, tensor[TENSOR]])


def _direction(way: Array, machine: StatedMachine, loaded: bool) -> dict:
    hinges = way[SLICES["hinges"]].reshape(2, LEGS, 3)
    return {
        "force_offset_n": way[SLICES["offset"]].tolist(),
        "force_gain": way[SLICES["gain"]].tolist(),
        "coulomb_n": way[SLICES["coulomb"]].tolist(),
        "stribeck_n": way[SLICES["stribeck"]].tolist(),
        "growth_n_n": way[SLICES["growth"]].tolist(),
        "viscous_n_s_m": way[SLICES["viscous"]].tolist(),
        "gravity_m_s2": (machine.gravity_m_s2 * way[SLICES["tilt"]]).tolist(),
        "platform": (np.zeros(10) if loaded else way[SLICES["theta"]]).tolist(),
        "base_hinges_m": hinges[0].tolist(),
        "platform_hinges_m": hinges[1].tolist(),
    }
