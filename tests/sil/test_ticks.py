"""Any tick from 0.25 to 5 ms: one key of the platform file, sensors.tick_s, in simulator, estimator and bus; and electric legs."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hexload import project
from hexload.io.toml_document import read_toml, to_toml

PAPER = project.SCENARIOS / "platforms" / "paper.toml"


def run(folder: Path, scenario: str, tick_s: float, options: tuple = ()) -> subprocess.CompletedProcess:
    """Four seconds of a scenario at a tick, without a known mass."""
    platform, tables = read_toml(PAPER), read_toml(project.SCENARIOS / f"{scenario}.toml")
    del platform["load"]
    platform["sensors"]["tick_s"] = tick_s
    tables["platform"] = "platform.toml"
    tables["simulation"]["duration_s"] = 4.0
    (folder / "platform.toml").write_text(to_toml(platform))
    (folder / "scenario.toml").write_text(to_toml(tables))
    command = [project.simulator(), folder / "scenario.toml", "--out", folder / "run", "--estimator", "momentum"]
    return subprocess.run([*command, "--quiet", *options], capture_output=True, text=True, stdin=subprocess.DEVNULL)


def in_sigmas(folder: Path) -> np.ndarray:
    """Of the last estimate."""
    last = np.genfromtxt(folder / "run" / "estimates.csv", delimiter=",", names=True, dtype=None, encoding=None)[-1]
    theta = json.loads((folder / "run" / "meta.json").read_text())["loads"][-1]["theta"]
    names = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    return np.array([(last[name] - true) / last[f"s_{name}"] for name, true in zip(names, theta, strict=True)])


@pytest.mark.parametrize("tick_s", [0.0005, 0.002, 0.005])
def test_a_load_is_found_at_another_tick(tick_s, tmp_path):
    # GIVEN a platform file with that tick WHEN its scenario is simulated
    done = run(tmp_path, "multisine", tick_s)
    # THEN rows are that far apart, and no parameter is off by more than five of its sigmas, without a false alarm
    assert done.returncode == 0, done.stderr
    meta = json.loads((tmp_path / "run" / "meta.json").read_text())
    assert meta["tick_s"] == tick_s
    assert meta["rows"] == round(4.0 / tick_s) + 1
    assert np.abs(in_sigmas(tmp_path)).max() < 5.0
    assert meta["load_changes_detected_s"] == []


def test_a_load_on_electric_legs_is_found(tmp_path):
    # GIVEN screws with reflected mass and friction, and load cells behind them WHEN the load is moved
    done = run(tmp_path, "electric", 0.001)
    # THEN it is found as on hydraulic legs
    assert done.returncode == 0, done.stderr
    assert np.abs(in_sigmas(tmp_path)).max() < 5.0


@pytest.mark.parametrize("profile, bus", [("classic", "udp_multicast:239.74.163.9:43999"), ("fd", "socketcan:can0")])
def test_a_bus_without_the_time_is_refused_with_the_figure(profile, bus, tmp_path):
    # GIVEN a tick of 0.25 ms WHEN a bus is to carry it that cannot
    done = run(tmp_path, "multisine", 0.00025, ("--bus", bus, "--profile", profile))
    # THEN the load of the bus is said, and what fits
    assert done.returncode == 2
    assert "sensors.tick_s" in done.stderr and "% of the time" in done.stderr and "ms on" in done.stderr


def test_a_tick_in_milliseconds_is_refused_where_it_stands(tmp_path):
    done = run(tmp_path, "multisine", 1.0)
    assert done.returncode == 2
    assert "sensors.tick_s: found 1.0, expected s, from 0.00025 to 0.005 (not ms)" in done.stderr
