"""A rig file that has everything the firmware takes off and considers, for what that costs."""

from pathlib import Path

import numpy as np

from hexload.estimation import rig_file
from hexload.theory.bound import LEGS

DIRECTIONS = 8  # as many as a configuration holds
# Of a rig as in host_sim/scenarios/rig.toml; delays of two ticks and a part, as a low-pass of 100 Hz makes them.
PARAMETERS = {
    "coulomb_n": np.full(LEGS, 60.0),
    "stribeck_n": np.full(LEGS, 25.0),
    "growth_n_n": np.full(LEGS, 0.003),
    "viscous_n_s_m": np.full(LEGS, 270.0),
    "force_offset_n": np.array([-16.0, 11.0, 21.0, -9.0, -24.0, 13.0]),
    "force_gain": np.array([-0.0023, 0.0032, -0.0032, -0.0019, 0.0026, -0.0017]),
    "gravity_m_s2": np.array([0.04, 0.044, -9.8098]),
    "leg_inertia_kg_m2": 3.4,
    "leg_slide_kg_m": 1.4,
    "leg_tilt_kg_m": 0.6,
    "presliding_m": 3e-5,
    "force_delay_s": 2.3e-3,
    "velocity_delay_s": 0.4e-3,
}
# One standard deviation of each number of a direction.
OPEN = {
    "force_offset_n": (LEGS, 0.5),
    "force_gain": (LEGS, 1e-3),
    "coulomb_n": (LEGS, 1.0),
    "stribeck_n": (LEGS, 1.0),
    "growth_n_n": (LEGS, 1e-4),
    "viscous_n_s_m": (LEGS, 5.0),
    "gravity_m_s2": (2, 1e-3),
    "platform": (10, 0.05),
    "base_hinges_m": ((LEGS, 3), 1e-5),
    "platform_hinges_m": ((LEGS, 3), 1e-5),
}


def with_full_rig(native, platform, folder: Path, directions: int = DIRECTIONS):
    """The platform with such a rig file, which it leaves in `folder`."""
    rng = np.random.default_rng(3)
    of_load = [
        {key: (sigma * rng.standard_normal(shape)).tolist() for key, (shape, sigma) in OPEN.items()}
        for _ in range(directions)
    ]
    path = folder / f"rig_{directions}.toml"
    text = rig_file.document(rig_file.of_model(platform) | PARAMETERS, {}, {}, of_load, platform)
    path.write_text(text.replace("direction = []\n", ""))
    return native.with_rig(platform, str(path))
