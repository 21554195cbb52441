"""What a campaign runs: classes of cases, and the load, servo, motion and machine drawn for each seed of a class.

A case is defined by its class, its seed and its duration alone: the same three give the same numbers, in whatever
campaign.
"""

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.campaign.rigs import TOLERANCES, draw_rig, with_rig
from hexload.io.toml_document import Table, read_toml
from hexload.theory.bound import LEGS, LegFriction

Array = NDArray[np.float64]
Motion = Literal["multisine", "paper", "paper_rest", "paper_run_in", "work", "work_after_stand", "standstill"]
Change = Literal["pick_up", "drop", "shift"]

REST_S = 0.3  # before the paper's motion in paper_rest; the length of its run-in in paper_run_in
MOTION_FILE = "motion.csv"
TARED = "momentum_tared"  # the momentum filter, given the tare
FRICTION = project.SCENARIOS / "friction.toml"  # whose legs the classes with machine effects have
FRICTION_SPEED_M_S = 5e-3  # from which their Coulomb friction is nearly whole; known to the controller
LEG_BARS = {"rod_mass_kg": 1.0, "cylinder_mass_kg": 2.0}
TARE_MOTION = {"kind": "multisine"}
TARE_S = 10.0
PROPORTIONAL_1_M = (5.0, 35.0)
INTEGRAL_1_M_S = (0.0, 35.0)
# The oil column, damped by the feedback of pressure alone, leaves a proportional servo stable up to 5.7e6 N/m times
# that feedback whatever the load's mass (Routh; 60 rad/s at 600 kg, 0.4 of critical at 7e-6 1/N): the valve takes a third.
PROPORTIONAL_PER_FEEDBACK_N_M = 4e6
COMMISSIONING_S = 20.0
# A simulated machine is exactly its platform file's, or a rig, whose tolerances are rigs.py's.
EXACT = dict.fromkeys(
    ("friction_shape", "force_gain_common", "platform_mass", "platform_com_m", "platform_inertia", "timing_s"), 0.0
)
LARGEST_BIAS_N = 70.0  # of a force sensor


@dataclass(frozen=True)
class CaseClass:
    says: str
    motion: Motion
    change: Change | None = None
    stated_sigma: float = 1.0  # times the machine's nominal sensor sigmas: what the estimators are given
    true_sigma: float = 1.0  # times the stated ones: what the sensors have
    mass_kg: tuple[float, float] = (100.0, 700.0)
    on_axis: bool = False  # the paper's kind of load: centre of mass on the axis, no products of inertia
    own_machine: bool = False  # hinges, platform and its centre of mass are drawn too
    legs: bool = False  # legs with mass, which the platform file does not know; a run of the empty platform is the tare
    velocity_sensors: bool = True
    rig: bool = False  # a machine with every effect of a real one, which is commissioned by a run of the empty platform
    effects: bool = False  # biased force sensors and legs that rub, of which the controller is to find out
    friction_shape: float = 0.0  # how little it knows of friction near zero speed: [tolerances] of the platform file
    freed: bool = False  # what commissioning leaves of a rig's offsets, friction and tilt is found with the load


CLASSES: dict[str, CaseClass] = {
    "multisine": CaseClass("six-axis multisine", "multisine"),
    "paper": CaseClass("the paper's motion, which starts with a step of velocity", "paper"),
    "paper_rest": CaseClass(f"the paper's motion after {REST_S} s of rest", "paper_rest"),
    "paper_run_in": CaseClass(f"the paper's motion run in over {REST_S} s", "paper_run_in"),
    "paper_on_axis": CaseClass("the paper's motion and kind of load, on the platform's axis", "paper", on_axis=True),
    "work": CaseClass("point-to-point work motion with dwells", "work"),
    "multisine_pick_up": CaseClass("multisine, the empty platform picks up a load", "multisine", "pick_up"),
    "multisine_drop": CaseClass("multisine, the load drops off", "multisine", "drop"),
    "multisine_shift": CaseClass("multisine, the load's centre of mass shifts by 5 to 12 cm", "multisine", "shift"),
    "work_pick_up": CaseClass("work motion, the empty platform picks up a load", "work", "pick_up"),
    "work_drop": CaseClass("work motion, the load drops off", "work", "drop"),
    "work_shift": CaseClass("work motion, the load's centre of mass shifts by 5 to 12 cm", "work", "shift"),
    "standstill": CaseClass("the platform holds a pose", "standstill"),
    "work_after_stand": CaseClass("work motion whose dwells take as long as its moves", "work_after_stand"),
    "multisine_noise5": CaseClass("multisine, five times the nominal noise", "multisine", stated_sigma=5.0),
    "paper_noise5": CaseClass("the paper's motion, five times the nominal noise", "paper", stated_sigma=5.0),
    "work_noise5": CaseClass("work motion, five times the nominal noise", "work", stated_sigma=5.0),
    "multisine_understated": CaseClass("multisine, twice the noise that is stated", "multisine", true_sigma=2.0),
    "paper_understated": CaseClass("the paper's motion, twice the noise that is stated", "paper", true_sigma=2.0),
    "work_understated": CaseClass("work motion, twice the noise that is stated", "work", true_sigma=2.0),
    "paper_light": CaseClass("the paper's motion, a load of 10 kg", "paper", mass_kg=(10.0, 10.0)),
    "multisine_machines": CaseClass("multisine on machines of other geometry", "multisine", own_machine=True),
    "work_machines": CaseClass("work motion on machines of other geometry", "work", own_machine=True),
    "multisine_no_velocity": CaseClass("multisine, no velocity sensors", "multisine", velocity_sensors=False),
    "work_no_velocity": CaseClass("work motion, no velocity sensors", "work", velocity_sensors=False),
    "paper_no_velocity": CaseClass("the paper's motion, no velocity sensors", "paper", velocity_sensors=False),
    "work_drop_no_velocity": CaseClass(
        "work motion, the load drops off, no velocity sensors", "work", "drop", velocity_sensors=False
    ),
    "work_shift_no_velocity": CaseClass(
        "work motion, the load's centre of mass shifts by 5 to 12 cm, no velocity sensors",
        "work",
        "shift",
        velocity_sensors=False,
    ),
    "multisine_leg_mass": CaseClass("multisine, legs with mass, and a tare", "multisine", legs=True),
    "work_leg_mass": CaseClass("work motion, legs with mass, and a tare", "work", legs=True),
    "multisine_actuator_effects": CaseClass("multisine, biased force sensors and friction", "multisine", effects=True),
    "paper_actuator_effects": CaseClass("the paper's motion, biased force sensors and friction", "paper", effects=True),
    "work_actuator_effects": CaseClass("work motion, biased force sensors and friction", "work", effects=True),
    "multisine_friction_shape": CaseClass(
        "multisine, biased force sensors and friction of unknown shape", "multisine", effects=True, friction_shape=2.0
    ),
    "paper_friction_shape": CaseClass(
        "the paper's motion, biased force sensors and friction of unknown shape",
        "paper",
        effects=True,
        friction_shape=2.0,
    ),
    "work_friction_shape": CaseClass(
        "work motion, biased force sensors and friction of unknown shape", "work", effects=True, friction_shape=2.0
    ),
    "rig_multisine": CaseClass("multisine on a new rig each run, commissioned", "multisine", rig=True),
    "rig_work": CaseClass("work motion on a new rig each run, commissioned", "work", rig=True),
    "rig_paper": CaseClass("the paper's motion on a new rig each run, commissioned", "paper_rest", rig=True),
    "rig_multisine_freed": CaseClass(
        "multisine on a new rig each run, commissioned, effects freed", "multisine", rig=True, freed=True
    ),
    "rig_work_freed": CaseClass(
        "work motion on a new rig each run, commissioned, effects freed", "work", rig=True, freed=True
    ),
    "rig_changes": CaseClass(
        "work motion on a new rig each run, the empty platform picks up a load", "work", "pick_up", rig=True
    ),
}
DEFAULT_CLASSES = ("multisine", "paper", "paper_rest", "work")


@dataclass(frozen=True)
class Case:
    class_name: str
    seed: int
    duration_s: float
    tick_s: float = 1e-3

    @property
    def name(self) -> str:
        return f"{self.class_name}-{self.seed}"


@dataclass(frozen=True)
class Body:
    """A load: mass, centre of mass in platform axes, tensor about it (Ixx, Iyy, Izz, Ixy, Ixz, Iyz)."""

    mass_kg: float
    com_m: Array
    inertia_com_kg_m2: Array


EMPTY = Body(0.0, np.zeros(3), np.zeros(6))


@dataclass(frozen=True)
class Effects:
    """What the machine adds to the forces that the controller sees."""

    bias_n: Array  # (6,)
    machine: LegFriction

    @property
    def values(self) -> Array:
        """(18,), in the order of bound.EFFECTS."""
        return np.concatenate([self.bias_n, self.machine.coulomb_n, self.machine.viscous_n_s_m])


@dataclass(frozen=True)
class Setup:
    """All that one case needs; arrays of tables as in the files of the simulator."""

    platform: Table  # without [load]
    scenario: Table
    motion_rows: Array | None  # (n, 7): t, x, y, z, roll, pitch, yaw, for the scenario's motion file
    tare_scenario: Table | None  # of the empty platform
    commissioning_scenario: Table | None  # of the empty platform of a rig
    effects: Effects | None
    freed: bool = False

    @property
    def filters(self) -> tuple[str, ...]:
        """The firmware's estimators of all ten parameters for this case; the first is the controller's."""
        if self.effects is not None:
            return ("momentum_effects", "momentum")
        if self.freed:
            return ("momentum_effects",)
        return ("momentum",) if self.tare_scenario is None else (TARED, "momentum")

    @property
    def kind(self) -> str:
        """The controller's estimator as platform files name it."""
        return self.filters[-1] if self.effects is None else self.filters[0]


def draw(case: Case, kind: CaseClass | None = None) -> Setup:
    """The case's load, servo, motion, machine and noise. `kind`: another class than that of its name."""
    kind = kind or CLASSES[case.class_name]
    # The class is part of the seed, so that two classes do not share their loads.
    random = np.random.default_rng([zlib.crc32(case.class_name.encode()), case.seed])
    loads = _draw_loads(random, kind, case.duration_s)
    controller = _draw_servo(random)
    noise_seed = int(random.integers(2**31))
    trajectory, rows = _motion(random, kind.motion, case.duration_s)
    scenario = {
        "name": case.name,
        "description": kind.says,
        "platform": "platform.toml",
        "simulation": {"duration_s": case.duration_s, "seed": noise_seed},
        "load": [_load_table(at_s, body) for at_s, body in loads],
        "trajectory": trajectory,
        "controller": controller,
        "sensors": {"noise_scale": kind.true_sigma, "velocity_sensor": kind.velocity_sensors},
    }
    platform = _draw_platform(random, kind)
    platform["sensors"]["tick_s"] = case.tick_s
    commissioning_scenario = None
    if kind.rig:
        platform["tolerances"] = TOLERANCES
        scenario = with_rig(scenario, draw_rig(random))
        commissioning_scenario = empty_run(random, scenario, COMMISSIONING_S)
    effects = _add_effects(random, platform, scenario) if kind.effects else None
    tare_scenario = _add_legs(random, scenario) if kind.legs else None
    return Setup(platform, scenario, rows, tare_scenario, commissioning_scenario, effects, kind.freed)


def _draw_servo(random: np.random.Generator) -> Table:
    """From sluggish to stiff, without velocity feed-forward and with all of it."""
    pressure_feedback_1_n = random.uniform(4e-6, 9e-6)
    stable_1_m = PROPORTIONAL_PER_FEEDBACK_N_M * pressure_feedback_1_n
    low_1_m, high_1_m = PROPORTIONAL_1_M
    proportional_1_m = np.exp(random.uniform(np.log(low_1_m), np.log(min(high_1_m, stable_1_m))))
    return {
        "velocity_feedforward": random.uniform(0.0, 1.0),
        "proportional_1_m": float(proportional_1_m),
        "integral_1_m_s": random.uniform(*INTEGRAL_1_M_S),
        "pressure_feedback_1_n": pressure_feedback_1_n,
    }


def _draw_loads(random: np.random.Generator, kind: CaseClass, duration_s: float) -> list[tuple[float, Body]]:
    body = _draw_body(random, kind.mass_kg)
    if kind.on_axis:
        body = Body(body.mass_kg, body.com_m * [0.0, 0.0, 1.0], body.inertia_com_kg_m2 * [1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    if kind.change is None:
        return [(0.0, body)]
    at_s = round(random.uniform(0.4, 0.6) * duration_s, 3)
    if kind.change == "shift":
        direction = random.normal(size=3)
        shift_m = random.uniform(0.05, 0.12) * direction / np.linalg.norm(direction)
        return [(0.0, body), (at_s, Body(body.mass_kg, body.com_m + shift_m, body.inertia_com_kg_m2))]
    order = [EMPTY, body] if kind.change == "pick_up" else [body, EMPTY]
    return list(zip((0.0, at_s), order, strict=True))


def _draw_body(random: np.random.Generator, mass_kg: tuple[float, float]) -> Body:
    """Mass spread like an ellipsoid's along three axes of any direction: a tensor that some body has."""
    mass = random.uniform(*mass_kg)
    radii_m = random.uniform(0.15, 0.3, 3)
    axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
    second_moment = axes @ np.diag(0.6 * mass * radii_m**2) @ axes.T
    inertia = np.trace(second_moment) * np.eye(3) - second_moment
    com_m = random.uniform([-0.12, -0.12, 0.1], [0.12, 0.12, 0.4])
    return Body(mass, com_m, inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)])


def _load_table(at_s: float, body: Body) -> Table:
    return {
        "at_s": at_s,
        "mass_kg": body.mass_kg,
        "com_m": body.com_m.tolist(),
        "inertia_com_kg_m2": body.inertia_com_kg_m2.tolist(),
    }


def _motion(random: np.random.Generator, motion: Motion, duration_s: float) -> tuple[Table, Array | None]:
    """The scenario's [trajectory], and the rows of its motion file if it has one."""
    if motion == "paper_run_in":
        return {"kind": "paper", "run_in_s": REST_S}, None
    if motion == "paper_rest":
        return {"kind": "file", "path": MOTION_FILE}, _paper_after_rest(duration_s)
    if motion == "work_after_stand":
        return {"kind": "work", "dwell_s": 2.5}, None
    if motion == "standstill":
        reach = np.array([0.08, 0.08, 0.08, 0.12, 0.12, 0.12])
        return {"kind": "standstill", "pose": random.uniform(-reach, reach).tolist()}, None
    return {"kind": motion}, None


def _paper_after_rest(duration_s: float) -> Array:
    t = np.arange(round(1000 * duration_s) + 2) * 1e-3
    sine = np.sin(np.pi * np.maximum(t - REST_S, 0.0))
    rows = np.zeros((len(t), 7))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 6] = t, 0.2 * sine, 0.2 * sine, np.radians(0.2) * sine
    return rows


def with_noise(sensors: Table, scale: float) -> Table:
    """[sensors] of a platform file that states `scale` times the noise."""
    return {name: scale * value if "_sigma_" in name else value for name, value in sensors.items()}


def _draw_platform(random: np.random.Generator, kind: CaseClass) -> Table:
    platform = read_toml(Path(project.SCENARIOS / "platforms" / "paper.toml"))
    del platform["load"], platform["estimator"]
    platform["tolerances"] = EXACT | {"friction_shape": kind.friction_shape}
    platform["sensors"] = with_noise(platform["sensors"], kind.stated_sigma)
    return with_own_machine(platform, random) if kind.own_machine else platform


def with_own_machine(platform: Table, random: np.random.Generator) -> Table:
    """Another hexapod with the same sensors: hinges, home lengths, mass, centre and inertia of the platform drawn."""
    hinges = _draw_hinges(random)
    mass = random.uniform(60.0, 200.0)
    com_m = random.uniform(-0.04, 0.04, 3)
    second_moments = random.uniform([0.15, 0.15, 0.04], [0.22, 0.22, 0.08]) * mass
    inertia = second_moments.sum() - second_moments
    about_origin = mass * (com_m @ com_m - com_m**2)
    products = -mass * com_m[[0, 0, 1]] * com_m[[1, 2, 2]]
    body = {
        "mass_kg": mass,
        "com_m": com_m.tolist(),
        "inertia_kg_m2": [*(inertia + about_origin).tolist(), *products.tolist()],
    }
    return platform | {"geometry": platform["geometry"] | hinges, "platform": body}


def _add_legs(random: np.random.Generator, scenario: Table) -> Table:
    """Returns the scenario of the tare."""
    scenario["legs"] = LEG_BARS
    return empty_run(random, scenario, TARE_S)


def empty_run(random: np.random.Generator, scenario: Table, duration_s: float) -> Table:
    """The scenario's machine without load, on a multisine."""
    seed = int(random.integers(2**31))
    empty = {"simulation": {"duration_s": duration_s, "seed": seed}, "load": [_load_table(0.0, EMPTY)]}
    return scenario | empty | {"trajectory": TARE_MOTION}


def _add_effects(random: np.random.Generator, platform: Table, scenario: Table) -> Effects:
    """Every leg has the friction of a scenario; biases are drawn. Of all that the controller knows the speed alone."""
    friction = read_toml(FRICTION)["hydraulics"] | {"friction_speed_m_s": FRICTION_SPEED_M_S}
    bias_n = random.uniform(-LARGEST_BIAS_N, LARGEST_BIAS_N, LEGS)
    scenario["hydraulics"] = friction
    scenario["sensors"]["force_bias_n"] = bias_n.tolist()
    platform["estimator"] = {"friction_speed_m_s": FRICTION_SPEED_M_S}
    coulomb_n, viscous_n_s_m = friction["coulomb_friction_n"], friction["viscous_friction_n_s_m"]
    return Effects(bias_n, LegFriction(np.full(LEGS, coulomb_n), np.full(LEGS, viscous_n_s_m), FRICTION_SPEED_M_S))


def _draw_hinges(random: np.random.Generator) -> Table:
    """Three pairs of hinges each, not quite on a circle or in a plane, the whole turned about the vertical."""
    turn = random.uniform(0.0, 2.0 * np.pi)
    pairs = np.repeat(np.radians([0.0, 120.0, 240.0]), 2)
    sides = np.tile([1.0, -1.0], 3)
    base_angle = np.radians(random.uniform(7.0, 14.0))
    upper_angle = np.radians(random.uniform(10.0, 20.0))
    base = _circle(random.uniform(0.55, 0.75), turn + pairs + sides * base_angle)
    # A leg goes from one base pair to the platform pair on its side.
    upper = _circle(random.uniform(0.35, 0.5), turn + pairs + sides * (np.pi / 3.0 - upper_angle))
    base += random.uniform(-0.01, 0.01, (6, 3))
    upper += random.uniform(-0.01, 0.01, (6, 3))
    lengths = np.linalg.norm(upper - base + [0.0, 0.0, random.uniform(0.68, 0.8)], axis=1)
    return {
        "base_hinges_m": base.tolist(),
        "platform_hinges_m": upper.tolist(),
        "home_leg_length_m": lengths.tolist(),
    }


def _circle(radius_m: float, angle_rad: Array) -> Array:
    return radius_m * np.stack([np.cos(angle_rad), np.sin(angle_rad), np.zeros_like(angle_rad)], axis=1)
