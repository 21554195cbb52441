"""A commissioned rig over the bus: controller and replay compensate the same machine, in either profile, and over LCM."""

from pathlib import Path

import pytest

from bus_frames import PROFILES
from lcm_listener import private_url
from loop import PATIENT, estimates
from momentum_scenario import platform_of
from rig_scenario import COM_M, MASS_KG, rig_of, write
from test_15_momentum import assert_same, last_estimate, replay


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("rig"))


def assert_load_is_found(directory: Path) -> None:
    last = last_estimate(directory)
    assert last["verdict"] == "converged"
    for name, truth in zip(("m", "hx", "hy", "hz"), (MASS_KG, *(MASS_KG * c for c in COM_M))):
        estimate, sigma = float(last[name]), float(last[f"s_{name}"])
        print(f"{name}: {estimate:.2f} +- {sigma:.2g}, truth {truth:.2f}")
        assert abs(estimate - truth) < 5 * sigma, name
    assert float(last["s_m"]) < 0.01 * MASS_KG


@pytest.mark.vcan
@pytest.mark.parametrize("profile", PROFILES)
def test_over_can_the_load_on_a_commissioned_rig_is_the_replays(in_module, kind, scenario, profile, tmp_path):
    # GIVEN a run over vcan0 of a controller that has the rig file
    recording = in_module.record(
        tmp_path / "run", profile, scenario=scenario, platform=platform_of(scenario), rig=rig_of(scenario)
    )
    # WHEN the firmware runs over the quantised log in this process, with the same rig file
    out = tmp_path / "replayed.csv"
    replayed, changes_s = replay(scenario, profile, recording.directory, out, rig_of(scenario))
    # THEN every estimate that came over the bus is its own
    received = estimates(recording.directory)
    assert len(received) > 15
    assert_same(received, [replayed[line.split(",")[0]] for line in received], kind.name == "linux")
    assert changes_s == []
    # AND the load is found
    assert_load_is_found(recording.directory)


def test_over_lcm_the_load_on_a_commissioned_rig_is_the_one_in_process(start, ecu, simulator, scenario, tmp_path):
    # GIVEN a run in process with the rig file, and a controller that has it on LCM
    files = ("--rig", rig_of(scenario))
    assert start(simulator, scenario, "--out", tmp_path / "inproc", *files).wait() == 0
    feed = f"lcm:{private_url()}"
    start(ecu, "--feed", feed, "--platform", platform_of(scenario), *files).wait_for("ready on LCM")
    # WHEN the same run feeds that THEN the estimates are the same to the byte, and the load is found
    fed = start(
        simulator, scenario, "--out", tmp_path / "fed", "--feed", feed, "--lockstep", "--any-configuration", *PATIENT
    )
    assert fed.wait() == 0
    assert (tmp_path / "fed" / "estimates.csv").read_bytes() == (tmp_path / "inproc" / "estimates.csv").read_bytes()
    assert_load_is_found(tmp_path / "inproc")
    assert (tmp_path / "inproc" / "rig.toml").read_bytes() == rig_of(scenario).read_bytes()


def test_without_the_rig_file_the_load_is_wrong(start, simulator, scenario, tmp_path):
    # GIVEN the same run WHEN the estimator has no rig file THEN the mass is off by many of the filter's own sigmas, and does not count as
    # converged: the tests above fail where a controller ignores the file
    assert start(simulator, scenario, "--out", tmp_path / "run").wait() == 0
    last = last_estimate(tmp_path / "run")
    assert abs(float(last["m"]) - MASS_KG) > 20 * float(last["n_m"]) and last["verdict"] != "converged"


@pytest.mark.parametrize("program", ["hexload_ecu", "hexload_sim"])
def test_a_rig_file_of_another_machine_is_refused(program, start, ecu, simulator, scenario, tmp_path):
    # GIVEN a rig file, and a platform file whose home is 1 mm longer
    other = tmp_path / "rig.toml"
    other.write_text(rig_of(scenario).read_text().replace("0.8741", "0.8751"))
    words = {
        "hexload_ecu": [ecu, "--feed", "lcm", "--platform", platform_of(scenario), "--rig", other],
        "hexload_sim": [simulator, scenario, "--out", tmp_path / "run", "--rig", other],
    }[program]
    # WHEN they meet THEN the key is named
    result = start(*words)
    assert result.wait() == 2
    result.wait_for("geometry.home_leg_length_m: found 0.8751, expected 0.8741 as in the platform file")
