"""`hexload commission` on the terminal."""

from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from hexload.estimation.commission import AS_DECLARED
from hexload.estimation.rig_model import LEGS

TITLES = {  # of groups of unknowns, as a control engineer calls them
    "theta": "platform's mass, centre, inertia",
    "leg_mass": "leg mass",
    "unlike_legs": "leg mass, by which legs differ",
    "stiffness": "pull towards home (hoses)",
    "coulomb": "Coulomb friction",
    "stribeck": "more at rest (Stribeck)",
    "viscous": "viscous friction",
    "growth": "friction growing with leg force",
    "offset": "force offset",
    "delay": "force delay",
    "tilt": "tilt of the base",
    "gain": "force gain",
    "hinges": "hinge positions",
}
TOLD_BY_TURNING = ("tilt", "offset")  # groups that a level platform does not tell apart
WIDER = "a run that turns the platform further tells more (hexload excite --empty)"


def print_summary(result: dict, out: Path) -> None:
    """What was found, on the terminal."""
    rig, sigma = result["rig"], result["sigma"]
    table = Table(box=box.SIMPLE_HEAD, padding=0)  # a leg in a line of 80 letters
    headings = ("leg", "offset,\nN", "gain,\n%", "Coulomb,\nN", "at rest\n+ N", "with\nforce, %", "viscous,\nN s/m")
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    for leg in range(LEGS):
        cells = (
            f"{factor * rig[key][leg]:.{digits}f} ± {factor * sigma[key][leg]:.{digits}f}"
            for key, factor, digits in (
                ("force_offset_n", 1.0, 1),
                ("force_gain", 100.0, 2),
                ("coulomb_n", 1.0, 1),
                ("stribeck_n", 1.0, 1),
                ("growth_n_n", 100.0, 2),
                ("viscous_n_s_m", 1.0, 1),
            )
        )
        table.add_row(str(leg + 1), *cells)
    Console().print(table)
    tilt = np.degrees(np.asarray(rig["gravity_m_s2"][:2]) / np.linalg.norm(rig["gravity_m_s2"]))
    print(f"platform:  {rig['mass_kg']:.2f} +- {sigma['mass_kg']:.2f} kg with what of the legs moves with it")
    print(f"base:      {tilt[0]:+.3f}, {tilt[1]:+.3f} degrees off level (x, y)")
    print(f"delays:    forces {1e3 * rig['force_delay_s']:.2f} ms, velocities {1e3 * rig['velocity_delay_s']:.2f} ms")
    if any(result["pull_home"]):
        pull = [f"{each:.1f} +- {of:.1f}" for each, of in zip(result["pull_home"], result["pull_home_sigma"])]
        print(f"hoses:     pull home by {', '.join(pull[:3])} N/m along x, y, z")
        print(f"           and {', '.join(pull[3:])} N m/rad about them")
    print(f"residual:  {result['residual_n']:.2f} N of {result['duration_s']:.1f} s")
    for name, words in result["words"].items():
        print(f"{TITLES[name] + ':':<34}{words}")
    if untold := [TITLES[name] for name in TOLD_BY_TURNING if AS_DECLARED in result["words"][name]]:
        print(f"open:      {' and '.join(untold)}, in every sigma as declared: {WIDER}")
    print(f"rig:       {out}")
