"""The estimator of actuator effects over the bus: the load of a machine whose legs rub, in either profile."""

from pathlib import Path

import pytest

import momentum_scenario
from bus_frames import PROFILES
from loop import OPEN, PATIENT, estimates
from momentum_scenario import platform_of
from test_15_momentum import ROUND_TICKS, assert_same, last_estimate, replay

DURATION_S = 1.2  # until the mass is known to a hundredth, friction or not
MASS_KG, COM_M = momentum_scenario.HEAVY

TEXT = momentum_scenario.of_heavy_load(
    "actuator_effects",
    "Six-axis multisine of a machine whose legs rub.",
    DURATION_S,
    """
[hydraulics]
coulomb_friction_n = 80.0
viscous_friction_n_s_m = 200.0
""",
)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("effects")
    platform = platform_of(momentum_scenario.write(folder))
    platform.write_text(platform.read_text().replace('kind = "momentum"', 'kind = "momentum_effects"'))
    (folder / "effects.toml").write_text(TEXT)
    return folder / "effects.toml"


def check_run(scenario: Path, profile: str, directory: Path, tmp_path: Path, is_same_arithmetic: bool) -> None:
    # WHEN the firmware runs over the quantised log in this process
    replayed, changes_s = replay(scenario, profile, directory, tmp_path / "replayed.csv")
    # THEN every estimate that came over the bus, the load's part of what is known, is its own
    received = estimates(directory)
    ticks = round(1000 * DURATION_S) + 1
    assert len(received) == {"fd": ticks, "classic": ticks // ROUND_TICKS}[profile]
    assert_same(received, [_of_load(replayed[line.split(",")[0]]) for line in received], is_same_arithmetic)
    assert changes_s == []
    # AND the mass is known to a hundredth, friction or not, and true
    last = last_estimate(directory)
    for name, truth in zip(("m", "hx", "hy", "hz"), (MASS_KG, *(MASS_KG * c for c in COM_M))):
        estimate, sigma = float(last[name]), float(last[f"s_{name}"])
        print(f"{profile} {name}: {estimate:.2f} +- {sigma:.2g}, truth {truth:.2f}")
        assert abs(estimate - truth) < 5 * sigma, name
    assert float(last["s_m"]) < 0.01 * MASS_KG


def _of_load(row: str) -> str:
    """t, ten values, ten sigmas, nis and verdict of a row that has the effects' values and sigmas too."""
    words = row.split(",")
    values = (len(words) - 3) // 2
    return ",".join([*words[:11], *words[1 + values : 11 + values], *words[-2:]])


@pytest.mark.parametrize("profile", PROFILES)
def test_over_udp_multicast_the_load_is_found_beside_friction(
    start, ecu, simulator, scenario, profile, free_bus, tmp_path
):
    # GIVEN the loop of two programs in lockstep, without a CAN bus, and a controller that starts with another estimator
    controller = start(
        ecu,
        OPEN,
        "--bus",
        free_bus,
        "--profile",
        profile,
        "--platform",
        platform_of(scenario),
        "--estimator",
        "momentum",
    )
    controller.wait_for("ready on")
    program = start(simulator, scenario, "--out", tmp_path / "run", "--bus", free_bus, "--profile", profile, *PATIENT)
    assert program.wait() == 0
    check_run(scenario, profile, tmp_path / "run", tmp_path, True)
    controller.wait_for("armed, lockstep, momentum_effects filter")


@pytest.mark.vcan
@pytest.mark.parametrize("profile", PROFILES)
def test_over_can_the_load_is_found_beside_friction(in_module, kind, scenario, profile, tmp_path):
    recording = in_module.record(tmp_path / "run", profile, scenario=scenario, platform=platform_of(scenario))
    check_run(scenario, profile, recording.directory, tmp_path, kind.name == "linux")


def test_without_the_stage_for_actuator_effects_the_mass_is_wrong(start, simulator, scenario, tmp_path):
    # GIVEN the same run in one process WHEN it is estimated without actuator effects THEN the mass is off by more than
    # five of the filter's own sigmas: the tests above fail where the controller runs another estimator
    program = start(simulator, scenario, "--out", tmp_path / "run", "--estimator", "momentum")
    assert program.wait() == 0
    last = last_estimate(tmp_path / "run")
    assert abs(float(last["m"]) - MASS_KG) > 5 * float(last["n_m"])
