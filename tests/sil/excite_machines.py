"""Random machines for `hexload excite`: is each motion that it writes safe in a run of the simulator of its own?

The judge has kinematics of its own, in numpy: it finds the pose from the leg displacements of the run, step by step from
home, so that a platform that went through a singular pose to another assembly of the same legs is somewhere else.

Also a command, for more machines than a test has time for:  python tests/sil/excite_machines.py --machines 200
"""

import argparse
import csv
import json
import subprocess
import sys
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import hexload_native
import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from hexload import project
from hexload.cli.excite_check import native_load
from hexload.cli.excite import Wish, design, summary_of
from hexload.errors import InputError

G = 9.81
SETTLING_S = 5.0
JOINT_DEG = 60.0  # of a leg from its direction at home: beyond what universal joints reach


@dataclass(frozen=True)
class Outcome:
    seed: int
    verdict: str  # safe, refused, or what went wrong in the run
    seconds: float
    detail: str


def hinges(random: np.random.Generator, radius_m: float, first_deg: float) -> np.ndarray:
    """Three pairs on a circle, each hinge off it by up to 4 % of the radius."""
    centre = np.radians(first_deg + np.repeat([0.0, 120.0, 240.0], 2))
    angle = centre + np.radians(random.uniform(5.0, 25.0)) * np.array([-1, 1, -1, 1, -1, 1])
    circle = radius_m * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(6)])
    return circle + random.uniform(-0.04, 0.04, (6, 3)) * radius_m


def random_platform(seed: int) -> str:
    """A platform file: 8 to 80 cm of radius, flat to long-legged, light to heavy, with actuators that can hold it."""
    random = np.random.default_rng(seed)
    radius_m = np.exp(random.uniform(np.log(0.08), np.log(0.8)))
    base_radius_m = radius_m * random.uniform(1.0, 2.0)
    upper = hinges(random, radius_m, 60.0)
    base = np.roll(hinges(random, base_radius_m, 0.0), -1, axis=0)
    height_m = base_radius_m * random.uniform(0.7, 3.0)
    length_m = np.linalg.norm(upper - base + [0.0, 0.0, height_m], axis=1)
    stroke_m = random.uniform(0.15, 0.45) * length_m.mean()
    mass_kg = 100.0 * (radius_m / 0.4) ** 3 * random.uniform(0.3, 2.0)
    load_kg = mass_kg * random.uniform(0.5, 5.0)
    inertia = mass_kg * radius_m**2 * random.uniform(0.25, 0.45, 3)
    leg_force_n = (mass_kg + 1.5 * load_kg) * G / 6.0 * random.uniform(6.0, 20.0)
    leg_speed_m_s = stroke_m * random.uniform(2.0, 6.0)
    return f"""[geometry]
base_hinges_m = {base.tolist()}
platform_hinges_m = {upper.tolist()}
home_leg_length_m = {length_m.tolist()}
stroke_m = [{-stroke_m}, {stroke_m}]
[platform]
mass_kg = {mass_kg}
com_m = {(random.uniform(-0.05, 0.05, 3) * radius_m).tolist()}
inertia_kg_m2 = [{inertia[0]}, {inertia[1]}, {inertia[2]}, 0.0, 0.0, 0.0]
[environment]
gravity_m_s2 = {G}
[sensors]
displacement_sigma_m = 20e-6
velocity_sigma_m_s = 1e-3
force_sigma_n = 5.0
[load]
known_mass_kg = {load_kg}
[actuators]
leg_speed_m_s = {leg_speed_m_s}
leg_force_n = {leg_force_n}
speed_sum_m_s = {leg_speed_m_s * random.uniform(2.5, 6.0)}
"""


def try_machine(seed: int, folder: Path, duration_s: float = 1.0, iterations: int = 5) -> Outcome:
    """Designs a motion and runs it with each of the loads that it is made for."""
    platform, out = folder / f"{seed}.toml", folder / f"{seed}.csv"
    platform.write_text(random_platform(seed))
    frequency_max_hz = np.random.default_rng([seed, 1]).uniform(max(0.8, 1.5 / duration_s), 5.0)  # slow ones go far
    wish = Wish(platform, duration_s, None, None, None, seed, 1, iterations, 4, frequency_max_hz)
    begin = time.process_time()
    try:
        design(wish, out)
    except InputError as error:
        assert not out.exists() and not summary_of(out).exists()
        return Outcome(seed, "refused", time.process_time() - begin, str(error))
    seconds = time.process_time() - begin
    summary = json.loads(summary_of(out).read_text())
    loads = [[0.0] * 10, summary["theta"], summary["heaviest_theta"]]
    faults = [fault for theta in loads for fault in faults_of_run(platform, out, theta, duration_s, loads[-1])]
    return Outcome(seed, "; ".join(faults) or "safe", seconds, f"scaled {summary['scaled']:.2f}")


@dataclass(frozen=True)
class Poses:
    """Of a run, found from its leg displacements alone."""

    position_m: np.ndarray  # (n, 3) of O_A from home
    rotation: np.ndarray  # (n, 3, 3)
    jacobian: np.ndarray  # (n, 6, 6), moments divided by the mean radius of the platform's hinges
    direction: np.ndarray  # (n, 6, 3) of the legs
    is_found: bool  # Newton's method has come to an end everywhere

    def condition(self) -> np.ndarray:
        return np.linalg.cond(self.jacobian, "fro") / 6.0

    def tilt_deg(self) -> np.ndarray:
        return np.degrees(np.arccos(np.clip(self.rotation[:, 2, 2], -1.0, 1.0)))

    def swing_deg(self) -> np.ndarray:
        """(n,): the largest angle of a leg to its direction at the start, in base or in platform axes."""
        home = self.direction[0]
        in_platform = np.einsum("nji,nlj->nli", self.rotation, self.direction)
        cosine = np.stack([(each * home).sum(axis=2) for each in (self.direction, in_platform)])
        return np.degrees(np.arccos(np.clip(cosine.min(axis=(0, 2)), -1.0, 1.0)))


def forward_kinematics(geometry: dict, displacement_m: np.ndarray) -> Poses:
    """Newton's method on the six lengths, each row from the pose of the row before; the first from home."""
    base, upper = (np.array(geometry[key]) for key in ("base_hinges_m", "platform_hinges_m"))
    length_m = np.array(geometry["home_leg_length_m"]) + displacement_m
    radius_m = np.linalg.norm(upper, axis=1).mean()
    position = np.array([0.0, 0.0, np.sqrt(np.mean(length_m[0]) ** 2 - np.mean(((upper - base)[:, :2] ** 2).sum(1)))])
    rotation = np.eye(3)
    rows, is_found = [], True
    for wanted in length_m:
        for _ in range(20):
            arm = upper @ rotation.T
            leg = position + arm - base
            length = np.linalg.norm(leg, axis=1)
            direction = leg / length[:, None]
            jacobian = np.hstack([direction, np.cross(arm, direction)])
            error = wanted - length
            if np.abs(error).max() < 1e-10:
                break
            step = np.linalg.solve(jacobian, error)
            position = position + step[:3]
            rotation = Rotation.from_rotvec(step[3:]).as_matrix() @ rotation
        is_found = is_found and np.abs(error).max() < 1e-10
        jacobian[:, 3:] /= radius_m
        rows.append((position, rotation, jacobian, direction))
    position, rotation, jacobian, direction = (np.array(part) for part in zip(*rows))
    return Poses(position - position[0], rotation, jacobian, direction, is_found)


def faults_of_run(platform: Path, motion: Path, theta: list[float], duration_s: float, heaviest: list[float]) -> list[str]:
    """What a run of the simulator's program shows, by this file's kinematics."""
    machine = hexload_native.load_platform(str(platform))
    folder = motion.parent
    scenario = folder / "scenario.toml"
    scenario.write_text(scenario_toml(machine, motion, (theta, heaviest), duration_s))
    run = folder / "run"
    command = [project.simulator(), scenario, "--out", run, "--force", "--quiet"]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        return [f"the simulator refuses: {result.stderr.strip()}"]
    truth = np.loadtxt(run / "truth.csv", delimiter=",", skiprows=1)[::5]
    if not np.isfinite(truth).all():
        return ["no finite pose"]
    checks = judged(tomllib.loads(platform.read_text())["geometry"], motion, truth)
    return [f"mass {theta[0]:.4g} kg: {name}" for name, is_fault in checks.items() if is_fault]


def judged(geometry: dict, motion: Path, truth: np.ndarray) -> dict[str, bool]:
    """What could be wrong with a run. `truth`: rows of truth.csv."""
    displacement, speed = truth[:, 19:25], np.abs(truth[:, 25:31])
    low, high = geometry["stroke_m"]
    stroke = high - low
    poses = forward_kinematics(geometry, displacement)
    condition = poses.condition()
    determinant = np.linalg.det(poses.jacobian)
    wanted = np.loadtxt(motion, delimiter=",", skiprows=1)
    asked = np.column_stack([np.interp(truth[:, 0], wanted[:, 0], wanted[:, k]) for k in range(1, 7)])
    of_asked = legs_of_pose(geometry, asked)
    return {
        "end stop": displacement.min() < low or displacement.max() > high,
        "another assembly": not poses.is_found or np.abs(poses.position_m - truth[:, 1:4]).max() > 1e-3 * stroke,
        "singularity": determinant.min() * determinant.max() <= 0.0,
        "condition": condition.max() > 3.0 * condition[0],
        "tilt": poses.tilt_deg().max() > 30.0,
        "joints": poses.swing_deg().max() > JOINT_DEG,
        "does not follow": np.abs(displacement - of_asked).max() > 0.2 * stroke,
        "not at rest at the end": speed[-1].max() > 0.05 * speed.max(),
        "not at home at the end": np.abs(displacement[-1] - displacement[0]).max() > 0.05 * stroke,
    }


def legs_of_pose(geometry: dict, pose: np.ndarray) -> np.ndarray:
    """(n, 6) leg displacements that the motion asks for."""
    base, upper = (np.array(geometry[key]) for key in ("base_hinges_m", "platform_hinges_m"))
    arms = np.einsum("nij,lj->nli", Rotation.from_euler("ZYX", pose[:, 5:2:-1]).as_matrix(), upper)
    length = np.array(geometry["home_leg_length_m"])
    height = brentq(
        lambda z: np.linalg.norm(upper - base + [0, 0, z], axis=1).mean() - length.mean(), 0.0, 2 * length.max()
    )
    legs = pose[:, None, :3] + arms - base + [0.0, 0.0, height]
    return np.linalg.norm(legs, axis=2) - length


def scenario_toml(machine, motion: Path, load: tuple[list[float], list[float]], duration_s: float) -> str:
    """The machine's own servo on the motion, with one load (theta; the heaviest one's) on its axis and time to come to rest."""
    theta, heaviest = load
    own = hexload_native.scaled_machine(machine, machine.actuators, native_load(hexload_native, np.array(heaviest)))
    resolved = own.to_toml()
    servo = resolved[resolved.index("[controller]") :]
    tables = [part for part in servo.split("\n\n") if part.startswith(("[controller]", "[hydraulics]"))]
    mass_kg = theta[0]
    height_m = theta[3] / mass_kg if mass_kg else 0.0
    central = [theta[4] - mass_kg * height_m**2, theta[5] - mass_kg * height_m**2, theta[6], 0.0, 0.0, 0.0]
    return "\n".join(
        [
            f'name = "excite"\nplatform = "{motion.with_suffix(".toml")}"',
            f"[simulation]\nduration_s = {duration_s + SETTLING_S}\nsubsteps = {own.substeps}",
            f"[[load]]\nat_s = 0.0\nmass_kg = {mass_kg}\ncom_m = [0.0, 0.0, {height_m}]",
            f"inertia_com_kg_m2 = {[max(value, 0.0) for value in central]}",
            f'[trajectory]\nkind = "file"\npath = "{motion}"\n',
            *tables,
        ]
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--duration", type=float, default=2.0, help="s of each motion")
    parser.add_argument("--iterations", type=int, default=20)
    options = parser.parse_args()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["seed", "verdict", "cpu_s", "detail"])
    verdicts = []
    for seed in range(options.first, options.first + options.machines):
        with TemporaryDirectory() as folder:
            outcome = try_machine(seed, Path(folder), options.duration, options.iterations)
        table.writerow([seed, outcome.verdict, f"{outcome.seconds:.1f}", outcome.detail])
        sys.stdout.flush()
        verdicts.append(outcome.verdict)
    refused, safe = verdicts.count("refused"), verdicts.count("safe")
    print(f"{len(verdicts)} machines: {safe} safe, {refused} refused, {len(verdicts) - safe - refused} unsafe")
    return 0 if safe + refused == len(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
