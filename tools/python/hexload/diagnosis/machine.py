"""The machine that a log is held against: the platform file's, or with a rig file what commissioning has found of it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hexload.diagnosis.dynamics import Machine
from hexload.estimation import rig_model
from hexload.estimation.rig_model import FrictionLaw, Geometry
from hexload.io.log_file import LegLog
from hexload.io.toml_document import read_toml
from hexload.theory.bound import TENSOR

SPEED_ROWS = 12  # over which the speeds of friction are taken


def machine_of(platform: Any) -> Machine:
    """Of a hexload_native.Platform."""
    return Machine(
        Geometry(*(np.asarray(getattr(platform, key)) for key in Geometry.__dataclass_fields__)),
        np.array([0.0, 0.0, -platform.gravity_m_s2]),
        np.concatenate(
            [
                [platform.mass_kg],
                platform.mass_kg * np.asarray(platform.com_m),
                np.asarray(platform.inertia_kg_m2)[TENSOR],
            ]
        ),
        platform.displacement_sigma_m,
        platform.velocity_sigma_m_s,
        platform.force_sigma_n,
    )


def in_time(platform: Any, log: LegLog) -> LegLog:
    """The log without the delays that the platform file states of its sensors."""
    force = _earlier(log.t_s, log.force_n, platform.force_delay_s)
    return replace(log, force_n=force, velocity_m_s=_earlier(log.t_s, log.velocity_m_s, platform.velocity_delay_s))


def with_rig(rig_file: Path, machine: Machine, log: LegLog) -> tuple[Machine, LegLog]:
    """The machine of the rig file, and the log without what the file says of its sensors, friction and legs."""
    rig = read_toml(rig_file)["rig"]
    number = {key: np.asarray(value, float) for key, value in rig.items()}
    hinges = (number["base_hinges_m"], number["platform_hinges_m"])
    geometry = Geometry(*hinges, machine.geometry.home_leg_length_m)
    theta = np.concatenate([number["mass_kg"][None], number["mass_kg"] * number["com_m"], number["inertia_kg_m2"]])
    gravity = number["gravity_m_s2"]
    known = replace(machine, geometry=geometry, gravity_m_s2=gravity, own_theta=theta, is_commissioned=True)
    return known, replace(
        log,
        force_n=_platform_forces(known, log, number),
        velocity_m_s=_earlier(log.t_s, log.velocity_m_s, rig["velocity_delay_s"]),
    )


def _earlier(t_s: np.ndarray, values: np.ndarray, late_s: float) -> np.ndarray:
    if late_s == 0.0:
        return values
    return np.stack([np.interp(t_s + late_s, t_s, leg) for leg in values.T], axis=1)


def _platform_forces(machine: Machine, log: LegLog, rig: dict[str, np.ndarray]) -> np.ndarray:
    """As of rig_model, the other way round."""
    dt_s = float(np.median(np.diff(log.t_s)))
    shown = _earlier(log.t_s, log.force_n, float(rig["force_delay_s"]))
    shown = (shown - rig["force_offset_n"]) / (1.0 + rig["force_gain"])
    displacement = np.stack([_even(log.t_s, leg) for leg in log.displacement_m.T], axis=1)
    speed = np.gradient(_mean(displacement), dt_s, axis=0)
    law = FrictionLaw(*(float(rig[key]) for key in ("stribeck_speed_m_s", "reversal_speed_m_s", "presliding_m")))
    shapes = rig_model.friction_shapes(speed, law, dt_s)
    dry = rig["coulomb_n"] + rig["growth_n_n"] * np.abs(shown)
    friction = dry * shapes[..., 0] + rig["stribeck_n"] * shapes[..., 1] + rig["viscous_n_s_m"] * shapes[..., 2]
    acceleration = np.gradient(_mean(speed), dt_s, axis=0)
    motion = rig_model.motion_of_legs(machine.geometry, displacement, speed, acceleration)
    legs = [float(rig[key]) for key in ("leg_inertia_kg_m2", "leg_slide_kg_m", "leg_tilt_kg_m")]
    return shown - friction - rig_model.leg_mass_forces(motion, machine.geometry, machine.gravity_m_s2) @ legs


def _even(t_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    there = np.isfinite(values)
    return np.interp(t_s, t_s[there], values[there])


def _mean(values: np.ndarray) -> np.ndarray:
    """Over 2 SPEED_ROWS + 1 rows, without lag."""
    padded = np.concatenate([np.repeat(values[:1], SPEED_ROWS, 0), values, np.repeat(values[-1:], SPEED_ROWS, 0)])
    sums = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), padded]), axis=0)
    width = 2 * SPEED_ROWS + 1
    return (sums[width:] - sums[:-width]) / width
