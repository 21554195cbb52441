"""Random machines, loads and states: the inputs of the cross-checks, as plain numbers and as platform files."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

LARGEST_ROTATION_RAD = np.radians(15.0)
PAPER_INERTIA_KG_M2 = np.diag([25.0, 25.0, 44.0])


@dataclass(frozen=True)
class Body:
    mass_kg: float
    com_m: np.ndarray  # (3,), platform axes, from O_A
    inertia_com_kg_m2: np.ndarray  # (3, 3) tensor about the centre of mass, platform axes


@dataclass(frozen=True)
class RigidMachine:
    """Without friction, and with legs without mass."""

    base_hinges_m: np.ndarray  # (6, 3)
    platform_hinges_m: np.ndarray  # (6, 3)
    home_leg_length_m: np.ndarray  # (6,)
    platform: Body
    gravity_m_s2: float


@dataclass(frozen=True)
class State:
    p_m: np.ndarray
    R: np.ndarray
    V: np.ndarray  # [v; omega], base axes
    leg_force_n: np.ndarray


def hinge_circle(radius_m: float, half_angle_deg: float, first_deg: float) -> np.ndarray:
    """Three pairs of hinges, each pair half_angle to both sides of its centre."""
    centre = np.radians(first_deg + np.repeat([0.0, 120.0, 240.0], 2))
    angle = centre + np.radians(half_angle_deg) * np.array([-1, 1, -1, 1, -1, 1])
    return radius_m * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(6)])


def paper_machine() -> RigidMachine:
    """Table 1 of the paper; base pairs at 0, 120, 240 degrees, platform pairs opposite, legs joining neighbours."""
    return RigidMachine(
        base_hinges_m=np.roll(hinge_circle(0.6, 10.0, 0.0), -1, axis=0),
        platform_hinges_m=hinge_circle(0.4, 15.0, 60.0),
        home_leg_length_m=np.full(6, 0.8741),
        platform=Body(100.0, np.zeros(3), PAPER_INERTIA_KG_M2),
        gravity_m_s2=9.81,
    )


def random_machine(rng: np.random.Generator) -> RigidMachine:
    """Every hinge off its circle in all axes, six home lengths, platform centre of mass and inertia at will."""
    paper = paper_machine()
    return RigidMachine(
        base_hinges_m=paper.base_hinges_m + rng.uniform(-0.08, 0.08, (6, 3)),
        platform_hinges_m=paper.platform_hinges_m + rng.uniform(-0.06, 0.06, (6, 3)),
        home_leg_length_m=rng.uniform(0.84, 0.91, 6),
        platform=Body(rng.uniform(60, 200), rng.uniform(-0.08, 0.08, 3), random_inertia(rng, rng.uniform(60, 200))),
        gravity_m_s2=rng.uniform(9.7, 9.9),
    )


def random_load(rng: np.random.Generator) -> Body:
    mass = rng.uniform(20, 1500)
    com = np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.05, 0.6)])
    return Body(mass, com, random_inertia(rng, mass))


def random_inertia(rng: np.random.Generator, mass_kg: float) -> np.ndarray:
    """Tensor of a box with edges of 0.3 to 1.2 m in any orientation."""
    edge2 = rng.uniform(0.3, 1.2, 3) ** 2
    axes = Rotation.random(random_state=rng).as_matrix()
    return axes @ np.diag(mass_kg / 12 * (edge2.sum() - edge2)) @ axes.T


def random_state(rng: np.random.Generator) -> State:
    """Within 0.12 m and 15 degrees of home about any axis, up to 1 m/s and 1 rad/s per component."""
    axis = rng.standard_normal(3)
    vector = rng.uniform(-LARGEST_ROTATION_RAD, LARGEST_ROTATION_RAD) * axis / np.linalg.norm(axis)
    return State(
        p_m=rng.uniform(-0.12, 0.12, 3),
        R=Rotation.from_rotvec(vector).as_matrix(),
        V=rng.uniform(-1, 1, 6),
        leg_force_n=rng.uniform(-5e3, 5e3, 6),
    )


def about_origin(body: Body) -> np.ndarray:
    """The body's tensor about O_A, by the parallel-axis theorem."""
    c = body.com_m
    return body.inertia_com_kg_m2 + body.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))


def write_platform(machine: RigidMachine, path: Path) -> Path:
    """The machine as a platform file with every digit."""
    tensor = about_origin(machine.platform)
    inertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    path.write_text(f"""\
[geometry]
base_hinges_m = {machine.base_hinges_m.tolist()}
platform_hinges_m = {machine.platform_hinges_m.tolist()}
home_leg_length_m = {machine.home_leg_length_m.tolist()}
stroke_m = [-0.3, 0.3]

[platform]
mass_kg = {float(machine.platform.mass_kg)}
com_m = {machine.platform.com_m.tolist()}
inertia_kg_m2 = {[float(entry) for entry in inertia]}

[environment]
gravity_m_s2 = {float(machine.gravity_m_s2)}

[sensors]
displacement_sigma_m = 20e-6
velocity_sigma_m_s = 1e-3
force_sigma_n = 5.0

[load]
known_mass_kg = 500.0
""")
    return path
