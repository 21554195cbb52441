"""Wrong machines, motions, scenarios, options, arrays and files: every verb that reads one says what is wrong, with a status other than 0.

The table of host_sim/README.md, "Wrong inputs", has a row for each of WRONG. Wrong logs have a test of their own.
"""

import os
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import typer

import hexload
from hexload.cli.app import app
from hexload.errors import InputError, ToolFailed
from hexload.io.log_file import COLUMNS, LegLog, read_log
from hexload.io.toml_document import to_toml

SOURCE = Path(os.environ["HEXLOAD_SOURCE_DIR"])
UNKNOWN = SOURCE / "tests" / "data" / "unknown_load.toml"
ROWS = 1500
MM = 1e3
G = 9.81

Tables = dict[str, dict]


@dataclass(frozen=True)
class Bench:
    """Good files in a folder."""

    folder: Path
    log: LegLog

    def platform(self, *changes: Callable[[Tables], None]) -> Path:
        tables = tomllib.loads(UNKNOWN.read_text())
        for change in changes:
            change(tables)
        return self.file("platform.toml", to_toml(tables))

    def file(self, name: str, text: str) -> Path:
        (self.folder / name).write_text(text)
        return self.folder / name

    def log_file(self, **factors: float) -> Path:
        log = self.log
        channels = {"t": log.t_s[:, None], "dl": log.displacement_m, "vl": log.velocity_m_s, "f": log.force_n}
        rows = np.hstack([values * factors.get(name, 1.0) for name, values in channels.items()])
        np.savetxt(self.folder / "log.csv", rows, "%.9g", ",", header=",".join(COLUMNS), comments="")
        return self.folder / "log.csv"

    def scenario(self, text: str, load: str = "mass_kg = 100.0", motion: str = 'kind = "multisine"') -> Path:
        return self.file(
            "scenario.toml",
            f'name = "wrong"\nplatform = "{self.platform()}"\n{text}\n[[load]]\nat_s = 0.0\n{load}\n[trajectory]\n{motion}\n',
        )

    def motion(self, rows: str) -> str:
        return f'kind = "file"\npath = "{self.file("motion.csv", "t,x,y,z,roll,pitch,yaw" + chr(10) + rows)}"'


def times(section: str, factor: float, *keys: str) -> Callable[[Tables], None]:
    def change(tables: Tables) -> None:
        for key in keys:
            tables[section][key] = (factor * np.array(tables[section][key])).tolist()

    return change


def put(section: str, **values: object) -> Callable[[Tables], None]:
    return lambda tables: tables.setdefault(section, {}).update(values)


def hinges(key: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Tables], None]:
    return lambda tables: tables["geometry"].update({key: change(np.array(tables["geometry"][key])).tolist()})


def frames_exchanged(tables: Tables) -> None:
    geometry = tables["geometry"]
    keys = ("base_hinges_m", "platform_hinges_m")
    geometry.update(zip(keys, (geometry[keys[1]], geometry[keys[0]])))


LENGTHS = ("base_hinges_m", "platform_hinges_m", "home_leg_length_m", "stroke_m")
SWAPPED = [1, 0, 2, 3, 4, 5]


@dataclass(frozen=True)
class Wrong:
    what: str
    verb: str
    says: str  # among other words
    words: Callable[[Bench], tuple | Callable]
    status: int = 2


def checked(*changes: Callable[[Tables], None]) -> Callable[[Bench], tuple]:
    return lambda bench: ("platform", "check", bench.platform(*changes))


def replayed(*changes: Callable[[Tables], None], more: tuple = (), **factors: float) -> Callable[[Bench], tuple]:
    return lambda bench: (
        *("replay", bench.log_file(**factors), "--platform", bench.platform(*changes)),
        *("--out", bench.folder / "estimates.csv", *more),
    )


def simulated(text: str = "", **parts: object) -> Callable[[Bench], tuple]:
    def words(bench: Bench) -> tuple:
        said = {name: part(bench) if callable(part) else part for name, part in parts.items()}
        return "sim", bench.scenario("[simulation]\nduration_s = 1.0" + text, **said), "--out", bench.folder / "run"

    return words


def excited(*more: object, mass: str = "100") -> Callable[[Bench], tuple]:
    return lambda bench: (
        *("excite", "--platform", bench.platform(), "--out", bench.folder / "motion.csv", "--mass", mass),
        *("--duration", 2, "--starts", 1, "--iterations", 2, "--sines", 3, *more),
    )


def new(**options: str) -> Callable[[Bench], tuple]:
    given = {
        **{"platform_radius": "400mm", "platform_angle": "15", "base_radius": "600mm", "base_angle": "10"},
        **{"leg_length": "874.1mm", "stroke": "300mm", "mass": "100kg", "displacement_sigma": "20um"},
        **{"velocity_sigma": "1mm/s", "force_sigma": "5N"},
    } | options
    words = [word for name, text in given.items() for word in (f"--{name.replace('_', '-')}", text)]
    return lambda bench: ("platform", "new", "--out", bench.folder / "new.toml", *words)


def on_empty(verb: str, *more: str, **factors: float) -> Callable[[Bench], tuple]:
    return lambda bench: (
        *(verb, bench.log_file(**factors), "--platform", bench.platform()),
        *("--out", bench.folder / f"{verb}.toml", *more),
    )


def arrays(**factors: float) -> Callable[[Bench], Callable]:
    def words(bench: Bench) -> Callable:
        log = bench.log
        channels = {"t": log.t_s, "dl": log.displacement_m, "vl": log.velocity_m_s, "f": log.force_n}
        return lambda: hexload.identify(
            *(values * factors.get(name, 1.0) for name, values in channels.items()), UNKNOWN
        )

    return words


IN_MM = ("--columns", 'dl = { unit = "mm" }')  # which mends the unit, so that what is wrong beside is said
ACTUATORS = ("--leg-speed", "1.2", "--leg-force", "19e3", "--speed-sum", "2.6")

WRONG = [
    # platform files
    Wrong("all lengths in mm", "platform check", "not mm", checked(times("geometry", MM, *LENGTHS))),
    Wrong("the stroke in mm", "platform check", "geometry.stroke_m", checked(times("geometry", MM, "stroke_m"))),
    Wrong(
        "the legs' length in mm",
        "platform check",
        "geometry.home_leg_length_m",
        checked(times("geometry", MM, "home_leg_length_m")),
    ),
    Wrong("the mass in g", "platform check", "platform.mass_kg", checked(times("platform", 1e3, "mass_kg")), 3),
    Wrong(
        "inertia in kg cm2",
        "platform check",
        "platform.inertia_kg_m2",
        checked(times("platform", 1e4, "inertia_kg_m2")),
        3,
    ),
    Wrong(
        "a negative mass", "platform check", "platform.mass_kg: found -100", checked(times("platform", -1, "mass_kg"))
    ),
    Wrong(
        "the centre of mass in mm",
        "platform check",
        "platform.inertia_kg_m2",
        checked(put("platform", com_m=[10.0, -5.0, 20.0])),
    ),
    Wrong(
        "an inertia that no body has",
        "platform check",
        "platform.inertia_kg_m2",
        checked(put("platform", inertia_kg_m2=[25.0, 25.0, 80.0, 0.0, 0.0, 0.0])),
    ),
    Wrong(
        "gravity with a sign",
        "platform check",
        "environment.gravity_m_s2",
        checked(put("environment", gravity_m_s2=-G)),
    ),
    Wrong(
        "gravity in mm/s2",
        "platform check",
        "environment.gravity_m_s2",
        checked(put("environment", gravity_m_s2=MM * G)),
    ),
    Wrong(
        "sensors' noise in um",
        "platform check",
        "sensors.displacement_sigma_m",
        checked(put("sensors", displacement_sigma_m=20.0)),
    ),
    Wrong(
        "force noise in kN", "platform check", "sensors.force_sigma_n", checked(put("sensors", force_sigma_n=5e-3)), 3
    ),
    Wrong(
        "limits of force in kN",
        "platform check",
        "actuators.leg_force_n",
        checked(put("actuators", leg_speed_m_s=1.2, leg_force_n=19.0, speed_sum_m_s=2.6)),
        3,
    ),
    Wrong(
        "limits of speed in mm/s",
        "platform check",
        "actuators.leg_speed_m_s",
        checked(put("actuators", leg_speed_m_s=1200.0, leg_force_n=19e3, speed_sum_m_s=2600.0)),
    ),
    Wrong(
        "a tilt tolerance in degrees", "platform check", "tolerances.tilt_rad", checked(put("tolerances", tilt_rad=5.0))
    ),
    Wrong(
        "two hinges in each other's place",
        "platform check",
        "legs 1 and 2 in each other's place",
        checked(hinges("platform_hinges_m", lambda p: p[SWAPPED])),
        3,
    ),
    Wrong(
        "the base mirrored", "platform check", "mirrored", checked(hinges("base_hinges_m", lambda p: p * [1, -1, 1]))
    ),
    Wrong(
        "hinges numbered one off",
        "platform check",
        "is the numbering one leg off?",
        checked(hinges("platform_hinges_m", lambda p: np.roll(p, 1, 0))),
        3,
    ),
    Wrong(
        "hinges of the platform in base axes",
        "platform check",
        "platform_hinges_m",
        checked(hinges("platform_hinges_m", lambda p: p + [0, 0, 0.798])),
        3,
    ),
    Wrong(
        "the stroke from its end", "platform check", "geometry.stroke_m", checked(put("geometry", stroke_m=[0.0, 0.6]))
    ),
    Wrong(
        "the stroke the wrong way round",
        "platform check",
        "geometry.stroke_m",
        checked(put("geometry", stroke_m=[0.3, -0.3])),
    ),
    Wrong("five legs", "platform check", "geometry.base_hinges_m", checked(hinges("base_hinges_m", lambda p: p[:5]))),
    Wrong("a number in quotes", "platform check", "platform.mass_kg", checked(put("platform", mass_kg="100 kg"))),
    Wrong(
        "a key with a typo",
        "platform check",
        "platform.mas_kg: found an unknown key",
        checked(put("platform", mas_kg=100.0)),
    ),
    Wrong(
        "base and platform exchanged",
        "replay",
        "the machine does not fit its platform file",
        replayed(frames_exchanged),
        3,
    ),
    Wrong(
        "two hinges in each other's place",
        "replay",
        "legs 1 and 2 in each other's place",
        replayed(hinges("platform_hinges_m", lambda p: p[SWAPPED])),
        3,
    ),
    Wrong(
        "the base mirrored",
        "replay",
        "geometry.platform_hinges_m: found Jacobian condition",
        replayed(hinges("base_hinges_m", lambda p: p * [1, -1, 1])),
    ),
    Wrong(
        "hinges numbered one off",
        "replay",
        "is the numbering one leg off?",
        replayed(hinges("platform_hinges_m", lambda p: np.roll(p, 1, 0))),
        3,
    ),
    Wrong("lengths in mm", "replay", "not mm", replayed(times("geometry", MM, *LENGTHS))),
    Wrong(
        "known mass of another load",
        "replay",
        "N more than the known mass explains",
        replayed(put("load", known_mass_kg=100.0), more=("--estimator", "paper")),
        3,
    ),
    Wrong(
        "the same file twice",
        "replay",
        "expected two",
        lambda bench: (*replayed()(bench), "--bodies", bench.folder / "estimates.csv"),
    ),
    Wrong(
        "a rig file that is none",
        "replay",
        "rig: found nothing, expected this key",
        lambda bench: (*replayed()(bench), "--rig", bench.platform()),
    ),
    Wrong(
        "a tare file that is none",
        "replay",
        "tare: found nothing, expected this table of a tare file",
        lambda bench: (*replayed()(bench), "--tare", bench.platform()),
    ),
    Wrong(
        "a radius without its unit and legs in mm",
        "platform new",
        "their units are mixed",
        new(platform_radius="0.4", leg_length="874.1"),
    ),
    Wrong(
        "whole angles for half",
        "platform new",
        "--platform-angle: found 90 deg, expected half the angle",
        new(platform_angle="90"),
    ),
    Wrong("a mass in newtons", "platform new", "expected a number, with one of the units kg", new(mass="981 N")),
    Wrong("displacements in mm", "tare", "displacements look like mm", on_empty("tare", dl=MM)),
    Wrong("forces in kN", "tare", "forces look like kN", on_empty("tare", f=1e-3)),
    Wrong("a load on the platform", "tare", "the platform seems to carry a load", on_empty("tare", *IN_MM, dl=MM)),
    Wrong("velocities in mm/s", "commission", "velocities look like mm/s", on_empty("commission", vl=MM)),
    Wrong(
        "forces with the opposite sign", "commission", "forces have the opposite sign", on_empty("commission", f=-1.0)
    ),
    Wrong("a run that is too short", "commission", "expected 4 s", on_empty("commission", *IN_MM, dl=MM)),
    Wrong(
        "forces in kN",
        "view",
        "forces look like kN",
        lambda bench: ("view", bench.log_file(f=1e-3), "--platform", bench.platform()),
    ),
    Wrong("a folder that is no run", "view", "found no such file", lambda bench: ("view", bench.folder)),
    Wrong(
        "displacements in mm",
        "convert",
        "displacements look like mm",
        lambda bench: ("convert", bench.log_file(dl=MM), bench.folder / "x.csv"),
    ),
    Wrong(
        "forces in kN",
        "convert",
        "forces look like kN",
        lambda bench: ("convert", bench.log_file(f=1e-3), bench.folder / "x.csv", "--platform", bench.platform()),
    ),
    Wrong("displacements in mm", "hexload.identify", "displacements look like mm", arrays(dl=MM)),
    Wrong("forces in kN", "hexload.identify", "forces look like kN", arrays(f=1e-3)),
    Wrong("time in ms", "hexload.identify", "time looks like ms", arrays(t=1e3)),
    Wrong("velocities with the opposite sign", "hexload.identify", "opposite sign", arrays(vl=-1.0)),
    Wrong(
        "a leg per row",
        "hexload.identify",
        "found shape (6, 1500), expected (1500, 6)",
        lambda bench: (
            lambda: hexload.identify(
                bench.log.t_s, bench.log.displacement_m.T, bench.log.velocity_m_s, bench.log.force_n, UNKNOWN
            )
        ),
    ),
    Wrong("the force in kN", "excite", "% of what the legs may push", excited(*ACTUATORS[:3], "19", *ACTUATORS[4:])),
    Wrong(
        "the speed in mm/s",
        "excite",
        "(m/s, not mm/s)",
        excited("--leg-speed", "1200", *ACTUATORS[2:4], "--speed-sum", "2600"),
    ),
    Wrong("the mass in g", "excite", "% of what the legs may push", excited(*ACTUATORS, mass="100000")),
    Wrong("the height in mm", "excite", "at most (not mm)", excited(*ACTUATORS, "--height", "300")),
    Wrong("the tilt in radians", "excite", "--tilt-max: found 0.5 deg", excited(*ACTUATORS, "--tilt-max", "0.5")),
    Wrong("the duration in ms", "excite", "--duration: found 10000 s", excited(*ACTUATORS, "--duration", "10000")),
    Wrong("no actuators", "excite", "expected what the actuators can do", excited()),
    Wrong(
        "a load's centre in mm",
        "sim",
        "expected one that 2.1e+07 Pa of supply pressure can hold",
        simulated(load="mass_kg = 100.0\ncom_m = [60.0, -40.0, 300.0]"),
    ),
    Wrong(
        "a load's mass in g",
        "sim",
        "expected one that 2.1e+07 Pa of supply pressure can hold",
        simulated(load="mass_kg = 500000.0"),
    ),
    Wrong("a negative load", "sim", "load[0].mass_kg: found -5", simulated(load="mass_kg = -5.0")),
    Wrong("a tilt in degrees", "sim", "machine.tilt_rad", simulated("\n[machine]\ntilt_rad = [1.5, 0.0]")),
    Wrong(
        "a key with a typo",
        "sim",
        "sensors.force_biass_n: found an unknown key",
        simulated("\n[sensors]\nforce_biass_n = 3.0"),
    ),
    Wrong("an unknown motion", "sim", "trajectory.kind", simulated(motion='kind = "sine"')),
    Wrong(
        "a motion in mm",
        "sim",
        "(not mm, not degrees)",
        simulated(motion=lambda bench: bench.motion("0,0,0,0,0,0,0\n1,50,0,0,0,0,0\n")),
    ),
    Wrong(
        "a motion in degrees",
        "sim",
        "(not mm, not degrees)",
        simulated(motion=lambda bench: bench.motion("0,0,0,0,0,0,0\n1,0,0,0,10,0,0\n")),
    ),
    Wrong(
        "a motion in ms",
        "sim",
        "expected seconds (not ms)",
        simulated(
            motion=lambda bench: bench.motion(
                "".join(f"{k},{0.05 * np.sin(0.01 * k)},0,0,0,0,0\n" for k in range(1000))
            )
        ),
    ),
    Wrong(
        "a platform file that is not there",
        "sim",
        "gone.toml: found no such file",
        lambda bench: (
            "sim",
            bench.file(
                "scenario.toml",
                'name = "a"\nplatform = "gone.toml"\n[[load]]\nat_s = 0.0\nmass_kg = 0.0\n[trajectory]\nkind = "work"\n',
            ),
        ),
    ),
]


@pytest.fixture(scope="module")
def log() -> LegLog:
    return read_log(SOURCE / "tests" / "data" / "multisine_eccentric.csv.gz").rows(slice(ROWS))


def outcome(words: tuple | Callable, capfd) -> tuple[int, str]:
    """Status and what is said, as of the command."""
    status: int | None = 0
    try:
        if callable(words):
            words()
        else:
            status = app([str(word) for word in words], prog_name="hexload", standalone_mode=False)
        status, line = status or 0, ""
    except (InputError, ToolFailed) as error:
        status, line = error.exit_code, str(error)
    except typer.TyperException as error:
        status, line = 2, error.format_message()
    return status, line or "".join(capfd.readouterr())


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: f"{wrong.verb}: {wrong.what}")
def test_what_is_wrong_is_said_with_a_status_other_than_0(wrong, log, tmp_path, capfd):
    # GIVEN good files but for one thing WHEN a verb reads them THEN it says what is wrong
    status, said = outcome(wrong.words(Bench(tmp_path, log)), capfd)
    assert (status, wrong.says in said) == (wrong.status, True), (status, said)
    # AND nothing is left that could be taken for a result, where it is refused
    left = {path.name for path in tmp_path.iterdir()} - {"platform.toml", "log.csv", "scenario.toml", "motion.csv"}
    assert wrong.status != 2 or not left


def test_the_document_has_a_row_for_each():
    # GIVEN the document of the formats WHEN its table is read THEN it has these rows and no others
    document = (SOURCE / "host_sim" / "README.md").read_text(encoding="utf-8").partition("## Wrong inputs")[2]
    rows = re.findall(r"^\| (.+) \| `(.+)` \| ([23]) \| (.+) \|$", document, re.MULTILINE)
    assert rows == [(wrong.what, wrong.verb, str(wrong.status), wrong.says) for wrong in WRONG]
    assert len(rows) >= 30
