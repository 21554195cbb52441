"""One case: simulate, run the firmware's estimators and the baselines on its log, compare with truth and bound.

Runs in the processes of the scheduler, on this machine or another.
"""

import json
import shutil
import subprocess
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.campaign import baselines, cases
from hexload.campaign.baselines import Answer
from hexload.campaign.cases import MOTION_FILE, TARED, Case, Setup
from hexload.errors import InputError, ToolFailed
from hexload.estimation import (
    commission,
    rig_file,
    tare,
)
from hexload.estimation.load_summary import load_changes_s
from hexload.io.log_file import LegLog, read_log
from hexload.io.toml_document import to_toml
from hexload.theory import bound
from hexload.theory.bound import scale_of

Array = NDArray[np.float64]

WITHIN = {"within_5": 0.05, "within_1": 0.01}
START_S = 0.2  # of a load: the mean NIS leaves out what the first tick of a filter makes of an unknown load
TARE_RUN = "tare_run"
COMMISSIONING_RUN = "commissioning_run"
FAILURE = "failure"  # key of a result that has no numbers
LARGEST_TARE = 0.45  # of the platform's own parameters
TEN = len(bound.THETA_NAMES)


def run_case(case: Case, keep: Path | None) -> dict:
    """What is stored of a case; of one whose log is refused, as a user's would be, the reason as its FAILURE.

    `keep`: a folder for the run's files, in a folder of its name. Raises ToolFailed.
    """
    with tempfile.TemporaryDirectory(prefix="hexload-campaign-") as name:
        folder = Path(name)
        directory = simulate(case, folder)
        if keep is not None:
            shutil.copytree(directory, keep / case.name, dirs_exist_ok=True)
        try:
            setup = cases.draw(case)
            evaluate = _evaluate if setup.commissioning_scenario is None else _evaluate_rig
            result = evaluate(setup, folder, directory)
        except InputError as refusal:
            result = {FAILURE: str(refusal).replace(f"{folder}/", "")}  # the same in whatever folder
    return {"code": project.code_version(), "case": asdict(case), **result}


def simulate(case: Case, folder: Path) -> Path:
    """The run directory of a case, in `folder`; its platform file lies beside it. Raises ToolFailed."""
    return simulate_setup(cases.draw(case), case.name, folder)


def simulate_setup(setup: Setup, name: str, folder: Path) -> Path:
    """The same of any setup; `name` is for messages."""
    (folder / "platform.toml").write_text(to_toml(setup.platform))
    (folder / "scenario.toml").write_text(to_toml(setup.scenario))
    if setup.motion_rows is not None:
        header = "t,x,y,z,roll,pitch,yaw"
        np.savetxt(folder / MOTION_FILE, setup.motion_rows, fmt="%.12g", delimiter=",", header=header, comments="")
    if setup.tare_scenario is not None:
        (folder / "tare_scenario.toml").write_text(to_toml(setup.tare_scenario))
        _simulate(name, setup.kind, folder / "tare_scenario.toml", folder / TARE_RUN)
    if setup.commissioning_scenario is not None:
        (folder / "commissioning.toml").write_text(to_toml(setup.commissioning_scenario))
        _simulate(name, setup.kind, folder / "commissioning.toml", folder / COMMISSIONING_RUN)
    _simulate(name, setup.kind, folder / "scenario.toml", folder / "run")
    return folder / "run"


def _simulate(name: str, estimator: str, scenario: Path, out: Path) -> None:
    command = [project.simulator(), scenario, "--out", out, "--estimator", estimator, "--quiet"]
    finished = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if finished.returncode != 0:
        said = finished.stderr.strip()
        raise ToolFailed(f"case {name}: the simulator ended with status {finished.returncode}: {said}")


def _evaluate(setup: Setup, folder: Path, directory: Path) -> dict:
    meta = json.loads((directory / "meta.json").read_text())
    load = meta["loads"][-1]
    theta, since_s = np.array(load["theta"]), load["at_s"]
    whole = _as_float32(read_log(directory / "log.csv"))
    found, tared = _tared(setup, folder, whole)
    platform = bound.read_platform(folder / "platform.toml")
    if found is not None:
        platform = replace(platform, theta=platform.theta + found.offset.theta)
    log = _from(tared, since_s)
    t_s = log.t_s - since_s

    logs = {name: tared if name == TARED else whole for name in setup.filters}
    replays = {name: _replay_filter(folder, name, seen, found) for name, seen in logs.items()}
    estimators = {name: _score(_load_answer(replay, since_s), theta, t_s) for name, replay in replays.items()}
    if load["mass_kg"] > 0:  # the paper's filter must be given a mass
        estimators["paper"] = _score(_replay_paper(folder, load["mass_kg"], log), theta, t_s)
    own = replays[setup.filters[0]]
    prior_sigma = own["sigma"][0]  # the filter runs behind: its first row is still its prior
    stated = setup.platform["sensors"]
    for name, answer in baselines.baselines(log, platform, prior_sigma[:TEN], stated["force_sigma_n"]).items():
        estimators[name] = _score(answer, theta, t_s)

    sigma = bound.Sigmas(meta["sensors"]["velocity_sigma_m_s"], meta["sensors"]["force_sigma_n"])
    truth = bound.read_truth(directory / "truth.csv", from_s=since_s)
    machine = None if setup.effects is None else setup.effects.machine
    known = prior_sigma[: TEN + (0 if setup.effects is None else len(setup.effects.values))]  # without the base's tilt
    limit = bound.crlb(platform, truth, theta, sigma, known, dt_s=meta["tick_s"], machine=machine)[-1]
    return {
        "theta": theta.tolist(),
        "bound": limit[:TEN].tolist(),
        "controller": setup.filters[0],
        "estimators": estimators,
        "effects": None if setup.effects is None else _score_effects(own, theta, setup.effects.values, limit[TEN:]),
        "rig": None,
        "changes_s": [change["at_s"] for change in meta["loads"][1:]],
        "alarms_s": load_changes_s(own),
        "verdict": own["verdict"][-1],
        "health": {name: ticks for name, ticks in own["health_counts"].items() if ticks},
    }


def _evaluate_rig(setup: Setup, folder: Path, directory: Path) -> dict:
    """The momentum filter with what commissioning has found of the machine. The bound is that of a machine that is its
    model. Raises InputError."""
    meta = json.loads((directory / "meta.json").read_text())
    load = meta["loads"][-1]
    theta, since_s = np.array(load["theta"]), load["at_s"]
    machine = folder / "platform.toml"
    log = _as_float32(read_log(directory / "log.csv"))
    replay = _replay_rig(setup, folder, log)

    sigma = bound.Sigmas(meta["sensors"]["velocity_sigma_m_s"], meta["sensors"]["force_sigma_n"])
    truth = bound.read_truth(directory / "truth.csv", from_s=since_s)
    prior_sigma = replay["sigma"][0, :TEN]
    limit = bound.crlb(bound.read_platform(machine), truth, theta, sigma, prior_sigma, dt_s=meta["tick_s"])[-1]
    answer = replace(
        _load_answer(replay, since_s), covariance=np.full((TEN, TEN), np.nan)
    )  # its own part says too little
    return {
        "theta": theta.tolist(),
        "bound": limit.tolist(),
        "controller": setup.kind,
        "estimators": {setup.kind: _score(answer, theta, log.t_s[log.t_s >= since_s - 1e-9] - since_s)},
        "effects": None,
        "rig": _score_rig(replay, theta),
        "changes_s": [change["at_s"] for change in meta["loads"][1:]],
        "alarms_s": load_changes_s(replay),
        "verdict": replay["verdict"][-1],
        "health": {name: ticks for name, ticks in replay["health_counts"].items() if ticks},
    }


def repeat(case: Case) -> tuple[Any, dict, list[dict]]:
    """The case once more, to be looked at: its platform, what the controller's filter says, with the log, as replay_log returns
    it, and the true loads. Raises ToolFailed, InputError."""
    with tempfile.TemporaryDirectory(prefix="hexload-campaign-") as name:
        folder = Path(name)
        setup, directory = cases.draw(case), simulate(case, folder)
        log = _as_float32(read_log(directory / "log.csv"))
        if setup.commissioning_scenario is None:
            found, tared = _tared(setup, folder, log)
            replay = _replay_filter(folder, setup.filters[0], tared, found)
        else:
            replay = _replay_rig(setup, folder, log)
        loads = json.loads((directory / "meta.json").read_text())["loads"]
        platform = project.native_module().load_platform(str(folder / "platform.toml"))
        return platform, replay | {"log": log, "rows": len(log.t_s)}, loads


def _tared(setup: Setup, folder: Path, log: LegLog) -> tuple[tare.MachineTare | None, LegLog]:
    """Where the class has a tare, that tare and the log without what it explains. Raises InputError."""
    if setup.tare_scenario is None:
        return None, log
    found = _make_tare(folder)
    return found, _as_float32(found.taken_off(log))


def _replay_rig(setup: Setup, folder: Path, log: LegLog) -> dict:
    """By the controller's filter, with what commissioning has found. Raises InputError."""
    machine, rig = folder / "platform.toml", folder / "rig.toml"
    commission.commission(commission.Wish(folder / COMMISSIONING_RUN / "log.csv", machine, rig))
    native = project.native_module()
    platform = rig_file.platform_with_rig(rig, native, native.load_platform(str(machine)))
    legs = (log.displacement_m, log.velocity_m_s, log.force_n)
    return native.replay(platform, setup.kind, None, log.t_s, *legs, str(folder / "estimates.csv"))


def _score_rig(replay: dict, theta: Array) -> dict:
    """Errors of mass, centre of mass and tensor about it, and of the ten parameters in published sigmas."""
    found, published = replay["value"][-1, :TEN], replay["sigma"][-1, :TEN]
    tensor = _central_tensor(theta)
    off = np.abs(_central_tensor(found) - tensor).max()
    return {
        "mass_percent": 100.0 * abs(found[0] / theta[0] - 1.0),
        "centre_mm": 1e3 * float(np.linalg.norm(found[1:4] / found[0] - theta[1:4] / theta[0])),
        "inertia_percent": float(100.0 * off / (np.trace(tensor) / 3.0)),
        "sigmas": (np.abs(found - theta) / published).tolist(),
    }


def _central_tensor(theta: Array) -> Array:
    mass, h = theta[0], theta[1:4]
    about_origin = theta[[4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(3, 3)
    return about_origin - ((h @ h) * np.eye(3) - np.outer(h, h)) / mass


def _make_tare(folder: Path) -> tare.MachineTare:
    """Of the run of the empty platform. Raises InputError."""
    tare.make_tare(folder / TARE_RUN / "log.csv", folder / "platform.toml", folder / "tare.toml", LARGEST_TARE)
    native, machine = project.native_module(), folder / "platform.toml"
    return tare.tare_for(folder / "tare.toml", native, native.load_platform(str(machine)), machine)


def _replay_filter(folder: Path, name: str, log: LegLog, found: tare.MachineTare | None) -> dict:
    """A momentum filter by its name in the campaign; with the tare, its covariance has the tare's too."""
    if name != TARED or found is None:
        return _replay(folder, folder / "platform.toml", name, log)
    result = _replay(folder, folder / "platform.toml", "momentum", log, found.offset)
    return result | {"covariance": result["covariance"] + np.diag(found.offset.sigma**2)}


def _load_answer(replay: dict, since_s: float) -> Answer:
    """The load's part of what a momentum filter says."""
    is_now = replay["t"] >= since_s - 1e-9
    value = replay["value"][is_now, :TEN]
    return Answer(value[-1], replay["covariance"][:TEN, :TEN], value, replay["nis"][is_now])


def _score_effects(replay: dict, theta: Array, values: Array, limit: Array) -> dict:
    """Of the machine's effects; the NEES is that of load and machine together."""
    size = TEN + len(values)  # a tilt of the base, which comes last, is none
    error = replay["value"][-1, :size] - np.concatenate([theta, values])
    nees = float(error @ np.linalg.solve(replay["covariance"][:size, :size], error))
    return {"error": error[TEN:].tolist(), "bound": limit.tolist(), "nees": nees}


def _as_float32(log: LegLog) -> LegLog:
    """The controller's samples are float32; the log has their shortest decimals."""
    legs = (log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(log.t_s, *(values.astype(np.float32).astype(np.float64) for values in legs))


def _from(log: LegLog, from_s: float) -> LegLog:
    rows = log.t_s >= from_s - 1e-9
    return LegLog(log.t_s[rows], log.displacement_m[rows], log.velocity_m_s[rows], log.force_n[rows])


def _replay(folder: Path, platform: Path, estimator: str, log: LegLog, offset=None) -> dict:
    native = project.native_module()
    legs = (log.displacement_m, log.velocity_m_s, log.force_n)
    return native.replay(
        native.load_platform(str(platform)), estimator, None, log.t_s, *legs, str(folder / "estimates.csv"), offset
    )


def _replay_paper(folder: Path, mass_kg: float, log: LegLog) -> Answer:
    """The paper's filter, given the mass, with what it takes for granted: centre of mass on the axis, no products."""
    platform = folder / "platform_paper.toml"
    platform.write_text((folder / "platform.toml").read_text() + to_toml({"load": {"known_mass_kg": mass_kg}}))
    result = _replay(folder, platform, "paper", log)
    dz, inertia = result["value"][:, 0], result["value"][:, 1:]
    history = np.zeros((len(dz), TEN))
    history[:, 0], history[:, 3] = mass_kg, mass_kg * dz
    history[:, 4:7] = inertia
    history[:, 4:6] += mass_kg * dz[:, None] ** 2  # about O_A, by the parallel-axis theorem
    return Answer(history[-1], np.full((TEN, TEN), np.nan), history, result["nis"])


def _score(answer: Answer, theta: Array, t_s: Array) -> dict:
    """Final errors, NEES, mean NIS, and when the estimate came within a share of the scale for good.

    None: never, or the method detects none.
    """
    error = answer.theta - theta
    score: dict = {"error": error.tolist(), "nees": None, "nis": None}
    if np.isfinite(answer.covariance).all():
        score["nees"] = float(error @ np.linalg.solve(answer.covariance, error))
    if answer.nis is not None:
        score["nis"] = float(answer.nis[t_s >= START_S].mean())
    scale = scale_of(theta)
    if answer.history is not None and scale is not None:
        relative = np.abs(answer.history - theta) / scale
        score |= {name: settled_at(t_s, relative.max(axis=1), share) for name, share in WITHIN.items()}
        score["mass_and_moments_within_2"] = settled_at(t_s, relative[:, :4].max(axis=1), 0.02)
    return score


def settled_at(t_s: Array, deviation: Array, limit: float) -> float | None:
    """The first time from which the deviation stays within the limit."""
    outside = np.flatnonzero(~(deviation <= limit))
    first = outside[-1] + 1 if len(outside) else 0
    return round(float(t_s[first]), 6) if first < len(t_s) else None
