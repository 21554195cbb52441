"""`hexload excite`: the motion it finds, checked with the simulator and with the bound, and what it refuses."""

import json
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import hexload_native
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from excite_machines import faults_of_run, random_platform, try_machine
from hexload import project
from hexload.cli import platform_new
from hexload.cli.excite import (
    ACTUATOR_KEYS,
    Wish,
    design,
    heaviest_kg,
    load_on_axis,
    machine_of,
    problem_of,
    summary_of,
)
from hexload.cli.excite_check import QUANTITIES
from hexload.errors import InputError
from hexload.estimation import commission as commissioning
from hexload.estimation.commission import commission
from hexload.io.toml_document import read_toml, to_toml
from hexload.theory import bound, excitation
from servo_poles import growth_1_s

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PAPER_LIKE = (1.2, 19e3, 2.6)  # unloaded speed, stall force and pump of the default hydraulics, rounded
FUZZED_MACHINES = 8
WISH = Wish(
    platform_file=PLATFORM,
    duration_s=3.0,
    scenario="multisine",
    mass_kg=None,
    height_m=None,
    seed=3,
    starts=1,
    iterations=20,
    sines=5,
    frequency_max_hz=2.5,
)


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("excite") / "found.csv"
    design(WISH, out)
    return out


def problem() -> excitation.Problem:
    scenario = hexload_native.load_scenario(str(project.SCENARIOS / "multisine.toml"))
    return problem_of(WISH, hexload_native.load_platform(str(PLATFORM)), scenario)[0]


def read_rows(path: Path) -> np.ndarray:
    assert path.read_text().startswith("t,x,y,z,roll,pitch,yaw\n")
    return np.loadtxt(path, delimiter=",", skiprows=1)


def trajectory_of_file(path: Path) -> bound.Trajectory:
    """At each tick, without the simulator's code: cubics with central slopes, angular velocity from the change of R."""
    rows = read_rows(path)
    slopes = np.zeros_like(rows[:, 1:])
    slopes[1:-1] = (rows[2:, 1:] - rows[:-2, 1:]) / (rows[2:, :1] - rows[:-2, :1])
    spline = CubicHermiteSpline(rows[:, 0], rows[:, 1:], slopes)
    t = np.arange(round(rows[-1, 0] / 1e-3) + 1) * 1e-3

    def rotation(at_s):
        return Rotation.from_euler("ZYX", spline(at_s)[:, 5:2:-1])

    step_s = 1e-6
    turn = rotation(t + step_s) * rotation(t - step_s).inv()
    return bound.Trajectory(
        spline(t)[:, :3], rotation(t).as_matrix(), spline(t, 1)[:, :3], turn.as_rotvec() / (2 * step_s)
    )


def test_the_motion_starts_and_ends_at_rest_at_home(found):
    # GIVEN the motion found
    rows = read_rows(found)
    # WHEN its ends are looked at THEN the time is the wanted one, and the pose is home
    assert (rows[0, 0], rows[-1, 0]) == (0.0, 3.0)
    assert (rows[[0, -1], 1:] == 0).all()
    # AND the first and last 2 ms of a quintic of 0.5 s, 10 (2 / 500)^3 = 6e-7 of 0.5 m or rad, are next to rest
    assert np.abs(rows[[1, -2], 1:]).max() < 1e-6


def test_the_motion_uses_a_limit_and_keeps_all(found, record_property):
    # GIVEN the limits of the simulator's own seeded motions
    scenario = hexload_native.load_scenario(str(project.SCENARIOS / "multisine.toml"))
    platform = hexload_native.load_platform(str(PLATFORM))
    low, high, speed_limit, sum_limit, force_limit = scenario.motion_limits(platform)
    # WHEN the simulator reads the file THEN it finds stroke, leg speed and flow kept
    rows, keeps_limits = scenario.reference_motion(platform, WISH.duration_s, file=found)
    assert keeps_limits
    # AND by the plant's kinematics and inverse dynamics the largest use of any limit is 100 %, less a margin of 0.1 %
    # and what force gains when accelerations are taken from differences of 1 ms: (2 pi 2.5 Hz 1 ms)^2 / 6 = 4e-5
    used = {"stroke": 0.0, "speed": 0.0, "flow": 0.0, "force": 0.0}
    sum_limit *= 0.8  # of the pump, what a motion may use
    # AND by the largest load that is thought of, half as heavy again as the expected 500 kg
    load = hexload_native.Load(750.0, np.array([0.0, 0.0, 0.3]), 750.0 * 0.2**2 * np.eye(3))
    for before, row, after in zip(rows, rows[1:], rows[2:]):
        rotation = hexload_native.rotation_from_rpy(row[3:6])
        displacement = hexload_native.leg_displacement(platform, row[:3], rotation)
        speed = np.abs(hexload_native.leg_velocity(platform, row[:3], rotation, row[6:]))
        force = hexload_native.leg_forces(platform, load, row[:3], rotation, row[6:], (after[6:] - before[6:]) / 2e-3)
        used["stroke"] = max(used["stroke"], (displacement / high).max(), (displacement / low).max())
        used["speed"] = max(used["speed"], speed.max() / speed_limit)
        used["flow"] = max(used["flow"], speed.sum() / sum_limit)
        used["force"] = max(used["force"], np.abs(force).max() / force_limit)
    record_property("used", used)
    print("used share of each limit:", used)
    assert 0.99 < max(used.values()) < 1.0 + 1e-3


def test_the_simulator_runs_the_motion_inside_the_machines_limits(found, tmp_path, record_property):
    # GIVEN a scenario with the file as its motion and the load that was expected
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(
        f'name = "excite"\nplatform = "{PLATFORM}"\n[simulation]\nduration_s = 3.0\n'
        "[[load]]\nat_s = 0.0\nmass_kg = 500.0\ncom_m = [0.0, 0.0, 0.3]\n"
        "inertia_com_kg_m2 = [20.0, 20.0, 20.0, 0.0, 0.0, 0.0]\n"
        f'[trajectory]\nkind = "file"\npath = "{found}"\n'
    )
    # WHEN it is simulated with hydraulics and servo
    out = tmp_path / "run"
    subprocess.run([project.simulator(), scenario, "--out", out, "--quiet"], check=True)
    log = np.loadtxt(out / "truth.csv", delimiter=",", skiprows=1)
    displacement, speed, force = log[:, 19:25], np.abs(log[:, 25:31]), np.abs(log[:, 31:37])
    low, high, speed_limit, sum_limit, force_limit = hexload_native.load_scenario(str(scenario)).motion_limits(
        hexload_native.load_platform(str(PLATFORM))
    )
    used = [
        displacement.max() / high,
        speed.max() / speed_limit,
        speed.sum(axis=1).max() / sum_limit,
        force.max() / force_limit,
    ]
    record_property("used", used)
    print("stroke, speed, flow and force of the run, of the limits:", np.array(used))
    # THEN no end stop is touched: the limit leaves a tenth of the stroke
    assert displacement.min() > low / 0.9
    assert displacement.max() < high / 0.9
    # AND speeds, which the limits leave three tenths of the valve's, and forces, half of stall, are what was planned
    # within the 20 % by which a servo of 3 Hz may shoot over at 2.5 Hz
    assert max(used[1:]) < 1.2


def test_the_bound_shown_is_that_of_the_trajectory_in_the_file(found, record_property):
    # GIVEN the summary, and the file read without the simulator
    summary = json.loads(summary_of(found).read_text())
    # WHEN the bound of that trajectory is computed for the summary's load, prior and the platform's sensors
    sigma = bound.crlb(
        bound.read_platform(PLATFORM),
        trajectory_of_file(found),
        summary["theta"],
        bound.Sigmas(1e-3, 5.0),
        summary["prior_sigma"],
    )[-1]
    relative = sigma / summary["scale"]
    record_property("relative bound", relative.tolist())
    # THEN it is the one told: angular velocity from differences of 1 us is good to 1e-9
    np.testing.assert_allclose(summary["relative_bound"]["found"], relative, rtol=1e-6)


def test_the_motion_is_better_than_the_papers_and_than_the_multisine(found, record_property):
    # GIVEN the bounds of the three motions over the same time
    bounds = {name: max(values) for name, values in json.loads(summary_of(found).read_text())["relative_bound"].items()}
    record_property("worst relative bound", bounds)
    print("worst relative bound:", bounds)
    # WHEN the worst parameter is looked at THEN the paper's motion leaves it unknown, its prior being ten times its
    # scale
    assert bounds["paper"] > 5.0
    # AND the motion found, after 20 steps of one search, is better than a random multisine inside the same limits
    assert bounds["found"] < bounds["multisine"]


def test_the_fast_information_is_the_bounds(found, record_property):
    # GIVEN a random motion inside the limits and the motion found
    random = excitation.fitted(problem(), 0.02 * np.random.default_rng(5).standard_normal((10, 6)), 1e-2)
    basis = excitation.Basis(problem(), 1e-3)
    motion = basis.motion(random)
    # WHEN the information is computed by low-pass in one go and by the bound's recursion
    fast = np.sqrt(np.diag(np.linalg.inv(excitation.information(problem(), motion[::10])))) / problem().scale
    exact = excitation.relative_bound(problem(), excitation.trajectory_of(motion))
    record_property("fast / exact", (fast / exact).tolist())
    print("fast / exact:", fast / exact)
    # THEN they agree within a tenth: implicit Euler at 10 ms lowers a 2.5 Hz signal by (1 + w^2 tau h / 2)^-1, 3 % at
    # 25 ms
    np.testing.assert_allclose(fast, exact, rtol=0.1)


def test_the_derivative_is_that_of_the_objective():
    # GIVEN a motion and a random direction
    random = np.random.default_rng(7)
    coefficients = excitation.fitted(problem(), 0.02 * random.standard_normal((10, 6)), 1e-2)
    direction = 1e-3 * random.standard_normal((10, 6))
    # WHEN the objective is taken a little ahead and behind
    step = 1e-3
    ahead, behind = (
        excitation.scaled_objective(problem(), coefficients + side * step * direction)[0] for side in (1, -1)
    )
    slope = (ahead - behind) / (2 * step)
    # THEN the slope is the derivative's, which has forward differences of 1e-6 in it
    gradient = excitation.scaled_objective(problem(), coefficients)[1]
    assert (gradient * direction).sum() == pytest.approx(slope, rel=1e-4)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_motion(tmp_path):
    # GIVEN three searches of two steps, two of them with one seed
    short = replace(WISH, duration_s=1.0, iterations=2, sines=3)
    files = {name: tmp_path / f"{name}.csv" for name in ("first", "again", "other")}
    for name, out in files.items():
        design(replace(short, seed=4 if name == "other" else 3), out)
    # WHEN compared THEN seed decides
    first, again, other = (out.read_bytes() for out in files.values())
    assert first == again
    assert summary_of(files["first"]).read_bytes() == summary_of(files["again"]).read_bytes()
    assert first != other


def test_a_small_platform_with_its_own_machine(tmp_path):
    # GIVEN the desk-size platform, bounded by the cylinders and the pump of its scenario
    platform = project.SCENARIOS / "platforms" / "small_platform.toml"
    out = tmp_path / "small.csv"
    # WHEN a motion is designed
    found, paper, multisine = design(
        replace(WISH, platform_file=platform, scenario="small_platform", duration_s=1.0, iterations=5, sines=3), out
    ).columns
    # THEN it keeps them, where the paper's 0.2 m do not, and its bound is below the multisine's
    assert (found.keeps_limits, paper.keeps_limits, multisine.keeps_limits) == (True, False, True)
    assert found.bound.max() < multisine.bound.max()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"empty": True, "mass_kg": 100.0}, "--empty: found together with --mass or --height"),
        ({"duration_s": 0.5}, "--duration: found 0.5 s, expected 1 to 120 s"),
        ({"duration_s": float("nan")}, "--duration: found nan s"),
        ({"duration_s": 3.0005}, "--duration: found 3.0005 s, expected a multiple of"),
        ({"mass_kg": -1.0}, "--mass: found -1 kg, expected a positive number"),
        ({"height_m": 0.0}, "--height: found 0 m, expected a number other than 0"),
        ({"frequency_max_hz": 0.2}, "--frequency-max: found 0.2 Hz, expected more than 1 / duration"),
        ({"frequency_max_hz": 50.0}, "--frequency-max: found 50 Hz"),
        ({"scenario": "nothing"}, "unknown scenario 'nothing'"),
        ({"platform_file": Path("no.toml")}, "no.toml"),
        ({"mass_kg": 1e5}, "--mass: found 100000 kg"),
        ({"mass_max_kg": 1e5}, "the heaviest load of 100000 kg (--mass-max) takes"),
        (
            {"mass_kg": 500.0, "mass_max_kg": 100.0},
            "--mass-max: found 100 kg, expected the 500 kg of the expected load or more",
        ),
        ({"tilt_max_deg": 0.0}, "--tilt-max: found 0 deg, expected 1 to less than 90 (not rad)"),
        ({"condition_max": 1.1}, "--condition-max: found 1.1, of which a motion may use"),
        ({"distance_min": 0.9}, "--distance-min: found 0.9, to which a motion keeps"),
        ({"actuators": (1.0, None, None)}, "--leg-speed: found together with --scenario, expected one of them"),
        (
            {"scenario": None},
            "paper.toml: actuators.leg_speed_m_s, actuators.leg_force_n, actuators.speed_sum_m_s: found nothing, "
            "expected what the actuators can do: leg_speed_m_s, leg_force_n, speed_sum_m_s in the section [actuators], "
            "or the options --leg-speed, --leg-force, --speed-sum, or --scenario",
        ),
        ({"scenario": None, "actuators": (1.0, 1e4, None)}, "actuators.speed_sum_m_s: found nothing"),
        ({"scenario": None, "actuators": (-1.0, 1e4, 3.0)}, "--leg-speed: found -1, expected a positive number"),
    ],
)
def test_bad_input_is_refused_and_nothing_is_written(tmp_path, change, message):
    # GIVEN one thing wrong WHEN a motion is wanted THEN it is named with what was expected
    with pytest.raises(InputError) as refusal:
        design(replace(WISH, **change), tmp_path / "out.csv")
    assert message in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


def test_the_motion_for_commissioning_is_that_of_the_empty_platform_and_safe(tmp_path):
    # GIVEN no load WHEN a motion is designed THEN it keeps the limits and is safe in the run that there is, without load
    out = tmp_path / "empty.csv"
    found = design(replace(WISH, empty=True), out)
    assert found.columns[0].keeps_limits
    assert [use.load for use in found.uses] == ["no"] and found.uses[0].is_safe
    # AND it tells more of the platform's own parameters than the multisine
    own, _, multisine = found.columns
    assert own.bound.max() < 0.5 * multisine.bound.max()
    assert json.loads(summary_of(out).read_text())["theta"] == [0.0] * 10


def test_the_motion_for_commissioning_commissions_a_rig(tmp_path, record_property):
    # GIVEN ten seconds of motion, designed with the platform file, WHEN a rig that is another machine runs it empty
    platform, motion = project.SCENARIOS / "platforms" / "rig.toml", tmp_path / "motion.csv"
    design(replace(WISH, platform_file=platform, scenario="rig", duration_s=10.0, iterations=10, empty=True), motion)
    scenario = read_toml(project.SCENARIOS / "rig.toml") | {
        "platform": str(platform),
        "load": [{"at_s": 0.0, "mass_kg": 0.0}],
        "trajectory": {"kind": "file", "path": str(motion)},
    }
    scenario["simulation"]["duration_s"] = 10.0
    (tmp_path / "rig.toml").write_text(to_toml(scenario))
    run = tmp_path / "run"
    subprocess.run([project.simulator(), tmp_path / "rig.toml", "--out", run, "--quiet"], check=True)
    # THEN that is commissioned, each group is found, and what friction leaves of the forces is noise: 5 N in a band of 15
    # of 500 Hz, and twice as much that is not in the model: friction under load, legs that differ
    result = commission(commissioning.Wish(run / "log.csv", platform, tmp_path / "found.toml"))
    record_property("residual_n", result["residual_n"])
    assert result["residual_n"] < 3.0 * 5.0 * np.sqrt(15.0 / 500.0)
    assert {result["words"][name] for name in ("theta", "coulomb", "viscous", "offset", "tilt")} == {"found"}
    # AND tilt and friction are the machine's, within four sigmas and what warming up and load do to friction
    truth, sigma = json.loads((run / "meta.json").read_text())["rig"], result["sigma"]
    off = np.abs(np.array(result["rig"]["gravity_m_s2"]) - truth["gravity_m_s2"])[:2]
    assert (off < 4.0 * np.array(sigma["gravity_m_s2"])[:2]).all()
    for key, true_key in (("coulomb_n", "coulomb_friction_n"), ("viscous_n_s_m", "viscous_friction_n_s_m")):
        ratio = np.array(result["rig"][key]) / np.array(truth[true_key])
        assert (np.abs(ratio - 1.05) < 0.05).all(), key


def test_without_a_least_distance_only_a_singular_pose_is_too_near():
    # GIVEN limits without a distance to singularity, by the library and by the command line's 0
    limits = replace(problem().limits, distance=0.0)
    unbounded = replace(problem(), limits=limits)
    still, tilted = excitation.home_posture(unbounded), np.zeros((1, 18))
    tilted[0, 3] = 0.3
    near = excitation.posture(unbounded, excitation.trajectory_of(tilted))
    # WHEN poses are compared with them THEN none is beyond for its distance, and a singular one is no number
    for posture in (still, near):
        assert excitation.posture_ratios(unbounded, posture)[0, 2] == 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        singular = replace(still, distance=np.zeros(1))
        assert np.isnan(excitation.posture_ratios(unbounded, singular)[0, 2])
    # AND 0 is not taken for nothing stated
    scenario = hexload_native.load_scenario(str(project.SCENARIOS / "multisine.toml"))
    platform = hexload_native.load_platform(str(PLATFORM))
    assert problem_of(replace(WISH, distance_min=0.0), platform, scenario)[1].limits.distance == 0.0


def test_a_summary_never_overwrites_the_motion(tmp_path):
    # GIVEN a name that ends like the summary's WHEN a motion is wanted THEN it is refused
    with pytest.raises(InputError, match="--out: found .*expected another name"):
        design(WISH, tmp_path / "out.json")


# A long-legged, light platform with the actuators of a large one: what a user had who named no machine of his own.
LONG_LEGS = """[geometry]
base_hinges_m = [
    [0.2794, 0.1105, -0.0075],
    [-0.0491, 0.2875, -0.0035],
    [-0.2286, 0.1807, 0.0115],
    [-0.2303, -0.1837, 0.0001],
    [-0.0473, -0.2841, -0.0105],
    [0.2654, -0.0897, -0.0059],
]
platform_hinges_m = [
    [0.1323, 0.0927, -0.0026],
    [0.0143, 0.1589, -0.0020],
    [-0.1483, 0.0743, -0.0041],
    [-0.1431, -0.0641, -0.0007],
    [0.0207, -0.1587, 0.0061],
    [0.1292, -0.0930, 0.0043],
]
home_leg_length_m = [0.7412, 0.7370, 0.7182, 0.7356, 0.7516, 0.7441]
stroke_m = [-0.32, 0.32]
[platform]
mass_kg = 11.2
com_m = [0.0, -0.002, 0.007]
inertia_kg_m2 = [0.0895, 0.1249, 0.1749, 0.0, 0.0, 0.0]
[environment]
gravity_m_s2 = 9.81
[sensors]
displacement_sigma_m = 20e-6
velocity_sigma_m_s = 1e-3
force_sigma_n = 5.0
[load]
known_mass_kg = 14.5
"""


def test_a_platform_that_was_flipped_stays_upright(tmp_path):
    # GIVEN a machine whose legs are long enough to go through a singular pose, and which forces do not keep from it:
    # bounded by stroke, speed and force alone, this search ends in a motion that flips it to 151 deg and leaves it at 104
    platform, out = tmp_path / "long_legs.toml", tmp_path / "long_legs.csv"
    platform.write_text(LONG_LEGS)
    # WHEN a motion is designed
    found = design(replace(WISH, platform_file=platform, duration_s=2.0, seed=124, iterations=8, sines=8), out)
    # THEN tilt and singularity are far, in the motion and in the runs with each load
    assert found.planned["tilt_rad"] <= 0.7 * np.radians(30.0)
    assert found.planned["distance"] > found.machine.limits.distance
    for use in found.uses:
        assert use.is_safe
        assert use.extremes["tilt_rad"] < np.radians(30.0)
    assert [use.load for use in found.uses] == ["no", "the expected", "the heaviest"]


@pytest.mark.parametrize("seed", range(FUZZED_MACHINES))
def test_no_motion_of_a_random_machine_is_unsafe_in_the_simulator(tmp_path, seed, record_property):
    # GIVEN a random machine WHEN a motion is designed and run with no, the expected and the heaviest load
    outcome = try_machine(seed, tmp_path)
    record_property("outcome", str(outcome))
    # THEN the program of the simulator, judged by the plant's kinematics, finds end stops, singularity and tilt far, and
    # rest at the end; or the motion was refused and nothing written
    assert outcome.verdict in ("safe", "refused"), outcome


def test_the_judge_of_the_runs_sees_a_platform_that_flips(tmp_path):
    # GIVEN a machine and a motion that tilts it by 60 deg
    platform, motion = tmp_path / "0.toml", tmp_path / "0.csv"
    platform.write_text(random_platform(0))
    motion.write_text("t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n1,0,0,0,1.05,0,0\n2,0,0,0,0,0,0\n")
    heavy = [100.0, 0.0, 0.0, 20.0, 10.0, 10.0, 4.0, 0.0, 0.0, 0.0]
    # WHEN it is run THEN tilt and end stop are named
    faults = faults_of_run(platform, motion, [0.0] * 10, 2.0, heavy)
    assert "mass 0 kg: tilt" in faults


@pytest.mark.parametrize("seed", range(40))
def test_the_servo_of_a_random_machine_lets_every_resonance_decay(seed, tmp_path):
    # GIVEN a random machine, whose servo is made for it
    file = tmp_path / "machine.toml"
    file.write_text(random_platform(seed))
    platform = hexload_native.load_platform(str(file))
    wish = replace(WISH, platform_file=file, scenario=None)
    scenario = machine_of(hexload_native, wish, platform)
    # WHEN its sampled loop is taken apart, empty and with the heaviest load, at home and where oil columns are short
    heaviest = load_on_axis(wish, platform, heaviest_kg(wish, platform))
    for theta in (np.zeros(10), heaviest):
        for displacement_m in (0.0, 0.9 * platform.stroke_m[0]):
            # THEN all poles are inside the unit circle
            assert growth_1_s(platform, scenario, theta, displacement_m) < 0.0


def test_the_default_servo_does_not_shake_a_platform_that_is_too_light_for_it(tmp_path):
    # GIVEN the paper's platform at rest, empty, with a light load, with one that the servo was made for, and empty with a
    # servo of the file's own, which shakes it
    own = "[controller]\npressure_feedback_1_n = 7e-6\n"
    cases = ((0.0, ""), (50.0, ""), (500.0, ""), (0.0, own))
    platform = hexload_native.load_platform(str(PLATFORM))
    feedback, growth = [], []
    for mass_kg, table in cases:
        file, run = tmp_path / "rest.toml", tmp_path / "run"
        load = f"[[load]]\nat_s = 0.0\nmass_kg = {mass_kg}\n"
        file.write_text(f'name = "rest"\nplatform = "{PLATFORM}"\n{load}[trajectory]\nkind = "standstill"\n{table}')
        # WHEN it is run
        command = [project.simulator(), file, "--duration", "0.002", "--out", run, "--force", "--quiet"]
        subprocess.run(command, check=True, capture_output=True)
        resolved = hexload_native.load_scenario(str(run / "scenario.toml"))
        feedback.append(tomllib.loads(resolved.to_toml())["controller"]["pressure_feedback_1_n"])
        growth.append(growth_1_s(platform, resolved, mass_kg * np.eye(10)[0]))
    # THEN every resonance decays, faster than the integral (1 1/s), with less feedback where there is too little mass for
    # the default; what the file says stays
    assert max(growth[:3]) < -1.0 and growth[3] > 0.9
    assert feedback[2:] == [7e-6, 7e-6]
    assert max(feedback[:2]) < 5e-6


def test_a_light_platform_on_strong_legs_is_commissioned(tmp_path):
    # GIVEN a disc of 100 kg on legs of 19 kN, whose rotations swing at 125 Hz on the oil, so that a servo made for its mass
    # alone shakes it
    file, out = tmp_path / "machine.toml", tmp_path / "empty.csv"
    given = {
        **{"platform-radius": "400mm", "platform-angle": "15", "base-radius": "600mm", "base-angle": "10"},
        **{"leg-length": "874mm", "stroke": "300mm", "mass": "100kg", "leg-speed": "1.2", "leg-force": "19e3"},
        **{"speed-sum": "2.6", "displacement-sigma": "20um", "velocity-sigma": "1mm/s", "force-sigma": "5N"},
    }
    platform_new.new(given, file, force=False)
    # WHEN a motion of the empty platform is wanted THEN it is written, as found
    wish = replace(WISH, platform_file=file, scenario=None, empty=True, duration_s=2.0, iterations=4)
    assert design(wish, out).scaled == 1.0


def test_a_motion_that_the_machine_does_not_follow_is_refused_with_the_reason(tmp_path):
    # GIVEN legs of 0.1 mm/s, whose servo does not come to rest under a load within the time that a run is given for it
    out = tmp_path / "slow.csv"
    wish = replace(WISH, scenario=None, actuators=(1e-4, 19e3, 1e-3), duration_s=1.0, iterations=2, sines=3)
    # WHEN a motion is wanted THEN it is refused with quantity, found and expected, and nothing is written
    with pytest.raises(InputError) as refusal:
        design(wish, out)
    assert re.search(
        r"no motion found that the simulated machine follows, in 8 tries.* load found .+, expected .+; nothing is written",
        str(refusal.value),
    )
    assert list(tmp_path.iterdir()) == []


def test_actuators_come_from_the_platform_file_or_from_options(tmp_path):
    # GIVEN a platform file with its actuators, and the same as options to a file without
    own = tmp_path / "own.toml"
    rows = "\n".join(f"{key} = {value}" for key, value in zip(ACTUATOR_KEYS, PAPER_LIKE))
    own.write_text(PLATFORM.read_text() + f"\n[actuators]\n{rows}\n")
    in_file = replace(WISH, scenario=None, platform_file=own)
    by_option = replace(WISH, scenario=None, actuators=PAPER_LIKE)
    # WHEN the machine is made THEN it is the same one, with the speed, supply and force that were stated
    machines = []
    for wish in (in_file, by_option):
        platform = hexload_native.load_platform(str(wish.platform_file))
        scenario = machine_of(hexload_native, wish, platform)
        machines.append(scenario.to_toml())
        speed, total, force = scenario.machine_limits(platform)
        assert (speed, force, total) == pytest.approx(PAPER_LIKE, rel=1e-12)
    assert machines[0] == machines[1]


def hexload(*arguments):
    environment = os.environ | {"COLUMNS": "200", "TERM": "dumb", "NO_COLOR": "1"}
    return subprocess.run(
        [sys.executable, "-m", "hexload_dev", *map(str, arguments)], capture_output=True, text=True, env=environment
    )


def test_the_command_line_shows_the_three_motions(tmp_path):
    # GIVEN a short search WHEN it runs as a user runs it
    out = tmp_path / "motion.csv"
    result = hexload(
        *("excite", "--platform", PLATFORM, "--scenario", "multisine", "--duration", 1, "--out", out),
        *("--starts", 1, "--iterations", 2, "--sines", 3),
    )
    # THEN the table has the summary's figures in %
    assert result.returncode == 0, result.stderr
    shown = json.loads(summary_of(out).read_text())["relative_bound"]
    row = next(line.split() for line in result.stdout.splitlines() if line.split()[:1] == ["hx"])
    assert row[1:] == [f"{100 * shown[name][1]:.4f}" for name in ("found", "paper", "multisine")]
    assert "not excited" in result.stdout
    # AND each limit with what the motion may use of it, what it asks for, and what the simulated runs use
    summary = json.loads(summary_of(out).read_text())
    shown = {line.split()[0]: line.split()[1:] for line in result.stdout.splitlines() if "%" in line.split()[-1:]}
    assert list(shown) == list(QUANTITIES)
    for key in ("leg_speed_m_s", "speed_sum_m_s", "leg_force_n", "tilt_rad", "condition"):
        worst = max(extremes[key] for extremes in summary["simulated"].values())
        numbers = (summary["limits"][key], summary["planned_limits"][key], summary["planned"][key], worst)
        assert shown[key][:4] == [f"{number:.4g}" for number in numbers]


def test_a_refusal_on_the_command_line_is_one_line_with_status_2(tmp_path):
    result = hexload("excite", "--platform", PLATFORM, "--duration", 0.1, "--out", tmp_path / "motion.csv")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
