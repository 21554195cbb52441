"""What no motion tells is in the sigmas: of a machine of which nothing was declared, and of faults in its logs."""

import json
import re
import tomllib
from pathlib import Path

import hexload_native
import numpy as np
import pytest

from hexload import project
from hexload.errors import InputError
from hexload.estimation import rig_file
from hexload.estimation.common_gain import with_common_gain
from hexload.estimation.firmware_run import run_firmware
from hexload.estimation.load_summary import mend_in_words
from hexload.estimation.plausibility import machine_of
from hexload.estimation.rig_regression import SLICES, UNKNOWNS
from hexload.io.log_file import LegLog, read_log
from hexload.platform import Platform
from hexload.theory.tolerances import DEFAULTS, GRAVITY, common_gain_of

DATA = Path(__file__).parents[1] / "data"
EXACT = tomllib.loads((DATA / "unknown_load.toml").read_text())
UNTOLD = {key: table for key, table in EXACT.items() if key != "tolerances"}
OWN = np.array([100.0, 0.0, 0.0, 0.0, 25.0, 25.0, 44.0, 0.0, 0.0, 0.0])  # of the empty platform
SIGMAS = 5.0


@pytest.fixture(scope="module")
def log() -> LegLog:
    return read_log(DATA / "multisine_eccentric.csv.gz")


@pytest.fixture(scope="module")
def theta() -> np.ndarray:
    return np.array(json.loads((DATA / "multisine_eccentric.truth.json").read_text())["segments"][0]["theta"])


def last(tables: dict, log: LegLog, force_n: np.ndarray, out: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict]:
    """Value, sigma and the filter's own sigma at the end, and all of the replay."""
    legs = LegLog(log.t_s, log.displacement_m, log.velocity_m_s, force_n)
    result = run_firmware(hexload_native, Platform.of(tables).native(), legs, out, "momentum")
    return result["value"][-1], result["sigma"][-1], result["own_sigma"][-1], result


def test_of_a_machine_of_which_nothing_was_declared_ordinary_tolerances_count(log, theta, tmp_path):
    # GIVEN a platform file without tolerances WHEN a log is replayed
    value, sigma, own, result = last(UNTOLD, log, log.force_n, tmp_path / "untold.csv")
    # THEN the mass is known to half a per cent of load and platform and to three of the platform, not to the grams of noise
    assert sigma[0] == pytest.approx(np.hypot(0.005 * (theta[0] + 100.0), 3.0), rel=0.01)
    assert own[0] < 0.05
    # AND all is converged, AND with tolerances that say exact it is the same number with the filter's own sigma
    assert result["verdict"][-1] == "converged"
    exact, of_exact, own_of_exact, _ = last(EXACT, log, log.force_n, tmp_path / "exact.csv")
    assert np.array_equal(exact, value)
    assert (of_exact < 2.0 * own_of_exact).all()


def test_the_document_has_the_defaults_that_the_code_has():
    # GIVEN the document's table of tolerances WHEN its numbers are read THEN they are those of the code
    text = (project.ROOT / "host_sim" / "README.md").read_text(encoding="utf-8")
    table = text[text.index("| key of `[tolerances]` |") :].partition("\n\n")[0]
    rows = re.findall(r"^\| `(\w+)` \| (\S+) \|", table, re.MULTILINE)
    assert {key: np.inf if number == "open" else float(number) for key, number in rows} == DEFAULTS
    # AND of the firmware, whose numbers are floats
    config = hexload_native.config_bytes(Platform.of(UNTOLD).native(), 1e-3)
    source = hexload_native.config_initialiser(config)
    for key in EXACT["tolerances"]:
        table = {"friction_shape": "actuator_effects", "timing_s": "momentum"}.get(key, "tolerances")
        name = key.removesuffix("_common")
        number = re.search(rf"\.{table} = \{{.*?\.{name} = HEXLOAD_REAL\(([^)]*)\)", source, re.DOTALL)[1]
        assert float.fromhex(number) if "0x" in number else float(number) == pytest.approx(DEFAULTS[key], rel=1e-6), key


@pytest.mark.parametrize("gain", [-0.02, 0.01, 0.02])
def test_a_common_gain_error_is_in_the_sigmas(log, theta, tmp_path, gain):
    # GIVEN force sensors that are all 1 or 2 % off, which no innovation shows
    value, sigma, own, result = last(UNTOLD, log, log.force_n * (1.0 + gain), tmp_path / "gain.csv")
    # THEN the load is off by that share of load and platform, tens of the filter's own sigmas
    assert np.abs(value - theta)[0] == pytest.approx(abs(gain) * (theta + OWN)[0], rel=0.02)
    assert (np.abs(value - theta) / own).max() > 10.0 * SIGMAS
    # AND within five of those that are published
    assert (np.abs(value - theta) < SIGMAS * sigma).all()


def test_a_steady_force_from_outside_that_is_declared_is_in_the_sigmas(tmp_path):
    # GIVEN a platform at work, and a rope that pulls it down with 40 N all the time, 0.3 m beside its centre
    work = read_log(DATA / "work_motion.csv.gz")
    truth = np.array(json.loads((DATA / "work_motion.truth.json").read_text())["segments"][0]["theta"])
    of_legs = machine_of(Platform.of(EXACT).native(), None).wrench_of_forces  # at home; the motion tilts by degrees
    pull_n, arm_m = 40.0, 0.3
    force_n = work.force_n + np.linalg.solve(of_legs, [0.0, 0.0, pull_n, 0.0, -pull_n * arm_m, 0.0])
    # WHEN its log is replayed as of a machine that is exact THEN the load has most of the rope's weight
    value, of_exact, own, _ = last(EXACT, work, force_n, tmp_path / "exact.csv")
    assert value[0] - truth[0] == pytest.approx(pull_n / 9.81, rel=0.2)
    assert (np.abs(value - truth) / own).max() > 10.0 * SIGMAS
    # AND with the force declared sigma has it: of the mass, and of the first moments at the hinges, 0.4 m from the middle
    declared = EXACT | {"tolerances": EXACT["tolerances"] | {"contact_force_n": pull_n}}
    same, sigma, *_ = last(declared, work, force_n, tmp_path / "declared.csv")
    assert np.array_equal(same, value) and (np.abs(value - truth) < SIGMAS * sigma).all()
    more = np.sqrt(sigma**2 - of_exact**2)
    assert more[:4] == pytest.approx(np.array([1.0, 0.4, 0.4, 0.4]) * pull_n / 9.81, rel=1e-3)


def test_a_force_beyond_the_platforms_weight_is_refused():
    # GIVEN 1,000 N on a platform of 100 kg WHEN its file is taken THEN the message has the key and what is expected
    table = EXACT | {"tolerances": {"contact_force_n": 1000.0}}
    expected = "tolerances.contact_force_n: found 1000 N, expected the platform's weight, 981 N, at most"
    with pytest.raises(hexload_native.InputError, match=expected):
        hexload_native.config_bytes(Platform.of(table).native(), 1e-3)


@pytest.mark.parametrize("fault", ["bias", "friction", "late"])
def test_an_error_that_lasts_widens_the_sigmas_of_an_exact_machine(log, theta, tmp_path, fault):
    # GIVEN an error of one leg's force: 3 N always, or 3 N against the speed; or all forces half a millisecond late
    force_n = log.force_n.copy()
    if fault == "bias":
        force_n[:, 1] += 3.0
    elif fault == "friction":
        force_n[:, 1] += 3.0 * np.tanh(log.velocity_m_s[:, 1] / 3e-3)
    else:
        force_n = np.stack([np.interp(log.t_s - 0.5e-3, log.t_s, leg) for leg in force_n.T], axis=1)
    # WHEN it is replayed as if all were exact THEN the filter's own sigma is too small by as much as it may be, AND the
    # published one covers the error
    value, sigma, own, result = last(EXACT, log, force_n, tmp_path / "fault.csv")
    assert (sigma > 10.0 * own).all()
    assert (np.abs(value - theta) < SIGMAS * sigma).all()


def test_a_misfit_that_keeps_parameters_open_is_said(log, tmp_path):
    # GIVEN a bias of one leg that leaves most of the inertias too uncertain WHEN it is replayed
    force_n = log.force_n + np.array([0.0, 0.0, 0.0, 40.0, 0.0, 0.0])
    *_, result = last(UNTOLD, log, force_n, tmp_path / "misfit.csv")
    # THEN it is not converged, the health bit says why, and the words what to do
    assert result["verdict"][-1] != "converged"
    assert result["health_counts"]["model misfit"] > 0
    assert "hexload commission" in mend_in_words(result["health_counts"]["model misfit"], result["verdict"][-1])


def test_a_negative_tolerance_is_refused():
    # GIVEN a tolerance below zero WHEN the platform is read THEN the key is named
    for key in EXACT["tolerances"]:
        with pytest.raises(InputError, match=f"tolerances.{key}"):
            Platform.of(UNTOLD | {"tolerances": {key: -0.1}})


def tolerances_of(machine) -> dict[str, float]:
    """Of the firmware's configuration of a platform."""
    text = hexload_native.config_initialiser(hexload_native.config_bytes(machine, 1e-3))
    table = re.search(r"\.tolerances = \{(.*?)\n    \}", text, flags=re.DOTALL)[1]
    return {key: float(value) for key, value in re.findall(r"\.(\w+) = (?:HEXLOAD_REAL\()?([\d.e-]+)", table)}


def test_what_a_tare_or_a_rig_file_has_found_is_open_no_more_by_what_was_declared(tmp_path):
    # GIVEN a machine with ordinary tolerances
    platform = Platform.of(UNTOLD).native()
    ordinary = {"force_gain": 0.005, "platform_mass": 0.03, "platform_com_m": 0.002, "platform_inertia": 0.06}
    assert tolerances_of(platform) == pytest.approx(ordinary)
    # WHEN half of the platform counts as load, to be tared THEN nothing of it is open beforehand
    assert set(tolerances_of(hexload_native.with_own_load(platform, 0.5)).values()) == {0.0}
    # WHEN a rig file has another body and a direction THEN it says all that is open
    found = rig_file.of_model(platform)
    legs, points = [0.0] * 6, [[0.0] * 3] * 6
    keys = ("force_offset_n", "force_gain", "coulomb_n", "stribeck_n", "growth_n_n", "viscous_n_s_m")
    direction = dict.fromkeys(keys, legs) | {"gravity_m_s2": [0.0, 0.0], "platform": [0.0] * 10}
    direction |= {"base_hinges_m": points, "platform_hinges_m": points}

    def with_rig(rig: dict, directions: list[dict], machine=platform) -> dict[str, float]:
        path = tmp_path / "rig.toml"
        path.write_text(rig_file.document(rig, {}, {}, directions, platform))
        return tolerances_of(hexload_native.with_rig(machine, str(path)))

    assert set(with_rig(found | {"mass_kg": 101.0}, [direction]).values()) == {0.0}
    # AND one that keeps the platform file's body, as of a loaded run, leaves that as declared
    assert with_rig(found, [direction]) == pytest.approx(ordinary | {"force_gain": 0.0})
    # AND for the paper's filter, which knows no directions and takes off body, hinges and gravity alone, all of it
    tables = UNTOLD | {"load": {"known_mass_kg": 500.0}, "estimator": {"kind": "paper"}}
    of_paper = with_rig(found | {"mass_kg": 101.0}, [direction], Platform.of(tables).native())
    assert of_paper == pytest.approx(ordinary)


def test_a_common_gain_that_nothing_is_said_of_is_the_default_one_of_default_sensors():
    # GIVEN sensors as exact as the defaults say WHEN nothing is stated of all together THEN they leave what the firmware's
    # default says, to its two digits
    assert common_gain_of(DEFAULTS["force_gain"]) == pytest.approx(DEFAULTS["force_gain_common"], rel=0.02)
    # AND however exact, gravity stays as open as it is
    assert common_gain_of(0.0) == GRAVITY


def test_the_declared_common_gain_is_what_an_empty_run_leaves():
    # GIVEN the covariance of a run: gains open by 1 % each, and a mass that follows their mean
    mean = np.zeros(UNKNOWNS)
    mean[SLICES["gain"]] = 1.0 / 6.0
    root = np.zeros((UNKNOWNS, 6))
    root[SLICES["gain"]] = 0.01 * np.eye(6)
    root[SLICES["theta"].start] = 100.0 * 0.01 / 6.0
    covariance = root @ root.T
    # WHEN the common gain is declared as open by 2 %
    after = with_common_gain(covariance, 0.02)
    # THEN their mean is, and the mass with it, AND differences between gains stay as they were
    assert mean @ after @ mean == pytest.approx(0.02**2)
    assert after[SLICES["theta"].start, SLICES["theta"].start] == pytest.approx(2.0**2)
    difference = np.zeros(UNKNOWNS)
    difference[SLICES["gain"]] = [1.0, -1.0, 0.0, 0.0, 0.0, 0.0]
    assert difference @ after @ difference == pytest.approx(difference @ covariance @ difference)
