"""A small run directory in hexload_sim's format, written without the simulator: the paper's motion with a tilt of a
known size, estimates that approach the truth exponentially, and NIS drawn from chi-square with 3 degrees of freedom."""

import json
from pathlib import Path

import numpy as np

TICK_S = 0.001
LOG_HEADER = "t," + ",".join(f"{channel}{leg}" for channel in ("dl", "vl", "f") for leg in range(1, 7))
TRUTH_HEADER = (
    "t,x,y,z,roll,pitch,yaw,vx,vy,vz,wx,wy,wz,ref_x,ref_y,ref_z,ref_roll,ref_pitch,ref_yaw,"
    + LOG_HEADER.removeprefix("t,")
)
ESTIMATES_HEADER = "t,dz,Ixx,Iyy,Izz,s_dz,s_Ixx,s_Iyy,s_Izz,nis,verdict"
TILT_RAD = 2e-4

PLATFORM_TOML = """\
[geometry]
base_hinges_m = [[0.5909, 0.1042, 0.0], [-0.2052, 0.5638, 0.0], [-0.3857, 0.4596, 0.0],
                 [-0.3857, -0.4596, 0.0], [-0.2052, -0.5638, 0.0], [0.5909, -0.1042, 0.0]]
platform_hinges_m = [[0.2828, 0.2828, 0.0], [0.1035, 0.3864, 0.0], [-0.3864, 0.1035, 0.0],
                     [-0.3864, -0.1035, 0.0], [0.1035, -0.3864, 0.0], [0.2828, -0.2828, 0.0]]
home_leg_length_m = 0.8741
stroke_m = [-0.3, 0.3]

[platform]
mass_kg = 100.0
com_m = [0.0, 0.0, 0.0]
inertia_kg_m2 = [25.0, 25.0, 44.0, 0.0, 0.0, 0.0]

[environment]
gravity_m_s2 = 9.81

[sensors]
displacement_sigma_m = 20e-6
velocity_sigma_m_s = 1e-3
force_sigma_n = 5.0

[load]
known_mass_kg = 500.0

[estimator]
kind = "paper"
"""


def write_run(
    directory: Path, rows: int = 3000, seed: int = 1, last_verdict: str = "converged", **meta_changes
) -> Path:
    """Writes a run directory of `rows` ticks. `meta_changes` replace entries of meta.json."""
    directory.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    t = np.arange(rows) * TICK_S
    (directory / "scenario.toml").write_text('name = "synthetic"\nplatform = "platform.toml"\n')
    (directory / "platform.toml").write_text(PLATFORM_TOML)
    legs = _leg_signals(t, rng)
    _write_table(directory / "log.csv", LOG_HEADER, np.column_stack([t, legs]))
    _write_table(directory / "truth.csv", TRUTH_HEADER, np.column_stack([t, _motion(t), legs]))
    _write_estimates(directory / "estimates.csv", t, rng, last_verdict)
    (directory / "meta.json").write_text(json.dumps(_meta(rows, seed) | meta_changes))
    return directory


def _leg_signals(t, rng):
    phase = np.arange(6)
    displacement = 0.05 * np.sin(np.pi * t[:, None] + phase)
    velocity = 0.05 * np.pi * np.cos(np.pi * t[:, None] + phase) + 1e-3 * rng.standard_normal((len(t), 6))
    force = 1070.0 + 300.0 * np.sin(np.pi * t[:, None] + phase) + 5.0 * rng.standard_normal((len(t), 6))
    return np.hstack([displacement, velocity, force])


def _motion(t):
    sine, cosine, zero = np.sin(np.pi * t), np.cos(np.pi * t), np.zeros_like(t)
    yaw = np.radians(0.2)
    reference = np.column_stack([0.2 * sine, 0.2 * sine, zero, zero, zero, yaw * sine])
    pose = reference + np.column_stack([1e-3 * cosine, 1e-3 * cosine, zero, TILT_RAD * sine, TILT_RAD * sine, zero])
    twist = np.pi * np.column_stack(
        [0.2 * cosine, 0.2 * cosine, zero, TILT_RAD * cosine, TILT_RAD * cosine, yaw * cosine]
    )
    return np.hstack([pose, twist, reference])


def _write_estimates(path, t, rng, last_verdict):
    truth = np.array([0.3, 25.0, 25.0, 25.0])
    start_sigma = np.sqrt([0.1, 500.0, 500.0, 500.0])
    final_sigma = np.array([3e-5, 0.5, 1.2, 0.3])
    decay = np.exp(-t[:, None] / 0.2)
    sigma = start_sigma * decay + final_sigma
    value = truth * (1.0 - decay) + 0.5 * final_sigma
    nis = rng.chisquare(3, len(t))
    with path.open("w") as file:
        print(ESTIMATES_HEADER, file=file)
        for row in zip(t, value, sigma, nis):
            numbers = np.hstack(row)
            print(*(f"{number:.9g}" for number in numbers), last_verdict, sep=",", file=file)


def _meta(rows, seed):
    load = {
        "at_s": 0.0,
        "mass_kg": 500.0,
        "com_m": [0.0, 0.0, 0.3],
        "inertia_com_kg_m2": [25.0, 25.0, 25.0, 0, 0, 0],
        "theta": [500.0, 0.0, 0.0, 150.0, 70.0, 70.0, 25.0, 0.0, 0.0, 0.0],
    }
    coupling = np.zeros((6, 6))
    coupling[0, 4] = coupling[4, 0] = 150.0
    coupling[1, 3] = coupling[3, 1] = -150.0
    return {
        "name": "synthetic",
        "description": "the motion (23) with a known tilt",
        "version": "0.1.0",
        "seed": seed,
        "duration_s": rows * TICK_S,
        "tick_s": TICK_S,
        "substeps": 4,
        "rows": rows,
        "missing": 0,
        "refused": 0,
        "loads": [load],
        "sensors": {"displacement_sigma_m": 20e-6, "velocity_sigma_m_s": 1e-3, "force_sigma_n": 5.0},
        "coupling_matrix_home": coupling.tolist(),
        "health_ticks": {"leg_out_of_range": 0, "not_excited": 12},
        "estimator": {"kind": "paper", "prior": "safe"},
    }


def _write_table(path, header, rows):
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=header, comments="")
