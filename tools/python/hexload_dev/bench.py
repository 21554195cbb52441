"""`hexload bench`: simulator speed beside MuJoCo's on the same platform, and what the firmware costs on a controller.

All but the reference rows of published filters is measured in the same call, on one thread.
"""

import json
import os
import platform as machine
import statistics
import subprocess
import time
import tomllib
from pathlib import Path

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.campaign.cases import Case
from hexload.campaign.one_case import run_case
from hexload.errors import ToolFailed
from hexload.theory.bound import read_platform
from hexload_dev import build
from hexload_dev.bench_page import write_page
from hexload_dev.controller_bench import TICK_S, print_controller_tables, rows_of

SCENARIO = project.SCENARIOS / "paper.toml"
PAGE = project.RUNS / "bench" / "report.html"
RIVAL_LEG_MASS_KG = 2.0  # of cylinder and of rod; MuJoCo's joints need some
RIVAL_SIMULATED_S = 10.0
CASES_S = (10.0, 20.0)  # the campaign's default, and what RESULTS has of rigs; 20 s are commissioned for either
CASES, CASE_SEED = 5, 77001
REPETITIONS = 3  # the shortest counts: what disturbs it only makes it longer


def run_bench(page: Path = PAGE) -> dict:
    """Writes the page; returns the figures too."""
    build.ensure_built("hexload_bench")
    own = _own_speed()
    rival = rival_speed(SCENARIO)
    processor = _processor()
    table = Table(title=f"{processor}, one thread, {own['simulated_s']:g} s of {SCENARIO.stem}", title_justify="left")
    for heading in ("simulator", "x real time", "x MuJoCo"):
        table.add_column(heading, justify="left" if heading == "simulator" else "right")
    plant = own["simulated_s"] / own["plant_s"]
    closed_loop = own["simulated_s"] / own["closed_loop_s"]
    for name, speed in (
        (f"hexload_sim, hydraulics, controller, {own['substeps']} RK4 steps per ms", plant),
        ("the same with the firmware in process", closed_loop),
        (f"MuJoCo {mujoco.__version__}, six legs, loop closure, Euler, no hydraulics", rival),
    ):
        table.add_row(name, f"{speed:.0f}", f"{speed / rival:.1f}")
    Console().print(table)
    tick_s = (own["closed_loop_s"] - own["plant_s"]) / own["simulated_s"] * TICK_S
    print(f"A tick of the firmware on this machine, with its sample and its link: {1e9 * tick_s:.0f} ns")
    rig_case = {duration_s: rig_case_cost(duration_s) for duration_s in CASES_S}
    for duration_s, ratio in rig_case.items():
        print(f"A campaign case of a rig, {duration_s:g} s: {ratio:.2f} times the processor time of an ideal machine's")
    speeds = {"plant": plant, "closed_loop": closed_loop, "mujoco": rival}
    tables = {"simulator": {str(table.title): rows_of(table)}, "cortex_m7": print_controller_tables()}
    figures = {"times_real_time": speeds, "tick_s": tick_s, "rig_case": rig_case, **tables, "page": page}
    write_page(page, figures, processor, SCENARIO)
    print(page)
    return figures


def _own_speed() -> dict:
    program = project.build_directory() / "host_sim" / "hexload_bench"
    result = subprocess.run([program, SCENARIO], stdout=subprocess.PIPE, text=True)
    if result.returncode != 0:
        raise ToolFailed(exit_code=result.returncode)
    return json.loads(result.stdout)


def rig_case_cost(duration_s: float) -> float:
    """Processor time of a campaign's case of a rig, commissioning included, over that of an ideal machine: medians of both, one
    in turn with the other in this process."""
    build.ensure_built("hexload_sim_app", "hexload_native")
    taken_s: dict[str, list[float]] = {"rig_multisine": [], "multisine": []}
    for seed in range(CASE_SEED, CASE_SEED + CASES):
        for name, times_s in taken_s.items():
            start_s = _processor_s()
            run_case(Case(name, seed, duration_s), None)
            times_s.append(_processor_s() - start_s)
    rig_s, ideal_s = map(statistics.median, taken_s.values())
    return rig_s / ideal_s


def _processor_s() -> float:
    times = os.times()
    return sum(times[:4])  # user and system, also of children that have ended


def rival_speed(scenario: Path) -> float:
    """Times real time: MuJoCo holds the platform of `scenario` and its load at home, 1 ms steps."""
    model = mujoco.MjModel.from_xml_string(rival_model(scenario))
    steps = round(RIVAL_SIMULATED_S / model.opt.timestep)
    shortest = np.inf
    for _ in range(REPETITIONS):
        data = mujoco.MjData(model)
        start = time.perf_counter()
        mujoco.mj_step(model, data, nstep=steps)
        shortest = min(shortest, time.perf_counter() - start)
    return RIVAL_SIMULATED_S / shortest


def rival_model(scenario: Path) -> str:
    """The platform as a MuJoCo user models it: per leg a universal joint, a slide with a position servo, and a ball
    closure at the upper hinge; the load is fixed to the platform."""
    table = tomllib.loads(scenario.read_text(encoding="utf-8"))
    platform = read_platform(scenario.parent / table["platform"])
    load = table["load"][0]
    home = np.array([0.0, 0.0, platform.home_height_m])
    load_inertia = _numbers(load["inertia_com_kg_m2"])
    legs, closures, servos = [], [], []
    for leg, (base, hinge) in enumerate(zip(platform.base_hinges_m, platform.platform_hinges_m), start=1):
        legs.append(_leg(leg, base, home + hinge - base))
        closures.append(f'<connect name="closure{leg}" body1="rod{leg}" body2="platform" anchor="0 0 0"/>')
        servos.append(f'<position joint="slide{leg}" kp="2e5"/>')
    return f"""
<mujoco model="rival">
  <option timestep="0.001" integrator="Euler" gravity="0 0 {-platform.gravity_m_s2}"/>
  <worldbody>
    {"".join(legs)}
    <body name="platform" pos="{_numbers(home)}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{platform.theta[0]}" fullinertia="{_numbers(platform.theta[4:])}"/>
      <body name="load">
        <inertial pos="{_numbers(load["com_m"])}" mass="{load["mass_kg"]}" fullinertia="{load_inertia}"/>
      </body>
    </body>
  </worldbody>
  <equality>{"".join(closures)}</equality>
  <actuator>{"".join(servos)}</actuator>
</mujoco>"""


def _leg(leg: int, base_m: np.ndarray, vector_m: np.ndarray) -> str:
    """Cylinder on a universal joint at the base hinge, rod on a slide; the rod's origin is its upper end."""
    inertial = f'<inertial pos="0 0 0" mass="{RIVAL_LEG_MASS_KG}" diaginertia="1e-3 1e-3 1e-3"/>'
    direction = vector_m / np.linalg.norm(vector_m)
    return f"""
    <body pos="{_numbers(base_m)}">
      <joint type="hinge" axis="1 0 0"/><joint type="hinge" axis="0 1 0"/>{inertial}
      <body name="rod{leg}" pos="{_numbers(vector_m)}">
        <joint name="slide{leg}" type="slide" axis="{_numbers(direction)}" damping="2e4"/>{inertial}
      </body>
    </body>"""


def _numbers(values) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return f"{machine.machine()}, {os.cpu_count()} processors"
