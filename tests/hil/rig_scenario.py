"""A rig and the rig file that a perfect commissioning of it would write: legs that rub, a base off level, late and biased
load cells. The scenario's plant has them, the rig file says so, and the platform file does not."""

from pathlib import Path

import numpy as np

import momentum_scenario
from hexload import project
from hexload.estimation import rig_file
from momentum_scenario import platform_of

DURATION_S = 1.5  # four blocks of the estimate, a lag and the start
MASS_KG, COM_M = momentum_scenario.HEAVY
TILT_RAD = (-0.006, 0.008)
COULOMB_N, VISCOUS_N_S_M, FRICTION_SPEED_M_S = 80.0, 200.0, 1e-3
GAIN = np.array([0.004, -0.003, 0.002, -0.004, 0.003, -0.002])
OFFSET_N = np.array([-16.0, 11.0, 21.0, -9.0, -24.0, 13.0])
FORCE_HZ, FORCE_DELAY_S = 350.0, 0.15e-3
LEGS = np.ones(6)

TEXT = momentum_scenario.of_heavy_load(
    "rig",
    "Six-axis multisine of a machine that is not its platform file's.",
    DURATION_S,
    f"""
[machine]
tilt_rad = {list(TILT_RAD)}

[hydraulics]
coulomb_friction_n = {COULOMB_N}
viscous_friction_n_s_m = {VISCOUS_N_S_M}
friction_speed_m_s = {FRICTION_SPEED_M_S}

[sensors]
force_gain = {(1.0 + GAIN).tolist()}
force_bias_n = {OFFSET_N.tolist()}
force_bandwidth_hz = {FORCE_HZ}
force_delay_s = {FORCE_DELAY_S}
""",
)


def write(folder: Path) -> Path:
    """The scenario, and beside it platform.toml and rig.toml."""
    platform = project.native_module().load_platform(str(platform_of(momentum_scenario.write(folder))))
    (folder / "rig.toml").write_text(rig_file.document(_rig(platform), {}, {}, [_direction()], platform))
    (folder / "scenario.toml").write_text(TEXT)
    return folder / "scenario.toml"


def rig_of(scenario: Path) -> Path:
    return scenario.with_name("rig.toml")


def _rig(platform) -> dict:
    x, y = TILT_RAD
    down = np.array([np.sin(y), -np.cos(y) * np.sin(x), -np.cos(y) * np.cos(x)])
    return rig_file.of_model(platform) | {
        "gravity_m_s2": platform.gravity_m_s2 * down,
        "coulomb_n": COULOMB_N * LEGS,
        "viscous_n_s_m": VISCOUS_N_S_M * LEGS,
        "reversal_speed_m_s": 1.2 * FRICTION_SPEED_M_S,  # tanh for v / sqrt(v^2 + v0^2)
        "force_offset_n": OFFSET_N,
        "force_gain": GAIN,
        "force_delay_s": FORCE_DELAY_S + np.sqrt(2.0) / (2.0 * np.pi * FORCE_HZ),
    }


def _direction() -> dict:
    """All gains may be off together by 0.1 %."""
    none = (0.0 * LEGS).tolist()
    return {
        "force_offset_n": none,
        "force_gain": (1e-3 * LEGS).tolist(),
        "coulomb_n": none,
        "stribeck_n": none,
        "growth_n_n": none,
        "viscous_n_s_m": none,
        "gravity_m_s2": [0.0, 0.0],
        "platform": [0.0] * 10,
        "base_hinges_m": np.zeros((6, 3)).tolist(),
        "platform_hinges_m": np.zeros((6, 3)).tolist(),
    }
