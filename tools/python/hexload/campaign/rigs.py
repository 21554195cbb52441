"""Random rigs: machines as they stand in a hall, each with every effect that the simulator has, in usual sizes.

What a rig has is drawn from its generator alone: the same generator state gives the same rig.
"""

import math

import numpy as np

from hexload.io.toml_document import Table
from hexload.theory.bound import LEGS

LAWS = ("coulomb", "stribeck", "lugre")
LARGEST_TILT_RAD = 0.01
LARGEST_BIAS_N = 25.0
LARGEST_GAIN_ERROR = 5e-3
HINGE_SIGMA_M = (0.1e-3, 0.4e-3)
TOLERANCES = {  # of all of that; gravity and the clock are exact here
    "force_gain": 0.003,
    "force_gain_common": 0.003 / math.sqrt(6.0),
    "force_offset_n": 15.0,
    "hinge_m": 0.3e-3,
    "tilt_rad": 0.006,
}
WITHOUT_VELOCITY = 0.25  # share of rigs that have encoders and load cells alone


def draw_rig(random: np.random.Generator) -> Table:
    """The scenario's tables [machine], [legs], [hydraulics] (friction), [controller] and [sensors] of one machine.

    Base up to 0.6 degrees off level about each axis, hinges off by 0.1 to 0.4 mm (one sigma), platform weighed to 1 %;
    legs of 8 to 22 kg that differ by 5 %; friction of 30 to 90 N by any of the laws, growing with the leg's force and
    with the cold; force gains to 0.5 %, biases to 25 N, low-passes of 200 to 500 Hz, forces up to 0.3 ms late, encoders
    of 1 to 10 um; the servo reads these sensors.
    """
    return {
        "machine": _draw_machine(random),
        "legs": _draw_legs(random),
        "hydraulics": _draw_friction(random),
        "controller": {"reads_sensors": True},
        "sensors": _draw_sensors(random),
    }


def with_rig(scenario: Table, rig: Table) -> Table:
    """The scenario on that machine; its own tables keep what the rig does not have."""
    return scenario | {name: scenario.get(name, {}) | table for name, table in rig.items()}


def _draw_machine(random: np.random.Generator) -> Table:
    return {
        "tilt_rad": random.uniform(-LARGEST_TILT_RAD, LARGEST_TILT_RAD, 2).tolist(),
        "hinge_error_sigma_m": random.uniform(*HINGE_SIGMA_M),
        "hinge_error_seed": int(random.integers(2**31)),
        "platform_scale": random.uniform(0.99, 1.01),
    }


def _draw_legs(random: np.random.Generator) -> Table:
    rod_kg, cylinder_kg = random.uniform([3.0, 5.0], [7.0, 15.0])
    return {
        "rod_mass_kg": (rod_kg * random.uniform(0.95, 1.05, LEGS)).tolist(),
        "rod_length_m": random.uniform(0.45, 0.6),
        "cylinder_mass_kg": (cylinder_kg * random.uniform(0.95, 1.05, LEGS)).tolist(),
        "cylinder_length_m": random.uniform(0.5, 0.65),
    }


def _draw_friction(random: np.random.Generator) -> Table:
    law = LAWS[random.integers(len(LAWS))]
    coulomb_n = random.uniform(30.0, 90.0) * random.uniform(0.8, 1.2, LEGS)
    breakaway = random.uniform(1.2, 1.7)
    friction = {
        "friction_law": law,
        "coulomb_friction_n": coulomb_n.tolist(),
        "viscous_friction_n_s_m": (random.uniform(150.0, 400.0) * random.uniform(0.8, 1.2, LEGS)).tolist(),
        "friction_speed_m_s": random.uniform(1e-3, 5e-3),
        "stribeck_speed_m_s": random.uniform(5e-3, 20e-3),
        "friction_force_share": random.uniform(0.0, 5e-3),
        "bristle_stiffness_n_m": random.uniform(1e6, 4e6),
        "cold_friction_factor": random.uniform(1.0, 1.1),
        "friction_warm_up_s": random.uniform(100.0, 600.0),
    }
    return friction if law == "coulomb" else friction | {"static_friction_n": (breakaway * coulomb_n).tolist()}


def _draw_sensors(random: np.random.Generator) -> Table:
    velocity_hz, velocity_delay_s = random.uniform([200.0, 0.0], [500.0, 0.2e-3])
    has_velocity = bool(random.uniform() >= WITHOUT_VELOCITY)
    return {
        "force_gain": (1.0 + random.uniform(-LARGEST_GAIN_ERROR, LARGEST_GAIN_ERROR, LEGS)).tolist(),
        "force_bias_n": random.uniform(-LARGEST_BIAS_N, LARGEST_BIAS_N, LEGS).tolist(),
        "force_bandwidth_hz": random.uniform(200.0, 500.0),
        "force_delay_s": random.uniform(0.0, 0.3e-3),
        "velocity_bandwidth_hz": velocity_hz,
        "velocity_delay_s": velocity_delay_s,
        "velocity_sensor": has_velocity,
        "displacement_step_m": random.uniform(1e-6, 10e-6),
    }
