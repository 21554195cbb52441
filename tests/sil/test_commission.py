"""`hexload commission` and `replay --rig`, on a rig that tests/sil/rig_plant.py makes."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt
from scipy.spatial.transform import Rotation

from hexload import project
from hexload.cli.commission import TITLES, print_summary
from hexload.diagnosis.channels import common_noise
from hexload.errors import InputError
from hexload.estimation.arrays import leg_log
from hexload.estimation.commission import AS_DECLARED, NONE, Wish, commission
from hexload.estimation.commissioning_run import Run, refuse_derived, refuse_held, refuse_velocities, run_of
from hexload.estimation.firmware_run import native_firmware
from hexload.estimation.input_check import WayIn
from hexload.estimation.load_summary import load_changes_s
from hexload.estimation.replay import replay_log
from hexload.estimation.rig_hinges import force_columns
from hexload.estimation.rig_model import (
    FrictionLaw,
    Geometry,
    gravity_vector,
    leg_mass_forces,
    motion_of_legs,
    rigid_forces,
    slides,
    stiffness_forces,
    unlike_leg_forces,
)
from hexload.estimation.rig_regression import SLICES
from hexload.io.log_columns import COLUMNS, WITHOUT_VELOCITY
from hexload.io.toml_document import GUESSED, to_toml
from hexload.theory.kinematics import vector_of_rotation
from hexload.theory.tolerances import DEFAULTS, common_gain_of
from rig_plant import ROD_KG, RubbingRig, log_of, multisine

NOMINAL = (project.SCENARIOS / "platforms" / "paper.toml").read_text()
TOLERANCES = "\n[tolerances]\nforce_gain = 0.004\nforce_offset_n = 25.0\nhinge_m = 0.4e-3\ntilt_rad = 0.01\n"
LOAD = np.array([312.0, -28.0, 40.0, 84.0, 48.0, 50.0, 24.0, 5.0, 6.0, -9.0])
EMPTY = np.zeros(10)
DELAY_S = 0.8e-3
PRESLIDING_M = 40e-6


@pytest.fixture(scope="module")
def platform(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "nominal.toml"
    text = re.sub(r"displacement_sigma_m = \S+", "displacement_sigma_m = 1e-5", NOMINAL)
    text = re.sub(r"\[(load|tolerances)\][^\[]*", "", text)
    text = re.sub(r'kind = "\w+"', 'kind = "momentum"', text)
    path.write_text(text + TOLERANCES)
    return path


def machine_of(platform: Path) -> RubbingRig:
    """Another machine than the file's, within its tolerances."""
    table = tomllib.loads(platform.read_text())
    random = np.random.default_rng(5)
    return RubbingRig(
        np.array(table["geometry"]["base_hinges_m"]) + 0.3e-3 * random.normal(size=(6, 3)),
        np.array(table["geometry"]["platform_hinges_m"]) + 0.3e-3 * random.normal(size=(6, 3)),
        float(np.mean(table["geometry"]["home_leg_length_m"])),
        np.array([101.0, 0.4, -0.3, 0.2, 25.0, 25.5, 44.0, 0.1, 0.0, -0.1]),
        9.81 * np.array([0.006, -0.004, -np.sqrt(1.0 - 0.006**2 - 0.004**2)]),
        0.003 * random.normal(size=6),
        15.0 * random.normal(size=6),
        random.uniform(40.0, 70.0, 6),
        random.uniform(15.0, 30.0, 6),
        random.uniform(200.0, 300.0, 6),
        DELAY_S,
        PRESLIDING_M,
    )


def hinged_kg(machine: RubbingRig) -> float:
    """The rods' mass at the upper hinges is a part of the platform's."""
    return machine.platform_theta[0] + 6.0 * ROD_KG


def write_log(path: Path, log: tuple) -> Path:
    np.savetxt(
        path,
        np.column_stack(log),
        delimiter=",",
        header=",".join(COLUMNS),
        comments="",
        fmt="%.9g",
    )
    return path


@pytest.fixture(scope="module")
def found(platform) -> tuple[RubbingRig, Path, dict]:
    machine = machine_of(platform)
    log = write_log(platform.parent / "empty.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    out = platform.parent / "rig.toml"
    return machine, out, commission(Wish(log, platform, out, report=platform.parent / "page.html"))


def test_every_constant_is_found_within_its_sigma(found):
    # GIVEN a rig with friction, offsets, gains, a tilted base, legs with mass and late forces WHEN it is commissioned
    machine, out, result = found
    rig, sigma = (tomllib.loads(out.read_text())[key] for key in ("rig", "sigma"))
    truth = {
        "force_offset_n": machine.offset_n,
        "force_gain": machine.gain,
        "coulomb_n": machine.coulomb_n,
        "viscous_n_s_m": machine.viscous_n_s_m,
        "gravity_m_s2": machine.gravity_m_s2,
    }
    for key, value in truth.items():
        # THEN each is within four of its sigmas and a hundredth: the common gain scales friction too
        slack = 4.0 * np.array(sigma[key]) + 0.01 * np.abs(value)
        assert (np.abs(np.array(rig[key]) - value) < slack).all(), key
    assert rig["force_delay_s"] == pytest.approx(DELAY_S, abs=0.1e-3)
    assert rig["presliding_m"] == pytest.approx(PRESLIDING_M, rel=0.5)
    # AND what is left of the forces is noise: 5 N of which a band of 15 Hz in 500 Hz stays, and 1 N of the friction law
    assert result["residual_n"] < 5.0 * np.sqrt(15.0 / 500.0) + 1.0
    assert result["words"]["coulomb"] == result["words"]["tilt"] == "found"


@pytest.mark.parametrize("presliding_m", [5e-6, 4e-5, 1e-2])
@pytest.mark.parametrize("ticks", [1, 2, 3, 1000])
def test_friction_turns_from_tick_to_tick_as_its_law_says(presliding_m, ticks):
    # GIVEN speeds of six legs, some of which stand still for a while
    random = np.random.default_rng(ticks)
    speed_m_s = 0.2 * np.sin(random.uniform(0.5, 20.0, 6) * 1e-3 * np.arange(ticks)[:, None])
    speed_m_s[ticks // 3 : ticks // 2, :3] = 0.0
    law = FrictionLaw(0.01, 0.001, presliding_m)
    # WHEN their shape is found THEN it is that of ds = |dx| / presliding (tanh(v / reversal) - s) with v held for a tick,
    # to the rounding of log2(ticks) additions
    shape = np.zeros(6)
    for speed, found in zip(speed_m_s, slides(speed_m_s, law, 1e-3), strict=True):
        kept = np.exp(-np.abs(speed) * 1e-3 / presliding_m)
        shape = kept * shape + (1.0 - kept) * np.tanh(speed / law.reversal_speed_m_s)
        assert np.abs(found - shape).max() < 1e-13


def test_what_a_wrong_hinge_does_to_forces_is_what_small_shifts_of_it_do(platform):
    # GIVEN a moving platform whose legs have mass, on a base off level
    table = tomllib.loads(platform.read_text())["geometry"]
    geometry = Geometry(*(np.array(table[key]) for key in ("base_hinges_m", "platform_hinges_m", "home_leg_length_m")))
    random = np.random.default_rng(8)
    motion = [size * random.uniform(-1.0, 1.0, (20, 6)) for size in (0.05, 0.3, 3.0)]
    theta, leg_mass, gravity = LOAD, np.array([3.0, 4.0, 6.0]), np.array([0.06, -0.05, -9.81])

    def forces(hinge: int, shift_m: float) -> np.ndarray:
        shifts_m = (shift_m * np.eye(36)[hinge]).reshape(2, 6, 3)
        there = replace(
            geometry,
            base_hinges_m=geometry.base_hinges_m + shifts_m[0],
            platform_hinges_m=geometry.platform_hinges_m + shifts_m[1],
        )
        return rigid_forces(motion_of_legs(there, *motion), there, gravity, theta, leg_mass)

    # WHEN the derivatives by each coordinate of each hinge are worked out
    found = force_columns(motion_of_legs(geometry, *motion), geometry, gravity, theta, leg_mass)
    # THEN they are those of shifts by 0.1 mm to both sides, but for the 1e-9 m to which poses are solved
    shift_m = 1e-4
    shifted = np.stack([(forces(k, shift_m) - forces(k, -shift_m)) / (2.0 * shift_m) for k in range(36)], axis=2)
    assert np.abs(found - shifted).max() < 1e-9 / shift_m * np.abs(shifted).max()


def test_forces_of_legs_one_by_one_are_together_those_of_legs_alike(platform):
    # GIVEN a moving platform WHEN each leg's own mass has its columns THEN a number of all legs has their sum, and a leg
    # with mass is pushed by no more than one wrench, that of a force at its own upper hinge; to rounding
    table = tomllib.loads(platform.read_text())["geometry"]
    geometry = Geometry(*(np.array(table[key]) for key in ("base_hinges_m", "platform_hinges_m", "home_leg_length_m")))
    random = np.random.default_rng(9)
    motion = motion_of_legs(geometry, *(size * random.uniform(-1.0, 1.0, (20, 6)) for size in (0.05, 0.3, 3.0)))
    gravity = np.array([0.06, -0.05, -9.81])
    one_by_one = unlike_leg_forces(motion, geometry, gravity).reshape(20, 6, 6, 3)
    alike = leg_mass_forces(motion, geometry, gravity)
    assert np.abs(one_by_one.sum(axis=2) - alike).max() < 1e-12 * np.abs(alike).max()
    wrenches = np.einsum("nfc,nflk->nlkc", motion.jacobian, one_by_one)
    moments = np.cross(geometry.platform_hinges_m[:, None], wrenches[..., :3])
    assert np.abs(wrenches[..., 3:] - moments).max() < 1e-12 * np.abs(wrenches).max()


def test_a_base_that_lies_on_its_side_is_none():
    # GIVEN what a regression makes of a run with displacements of the wrong sign WHEN it asks for gravity THEN that is said
    with pytest.raises(ValueError, match="tilted by more than 90 degrees, as sensors of the wrong sign show it"):
        gravity_vector(9.81, np.array([0.8, 0.7]))


def test_displacements_of_the_wrong_sign_are_known_by_friction_that_drives(found, platform, tmp_path):
    # GIVEN a machine without velocity sensors, whose displacements grow where the platform file has them shrink
    machine, _, _ = found
    time_s, displacement_m, _, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 3)
    rows = np.column_stack([time_s, -displacement_m, force_n])
    log = tmp_path / "negated.csv"
    np.savetxt(log, rows, delimiter=",", header=",".join(WITHOUT_VELOCITY), comments="", fmt="%.9g")
    # WHEN it is commissioned THEN the cause is named, and no livelier motion is asked for
    with pytest.raises(InputError, match="friction of -.* that pushes .*the sign of forces or displacements"):
        commission(Wish(log, platform, tmp_path / "rig.toml"))


def test_a_rotation_vector_makes_the_rotation_that_it_is_of():
    # GIVEN rotations of up to 3.1 rad about any axis, none and one of a nanoradian among them
    random = np.random.default_rng(11)
    axis = random.normal(size=(1000, 3))
    angle = np.concatenate([[0.0, 1e-9], random.uniform(0.0, 3.1, 998)])
    vector = axis * (angle / np.linalg.norm(axis, axis=1))[:, None]
    # WHEN another library makes matrices of their vectors THEN these come back, but for the roundings of a sine of 0.04
    found = vector_of_rotation(Rotation.from_rotvec(vector).as_matrix())
    assert np.abs(found - vector).max() < 10.0 * np.finfo(float).eps / np.sin(3.1)


def test_a_pull_home_is_a_spring_at_the_platforms_origin_in_base_axes(platform):
    # GIVEN poses beside home and a machine on springs WHEN the legs' forces for each spring are found THEN their work over a
    # small step is what the springs' energy k x^2 / 2 grows by, x along each of the base axes, and of three alike about them
    # as a rotation vector
    table = tomllib.loads(platform.read_text())["geometry"]
    geometry = Geometry(*(np.array(table[key]) for key in ("base_hinges_m", "platform_hinges_m", "home_leg_length_m")))
    random = np.random.default_rng(10)
    legs_m, step_m = random.uniform(-0.05, 0.05, (20, 6)), 1e-5 * random.normal(size=(20, 6))
    still = np.zeros((20, 6))
    home = motion_of_legs(geometry, still[:1], still[:1], still[:1])

    def energies(displacement_m: np.ndarray) -> np.ndarray:
        motion = motion_of_legs(geometry, displacement_m, still, still)
        turn = Rotation.from_matrix(np.swapaxes(motion.to_platform, 1, 2) @ home.to_platform[0]).as_rotvec()
        return 0.5 * np.concatenate([motion.place_m - home.place_m[0], turn], axis=1) ** 2

    forces = stiffness_forces(motion_of_legs(geometry, legs_m, still, still), geometry)
    work = np.einsum("nlk,nl->nk", forces, step_m)
    gained = energies(legs_m + 0.5 * step_m) - energies(legs_m - 0.5 * step_m)
    # Poses are solved to 1e-9, beside ways and turns of less than 0.25; by the step's third power nothing counts.
    for part in (slice(0, 1), slice(1, 2), slice(2, 3), slice(3, 6)):
        assert np.abs(np.sum((work - gained)[:, part], axis=1)).max() < 2e-9 * 0.25


def test_the_page_says_what_was_found_and_how_well(found, platform):
    # GIVEN the page of the commissioning WHEN its words and numbers are read
    machine, out, result = found
    page = (platform.parent / "page.html").read_text()
    words = " ".join(re.sub(r"<script>.*?</script>|<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL).split())
    # THEN every group stands there with its identifiability, and each leg's numbers with their sigmas
    for title, key in (("Coulomb friction", "coulomb"), ("tilt of gravity", "tilt"), ("hinges", "hinges")):
        assert re.search(rf"{title} \d+ \S+ \S+ \S+ \S+ {re.escape(result['words'][key])}", words), title
    rig, sigma = (tomllib.loads(out.read_text())[key] for key in ("rig", "sigma"))
    for leg in range(6):
        assert f"{rig['coulomb_n'][leg]:.1f} ± {sigma['coulomb_n'][leg]:.1f}" in words
    # AND the residual has fallen from that of a machine that rubs to the sensors' noise
    before, after = map(float, re.search(r"([\d.]+) N rms with .*? ([\d.]+) N with those found", words).groups())
    assert before > 40.0 and after < 2.5
    # AND the common gain is what six gains of 0.4 % and gravity leave, of which an empty run tells nothing
    assert f"known to {100.0 * common_gain_of(0.004):.2f} % (one sigma)" in words
    # AND nothing is loaded from a network
    assert not re.search(r"<(script|link|img)[^>]*(src|href)=", page)


@pytest.mark.parametrize("name", ["tilt", "offset"])
def test_what_a_level_run_leaves_open_is_said_with_the_run_that_tells_it(name, found, capsys):
    # GIVEN a commissioning that has found all WHEN its summary is printed THEN nothing is called open
    _, out, result = found
    print_summary(result, out)
    assert "open:" not in capsys.readouterr().out
    # AND of one that knows a group no better than it was declared, this is said with what to do
    words = result["words"] | {name: AS_DECLARED}
    print_summary(result | {"words": words}, out)
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("open:")]
    assert len(told) == 1 and TITLES[name] in told[0] and "hexload excite --empty" in told[0]


def test_a_load_is_found_on_the_commissioned_rig(found, platform):
    # GIVEN the same rig with a load that comes at 7 s WHEN its log is replayed with the rig file
    machine, out, _ = found
    log = write_log(
        platform.parent / "load.csv",
        log_of(machine, multisine(3, 14.0), LOAD, 4, load_from_s=7.0),
    )
    with_rig = replay_log(log, platform, None, None, platform.parent / "with.csv", rig=out)
    without = replay_log(log, platform, None, None, platform.parent / "without.csv")
    # THEN the change is reported once, within 30 ms
    assert [round(t_s, 3) for t_s in load_changes_s(with_rig)] == pytest.approx([7.015], abs=0.015)
    # AND mass and centre are within half a percent and 1.5 mm, all ten within four of the published sigmas
    error = with_rig["value"][-1] - LOAD
    assert with_rig["verdict"][-1] == "converged"
    assert abs(error[0]) < 0.005 * LOAD[0]
    centre = with_rig["value"][-1][1:4] / with_rig["value"][-1][0] - LOAD[1:4] / LOAD[0]
    assert np.abs(centre).max() < 1.5e-3
    assert (np.abs(error) < 4.0 * with_rig["sigma"][-1]).all()
    # AND without it nothing counts as converged, and after 4 s no change is reported but that one, later, as the machine's
    # own errors hide it at first
    assert "converged" not in without["verdict"]
    late = [t_s for t_s in load_changes_s(without) if t_s > 4.0]
    assert late == pytest.approx([7.1], abs=0.1)


def test_a_load_that_comes_early_is_reported_on_the_commissioned_rig(found, platform):
    # GIVEN a load that comes after 2.5 s, before the controller has seen what the machine's errors are like
    machine, out, _ = found
    log = write_log(platform.parent / "early.csv", log_of(machine, multisine(3, 4.0), LOAD, 4, load_from_s=2.5))
    # WHEN the log is replayed with the rig file THEN the change is reported once, within 30 ms
    replayed = replay_log(log, platform, None, None, platform.parent / "early_estimates.csv", rig=out)
    assert load_changes_s(replayed) == pytest.approx([2.515], abs=0.015)
    # AND the mass is that of the load
    assert replayed["value"][-1][0] == pytest.approx(LOAD[0], rel=0.01)


def test_a_load_is_found_on_legs_that_are_not_alike_and_rub_more_under_load(found, platform):
    # GIVEN LuGre's friction that grows by 1 % of the leg's force, and legs whose masses differ by up to a tenth
    machine, _, _ = found
    machine = replace(machine, growth=0.01, has_bristles=True, leg_scale=np.array([1.1, 0.92, 1.03, 0.9, 1.06, 0.97]))
    empty = write_log(platform.parent / "grown_empty.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    out = platform.parent / "grown.toml"
    # WHEN it is commissioned THEN the growth is found within four of its sigmas, as sure as a tenth of what is declared
    result = commission(Wish(empty, platform, out))
    sigma = np.array(result["sigma"]["growth_n_n"])
    assert (np.abs(result["rig"]["growth_n_n"] - machine.growth) < 4.0 * sigma).all()
    assert sigma.max() < 0.1 * DEFAULTS["friction_growth"]
    # AND a load is found to 0.4 %, 1.5 mm and four of the published sigmas
    log = write_log(platform.parent / "grown_load.csv", log_of(machine, multisine(3, 10.0), LOAD, 4))
    replayed = replay_log(log, platform, None, None, platform.parent / "grown_estimates.csv", rig=out)
    error = replayed["value"][-1] - LOAD
    centre = replayed["value"][-1][1:4] / replayed["value"][-1][0] - LOAD[1:4] / LOAD[0]
    assert replayed["verdict"][-1] == "converged"
    assert load_changes_s(replayed) == []
    assert abs(error[0]) < 0.004 * LOAD[0]
    assert np.linalg.norm(centre) < 1.5e-3
    assert (np.abs(error) < 4.0 * replayed["sigma"][-1]).all()


def test_no_leg_weighs_less_than_nothing(found, platform):
    # GIVEN legs without mass, and forces that lack a tenth of what the machine's own would take, as elastic legs make it seem
    machine, _, _ = found
    *motion, heavy_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    *_, massless_n = log_of(replace(machine, has_leg_mass=False), multisine(1, 12.0), EMPTY, 2)
    log = write_log(platform.parent / "light.csv", (*motion, massless_n - 0.1 * (heavy_n - massless_n)))
    # WHEN it is commissioned THEN the rig file has legs without mass, not of a negative one
    rig = commission(Wish(log, platform, platform.parent / "light.toml"))["rig"]
    assert [rig[f"leg_{name}"] for name in ("inertia_kg_m2", "slide_kg_m", "tilt_kg_m")] == [0.0, 0.0, 0.0]


def test_what_legs_differ_by_is_not_taken_for_hinges(found, platform):
    # GIVEN the same rig with cylinders and rods of up to half as much again, or less
    alike, _, of_alike = found
    machine = replace(alike, leg_scale=np.array([1.5, 0.7, 0.8, 1.4, 0.6, 1.0]))
    empty = write_log(platform.parent / "unlike_empty.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    # WHEN it is commissioned THEN its hinges are as well known as with legs that are alike, to a twentieth: motion and noise are
    # the same. As errors of hinges alone what legs differ by made them 1.4 times as wrong
    of_unlike = commission(Wish(empty, platform, platform.parent / "unlike.toml"))
    assert hinges_off_m(of_unlike, machine) < 1.05 * hinges_off_m(of_alike, alike)


def test_hoses_are_not_taken_for_the_weight_of_legs(found, platform):
    # GIVEN the same rig with hoses that pull its platform home by 60 N/m
    machine, _, without = found
    pulled = replace(machine, hoses_n_m=60.0)
    empty = write_log(platform.parent / "hoses_empty.csv", log_of(pulled, multisine(1, 12.0), EMPTY, 2))
    out = platform.parent / "hoses.toml"
    # WHEN it is commissioned
    result = commission(Wish(empty, platform, out))
    # THEN they are said, and each stiffness, three of which are none, is within four of its sigmas
    assert result["words"]["stiffness"].startswith("found; no controller takes it off")
    assert without["words"]["stiffness"] == NONE
    off = np.array(result["pull_home"]) - [60.0, 60.0, 60.0, 0.0, 0.0, 0.0]
    assert (np.abs(off) < 4.0 * np.array(result["pull_home_sigma"])).all()
    # AND the legs are as heavy as without them, within three sigmas of what six unknowns more leave open
    for key in ("leg_inertia_kg_m2", "leg_slide_kg_m", "leg_tilt_kg_m"):
        more = np.sqrt(max(result["sigma"][key] ** 2 - without["sigma"][key] ** 2, 0.0))
        assert abs(result["rig"][key] - without["rig"][key]) < 3.0 * more, key
    # AND a load in another motion is within four of its sigmas, as nobody takes hoses off
    log = write_log(platform.parent / "hoses_load.csv", log_of(pulled, multisine(3, 8.0), LOAD, 4))
    replayed = replay_log(log, platform, None, None, platform.parent / "hoses_estimates.csv", rig=out)
    assert (np.abs(replayed["value"][-1] - LOAD) < 4.0 * replayed["sigma"][-1]).all()


def hinges_off_m(result: dict, machine: RubbingRig) -> float:
    """Root mean square of what they are off by."""
    keys = ("base_hinges_m", "platform_hinges_m")
    return float(np.sqrt(np.mean([(result["rig"][key] - getattr(machine, key)) ** 2 for key in keys])))


def test_a_reference_mass_tells_the_common_gain_and_the_growth_of_friction(found, platform):
    # GIVEN load cells that all show 0.8 % too much, friction that grows by 1 % of the force, and a run with a known mass
    machine, _, _ = found
    machine = replace(machine, gain=machine.gain - machine.gain.mean() + 0.008, growth=0.01)
    empty = write_log(platform.parent / "gain.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    loaded = write_log(platform.parent / "reference.csv", log_of(machine, multisine(5, 12.0), LOAD, 6))
    # WHEN the rig is commissioned with it THEN the mean gain is found to a tenth of a percent
    result = commission(Wish(empty, platform, platform.parent / "gain.toml", loaded, LOAD[0]))
    assert np.mean(result["rig"]["force_gain"]) == pytest.approx(0.008, abs=1e-3)
    # AND the growth within four of its sigmas, as sure as 3 % of what is declared; the empty run alone leaves
    # 4.7 %
    growth_sigma = np.array(result["sigma"]["growth_n_n"])
    assert (np.abs(result["rig"]["growth_n_n"] - machine.growth) < 4.0 * growth_sigma).all()
    assert growth_sigma.max() < 0.03 * DEFAULTS["friction_growth"]
    # AND offsets, gains and the platform's mass with its legs' upper parts are within four of theirs
    for key, value in (
        ("force_offset_n", machine.offset_n),
        ("force_gain", machine.gain),
        ("mass_kg", hinged_kg(machine)),
    ):
        assert (np.abs(np.array(result["rig"][key]) - value) < 4.0 * np.array(result["sigma"][key])).all(), key
    # AND a mass that is not that one is refused
    with pytest.raises(InputError, match="expected --reference-mass 250 kg"):
        commission(Wish(empty, platform, platform.parent / "no.toml", loaded, 250.0))


def test_noise_is_not_taken_for_a_motion(found, platform):
    # GIVEN a run in which the platform turns only: its weight and equal offsets of all forces look alike but for noise
    machine, _, _ = found
    t_s, pose = multisine(1, 8.0)
    turning = (t_s, pose * np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))
    log = write_log(platform.parent / "turning.csv", log_of(machine, turning, EMPTY, 2))
    # WHEN it is commissioned THEN mass and offsets are within three of their sigmas
    result = commission(Wish(log, platform, platform.parent / "turning.toml"))
    for key, value in (("force_offset_n", machine.offset_n), ("mass_kg", hinged_kg(machine))):
        assert (np.abs(np.array(result["rig"][key]) - value) < 3.0 * np.array(result["sigma"][key])).all(), key


def test_what_is_no_run_of_an_empty_platform_is_refused(found, platform):
    # GIVEN logs of a loaded platform, of one whose load comes in mid-run, of legs that stand still, of load cells at the
    # end of their range and stopped, and a short one, with a platform file whose mass was guessed
    guessed = platform.parent / "guessed.toml"
    guessed.write_text(re.sub("(mass_kg = 100.0)", f"\\1 # {GUESSED} a drawing", platform.read_text()))
    machine, _, _ = found
    motion = multisine(1, 6.0)
    still = (motion[0], np.zeros_like(motion[1]))
    t_s, way_m, speed_m_s, force_n = log_of(machine, motion, EMPTY, 7)
    stopped_n = force_n.copy()
    stopped_n[3000:, 2] = stopped_n[3000, 2]
    cases = {
        "seems to carry a load.*; mass_kg in .* was guessed: the first suspect": log_of(machine, motion, LOAD, 7),
        "a load that comes or goes": log_of(machine, motion, 2.0 * LOAD, 7, load_from_s=3.0),
        "a livelier motion of all six axes": with_noise_of_displacements(log_of(machine, still, EMPTY, 7), 2e-5),
        "leg 1's force at -250 N in .* of all rows": (t_s, way_m, speed_m_s, np.maximum(force_n, -250.0)),
        "leg 3's force at .* from 3.000 to": (t_s, way_m, speed_m_s, stopped_n),
        "4 s of motion at least": log_of(machine, multisine(1, 2.0), EMPTY, 7),
    }
    for words, log in cases.items():
        path = write_log(platform.parent / "refused.csv", log)
        # WHEN they are commissioned THEN the cause is named, and nothing written
        with pytest.raises(InputError, match=words):
            commission(Wish(path, guessed, platform.parent / "refused.toml"))
        assert not (platform.parent / "refused.toml").exists()


def with_noise_of_displacements(log, sigma_m: float):
    """Which differences of one row and the next show as speeds."""
    t_s, way_m, speed_m_s, force_n = log
    return t_s, way_m + np.random.default_rng(8).normal(0.0, sigma_m, way_m.shape), speed_m_s, force_n


def test_velocities_that_are_not_the_change_of_displacements_are_refused(found, platform):
    # GIVEN an empty run whose velocities are 2 % large, in all legs, as a wrong clock makes them, or in leg 4
    machine, _, _ = found
    t_s, way_m, speed_m_s, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    out = platform.parent / "scaled.toml"
    large = np.array([1.0, 1.0, 1.0, 1.02, 1.0, 1.0])
    cases = {
        r"velocities of leg \d at 1\.0[12]\d times .*: check the scale of both sensors and the log's clock": 1.02,
        r"velocities of leg 4 at 1\.0[12]\d times .*: check scale and wiring of both sensors \(": large,
    }
    for words, gain in cases.items():
        path = write_log(platform.parent / "scaled.csv", (t_s, way_m, gain * speed_m_s, force_n))
        # WHEN it is commissioned THEN the leg and the suspects are named, and nothing is written
        with pytest.raises(InputError, match=words):
            commission(Wish(path, platform, out))
        assert not out.exists()
        # AND who knows better goes on
        commission(Wish(path, platform, out, way_in=WayIn(is_unchecked=True)))
        out.unlink()
    # AND 0.3 % are those of ordinary sensors
    path = write_log(platform.parent / "scaled.csv", (t_s, way_m, 1.003 * speed_m_s, force_n))
    commission(Wish(path, platform, out))


def test_a_displacement_whose_scale_is_no_line_is_refused(found, platform):
    # GIVEN an empty run in which leg 2 shows a parabola, off by 0.5 % at its largest displacement D: its scale is off by
    # 1 % there, and by that times (d_max - d_min) / 2 D at the ends of its stroke, from the middle
    machine, _, _ = found
    t_s, way_m, speed_m_s, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    curve_m, largest_m = np.zeros_like(way_m), np.abs(way_m[:, 1]).max()
    curve_m[:, 1] = way_m[:, 1] ** 2 / largest_m
    expected, sigma = 1.0 * np.ptp(way_m[:, 1]) / 2.0 / largest_m, 0.02  # %, the latter of 12 s at 1 mm/s of noise

    def shown(share: float) -> Run:
        return run_of(leg_log(t_s, way_m + share * curve_m, speed_m_s, force_n), platform)

    # WHEN its channels are compared THEN leg and cause are named
    for share in (0.005, -0.005):
        with pytest.raises(InputError, match="leg 2 that differ .* check the linearity of both sensors") as refused:
            refuse_velocities(shown(share))
        percent = float(re.search(r"by (\S+) % more", str(refused.value))[1])
        assert percent == pytest.approx(expected, abs=3.0 * sigma + 0.005)  # and two digits
    # AND 0.1 % are those of ordinary sensors
    refuse_velocities(shown(0.001))


@pytest.mark.parametrize("cutoff_hz", [30.0, 200.0])
def test_velocities_that_are_made_of_displacements_are_refused(found, platform, cutoff_hz):
    # GIVEN an empty run whose velocities are differences of its displacements, through a low-pass
    machine, _, _ = found
    t_s, way_m, _, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    filters = butter(2, cutoff_hz, fs=1e3, output="sos")
    made = sosfilt(filters, np.gradient(way_m, t_s, axis=0), axis=0)
    path, out = write_log(platform.parent / "made.csv", (t_s, way_m, made, force_n)), platform.parent / "made.toml"
    # WHEN it is commissioned THEN that is said, with what to do, and nothing is written
    with pytest.raises(
        InputError, match=r"with the noise of its displacement \(coherence (0.9\d|1.00)\).*leave vl1 to vl6 out"
    ):
        commission(Wish(path, platform, out))
    assert not out.exists()


def test_velocities_of_their_own_share_no_noise_with_displacements(found, platform):
    # GIVEN an empty run of velocity sensors, of filtered ones, and one without noise WHEN it is commissioned
    machine, _, _ = found
    t_s, way_m, speed_m_s, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    slow, quiet = (butter(2, cutoff_hz, fs=1e3, output="sos") for cutoff_hz in (100.0, 20.0))
    smooth_m = sosfiltfilt(quiet, way_m, axis=0)
    logs = (
        (way_m, speed_m_s),
        (way_m, sosfilt(slow, speed_m_s, axis=0)),
        (smooth_m, np.gradient(smooth_m, t_s, axis=0)),
    )
    for shown_m, shown_m_s in logs:
        # THEN nothing is refused: of 92 segments, independent noise leaves a coherence of 1 / 92, and half of it more as
        # they overlap
        refuse_derived(run_of(leg_log(t_s, shown_m, shown_m_s, force_n), platform), 1e-5)
        assert common_noise(shown_m, shown_m_s, 1e-5).max() < 2.0 / 92.0


def test_a_leg_that_is_later_than_the_others_is_refused(found, platform):
    # GIVEN an empty run of which one leg's velocities, or another's forces, are shown 2 ms late
    machine, _, _ = found
    log = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    out = platform.parent / "late.toml"
    cases = {r"velocities of leg 3 2 ms later than other legs'": (2, 2), r"forces of leg 5 \S+ ms later": (3, 4)}
    for words, (channel, leg) in cases.items():
        late = [values.copy() for values in log]
        late[channel][2:, leg] = log[channel][:-2, leg]
        path = write_log(platform.parent / "late.csv", tuple(late))
        # WHEN it is commissioned THEN channel and leg are named, and nothing is written
        with pytest.raises(InputError, match=words):
            commission(Wish(path, platform, out))
        assert not out.exists()
        # AND who knows better goes on
        commission(Wish(path, platform, out, way_in=WayIn(is_unchecked=True)))
        out.unlink()
    # AND where all legs are late alike it is a delay that is found
    late = [values.copy() for values in log]
    late[3][2:] = log[3][:-2]
    result = commission(Wish(write_log(platform.parent / "late.csv", tuple(late)), platform, out))
    assert result["rig"]["force_delay_s"] == pytest.approx(DELAY_S + 2e-3, abs=0.1e-3)


DRAWN = np.array([100.0, 0.0, 0.0, 0.0, 25.0, 25.0, 44.0, 0.0, 0.0, 0.0])  # theta of the platform file


@pytest.mark.parametrize("factor", [1.06, 0.8])
def test_a_common_gain_beyond_what_is_declared_is_in_the_sigmas(found, platform, factor):
    # GIVEN load cells that all show 6 % too much (0.34 % is declared, and 3 % of the platform's mass), or a fifth too
    # little, of a platform as it is drawn on legs of no mass
    machine, _, _ = found
    machine = replace(machine, platform_theta=DRAWN, has_leg_mass=False, gain=factor * (1.0 + machine.gain) - 1.0)
    empty = write_log(platform.parent / "common.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    log = write_log(platform.parent / "common_load.csv", log_of(machine, multisine(3, 10.0), LOAD, 4))
    rig = platform.parent / "common.toml"
    # WHEN the empty platform is commissioned THEN it is said that its weight or the sensors are off by as much
    words = commission(Wish(empty, platform, rig))["words"]["gain"]
    said = re.search(
        r"all masses are ([+-]\d+\.\d) % off what is stated, by the platform or by all force sensors", words
    )
    assert float(said[1]) == pytest.approx(100.0 * (factor - 1.0), abs=0.5)
    # AND a load is as much off, and within twice its sigmas
    replayed = replay_log(log, platform, None, None, platform.parent / "common_estimates.csv", rig=rig)
    error = replayed["value"][-1] - LOAD
    assert abs(error[0]) > 0.8 * abs(factor - 1.0) * LOAD[0]
    assert (np.abs(error) < 2.0 * replayed["sigma"][-1]).all()
    # AND a run with a known mass tells the gain, and nothing of it is left open
    loaded = write_log(platform.parent / "common_reference.csv", log_of(machine, multisine(5, 12.0), LOAD, 6))
    result = commission(Wish(empty, platform, platform.parent / "common_known.toml", loaded, LOAD[0]))
    sigma = np.array(result["sigma"]["force_gain"])
    assert (np.abs(result["rig"]["force_gain"] - machine.gain) < 4.0 * sigma).all()
    assert sigma.max() < 0.1 * abs(factor - 1.0)
    assert "all masses" not in result["words"]["gain"]


@pytest.mark.parametrize("key", ["mass_kg", "inertia_kg_m2"])
@pytest.mark.parametrize("has_leg_mass", [False, True])
def test_a_wrong_mass_or_inertia_alone_is_no_common_gain(found, platform, key, has_leg_mass):
    # GIVEN a platform file whose mass is 10 % too small, or all of its inertia, of a machine with and without leg mass
    machine, _, _ = found
    machine = replace(machine, has_leg_mass=has_leg_mass)
    table = tomllib.loads(platform.read_text())
    table["platform"][key] = (0.9 * np.array(table["platform"][key])).tolist()
    light = platform.parent / "light.toml"
    light.write_text(to_toml(table))
    empty = write_log(platform.parent / "drawn.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    # WHEN the machine is commissioned THEN the gain is as open as declared
    result = commission(Wish(empty, light, platform.parent / "light_rig.toml"))
    assert np.mean(result["sigma"]["force_gain"]) == pytest.approx(common_gain_of(0.004), rel=0.2)
    assert "all masses" not in result["words"]["gain"]


def test_a_machine_beyond_its_tolerances_is_refused(found, platform):
    # GIVEN a platform file whose hinges stand on a circle 2 % too large, 8 mm with a tolerance of 0.4 mm, and a run whose
    # leg 3 shows forces 10 % too large with a tolerance of 0.4 %
    machine, _, _ = found
    t_s, way_m, speed_m_s, force_n = log_of(machine, multisine(1, 12.0), EMPTY, 2)
    wide, out = platform.parent / "wide.toml", platform.parent / "beyond.toml"
    table = tomllib.loads(platform.read_text())
    table["geometry"]["platform_hinges_m"] = (1.02 * np.array(table["geometry"]["platform_hinges_m"])).tolist()
    wide.write_text(to_toml(table))
    honest = write_log(platform.parent / "honest.csv", (t_s, way_m, speed_m_s, force_n))
    scale = np.array([1.0, 1.0, 1.1, 1.0, 1.0, 1.0])
    scaled = write_log(platform.parent / "scaled.csv", (t_s, way_m, speed_m_s, force_n * scale))
    cases = {
        rf"{wide}: found hinges \S+ m \(rms\) off .* \S+ m at most by \[tolerances\] hinge_m = 0.0004": (honest, wide),
        r"found force gains \S+ \(rms\) off .* by \[tolerances\] force_gain = 0.004": (scaled, platform),
    }
    for words, (log, file) in cases.items():
        # WHEN it is commissioned THEN the group and its tolerance are named, and nothing is written
        with pytest.raises(InputError, match=words):
            commission(Wish(log, file, out))
        assert not out.exists()
        # AND who knows better goes on
        commission(Wish(log, file, out, way_in=WayIn(is_unchecked=True)))
        out.unlink()
    # AND it is commissioned where the platform file states as much
    table["tolerances"]["hinge_m"] = 5e-3
    wide.write_text(to_toml(table))
    commission(Wish(honest, wide, out))


def test_channels_that_are_held_are_refused_and_an_encoder_with_steps_is_not(found, platform):
    # GIVEN a log of which one channel, or all, have a new value in every other row only
    machine, _, _ = found
    log = log_of(machine, multisine(1, 5.0), EMPTY, 2)
    for channel, name in ((1, "displacements"), (2, "velocities"), (3, "forces")):
        held = [values.copy() for values in log]
        held[channel] = log[channel][np.arange(len(log[0])) // 2 * 2]
        out = platform.parent / "held.toml"
        # WHEN it is commissioned THEN that is refused, with the channel and the rate that it has
        with pytest.raises(InputError, match=f"found new {name} in one of 2 rows only .* every 2 ms"):
            commission(Wish(write_log(platform.parent / "held.csv", tuple(held)), platform, out))
        assert not out.exists()
    # AND displacements in steps of 0.1 mm, of which at a time some repeat and some do not, are none of that
    steps = [values.copy() for values in log]
    steps[1] = 1e-4 * np.round(log[1] / 1e-4)
    run = run_of(leg_log(*steps), platform)
    refuse_held(run)


def test_every_group_of_unknowns_has_a_name_on_the_terminal():
    assert set(TITLES) == set(SLICES)


def test_a_rig_file_of_another_machine_is_refused(found, platform):
    # GIVEN a rig file, and a platform file with another mass WHEN they meet THEN the key is named
    _, out, _ = found
    other = platform.parent / "other.toml"
    other.write_text(platform.read_text().replace("mass_kg = 100.0", "mass_kg = 120.0"))
    with pytest.raises(InputError, match="platform.mass_kg: found 100, expected 120 as in the platform file"):
        replay_log(
            platform.parent / "empty.csv",
            other,
            None,
            None,
            platform.parent / "x.csv",
            rig=out,
        )
    # AND a key that is missing is named too
    broken = platform.parent / "broken.toml"
    broken.write_text(re.sub(r"coulomb_n = \[[^\]]*\]\n", "", out.read_text(), count=1))
    with pytest.raises(InputError, match="rig.coulomb_n: found nothing"):
        replay_log(
            platform.parent / "empty.csv",
            platform,
            None,
            None,
            platform.parent / "x.csv",
            rig=broken,
        )


def test_bandwidths_of_the_sensors_are_delays(platform):
    # GIVEN a platform file that tells of low-pass filters of second order WHEN it is read
    path = platform.parent / "filtered.toml"
    keys = "force_sigma_n = 5.0\nforce_bandwidth_hz = 200.0\nforce_delay_s = 1e-4\nvelocity_bandwidth_hz = 150.0\n"
    path.write_text(platform.read_text().replace("force_sigma_n = 5.0\n", keys))
    filtered = native_firmware().load_platform(str(path))
    # THEN each is as late as Butterworth's filter makes a slow signal, and the delay is added
    assert filtered.force_delay_s == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * 200.0) + 1e-4)
    assert filtered.velocity_delay_s == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * 150.0))
    # AND a tolerance below zero is refused
    path.write_text(platform.read_text().replace("hinge_m = 0.4e-3", "hinge_m = -1.0"))
    with pytest.raises(ValueError, match="tolerances.hinge_m"):
        native_firmware().load_platform(str(path))
