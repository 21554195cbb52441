"""`hexload tare`: what the empty platform's own parameters are beyond those of its platform file.

The momentum estimator runs over a log of the empty platform. Modelling errors act on it as a constant offset
of theta = [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz]. That offset is no body: its mass may well be negative. So half
of the platform counts as the unknown load, which with any offset that a tare may have is one.

Legs with mass are such an offset in part only: what they weigh and how they resist differs with pose and motion. Where
a log tells of them, that is found first and taken off its forces, and off those of every log that is replayed with the
tare (leg_mass.py).
"""

from __future__ import annotations

import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload.errors import InputError
from hexload.estimation.arrays import leg_log
from hexload.estimation.firmware_run import load_platform, native_firmware, run_firmware
from hexload.estimation.input_check import WayIn, checked_log, refuse_implausible
from hexload.estimation.leg_mass import find_leg_mass, without_leg_mass
from hexload.estimation.load_summary import load_changes_s
from hexload.estimation.rig_file import MACHINE_KEYS, machine_of
from hexload.io.atomic_file import replaced_when_done
from hexload.io.log_file import LegLog
from hexload.io.toml_document import Table, guessed_in_words, read_toml, to_toml
from hexload.platform import Platform as MachineDescription
from hexload.theory.bound import LEGS, THETA_NAMES, Platform, read_platform, unit_of
from hexload.theory.tolerances import GRANTED_SIGMAS

Array = NDArray[np.float64]

OWN_LOAD_SHARE = 0.5
CONVERGED_SHARE = 0.05  # of the scale: the estimator's limit for its verdict "converged"
SAME = {"rtol": 1e-9, "atol": 1e-12}  # numbers of a file that was written and read again
KEYS = ("theta", "sigma", "duration_s", "verdict")
LEG_KEYS = ("inertia_kg_m2", "slide_kg_m", "tilt_kg_m")  # B, C and D of leg_mass.py


def make_tare(log: Path, platform_file: Path, out: Path, largest_offset: float, way_in: WayIn | None = None) -> dict:
    """Writes the tare file and returns what stands in its table [tare], and as "legs" what in the table of that name.

    `largest_offset`: share of the platform's own parameters above which an offset is taken for a load. `way_in`: how the
    log is read and checked. Raises InputError.
    """
    native = native_firmware()
    platform = load_platform(native, platform_file)
    samples = checked_log(native, log, platform, way_in or WayIn(), 0.0)
    with replaced_when_done(out) as temporary:
        names = (str(log), f"{log} with {platform_file}")
        try:
            found = _find(native, platform, read_platform(platform_file), samples, largest_offset, names)
        except InputError as error:
            guessed = guessed_in_words(platform_file, MACHINE_KEYS["platform"])
            raise InputError(f"{error}; {guessed}: the first suspect") if guessed else error from None
        table = {
            "theta": found.theta.tolist(),
            "sigma": found.sigma.tolist(),
            "duration_s": float(samples.t_s[-1] - samples.t_s[0]),
            "verdict": found.verdict,
        }
        of_legs = {} if found.leg_mass is None else dict(zip(LEG_KEYS, found.leg_mass.tolist(), strict=True))
        temporary.write_text(_document(log, platform_file, table, of_legs, machine_of(platform)), encoding="utf-8")
    return table | {"legs": of_legs}


@dataclass(frozen=True)
class _TareResult:
    theta: Array  # (10,) empty platform less platform file
    sigma: Array  # (10,)
    leg_mass: Array | None  # (3,), of LEG_KEYS
    verdict: str


def _find(
    native: ModuleType, platform, machine: Platform, samples: LegLog, largest_offset: float, names: tuple[str, str]
) -> _TareResult:
    """`names`: of the log, and of the log with its platform, in errors."""
    _refuse_without_velocity(names[0], samples)
    run = partial(_run, native, platform, names[1])
    legs = find_leg_mass(samples, machine, largest_offset * platform.mass_kg / LEGS)
    result = run(samples if legs is None else without_leg_mass(samples, machine, legs.value))
    if legs is not None and load_changes_s(result):
        legs, result = None, run(samples)  # what was found are no legs, and would shift the time of the change
    theta = result["value"][-1] - OWN_LOAD_SHARE * platform.theta
    sigma = np.sqrt(result["sigma"][-1] ** 2 + (0.0 if legs is None else legs.offset_variance))
    scale = _scales(platform)
    _refuse_changes(names[0], result)
    _refuse_doubt(names[0], result, scale)
    _refuse_load(names[0], theta, sigma, largest_offset * scale)
    return _TareResult(theta, sigma, None if legs is None else legs.value, result["verdict"][-1])


def tare(
    t: ArrayLike,
    dl: ArrayLike,
    vl: ArrayLike,
    f: ArrayLike,
    platform: MachineDescription | Mapping[str, Any] | Path | str,
    *,
    largest_offset: float = 0.25,
    unchecked: bool = False,
) -> MachineTare:
    """What the empty platform's parameters are beyond those of its platform file, from a log of it in motion.

    t, dl, vl, f    (n,) s and (n, 6) m, m/s, N, as of hexload.replay()
    largest_offset  0 to 0.45: more than this share of the platform's own parameters is taken for a load
    unchecked       go on where units, signs or order contradict each other

    Raises InputError: an estimate that has not converged or is inconsistent, a load that changes, an offset that is
    rather a load. Needs scipy: pip install "hexload[excite]". Source: the first lines of hexload.estimation.tare, and
    of hexload.estimation.leg_mass for legs with mass.
    """
    described = MachineDescription.of(platform)
    native, machine = native_firmware(), described.theory()
    names = ("log", f"log with {described.source}")
    samples, known = leg_log(t, dl, vl, f).whole("arrays"), described.native()
    if not unchecked:
        refuse_implausible(native, samples, known, 0.0)
    found = _find(native, known, machine, samples, largest_offset, names)
    return MachineTare(native.Tare(found.theta, found.sigma), found.leg_mass, machine)


def _run(native: ModuleType, platform, files: str, samples: LegLog) -> dict:
    lightened = native.with_own_load(platform, OWN_LOAD_SHARE)
    with tempfile.TemporaryDirectory() as folder:
        try:
            return run_firmware(native, lightened, samples, Path(folder) / "estimates.csv", "momentum")
        except ValueError as error:
            raise InputError(f"{files}: {error}") from None


def _scales(platform) -> Array:
    """What an offset is compared with: the platform's mass, that mass at the hinges, its mean moment of inertia."""
    radius_m = np.linalg.norm(platform.platform_hinges_m, axis=1).mean()
    moment_kg_m2 = np.trace(platform.inertia_kg_m2) / 3.0
    return np.repeat([platform.mass_kg, platform.mass_kg * radius_m, moment_kg_m2], [1, 3, 6])


def _refuse_without_velocity(name: str, log: LegLog) -> None:
    if not log.has_velocity:
        raise InputError(
            f"{name}: found no leg velocities, by which the legs' mass is taken off, expected them; without velocity "
            "sensors `hexload commission` does what a tare does"
        )


def _refuse_changes(log: str, result: dict) -> None:
    if changes_s := load_changes_s(result):
        raise InputError(
            f"{log}: found another load from {changes_s[0]:.3f} s on, expected the empty platform throughout; "
            "if it was empty, legs rub, force sensors are biased, or the mass of one leg is not that of the others"
        )


def _refuse_doubt(log: str, result: dict, scale: Array) -> None:
    verdicts = np.array(result["verdict"])
    doubtful = np.flatnonzero(np.isin(verdicts[len(verdicts) // 2 :], ("misfit", "inconsistent")))
    if doubtful.size:
        at_s = result["t"][len(verdicts) // 2 + doubtful[0]]
        raise InputError(
            f"{log}: found verdict {verdicts[len(verdicts) // 2 + doubtful[0]]} at {at_s:.3f} s, expected none in the log's second half: "
            "friction, sensor sigmas or geometry are not as the platform file says"
        )
    if verdicts[-1] != "converged":
        unsure = [
            f"{name} +- {sigma:.3g}"
            for name, sigma, limit in zip(THETA_NAMES, result["sigma"][-1], CONVERGED_SHARE * scale)
            if sigma > OWN_LOAD_SHARE * limit
        ]
        raise InputError(
            f"{log}: found verdict {verdicts[-1]} at the end ({', '.join(unsure) or 'SI units'}), expected converged: "
            "a longer or livelier motion of all six axes"
        )


def _refuse_load(log: str, theta: Array, sigma: Array, largest: Array) -> None:
    excess = (np.abs(theta) - GRANTED_SIGMAS * sigma) / largest
    k = int(np.argmax(excess))
    if excess[k] > 1.0:
        raise InputError(
            f"{log}: the platform seems to carry a load: found {THETA_NAMES[k]} = {theta[k]:.4g} "
            f"{unit_of(THETA_NAMES[k])} beyond the platform file's, expected {largest[k]:.4g} at most "
            "(--largest-offset allows more)"
        )


def _document(log: Path, platform_file: Path, table: Table, of_legs: Table, machine: Table) -> str:
    heading = [
        f"# Made by hexload tare from {log.name} and {platform_file.name}, in SI units.",
        "# tare: empty platform less platform file, about O_A; sigma: one standard deviation;",
        f"# theta = [{', '.join(THETA_NAMES)}]",
        *(["# legs: of each leg, beside theta: to be taken off the forces."] if of_legs else []),
        "# The other tables: the machine that it belongs to.",
    ]
    tables = {"tare": table} | ({"legs": of_legs} if of_legs else {}) | machine
    return "\n".join([*heading, to_toml(tables)])


@dataclass(frozen=True)
class MachineTare:
    """A tare, for the machine of a platform file."""

    offset: Any  # hexload_native.Tare
    leg_mass: Array | None  # (3,), of LEG_KEYS; None: the legs have none
    machine: Platform  # without its load

    @property
    def theta(self) -> Array:
        """(10,), in the order of THETA_NAMES, SI."""
        return self.offset.theta

    @property
    def sigma(self) -> Array:
        """(10,), one standard deviation of each."""
        return self.offset.sigma

    def taken_off(self, log: LegLog) -> LegLog:
        """The log without what the mass of the legs takes beside the offset."""
        if self.leg_mass is None:
            return log
        _refuse_without_velocity("log", log)
        return without_leg_mass(log, self.machine, self.leg_mass)


def tare_for(path: Path, native: ModuleType, platform, platform_file: Path) -> MachineTare:
    """The tare of a file. Raises InputError: no tare file, or that of another machine."""
    document = _read(path)
    table = document["tare"]
    theta, sigma = (_numbers(path, f"tare.{key}", table[key], len(THETA_NAMES)) for key in ("theta", "sigma"))
    of_legs = document.get("legs")
    leg_mass = None if of_legs is None else _numbers(path, "legs", [of_legs[key] for key in LEG_KEYS], len(LEG_KEYS))
    if (sigma < 0).any():
        raise InputError(f"{path}: tare.sigma: found {sigma.min():g}, expected no negative number")
    for section, values in machine_of(platform).items():
        for key, value in values.items():
            if not _is_same(document[section][key], value):
                raise InputError(
                    f"{path}: {section}.{key}: found {document[section][key]}, expected {value} as in {platform_file}: "
                    "this is another machine's tare"
                )
    return MachineTare(native.Tare(theta, sigma), leg_mass, read_platform(platform_file))


def _read(path: Path) -> dict:
    try:
        document = read_toml(path)
    except FileNotFoundError:
        raise InputError(f"{path}: found no such file, expected a tare file written by `hexload tare`") from None
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: found no valid TOML ({error}), expected a tare file") from None
    expected = {"tare": KEYS, **MACHINE_KEYS} | ({"legs": LEG_KEYS} if "legs" in document else {})
    for section, keys in expected.items():
        if not isinstance(document.get(section), dict):
            raise InputError(f"{path}: {section}: found nothing, expected this table of a tare file")
        for key in keys:
            if key not in document[section]:
                raise InputError(f"{path}: {section}.{key}: found nothing, expected this key of a tare file")
    known = {*expected, *(f"{section}.{key}" for section, keys in expected.items() for key in keys)}
    found = {*document, *(f"{section}.{key}" for section in expected for key in document[section])}
    if found - known:
        raise InputError(
            f"{path}: {min(found - known)}: found an unknown key, expected those that `hexload tare` writes"
        )
    return document


def _numbers(path: Path, key: str, value: ArrayLike, count: int) -> Array:
    try:
        numbers = np.asarray(value, float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise InputError(f"{path}: {key}: found {value}, expected {count} finite numbers")
    return numbers


def _is_same(found: object, expected: ArrayLike) -> bool:
    try:
        numbers = np.asarray(found, float)
    except (TypeError, ValueError):
        return False
    return numbers.shape == np.shape(expected) and np.allclose(numbers, expected, **SAME)
