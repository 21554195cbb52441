"""A rig's forces against MuJoCo: what the oil pushed at every tick of a run must be what MuJoCo says that platform, load
and six unlike legs with mass took, on a tilted base, at the true hinges, and what friction took.

Pose and twist are the run's truth, the machine is the one that meta.json tells; accelerations are differences of the
truth. MuJoCo has each leg as two bodies on a universal joint and a slide; the laws of friction are written out here.
"""

import json
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from hexload import project
from hexload.io.toml_document import read_toml, to_toml
from hexload.theory.bound import read_platform
from machines import Body, RigidMachine, State
from mujoco_plant import MujocoPlant

STEP_S = 1e-3
LEGS = 6
# Fourth-order differences on both sides of a tick; the start, where the first valve command steps, is left out.
MARGIN = 100
BRISTLE_STEPS = 40
FIRST = np.array([1, -8, 0, 8, -1]) / (12 * STEP_S)
SECOND = np.array([-1, 16, -30, 16, -1]) / (12 * STEP_S**2)


def difference(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Along the first axis; the two rows at each end are not used."""
    return sum(weight * np.roll(values, 2 - i, axis=0) for i, weight in enumerate(weights))


def run_rig(folder: Path, changes: dict, **sections: dict) -> tuple[np.ndarray, dict]:
    """Truth by column name and meta.json of one second of the rig with some keys of the hydraulics, and of other sections,
    changed."""
    scenario = read_toml(project.SCENARIOS / "rig.toml")
    scenario["platform"] = str(project.SCENARIOS / "platforms" / "rig.toml")
    scenario["simulation"]["duration_s"] = 1.0
    # A slow valve: its commands step every millisecond, which differences of the truth follow the less well, the
    # faster the oil is.
    scenario["hydraulics"] |= {"valve_bandwidth_hz": 15.0} | changes
    scenario["sensors"]["noise_scale"] = 0.0
    for name, keys in sections.items():
        scenario[name] = scenario.get(name, {}) | keys
    (folder / "scenario.toml").write_text(to_toml(scenario))
    command = [project.simulator(), folder / "scenario.toml", "--out", folder / "run", "--quiet"]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
    truth = np.genfromtxt(folder / "run" / "truth.csv", delimiter=",", names=True)
    return truth, json.loads((folder / "run" / "meta.json").read_text())


def columns(truth: np.ndarray, names: list[str]) -> np.ndarray:
    return np.column_stack([truth[name] for name in names])


def platform_of(theta: np.ndarray) -> Body:
    mass, com = theta[0], theta[1:4] / theta[0]
    about_origin = np.array(
        [[theta[4], theta[7], theta[8]], [theta[7], theta[5], theta[9]], [theta[8], theta[9], theta[6]]]
    )
    return Body(mass, com, about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))


def load_of(meta: dict) -> Body:
    load = meta["loads"][0]
    i = load["inertia_com_kg_m2"]
    return Body(
        load["mass_kg"],
        np.array(load["com_m"]),
        np.array([[i[0], i[3], i[4]], [i[3], i[1], i[5]], [i[4], i[5], i[2]]]),
    )


def leg_model(rod_kg: float, rod_m: float, cylinder_kg: float, cylinder_m: float, gravity: list) -> mujoco.MjModel:
    """Two uniform bars, with next to no inertia about their own axis; the site is the upper hinge."""
    bar = lambda kg, length: f"{kg * length**2 / 12:.17g} {kg * length**2 / 12:.17g} 1e-12"  # noqa: E731
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0"/>
  <option gravity="{gravity[0]:.17g} {gravity[1]:.17g} {gravity[2]:.17g}"/>
  <worldbody>
    <body>
      <joint type="hinge" axis="1 0 0"/>
      <joint type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 {cylinder_m / 2:.17g}" mass="{cylinder_kg:.17g}" diaginertia="{bar(cylinder_kg, cylinder_m)}"/>
      <body>
        <joint type="slide" axis="0 0 1"/>
        <inertial pos="0 0 {-rod_m / 2:.17g}" mass="{rod_kg:.17g}" diaginertia="{bar(rod_kg, rod_m)}"/>
        <site name="upper" pos="0 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>""")


def hinge_forces(model: mujoco.MjModel, leg_m: np.ndarray) -> np.ndarray:
    """(n, 3) what the upper hinge must be pushed with to go along leg_m, base axes."""
    length = np.linalg.norm(leg_m, axis=1)
    e = leg_m / length[:, None]
    q = np.column_stack([np.arctan2(-e[:, 1], e[:, 2]), np.arcsin(e[:, 0]), length])
    rate, acceleration = difference(q, FIRST), difference(q, SECOND)
    data = mujoco.MjData(model)
    forces = np.zeros_like(leg_m)
    for tick in range(2, len(q) - 2):
        data.qpos, data.qvel, data.qacc = q[tick], rate[tick], acceleration[tick]
        mujoco.mj_inverse(model, data)
        jacobian = np.zeros((3, 3))
        mujoco.mj_jacSite(model, data, jacobian, None, 0)
        forces[tick] = np.linalg.solve(jacobian.T, data.qfrc_inverse)
    return forces


def body_wrenches(plant: MujocoPlant, p: np.ndarray, R: np.ndarray, V: np.ndarray) -> np.ndarray:
    """(n, 6) what platform and load take, about O_A, base axes."""
    rate = difference(V, FIRST)
    wrenches = np.zeros((len(p), 6))
    for tick in range(2, len(p) - 2):
        plant.set_state(State(p[tick], R[tick], V[tick], np.zeros(LEGS)))
        wrenches[tick] = plant.mass_matrix() @ rate[tick] + plant.holding_wrench()
    return wrenches


def needed_forces(truth: np.ndarray, meta: dict) -> np.ndarray:
    """(n, 6) leg forces on the platform, by MuJoCo."""
    rig = meta["rig"]
    nominal = read_platform(project.SCENARIOS / "platforms" / "rig.toml")
    base, upper = np.array(rig["base_hinges_m"]), np.array(rig["platform_hinges_m"])
    home = np.array([0.0, 0.0, nominal.home_height_m])
    machine = RigidMachine(base, upper, np.full(LEGS, 0.8741), platform_of(np.array(rig["platform_theta"])), 0.0)
    plant = MujocoPlant(machine, load_of(meta), nominal.home_height_m)
    plant.model.opt.gravity[:] = rig["gravity_m_s2"]
    p = columns(truth, ["x", "y", "z"])
    R = Rotation.from_euler("xyz", columns(truth, ["roll", "pitch", "yaw"])).as_matrix()
    V = columns(truth, ["vx", "vy", "vz", "wx", "wy", "wz"])
    wrench = body_wrenches(plant, p, R, V)
    arm = R @ upper.T  # (n, 3, leg)
    leg_m = (home + p)[:, :, None] + arm - base.T
    bars = ("rod_mass_kg", "rod_length_m", "cylinder_mass_kg", "cylinder_length_m")
    values = [np.broadcast_to(rig[name], LEGS) for name in bars]
    for leg in range(LEGS):
        model = leg_model(*(value[leg] for value in values), rig["gravity_m_s2"])
        force = hinge_forces(model, leg_m[:, :, leg])
        wrench += np.concatenate([force, np.cross(arm[:, :, leg], force)], axis=1)
    e = leg_m / np.linalg.norm(leg_m, axis=1)[:, None, :]
    jacobian_t = np.concatenate([e, np.cross(arm, e, axis=1)], axis=1)
    return np.linalg.solve(jacobian_t, wrench[:, :, None])[:, :, 0]


def dry_level(rig: dict, v: np.ndarray, f: np.ndarray) -> np.ndarray:
    coulomb, at_rest = np.array(rig["coulomb_friction_n"]), np.array(rig["static_friction_n"])
    stribeck = (at_rest - coulomb) * np.exp(-((v / rig["stribeck_speed_m_s"]) ** 2))
    return coulomb + stribeck + rig["friction_force_share"] * np.abs(f)


def coldness(rig: dict, t: np.ndarray) -> np.ndarray:
    return (1 + (rig["cold_friction_factor"] - 1) * np.exp(-t / rig["friction_warm_up_s"]))[:, None]


def stribeck_friction(rig: dict, t: np.ndarray, v: np.ndarray, f: np.ndarray) -> np.ndarray:
    smooth = v / np.sqrt(v**2 + rig["friction_speed_m_s"] ** 2)
    return coldness(rig, t) * (dry_level(rig, v, f) * smooth + np.array(rig["viscous_friction_n_s_m"]) * v)


def lugre_friction(rig: dict, t: np.ndarray, v: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Bristles in steps so short that speed and level are constant in each, where the solution is an exponential."""
    step_s = STEP_S / BRISTLE_STEPS
    fine_t = np.arange((len(t) - 1) * BRISTLE_STEPS + 1) * step_s
    middle_t = fine_t[:-1] + step_s / 2
    speed = CubicSpline(t, v)(middle_t)
    level = coldness(rig, middle_t) * dry_level(rig, speed, CubicSpline(t, f)(middle_t))
    relaxation = rig["bristle_stiffness_n_m"] * np.abs(speed) / level
    kept, end = np.exp(-relaxation * step_s), np.sign(speed) * level / rig["bristle_stiffness_n_m"]
    z = np.zeros((len(fine_t), LEGS))
    for i in range(len(middle_t)):
        z[i + 1] = end[i] + (z[i] - end[i]) * kept[i]
    z = z[::BRISTLE_STEPS]
    z_rate = v - rig["bristle_stiffness_n_m"] * np.abs(v) / (coldness(rig, t) * dry_level(rig, v, f)) * z
    viscous = coldness(rig, t) * np.array(rig["viscous_friction_n_s_m"]) * v
    return rig["bristle_stiffness_n_m"] * z + rig["bristle_damping_n_s_m"] * z_rate + viscous


LAWS = {"stribeck": stribeck_friction, "lugre": lugre_friction}


# Where a leg turns round friction steps by 200 N within two ticks, which differences of the truth do not follow: the
# median and the third quartile of the ticks count. The rest is what they lose of oil columns of up to 40 Hz,
# (2 pi 40 Hz x 1 ms)^4 / 30 = 1e-4 of some 10 N, and the bristles' time steps. What is judged is larger throughout:
# hinge errors change forces by 0.5 N, the cold and the load on the seals by 3 N, tilt by 20 N, legs by 100 N.
@pytest.mark.parametrize("law", LAWS)
def test_what_the_oil_of_a_rig_pushes_is_what_mujoco_and_friction_take(law, tmp_path, record_property):
    # GIVEN a second of the rig
    truth, meta = run_rig(tmp_path, {"friction_law": law})
    legs = range(1, LEGS + 1)
    f, v = columns(truth, [f"f{i}" for i in legs]), columns(truth, [f"vl{i}" for i in legs])
    # WHEN MuJoCo and the law of friction are asked what the motion takes
    off = f - needed_forces(truth, meta) - LAWS[law](meta["rig"], truth["t"], v, f)
    # THEN that is what the oil pushed
    median, quartile = np.quantile(np.abs(off[MARGIN:-MARGIN]).max(axis=1), [0.5, 0.75])
    record_property("off_n", [median, quartile])
    print(f"{law}: {median:.2g} N at half of the ticks, {quartile:.2g} N at three quarters, of {np.abs(f).max():.0f} N")
    assert median < 5e-3
    assert quartile < 0.05


# Friction turns round within a tick, so quantiles are judged here too. Differences lose what the drives' speed loop of 20 Hz leaves
# of the servo's steps in slope, thousandths of a newton; screws of 75 kg take 100 N, friction 150 N, and a cell that showed them, or
# a current that did not, would be as much off.
@pytest.mark.parametrize("force_signal", ["load_cell", "current"])
def test_what_an_electric_leg_shows_is_what_mujoco_screw_and_motor_take(force_signal, tmp_path, record_property):
    # GIVEN a second of the rig on motors with screws of 75 kg that rub
    rubs = {"coulomb_friction_n": 150.0, "static_friction_n": 150.0, "viscous_friction_n_s_m": 400.0}
    law = rubs | {"friction_law": "stribeck", "friction_speed_m_s": 5e-3, "stribeck_speed_m_s": 1e-2}
    electric = law | {"force_gain_n_a": 400.0, "reflected_mass_kg": 75.0, "force_signal": force_signal}
    servo = {"reads_sensors": False, "velocity_feedforward": 1.0, "pressure_feedback_1_n": 0.0}
    truth, meta = run_rig(tmp_path, {}, electric=electric, controller=servo)
    legs = range(1, LEGS + 1)
    f, v = columns(truth, [f"f{i}" for i in legs]), columns(truth, [f"vl{i}" for i in legs])
    # WHEN MuJoCo is asked what platform, load and legs take
    needed = needed_forces(truth, meta)
    # THEN a load cell shows that, and the current what friction and the reflected mass take besides
    if force_signal == "current":
        needed += 150.0 * v / np.sqrt(v**2 + 5e-3**2) + 400.0 * v + 75.0 * difference(v, FIRST)
    off = np.abs(f - needed)[MARGIN:-MARGIN].max(axis=1)
    median, quartile = np.quantile(off, [0.5, 0.75])
    record_property("off_n", [median, quartile])
    print(f"{force_signal}: {median:.2g} N at half of the ticks, {quartile:.2g} N at three quarters")
    assert median < 0.02
    assert quartile < 0.05
