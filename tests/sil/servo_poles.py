"""How fast the servo of a simulated machine lets its slowest mode decay at home: poles of the sampled loop, mode by mode.

The six legs are alike, so each mode of the platform on its oil columns is a loop of its own: spool (two states), force,
displacement, speed, and the servo's integral, of which the plant's five go from sample to sample by a matrix exponential.
"""

import tomllib

import numpy as np
from scipy.linalg import expm

SERVO_S = 1e-3


def body_matrix(theta: np.ndarray) -> np.ndarray:
    """(6, 6) of [m, h, I] about O_A: momentum by twist."""
    m, h, (xx, yy, zz, xy, xz, yz) = theta[0], theta[1:4], theta[4:]
    cross = np.array([[0, -h[2], h[1]], [h[2], 0, -h[0]], [-h[1], h[0], 0]])
    return np.block([[m * np.eye(3), -cross], [cross, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])]])


def growth_1_s(platform, scenario, load_theta: np.ndarray, displacement_m: float = 0.0) -> float:
    """The largest real part of all poles; below 0: every mode decays. `displacement_m`: where the oil columns are."""
    upper, base = np.asarray(platform.platform_hinges_m), np.asarray(platform.base_hinges_m)
    legs = upper - base + [0.0, 0.0, platform.home_height_m]
    e = legs / np.linalg.norm(legs, axis=1)[:, None]
    jacobian = np.hstack([e, np.cross(upper, e)])
    body = body_matrix(np.asarray(platform.theta) + load_theta)
    masses_1_kg = np.linalg.eigvals(jacobian @ np.linalg.solve(body, jacobian.T)).real
    tables = tomllib.loads(scenario.to_toml())
    speed_m_s = scenario.machine_limits(platform)[0]
    return max(
        _growth_1_s(tables["hydraulics"], tables["controller"], speed_m_s, platform.stroke_m, displacement_m, each)
        for each in masses_1_kg
    )


def _growth_1_s(oil, servo, speed_m_s, stroke_m, displacement_m, inverse_mass_1_kg) -> float:
    area_m2, dead_m3 = oil["piston_area_m2"], oil["dead_volume_m3"]
    low_m3, high_m3 = (dead_m3 + area_m2 * abs(displacement_m - end) for end in stroke_m)
    stiffness = oil["bulk_modulus_pa"] * area_m2**2 * (1.0 / low_m3 + 1.0 / high_m3)
    valve = 2.0 * np.pi * oil["valve_bandwidth_hz"]
    plant = np.zeros((6, 6))  # spool, its rate, force, displacement, speed; then the command, which is held
    plant[0, 1] = 1.0
    plant[1, [0, 1, 5]] = -(valve**2), -2.0 * oil["valve_damping"] * valve, valve**2
    plant[2, [0, 2, 4]] = stiffness * np.array([speed_m_s, -oil["leakage_m3_s_pa"] / area_m2**2, -1.0])
    plant[3, 4] = 1.0
    plant[4, 2] = inverse_mass_1_kg
    step = expm(SERVO_S * plant)
    loop = np.zeros((6, 6))  # the same, with the integral in the place of the command
    loop[:5, :5] = step[:5, :5]
    loop[5, [3, 5]] = -SERVO_S * servo["integral_1_m_s"], 1.0
    command = np.array([0.0, 0.0, -servo["pressure_feedback_1_n"], -servo["proportional_1_m"], 0.0, 1.0])
    loop[:5] += np.outer(step[:5, 5], command)
    return float(np.log(np.abs(np.linalg.eigvals(loop)).max()) / SERVO_S)
