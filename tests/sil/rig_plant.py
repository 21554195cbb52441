"""A rig by inverse dynamics, written independently of tools and firmware: a prescribed motion, the leg forces that it
takes with legs of mass on a base that is not level, and what imperfect sensors show of them."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

SUBSTEPS = 4
TICK_S = 1e-3
CYLINDER_KG, CYLINDER_COM_M, CYLINDER_KG_M2 = (
    11.0,
    0.26,
    0.55,
)  # about its centre; from the base hinge
ROD_KG, ROD_COM_M, ROD_KG_M2 = 5.5, 0.21, 0.19  # from the upper hinge
STRIBECK_M_S, REVERSAL_M_S = 0.012, 0.001


@dataclass(frozen=True)
class RubbingRig:
    """What commissioning is to find."""

    base_hinges_m: np.ndarray
    platform_hinges_m: np.ndarray
    home_leg_length_m: float
    platform_theta: np.ndarray
    gravity_m_s2: np.ndarray  # base axes
    gain: np.ndarray
    offset_n: np.ndarray
    coulomb_n: np.ndarray
    stribeck_n: np.ndarray
    viscous_n_s_m: np.ndarray
    force_delay_s: float
    presliding_m: float = 0.0
    has_leg_mass: bool = True
    leg_scale: np.ndarray = field(default_factory=lambda: np.ones(6))  # of each leg's masses
    growth: float = 0.0  # N of dry friction per N of the actuator's push
    damper_n_s_m: float = 0.0  # between the platform's origin and the ground
    hoses_n_m: float = 0.0  # that pull the platform's origin home
    has_bristles: bool = False  # LuGre's law in place of Dahl's: the bristles' length goes with the level of friction
    sigma: dict = field(default_factory=lambda: {"displacement": 1e-5, "velocity": 1e-3, "force": 5.0})


def without_effects(
    base_hinges_m, platform_hinges_m, home_leg_length_m: float, platform_theta, gravity_m_s2, sigma: dict
) -> RubbingRig:
    """A machine that is its model, with noise."""
    own = (base_hinges_m, platform_hinges_m, home_leg_length_m, platform_theta, gravity_m_s2)
    return RubbingRig(*own, *np.zeros((5, 6)), 0.0, has_leg_mass=False, sigma=sigma)


def multisine(seed: int, duration_s: float, start_s: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and poses [x, y, z, roll, pitch, yaw], from rest at home."""
    random = np.random.default_rng(seed)
    t_s = np.arange(0.0, duration_s, TICK_S / SUBSTEPS)
    pose = np.zeros((len(t_s), 6))
    for k in range(6):
        hz = random.uniform(0.3, 3.0, 6)
        sines = np.sin(2 * np.pi * hz * t_s[:, None] + random.uniform(0, 2 * np.pi, 6)) @ (random.normal(size=6) / hz)
        pose[:, k] = (0.06 if k < 3 else 0.12) * sines / np.abs(sines).max()
    share = np.clip(t_s / start_s, 0.0, 1.0)[:, None]
    return t_s, pose * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def log_of(
    machine: RubbingRig,
    motion: tuple,
    load: np.ndarray,
    seed: int,
    load_from_s: float = 0.0,
) -> tuple:
    """t, displacements, velocities, forces at every tick; the load is there from load_from_s on."""
    t_s, pose = motion
    dt_s = t_s[1] - t_s[0]
    rate = lambda x: np.gradient(x, dt_s, axis=0)
    rotation = Rotation.from_euler("xyz", pose[:, 3:]).as_matrix()
    spin = rate(rotation) @ np.swapaxes(rotation, 1, 2)
    w = 0.5 * np.stack(
        [
            spin[:, 2, 1] - spin[:, 1, 2],
            spin[:, 0, 2] - spin[:, 2, 0],
            spin[:, 1, 0] - spin[:, 0, 1],
        ],
        1,
    )
    arm = np.einsum("nij,lj->nli", rotation, machine.platform_hinges_m)
    spread = machine.platform_hinges_m[:, :2] - machine.base_hinges_m[:, :2]
    height_m = np.sqrt(machine.home_leg_length_m**2 - np.mean(np.sum(spread**2, axis=1)))
    centre = pose[:, :3] + [0.0, 0.0, height_m]
    legs = centre[:, None] + arm - machine.base_hinges_m
    length = np.linalg.norm(legs, axis=2, keepdims=True)
    e = legs / length
    theta = machine.platform_theta + load * (t_s >= load_from_s)[:, None]
    force, moment = _body(theta, rotation, w, rate(w), rate(rate(centre)) - machine.gravity_m_s2)
    force = force + machine.damper_n_s_m * rate(centre) + machine.hoses_n_m * (centre - [0.0, 0.0, height_m])
    if machine.has_leg_mass:
        on_hinge = _leg_forces(machine, e, length, rate)
        force, moment = (
            force + on_hinge.sum(axis=1),
            moment + np.cross(arm, on_hinge).sum(axis=1),
        )
    jacobian = np.concatenate([e, np.cross(arm, e)], axis=2)
    wrench = np.concatenate([force, moment], axis=1)
    push = np.linalg.solve(np.swapaxes(jacobian, 1, 2), wrench[:, :, None])[:, :, 0]
    speed = rate(length[:, :, 0])
    shown = (1.0 + machine.gain) * (push + _friction(machine, speed, push, dt_s)) + machine.offset_n
    shown = np.stack([np.interp(t_s - machine.force_delay_s, t_s, leg) for leg in shown.T], axis=1)
    random = np.random.default_rng(seed)
    every = slice(None, None, SUBSTEPS)
    channels = (length[:, :, 0] - machine.home_leg_length_m, speed, shown)
    noisy = (x[every] + s * random.normal(size=x[every].shape) for x, s in zip(channels, machine.sigma.values()))
    return t_s[every], *noisy


def _body(theta, rotation, w, alpha, specific):
    """Newton and Euler about O_A."""
    h = np.einsum("nij,nj->ni", rotation, theta[:, 1:4])
    tensor = theta[:, [4, 7, 8, 7, 5, 9, 8, 9, 6]].reshape(-1, 3, 3)
    tensor = rotation @ tensor @ np.swapaxes(rotation, 1, 2)
    times = lambda x: np.einsum("nij,nj->ni", tensor, x)
    force = theta[:, :1] * specific + np.cross(alpha, h) + np.cross(w, np.cross(w, h))
    return force, np.cross(h, specific) + times(alpha) + np.cross(w, times(w))


def _leg_forces(machine, e, length, rate):
    """What the platform gives each leg at its upper hinge, beside the actuator's push: angular momentum about the base
    hinge, and the rod along the leg."""
    scale = machine.leg_scale[:, None]
    inertia = CYLINDER_KG_M2 + CYLINDER_KG * CYLINDER_COM_M**2 + ROD_KG_M2 + ROD_KG * (length - ROD_COM_M) ** 2
    g = np.broadcast_to(machine.gravity_m_s2, e.shape)
    first_moment = CYLINDER_KG * CYLINDER_COM_M + ROD_KG * (length - ROD_COM_M)
    torque = rate(inertia * np.cross(e, rate(e))) - np.cross(e, g) * first_moment
    rod = rate(rate((length - ROD_COM_M) * e))
    along = ROD_KG * np.sum(e * (rod - g), axis=2, keepdims=True) * e
    return scale * (np.cross(torque / length, e) + along)


def _friction(machine, speed, push, dt_s):
    level = machine.coulomb_n + machine.stribeck_n * np.exp(-((speed / STRIBECK_M_S) ** 2))
    level = level + machine.growth * np.abs(push)
    if machine.has_bristles:
        return _bristles(machine, speed, level, dt_s) + machine.viscous_n_s_m * speed
    share = np.tanh(speed / REVERSAL_M_S)
    if machine.presliding_m > 0.0:
        share = _towards(share, np.exp(-np.abs(speed) * dt_s / machine.presliding_m))
    return level * share + machine.viscous_n_s_m * speed


def _bristles(machine, speed, level, dt_s):
    """Canudas de Wit et al. 1995: dz/dt = v - stiffness |v| z / level, force = stiffness z, exact for constant v and level."""
    stiffness = machine.coulomb_n / machine.presliding_m
    return _towards(level * np.sign(speed), np.exp(-stiffness * np.abs(speed) * dt_s / level))


def _towards(end, left):
    """From zero, row after row: of the way to `end` the share `left` is left. Python's numbers are faster at it than arrays of
    six."""
    columns = []
    for ends, shares in zip(end.T.tolist(), left.T.tolist()):
        now, column = 0.0, []
        for towards, share in zip(ends, shares):
            now = towards + (now - towards) * share
            column.append(now)
        columns.append(column)
    return np.array(columns).T
