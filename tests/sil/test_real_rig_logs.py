"""Logs of an independent plant that is no ideal machine (tests/data): commissioned, with the sensors that it has, scored
against its truth."""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hexload import project
from hexload.estimation.commission import Wish, commission
from hexload.estimation.load_summary import load_changes_s
from hexload.estimation.replay import replay_log

DATA = project.ROOT / "tests" / "data"
EXACT = re.sub("displacement_sigma_m = .*", "displacement_sigma_m = 10e-6", (DATA / "unknown_load.toml").read_text())
BANDWIDTHS = "[sensors]\nforce_bandwidth_hz = 200.0\nvelocity_bandwidth_hz = 150.0"
UNTOLD = re.sub(r"\[tolerances\].*?(?=\[)", "", EXACT, flags=re.DOTALL)
DECLARED = "[tolerances]\nforce_gain = 0.005\nforce_offset_n = 30.0\nhinge_m = 0.0005\ntilt_rad = 0.01\n\n[estimator]"
PICKED_UP_S = 12.3  # of rig_work


@cache
def truths(name: str) -> list[np.ndarray]:
    return [np.array(part["theta"]) for part in json.loads((DATA / f"{name}.truth.json").read_text())["segments"]]


def body_of(theta: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre, and tensor about it."""
    m, h = theta[0], theta[1:4]
    tensor = np.array([theta[[4, 7, 8]], theta[[7, 5, 9]], theta[[8, 9, 6]]])
    return m, h / m, tensor - (h @ h * np.eye(3) - np.outer(h, h)) / m


def check(result: dict, row: int, theta: np.ndarray, within: tuple[float, float, float], sigmas: float) -> None:
    """Mass in %, centre in mm, tensor about it in % of its largest moment; each of the ten in its published sigmas."""
    value, sigma = result["value"][row][:10], result["sigma"][row][:10]
    m, centre, tensor = body_of(value)
    true_m, true_centre, true_tensor = body_of(theta)
    found = (
        100.0 * abs(m / true_m - 1.0),
        1e3 * float(np.abs(centre - true_centre).max()),
        100.0 * float(np.abs(tensor - true_tensor).max() / true_tensor.max()),
    )
    beyond = float(np.abs((value - theta) / sigma).max())
    print("mass {:.3f} %, centre {:.2f} mm, inertia {:.2f} %,".format(*found), f"{beyond:.1f} sigmas")
    assert (np.array(found) < within).all() and beyond < sigmas


def replayed(name: str, platform: str, folder: Path, rig: Path | None = None) -> dict:
    path = folder / f"{name}.toml"
    path.write_text(platform)
    return replay_log(DATA / f"{name}.csv.gz", path, None, None, folder / f"{name}_{rig is None}.csv", rig=rig)


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Path:
    """Rig file of the machine of rig_multisine and rig_work, with what a user states of its sensors and tolerances."""
    folder = tmp_path_factory.mktemp("rig")
    platform = folder / "platform.toml"
    platform.write_text(rig_platform())
    commission(Wish(DATA / "rig_empty.csv.gz", platform, folder / "rig.toml"))
    return folder / "rig.toml"


def rig_platform() -> str:
    with_bandwidth = UNTOLD.replace("[sensors]", "[sensors]\nforce_bandwidth_hz = 300.0")
    return with_bandwidth.replace("[estimator]", DECLARED)


@pytest.mark.parametrize(
    ("name", "platform", "within"),
    [
        ("filtered_sensors", EXACT.replace("[sensors]", BANDWIDTHS), (0.02, 0.1, 0.3)),
        ("no_velocity", re.sub("velocity_sigma_m_s = .*", "velocity = false", EXACT), (0.02, 0.1, 0.4)),
        ("tilted_base", EXACT.replace('"momentum"', '"momentum_effects"\ntilt_sigma_rad = 0.02'), (0.02, 0.1, 0.6)),
    ],
)
def test_a_machine_with_one_effect_that_its_file_says_is_as_exact_as_an_ideal_one(name, platform, within, tmp_path):
    # GIVEN low-passes of 200 and 150 Hz in the force and velocity channels, no velocity sensors, or a base 1.1 degrees
    # off level that is found beside the load WHEN the log is replayed
    result = replayed(name, platform, tmp_path)
    # THEN the load is the true one, no change is reported, and it has converged
    check(result, -1, truths(name)[0], within, 4.0)
    assert load_changes_s(result) == [] and result["verdict"][-1] == "converged"


def test_the_load_of_a_commissioned_rig_is_the_true_one(rig, tmp_path):
    # GIVEN legs with mass, friction of 50 to 100 N, a base off level, hinges 0.35 mm off, offsets, gains and a low-pass,
    # commissioned on its empty run WHEN a multisine with a load is replayed
    result = replayed("rig_multisine", rig_platform(), tmp_path, rig)
    # THEN the load is the true one, within its sigmas
    check(result, -1, truths("rig_multisine")[0], (0.2, 0.8, 1.0), 3.0)
    assert load_changes_s(result) == [] and result["verdict"][-1] == "converged"


def test_both_loads_of_a_commissioned_rig_at_work_are_the_true_ones(rig, tmp_path):
    # GIVEN the same rig at work, which picks up a load WHEN the log is replayed
    result = replayed("rig_work", rig_platform(), tmp_path, rig)
    before, after = truths("rig_work")
    # THEN that is reported once, within 30 ms, and both loads are the true ones
    assert load_changes_s(result) == [pytest.approx(PICKED_UP_S + 0.015, abs=0.015)]
    check(result, int(np.searchsorted(result["t"], PICKED_UP_S)) - 1, before, (0.2, 0.8, 5.0), 3.0)
    check(result, -1, after, (0.2, 0.8, 5.0), 3.0)


@pytest.mark.parametrize(("name", "changes_s"), [("rig_multisine", []), ("rig_work", [PICKED_UP_S])])
def test_a_rig_that_is_not_commissioned_is_never_taken_for_its_model(name, changes_s, tmp_path):
    # GIVEN the same logs and no rig file WHEN they are replayed
    result = replayed(name, rig_platform(), tmp_path)
    # THEN nothing counts as converged, and after the first four seconds no change is reported but the true one
    assert "converged" not in result["verdict"]
    assert [t_s for t_s in load_changes_s(result) if t_s > 4.0] == pytest.approx(changes_s, abs=0.1)
