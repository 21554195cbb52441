"""One case: a clean run, one fault in it, one estimator's answer, its score. Runs in the processes of the scheduler."""

import functools
import json
import os
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hexload import project
from hexload.campaign import cases, one_case
from hexload.campaign.store import plain
from hexload.diagnosis import wiring
from hexload.errors import InputError
from hexload.estimation import (
    commission,
    firmware_run,
    rig_file,
)
from hexload.faults import (
    naming,
    recording,
    score,
    words,
)
from hexload.faults.kinds import KINDS, NONE
from hexload.faults.recording import LoadStep, Recording
from hexload.faults.score import Reported, Score, Truth
from hexload.io.atomic_file import replaced_when_done
from hexload.io.log_file import read_log
from hexload.io.toml_document import Table
from hexload.platform import Platform
from hexload.theory import bound

CLASS_OF = {"multisine": "multisine", "paper": "paper", "work": "work", "pick_up": "multisine_pick_up"}
MOTIONS = tuple(CLASS_OF)


@dataclass(frozen=True)
class FaultCase:
    kind: str
    size: float
    motion: str
    estimator: str
    seed: int
    duration_s: float
    is_commissioned: bool = False
    names_cause: bool = False
    has_own_machine: bool = False  # drawn with the seed; else the paper's
    has_velocity: bool = True  # sensors

    @property
    def name(self) -> str:
        rig = "-rig" if self.is_commissioned else ""
        named = "-named" if self.names_cause else ""
        return f"{self.kind}-{self.size:g}-{self.motion}-{self.estimator}-{self.seed}{rig}{named}{self.machine_tag}"

    @property
    def machine_tag(self) -> str:
        return _machine_tag(self.has_own_machine) + ("" if self.has_velocity else "-no-velocity")

    def as_sensed(self, shown: Recording) -> Recording:
        return shown if self.has_velocity else recording.without_velocity(shown)


def is_possible(case: FaultCase) -> bool:
    """The paper's filter is given one load's mass, so that a pick-up is none of its motions; sensors that are not there
    have no fault."""
    kind = KINDS[case.kind]
    is_of_both = case.estimator in kind.estimators and (case.has_velocity or not kind.is_of_velocity)
    return is_of_both and not (case.estimator == "paper" and case.motion == "pick_up")


def run_fault(case: FaultCase, logs: Path) -> dict:
    """What is stored of a case. `logs`: the folder of clean runs, which are made when they are missing. Raises ToolFailed."""
    base, faulty, rig = _of_case(case, logs)
    scored = plain(score_of(faulty, case.estimator, rig))
    named = told = None
    if case.names_cause:
        named = asdict(naming.name_cause(faulty, base, case.kind))
        told = asdict(words.told_by_replay(faulty, case.estimator))
    return {"code": project.code_version(), "case": asdict(case), **scored, "named": named, "told": told}


def score_of(faulty: Recording, estimator: str, rig: Callable[[], Path] | None = None) -> Score:
    """`rig`: makes the rig file that the estimator is given beside the platform, or refuses with InputError."""
    try:
        _, answer = _answer(faulty, estimator, rig)
    except (InputError, ValueError) as refused:
        return score.refusal(str(refused))
    return score.score(reported_by(answer, faulty.log.t_s), truth_of(faulty, estimator), twin_of(faulty, estimator))


def repeat(case: FaultCase, logs: Path) -> tuple[Any, dict, tuple[LoadStep, ...]]:
    """A case that was answered, once more, to be looked at: its platform, what the estimator says with the true motion and forces
    as its "log", as replay_log returns it, and the true loads. Raises ToolFailed, InputError, ValueError."""
    _, faulty, rig = _of_case(case, logs)
    machine, answer = _answer(faulty, case.estimator, rig)
    return machine, answer | {"log": faulty.clean, "rows": len(faulty.log.t_s)}, faulty.loads


def _of_case(case: FaultCase, logs: Path) -> tuple[Recording, Recording, Callable[[], Path] | None]:
    """The clean recording, the faulty one, and what makes the rig file, if it has one."""
    base = clean_recording(case.motion, case.seed, case.duration_s, case.estimator, str(logs), case.has_own_machine)
    faulty = KINDS[case.kind].apply(base, case.size, _random(case))
    rig = (lambda: _rig_file(case, logs)) if case.is_commissioned else None
    return case.as_sensed(base), case.as_sensed(faulty), rig


def _answer(faulty: Recording, estimator: str, rig: Callable[[], Path] | None) -> tuple[Any, dict]:
    """The machine as the estimator knows it, and what hexload_native.replay returns. Raises InputError, ValueError."""
    native = project.native_module()
    machine = Platform.of(faulty.platform).with_estimator(estimator).native()
    if rig is not None:
        machine = rig_file.platform_with_rig(rig(), native, machine)
    return machine, firmware_run.run_firmware(native, machine, faulty.log, Path(os.devnull))


def reported_by(answer: dict, sample_t_s: np.ndarray) -> Reported:
    """Of what hexload_native.replay returns."""
    count = len(answer["parameter_verdict"])
    health = answer["health"].astype(np.int64)
    return Reported(
        names=tuple(answer["names"][:count]),
        value=answer["value"][-1, :count],
        sigma=answer["sigma"][-1, :count],
        parameter_verdict=tuple(answer["parameter_verdict"]),
        t_s=answer["t"],
        verdict=answer["verdict"],
        bits={name: (health >> bit & 1).astype(bool) for bit, name in enumerate(answer["health_counts"])},
        sample_t_s=sample_t_s,
        causes=_causes_named(answer, float(sample_t_s[-1])),
    )


def _causes_named(answer: dict, end_s: float) -> tuple[tuple[float, str], ...]:
    """Where the firmware names any: as they came, and the one that stands at the end."""
    standing = answer.get("input_fault", "")
    return (*answer.get("input_faults", ()), *([(end_s, standing)] if standing else []))


def truth_of(faulty: Recording, estimator: str) -> Truth:
    theta = faulty.theta
    if estimator != "paper":
        return Truth(theta, score.load_scale(theta, faulty.own_theta), faulty.changes_s)
    mass, (hx, hy, hz) = theta[0], theta[1:4]
    steiner = np.array([hy**2 + hz**2, hx**2 + hz**2, hx**2 + hy**2]) / mass
    value = np.array([hz / mass, *(theta[4:7] - steiner)])
    scale = np.maximum(np.abs(value), bound.paper_prior_sigma("safe", mass))
    return Truth(value, scale, (*faulty.changes_s, *_misstated_s(faulty)))


def _misstated_s(faulty: Recording) -> tuple[tuple[float, float], ...]:
    """From when to when the load has not the stated mass: then it is true that the legs do not carry it."""
    stated_kg = faulty.platform["load"]["known_mass_kg"]
    ends_s = [*(load.at_s for load in faulty.loads[1:]), float(faulty.t_s[-1])]
    return tuple(
        (load.at_s, end_s)
        for load, end_s in zip(faulty.loads, ends_s)
        if abs(load.theta[0] - stated_kg) > score.WRONG_SHARE * stated_kg
    )


def twin_of(faulty: Recording, estimator: str) -> Truth | None:
    """Of the load whose log this is as well: legs counted so that the machine, as it is stated, is congruent to itself."""
    geometry = naming.machine_of(Platform.of(faulty.platform).native()).geometry
    if faulty.order not in wiring.indistinguishable(geometry):
        return None
    turned = wiring.turned_body(wiring.turned(geometry, faulty.order), faulty.theta + faulty.own_theta)
    load = replace(faulty.loads[-1], theta=turned - faulty.own_theta)
    return truth_of(replace(faulty, loads=(*faulty.loads[:-1], load)), estimator)


def clean_recording(
    motion: str, seed: int, duration_s: float, estimator: str, logs: str, has_own_machine: bool = False
) -> Recording:
    """With the platform as it is stated to the estimator: no tolerances, so that the default ones count. The paper's filter
    has the paper's kind of load."""
    base = _kept_recording(motion, seed, duration_s, estimator == "paper", logs, has_own_machine)
    more: Table = {"estimator": {"friction_speed_m_s": cases.FRICTION_SPEED_M_S}}
    if estimator == "paper":
        more = {"load": {"known_mass_kg": float(base.theta[0])}}
    return replace(base, platform=_stated(base, more))


def _stated(base: Recording, more: Table) -> Table:
    return {name: table for name, table in base.platform.items() if name != "tolerances"} | more


@functools.lru_cache(maxsize=4)
def _kept_recording(
    motion: str, seed: int, duration_s: float, on_axis: bool, logs: str, has_own_machine: bool
) -> Recording:
    """All kinds and sizes share the run of a motion and seed."""
    case = cases.Case(CLASS_OF[motion], seed, duration_s)
    setup = _drawn(case, replace(cases.CLASSES[case.class_name], on_axis=on_axis), has_own_machine)
    load = "on_axis" if on_axis else "any_load"
    return _simulated(
        setup,
        Path(logs) / f"{case.name}-{load}{_machine_tag(has_own_machine)}-{duration_s:g}-{project.code_version()}.npz",
    )


@functools.lru_cache(maxsize=2)
def _empty_recording(seed: int, logs: str, has_own_machine: bool) -> Recording:
    """The run by which a machine is commissioned."""
    setup = _drawn(cases.Case("multisine", seed, cases.COMMISSIONING_S), None, has_own_machine)
    scenario = cases.empty_run(np.random.default_rng(seed), setup.scenario, cases.COMMISSIONING_S)
    path = Path(logs) / f"empty-{seed}{_machine_tag(has_own_machine)}-{project.code_version()}.npz"
    base = _simulated(replace(setup, scenario=scenario), path)
    return replace(base, platform=_stated(base, {}))


def _drawn(case: cases.Case, kind: cases.CaseClass | None, has_own_machine: bool) -> cases.Setup:
    """All motions of a seed have the same machine."""
    setup = cases.draw(case, kind)
    if not has_own_machine:
        return setup
    return replace(setup, platform=cases.with_own_machine(setup.platform, np.random.default_rng(case.seed)))


def _machine_tag(has_own_machine: bool) -> str:
    return "-own" if has_own_machine else ""


def _simulated(setup: cases.Setup, path: Path) -> Recording:
    """The recording that is kept at the path, made when it is missing."""
    if not path.is_file():
        with tempfile.TemporaryDirectory(prefix="hexload-faults-") as name:
            run = one_case.simulate_setup(setup, path.stem, Path(name))
            loads = json.loads((run / "meta.json").read_text())["loads"]
            with replaced_when_done(path) as temporary:
                recording.write_recording(temporary, run, loads, read_log(run / "log.csv"))
    return recording.read_recording(path, setup.platform)


def _rig_file(case: FaultCase, logs: Path) -> Path:
    """Of hexload commission, on a run of the empty machine with the same fault, if it is one of the machine. All motions
    and estimators share it, or the refusal. Raises InputError."""
    fault = case if KINDS[case.kind].is_of_machine else replace(case, kind=NONE, size=0.0)
    machine = f"{fault.seed}{case.machine_tag}"
    path = logs / f"{fault.kind}-{fault.size:g}-{machine}-{project.code_version()}.rig.toml"
    refused = path.with_suffix(".refused")
    if not path.is_file() and not refused.is_file():
        clean = _empty_recording(case.seed, str(logs), case.has_own_machine)
        _commission(case.as_sensed(KINDS[fault.kind].apply(clean, fault.size, _random(fault))), path, refused)
    if refused.is_file():
        raise InputError(f"commissioning: {refused.read_text()}")
    return path


def _commission(empty: Recording, rig: Path, refused: Path) -> None:
    """Writes one of the two files."""
    with tempfile.TemporaryDirectory(prefix="hexload-faults-") as name:
        log, platform = recording.write_files(empty, Path(name), "empty.csv")
        try:
            commission.commission(commission.Wish(log, platform, rig))
        except InputError as error:
            with replaced_when_done(refused) as temporary:
                temporary.write_text(str(error).replace(f"{name}/", ""))


def _random(case: FaultCase) -> np.random.Generator:
    """Sizes and estimators share leg, sign and moment; the motions too, when one machine runs them all."""
    motion = "" if case.is_commissioned else case.motion
    return np.random.default_rng([zlib.crc32(f"{case.kind} {motion}".encode()), case.seed])
