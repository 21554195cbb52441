"""A stretch of motion: MuJoCo integrates it, host_sim's acceleration integrated by a textbook RK4 must follow.

What single states cannot show: that velocity, angular velocity and pose fit together in their axes and signs.
"""

import hexload_native as native
import numpy as np
from scipy.spatial.transform import Rotation

from hexload.theory.bound import read_platform
from machines import State, random_load, random_machine, random_state, write_platform
from mujoco_plant import MujocoPlant

STEP_S = 1e-3
DURATION_S = 1.0


def turned(R: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(vector).as_matrix() @ R


def rk4_step(acceleration, p, R, V, h):
    """Classic RK4 on (p, V); on R in exponential coordinates about the start of the step, to fourth order.

    d(phi)/dt = omega - phi x omega / 2 + phi x (phi x omega) / 12 keeps the order (Iserles et al., Lie-group methods,
    Acta Numerica 9, 2000; sign for omega in base axes).
    """

    def rate(dp, phi, dV):
        velocity = V + dV
        w = velocity[3:]
        phi_rate = w - np.cross(phi, w) / 2 + np.cross(phi, np.cross(phi, w)) / 12
        return velocity[:3], phi_rate, acceleration(p + dp, turned(R, phi), velocity)

    zero = np.zeros(3)
    k1 = rate(zero, zero, np.zeros(6))
    k2 = rate(*(h / 2 * k for k in k1))
    k3 = rate(*(h / 2 * k for k in k2))
    k4 = rate(*(h * k for k in k3))
    dp, phi, dV = (h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return p + dp, turned(R, phi), V + dV


def test_a_second_of_forced_motion_agrees_with_mujoco(tmp_path, record_property):
    # GIVEN a general machine and load in motion, under leg forces that hold its weight and swing by 2 % of it at 1 to
    # 3 Hz, constant within each millisecond
    rng = np.random.default_rng(7)
    machine, body = random_machine(rng), random_load(rng)
    path = write_platform(machine, tmp_path / "platform.toml")
    platform = native.load_platform(path)
    load = native.Load(body.mass_kg, body.com_m, body.inertia_com_kg_m2)
    mujoco_plant = MujocoPlant(machine, body, read_platform(path).home_height_m, STEP_S)
    p, R = np.zeros(3), np.eye(3)
    V = 0.2 * random_state(rng).V
    holding = native.leg_forces(platform, load, p, R, np.zeros(6), np.zeros(6))
    frequency, phase = rng.uniform(1, 3, 6), rng.uniform(0, 2 * np.pi, 6)
    swing = 0.02 * (body.mass_kg + machine.platform.mass_kg) * machine.gravity_m_s2
    mujoco_plant.set_state(State(p, R, V, holding))
    # WHEN both integrate with the same step
    widest = np.zeros(6)
    for tick in range(round(DURATION_S / STEP_S)):
        force = holding + swing * np.sin(2 * np.pi * frequency * tick * STEP_S + phase)
        p, R, V = rk4_step(lambda p, R, V, f=force: native.acceleration(platform, load, p, R, V, f), p, R, V, STEP_S)
        mujoco_plant.step(force)
        widest = np.maximum(widest, np.abs(V))
    # THEN poses and twists agree. Two RK4 of different parametrisation differ by their truncation: with rates of
    # change of some 10 1/s (a free platform topples), (10 h)^4 / 120 per unit time and second is 1e-10
    apart_m = np.abs(p - mujoco_plant.p_m).max()
    apart_rad = np.linalg.norm(Rotation.from_matrix(R @ mujoco_plant.R.T).as_rotvec())
    apart_twist = np.abs(V - mujoco_plant.V).max()
    record_property("apart", [apart_m, apart_rad, apart_twist])
    print(f"apart after {DURATION_S} s: {apart_m:.1e} m, {apart_rad:.1e} rad, {apart_twist:.1e} m/s or rad/s")
    assert max(apart_m, apart_rad, apart_twist) < 1e-8
    # AND it was a motion: angular rates that make centripetal terms count
    assert np.linalg.norm(widest[3:]) > 0.1
