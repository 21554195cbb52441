"""`hexload platform new` and `platform check`: a machine as its owner knows it, and every wrong number by its key."""

import json
import tomllib
from itertools import combinations
from pathlib import Path

import hexload_native
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from excite_machines import forward_kinematics, random_platform
from forked_command import hexload
from hexload import project
from hexload.cli import platform_new
from hexload.errors import InputError
from hexload.estimation.machine_check import check, lag_in_words
from hexload.io.log_file import COLUMNS
from hexload.io.quantity import parse
from hexload.io.toml_document import GUESSED, guessed_in_words, read_toml, to_toml
from hexload.platform import Platform
from hexload.theory import workspace
from hexload.theory.machine_findings import findings_of, order_findings

PAPER = {
    "platform-radius": "400mm",
    "platform-angle": "15",
    "base-radius": "600mm",
    "base-angle": "10",
    "leg-length": "874.1mm",
    "stroke": "300 mm",
    "mass": "100",
    "inertia": "25, 25, 44",
    "displacement-sigma": "20um",
    "velocity-sigma": "1mm/s",
    "force-sigma": "5N",
}
PAPER_FILE = project.SCENARIOS / "platforms" / "paper.toml"


def made(tmp_path: Path, **changes: str | None) -> Path:
    out = tmp_path / "mine.toml"
    given = PAPER | {name.replace("_", "-"): text for name, text in changes.items()}
    platform_new.new({name: text for name, text in given.items() if text is not None}, out, force=True)
    return out


def test_the_papers_machine_is_made_of_its_radii_and_angles(tmp_path):
    # GIVEN what the paper says of its machine WHEN a platform file is made THEN it is the one in the scenarios
    mine, papers = (hexload_native.load_platform(str(path)) for path in (made(tmp_path), PAPER_FILE))
    for name in ("base_hinges_m", "platform_hinges_m", "home_leg_length_m", "stroke_m", "inertia_kg_m2"):
        np.testing.assert_allclose(getattr(mine, name), getattr(papers, name), rtol=0, atol=1e-9, err_msg=name)
    for name in ("mass_kg", "gravity_m_s2", "displacement_sigma_m", "velocity_sigma_m_s", "force_sigma_n"):
        assert getattr(mine, name) == pytest.approx(getattr(papers, name)), name


def test_hinges_legs_and_stroke_may_be_said_in_other_ways(tmp_path):
    # GIVEN the same machine as lists of hinges, with a height and with shortest and longest legs, in millimetres
    geometry = tomllib.loads(PAPER_FILE.read_text())["geometry"]
    rows = "\n".join(";".join(f"{1e3 * x:.4f}".replace(".", ",") for x in row) for row in geometry["base_hinges_m"])
    (tmp_path / "base.csv").write_text("x;y;z\n" + rows + "\n")  # with decimal commas
    upper = "; ".join(", ".join(f"{1e3 * x:.4f}" for x in row) for row in geometry["platform_hinges_m"])
    none = dict.fromkeys(
        ("platform_radius", "platform_angle", "base_radius", "base_angle", "leg_length", "stroke"), None
    )
    lists = {"base_hinges": str(tmp_path / "base.csv"), "platform_hinges": upper}
    path = made(tmp_path, **none, **lists, home_height="798.276", leg_range="574.1, 1174.1")
    # WHEN it is made THEN lengths are those of the other file, to the digits that were given
    mine, papers = (hexload_native.load_platform(str(path)) for path in (path, PAPER_FILE))
    for name in ("base_hinges_m", "platform_hinges_m", "home_leg_length_m", "stroke_m"):
        np.testing.assert_allclose(getattr(mine, name), getattr(papers, name), rtol=0, atol=2e-6, err_msg=name)


def hinge_lists(tmp_path: Path, base: tuple[float, str], platform: tuple[float, str]) -> dict[str, str | None]:
    """Options of the paper's machine with lists of hinges: of each side its scale from m, and the first line of its file."""
    geometry = tomllib.loads(PAPER_FILE.read_text())["geometry"]
    changes = dict.fromkeys(("platform_radius", "platform_angle", "base_radius", "base_angle"), None)
    for side, (scale, heading) in (("base", base), ("platform", platform)):
        rows = ["; ".join(f"{scale * x:.6f}" for x in row) for row in geometry[f"{side}_hinges_m"]]
        path = tmp_path / f"{side}.csv"
        path.write_text("\n".join([heading, *rows]) + "\n")
        changes[f"{side}_hinges"] = str(path)
    return changes


@pytest.mark.parametrize("heading", ["x [m]; y [m]; z [m]", "# x, y, z in (m)", "x_m;y_m;z_m", '"x/m";"y/m";"z/m"'])
def test_the_unit_above_a_list_of_hinges_is_its_unit(tmp_path, heading):
    # GIVEN a list in mm and one in m, each with its unit above its rows WHEN the file is made THEN both are right
    mine = made(tmp_path, **hinge_lists(tmp_path, (1e3, "x [mm]; y [mm]; z [mm]"), (1.0, heading)))
    made_of, papers = (hexload_native.load_platform(str(path)) for path in (mine, PAPER_FILE))
    for name in ("base_hinges_m", "platform_hinges_m"):
        np.testing.assert_allclose(getattr(made_of, name), getattr(papers, name), rtol=0, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-8-sig"])
def test_a_list_of_hinges_may_have_another_encoding(tmp_path, encoding):
    # GIVEN a list with a comment that is no ASCII WHEN the file is made THEN it has the hinges of the plain one
    lists = hinge_lists(tmp_path, (1.0, "# Gelenke des Prüfstands, in m"), (1.0, "x [m]"))
    plain = made(tmp_path, **lists).read_text()
    base = Path(lists["base_hinges"])
    base.write_bytes(base.read_text().encode(encoding))
    assert made(tmp_path, **lists).read_text() == plain


def test_sizes_in_mixed_units_are_refused(tmp_path):
    # GIVEN lists of which one is in mm and one in m, and nobody says so WHEN the file is made THEN it is refused, by both
    with pytest.raises(InputError) as refused:
        made(tmp_path, **hinge_lists(tmp_path, (1e3, "x;y;z"), (1.0, "x;y;z")))
    assert str(refused.value).startswith("--platform-hinges: found 0.386")
    assert (
        "beside --base-hinges of 590.885 without a unit, expected sizes of one machine: their units are mixed"
        in str(refused.value)
    )
    # AND a list that names two units likewise
    with pytest.raises(InputError, match="found the units m, mm above the rows"):
        made(tmp_path, **hinge_lists(tmp_path, (1e3, "x [mm];y [mm];z [m]"), (1.0, "x")))


def test_what_was_guessed_is_marked_in_the_file(tmp_path):
    # GIVEN a machine without inertia and centre of mass, with bare lengths WHEN its file is made
    path = made(tmp_path, inertia=None, leg_length="874.1", stroke="300", mass="100")
    # THEN the lines of what was guessed say so, and no others
    marked = {line.partition(" =")[0] for line in path.read_text().splitlines() if f"# {GUESSED}" in line}
    assert marked == {"home_leg_length_m", "stroke_m", "com_m", "inertia_kg_m2"}
    assert guessed_in_words(path, ("mass_kg", "inertia_kg_m2")) == f"inertia_kg_m2 in {path} was guessed"
    assert guessed_in_words(path, ("mass_kg",)) == ""
    # AND the check of the file names them
    printed = hexload("platform", "check", path).stdout
    assert (
        f"com_m, inertia_kg_m2 in {path} were guessed: what the guess is off, the load's estimate will be"
        in " ".join(printed.split())
    )


@pytest.mark.parametrize(
    ("changes", "guess"),
    [
        (
            {"platform_radius": "400", "base_radius": "600", "leg_length": "874.1", "stroke": "300"},
            "--base-radius, --platform-radius, --leg-length, --stroke without a unit read as mm, because the largest number is 874.1",
        ),
        (
            {"platform_radius": "0.4", "base_radius": "0.6", "leg_length": "0.8741", "stroke": "0.3"},
            "read as m, because the largest number is 0.8741",
        ),
        ({"platform_angle": "0.2618"}, "--platform-angle 0.2618 without a unit read as rad, because"),
        ({"displacement_sigma": "20"}, "--displacement-sigma 20 without a unit read as um, because"),
        ({"velocity_sigma": "1"}, "--velocity-sigma 1 without a unit read as mm/s, because"),
        ({"inertia": "25e6, 25e6, 44e6"}, "--inertia without a unit read as kg mm2, because"),
    ],
)
def test_a_unit_that_is_not_there_is_guessed_and_told(tmp_path, changes, guess):
    # GIVEN a number without its unit WHEN the file is made THEN it is the same machine, and the guess is told
    given = PAPER | {name.replace("_", "-"): text for name, text in changes.items()}
    guesses, _ = platform_new.new(given, tmp_path / "mine.toml", force=False)
    assert any(guess in each for each in guesses), guesses
    mine, papers = (hexload_native.load_platform(str(path)) for path in (tmp_path / "mine.toml", PAPER_FILE))
    for name in ("platform_hinges_m", "stroke_m", "inertia_kg_m2", "displacement_sigma_m", "velocity_sigma_m_s"):
        np.testing.assert_allclose(getattr(mine, name), getattr(papers, name), rtol=1e-4, atol=1e-9, err_msg=name)


def test_what_is_missing_is_asked_for_until_it_is_a_number(monkeypatch, capsys):
    # GIVEN a terminal on which a word is typed first, then a number
    answers = iter(["heavy", "100 kg"])
    monkeypatch.setattr(platform_new.typer, "prompt", lambda question: next(answers))
    # WHEN the mass is missing THEN it is asked for again, with what was expected
    texts = platform_new._completed({name: text for name, text in PAPER.items() if name != "mass"}, can_ask=True)
    assert texts["mass"] == "100 kg"
    assert "mass: found 'heavy', expected a number, with one of the units kg, g, t, lb" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": None}, "found no --mass, expected them (--mass: mass of the empty platform"),
        ({"mass": "heavy"}, "--mass: found 'heavy', expected a number, with one of the units kg"),
        ({"stroke": "-0.3 m, 300 mm"}, "--stroke: found '-0.3 m, 300 mm', expected 1 or 2 numbers"),
        ({"leg_length": "1, 2, 3"}, "--leg-length: found '1, 2, 3', expected 1 or 6 numbers"),
        ({"home_height": "0.8"}, "--leg-length: found together with --home-height, expected one of them"),
        ({"platform_angle": "75"}, "--platform-angle: found 75 deg, expected half the angle"),
        ({"leg_length": "100mm"}, "home_leg_length_m: found mean length 0.1 m, too short to reach"),
        (
            {"base_angle": "45"},  # the hexagons are similar
            "--platform-radius, --platform-angle, --base-angle: geometry.platform_hinges_m: found Jacobian condition",
        ),
        ({"stroke": "574, 1174 mm"}, "--stroke: geometry.stroke_m: found leg 1 at 0 m in the home pose"),
        ({"mass": "-5"}, "--mass: platform.mass_kg: found -5, expected kg, from 0.001"),
    ],
)
def test_a_wrong_answer_is_refused_and_nothing_is_written(tmp_path, changes, message):
    with pytest.raises(InputError) as refusal:
        made(tmp_path, **changes)
    assert message in str(refusal.value)
    assert list(tmp_path.iterdir()) == []


def test_the_new_file_is_one_that_the_other_verbs_take(tmp_path):
    # GIVEN a file made on the command line, with actuators
    out = tmp_path / "mine.toml"
    options = [word for name, text in PAPER.items() for word in (f"--{name}", text)]
    actuators = ("--leg-speed", "1.2", "--leg-force", "19kN", "--speed-sum", "2.6")
    result = hexload("platform", "new", "--out", out, *options, *actuators)
    assert result.returncode == 0, result.stderr
    assert f"{out}: plausible" in result.stdout
    # WHEN it is read as excite reads it, and given to replay THEN both take it
    assert hexload_native.load_platform(str(out)).actuators == [1.2, 19e3, 2.6]
    log = tmp_path / "log.csv"
    rows = (f"{k / 1000}" + ",0" * 12 + ",179" * 6 for k in range(20))
    log.write_text("\n".join([",".join(COLUMNS), *rows, ""]))
    replay = hexload("replay", log, "--platform", out, "--out", tmp_path / "estimates.csv")
    assert replay.returncode == 0, replay.stderr
    # AND that its centre of mass was guessed is told where it counts
    assert f"guessed:   com_m in {out} was guessed" in replay.stdout


def scaled(path: Path, **factors: float) -> str:
    """The platform file with all numbers of these keys in another unit."""
    tables = tomllib.loads(path.read_text())
    for table in tables.values():
        for key in set(table) & set(factors):
            table[key] = (factors[key] * np.array(table[key])).tolist()
    return to_toml(tables)


ALL = {
    "base_hinges_m": 1e3,
    "platform_hinges_m": 1e3,
    "home_leg_length_m": 1e3,
    "stroke_m": 1e3,
    "mass_kg": 1e3,
    "inertia_kg_m2": 1e6,
    "gravity_m_s2": 1e3,
    "displacement_sigma_m": 1e3,
    "velocity_sigma_m_s": 1e3,
    "force_sigma_n": 1e3,
    "known_mass_kg": 1e3,
    "leg_speed_m_s": 1e3,
    "leg_force_n": 1e-3,
}


@pytest.mark.parametrize("key", ALL)
def test_each_number_in_another_unit_is_named_by_its_key(tmp_path, key):
    # GIVEN a good file, of which one key is in mm, g, kg mm2, mN, or kN
    good = made(tmp_path, load="500", leg_speed="1.2", leg_force="19e3", speed_sum="2.6")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(scaled(good, **{key: ALL[key]}))
    # WHEN it is checked THEN it is refused, or called implausible, at this key
    try:
        words = "; ".join(map(str, check(wrong).findings))
    except InputError as error:
        words = str(error)
        assert str(wrong) in words
    assert f".{key}" in words, words


def test_a_platform_in_millimetres_is_refused_in_the_same_words_by_every_reader(tmp_path):
    # GIVEN hinges, legs and stroke in mm, as drawings have them
    lengths = dict.fromkeys(("base_hinges_m", "platform_hinges_m", "home_leg_length_m", "stroke_m"), 1e3)
    path = tmp_path / "mm.toml"
    path.write_text(scaled(made(tmp_path), **lengths))
    # WHEN it is read by a verb and by the library THEN file, key, number and the likely unit are named
    for refused in (lambda: check(path), lambda: Platform.of(path)):
        with pytest.raises(InputError, match=r"mm\.toml:\d+: geometry\.base_hinges_m\[0\]\[0\]: found 590\.88.*not mm"):
            refused()


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-8-sig"])
def test_a_platform_file_in_another_encoding_is_read_or_refused_alike_by_every_reader(tmp_path, encoding):
    # GIVEN a platform file with a letter that is no ASCII, of an editor that writes another encoding
    path = tmp_path / "p.toml"
    path.write_bytes(("\n# Prüfstand\n" + PAPER_FILE.read_text()).encode(encoding))
    # WHEN the firmware's and the formulas' readers read it THEN UTF-8 with its mark is taken
    if encoding == "utf-8-sig":
        assert hexload_native.load_platform(str(path)).mass_kg == read_toml(path)["platform"]["mass_kg"]
        return
    # AND else both say the line, what it looks like and the command that mends it
    with pytest.raises(ValueError) as native:
        hexload_native.load_platform(str(path))
    with pytest.raises(InputError) as own:
        read_toml(path)
    assert str(native.value) == str(own.value)
    line, iconv = (2, "latin1") if encoding == "latin-1" else (1, "utf-16")
    assert str(own.value).startswith(f"{path}:{line}: found ")
    assert str(own.value).endswith(f"expected UTF-8: iconv -f {iconv} -t utf-8 p.toml > utf8-p.toml")


def test_what_follows_from_several_numbers_is_told_by_those_that_the_user_wrote(tmp_path):
    # GIVEN a channel that is later than the firmware can wait, and a heavy platform that is large
    good = made(tmp_path)
    late, huge = tmp_path / "late.toml", tmp_path / "huge.toml"
    late.write_text(good.read_text().replace("force_sigma_n = 5", "force_sigma_n = 5\nforce_delay_s = 0.1"))
    lengths = dict.fromkeys(("base_hinges_m", "platform_hinges_m", "home_leg_length_m", "stroke_m"), 20.0)
    huge.write_text(scaled(good, **lengths, mass_kg=990.0, inertia_kg_m2=2e4))
    # WHEN they are checked THEN these keys are named, not the estimator's own
    with pytest.raises(InputError, match=r"late\.toml: sensors\.force_delay_s.*0\.1 s late, expected 8 samples of"):
        check(late)
    with pytest.raises(InputError, match=r"huge\.toml: platform\.mass_kg: found 99000 kg on hinges 8 m from"):
        check(huge)


def test_no_plausible_machine_is_called_implausible():
    # GIVEN 40 random machines and those of the scenarios WHEN they are looked at THEN nothing is found
    tables = [tomllib.loads(random_platform(seed)) for seed in range(40)]
    tables += [tomllib.loads(path.read_text()) for path in PAPER_FILE.parent.glob("*.toml")]
    found = [str(each) for table in tables for each in findings_of(table, workspace.machine_of(table))]
    assert found == []


def test_legs_in_each_others_place_and_mirrored_ones_are_named():
    # GIVEN random machines, of which two legs have changed places in one list, or one list is mirrored
    for seed in range(20):
        geometry = tomllib.loads(random_platform(seed))["geometry"]
        base, platform = (np.array(geometry[key]) for key in ("base_hinges_m", "platform_hinges_m"))
        for first, second in combinations(range(6), 2):
            swapped = platform.copy()
            swapped[[first, second]] = platform[[second, first]]
            # WHEN the order is looked at THEN these legs are named
            found = " ".join(map(str, order_findings(base, swapped)))
            assert f"legs {first + 1} and {second + 1} in each other's place" in found, (seed, first, second)
        for sign in ([1, -1, 1], [-1, 1, 1]):
            assert "legs mirrored" in " ".join(map(str, order_findings(base, platform * sign)))


def test_reach_and_condition_are_those_of_other_kinematics():
    # GIVEN a machine and the end of its reach along each axis
    tables = tomllib.loads(random_platform(11))
    machine = workspace.machine_of(tables)
    low, high = machine.stroke_m
    for reach in workspace.reaches(machine):
        pose = np.zeros((1, 6))
        pose[0, workspace.AXES.index(reach.axis)] = reach.from_home
        legs = workspace.displacements(machine, pose)[0]
        # WHEN its legs are put into the test's own kinematics, on a way from home THEN the pose is that one, with that condition
        poses = forward_kinematics(
            tables["geometry"], np.linspace(workspace.displacements(machine, 0 * pose)[0], legs, 40)
        )
        np.testing.assert_allclose(poses.position_m[-1], pose[0, :3], atol=1e-6)
        turned = Rotation.from_matrix(poses.rotation[-1]).as_euler("ZYX")[::-1]
        np.testing.assert_allclose(turned, pose[0, 3:], atol=1e-6)
        condition = workspace.conditions(machine, pose)[0]
        assert poses.condition()[-1] == pytest.approx(condition, rel=1e-6)
        # AND no leg is beyond its end, and one is near it where a leg is named
        assert low <= legs.min() and legs.max() <= high
        if reach.limit.startswith("leg"):
            assert min(legs.min() - low, high - legs.max()) < 0.02 * (high - low)


def test_a_tilt_is_a_turn_about_a_horizontal_axis():
    for tilt, direction in ((0.3, 1.0), (0.5, 4.0)):
        expected = Rotation.from_rotvec(tilt * np.array([np.cos(direction), np.sin(direction), 0.0])).as_euler("ZYX")
        np.testing.assert_allclose(workspace._tilt(tilt, direction), expected[::-1], atol=1e-12)


def test_the_check_prints_json_and_writes_a_page_and_ends_with_3_when_something_is_implausible(tmp_path):
    # GIVEN a good file and one with the mass in g
    good = made(tmp_path)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(scaled(good, mass_kg=1e3, inertia_kg_m2=1e3))
    # WHEN both are checked THEN the status tells them apart, and what is found stands in JSON and on the page
    result = hexload("platform", "check", good, "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["findings"] == []
    assert json.loads(result.stdout)["home"]["height_m"] == pytest.approx(0.798276, abs=1e-6)
    result = hexload("platform", "check", wrong, "--report", tmp_path / "page.html")
    assert result.returncode == 3
    assert "implausible: platform.mass_kg: found 100000 kg on a radius of 0.4 m" in result.stdout
    page = (tmp_path / "page.html").read_text()
    assert "1 implausible" in page and "platform.mass_kg" in page and page.count('class="chart"') == 2


@pytest.mark.parametrize(("tick_s", "words"), [(1e-3, ""), (0.25e-3, "looks back 20.5 ms (82 ticks) of the 53.4 ms")])
def test_a_tick_at_which_the_filters_lag_is_too_short_is_told(tmp_path, tick_s, words):
    # GIVEN the paper's sensors at a tick WHEN the file is checked THEN a lag that is much shorter than they ask for is told
    path = made(tmp_path)
    path.write_text(path.read_text().replace("[sensors]", f"[sensors]\ntick_s = {tick_s}"))
    assert words in lag_in_words(check(path).tables)
    assert bool(lag_in_words(check(path).tables)) == bool(words)


def test_quantities_with_their_units():
    for text, kind, si in (
        ("400mm", "length", [0.4]),
        ("20 µm", "length", [20e-6]),
        ("-30, 30 cm", "length", [-0.3, 0.3]),
        ("2.5 kg m²", "inertia", [2.5]),
        ("180°", "angle", [np.pi]),
        ("1e-3", "speed", [1e-3]),
    ):
        assert parse(text, kind, "x", (1, 2)).si() == pytest.approx(si)
