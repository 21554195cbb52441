"""Machines without velocity sensors: logs without these columns, every verb that reads them, live samples, buses."""

import csv
import gzip
import json
import re
from pathlib import Path

import lcm
import numpy as np
import pytest

import hexload
from hexload import project
from hexload.campaign import cases
from hexload.campaign.one_case import run_case
from hexload.errors import InputError
from hexload.estimation.commission import Wish, commission
from hexload.estimation.load_summary import load_changes_s
from hexload.estimation.replay import replay_log
from hexload.io.log_file import COLUMNS, WITHOUT_VELOCITY, read_log
from hexload.io.log_formats import read_any_log
from rig_plant import log_of, multisine
from test_commission import EMPTY, LOAD, machine_of, platform  # noqa: F401 (a fixture)

DATA = project.ROOT / "tests" / "data"
UNKNOWN = DATA / "unknown_load.toml"


def without_columns(name: str, folder: Path) -> Path:
    """A recorded log without its velocity columns."""
    out = folder / f"{name}.csv"
    with gzip.open(DATA / f"{name}.csv.gz", "rt") as file, out.open("w") as cut:
        for row in csv.reader(file):
            cut.write(",".join(row[:7] + row[13:]) + "\n")
    return out


def truth(name: str) -> np.ndarray:
    return np.array(json.loads((DATA / f"{name}.truth.json").read_text())["segments"][-1]["theta"])


@pytest.fixture(scope="module")
def multisine_log(tmp_path_factory) -> Path:
    return without_columns("multisine_eccentric", tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="module")
def replayed_without(multisine_log, tmp_path_factory) -> dict:
    return replay_log(multisine_log, UNKNOWN, None, None, tmp_path_factory.mktemp("replayed") / "out.csv")


@pytest.fixture
def no_velocity_file(tmp_path) -> Path:
    """The platform file of a machine that says so, without a sigma."""
    text = re.sub(r"velocity_sigma_m_s = .*\n", "velocity = false\n", UNKNOWN.read_text())
    path = tmp_path / "platform.toml"
    path.write_text(text)
    return path


def test_a_log_without_velocity_columns_has_no_velocities(multisine_log):
    log = read_log(multisine_log)
    assert not log.has_velocity
    assert np.isnan(log.velocity_m_s).all()
    with_velocities = read_log(DATA / "multisine_eccentric.csv.gz")
    assert with_velocities.has_velocity
    np.testing.assert_array_equal(log.force_n, with_velocities.force_n)


def test_a_log_that_lacks_some_velocities_is_refused(tmp_path):
    columns = [name for name in COLUMNS if name != "vl4"]
    path = tmp_path / "log.csv"
    path.write_text(f"{','.join(columns)}\n" + 2 * f"{','.join('0' for _ in columns)}\n")
    with pytest.raises(InputError, match=r"line 1: found no column vl4 \(leg 4\)"):
        read_log(path)


def test_the_load_of_a_log_without_velocities_is_found(multisine_log, tmp_path):
    # GIVEN a multisine of 10 s WHEN it is replayed THEN all ten parameters are within four sigmas, which are at most a
    # quarter above those with sensors, and no change is reported
    found = replay_log(multisine_log, UNKNOWN, None, None, tmp_path / "out.csv")
    with_sensors = replay_log(DATA / "multisine_eccentric.csv.gz", UNKNOWN, None, None, tmp_path / "with.csv")
    error = found["value"][-1] - truth("multisine_eccentric")
    assert found["verdict"][-1] == "converged"
    assert (np.abs(error) < 4.0 * found["sigma"][-1]).all()
    assert (found["sigma"][-1] < 1.25 * with_sensors["sigma"][-1]).all()
    assert load_changes_s(found) == []
    # AND the first rows, before a window of 13 samples, are the prior's
    assert (found["value"][:12] == found["value"][0]).all() and len(found["t"]) == len(with_sensors["t"])


def test_a_load_change_is_reported_within_20_ms(tmp_path):
    log = without_columns("load_pickup", tmp_path)
    assert load_changes_s(replay_log(log, UNKNOWN, None, None, tmp_path / "out.csv")) == pytest.approx([6.11], abs=0.01)


@pytest.mark.parametrize("says", ["velocity = false\n", ""])
def test_the_platform_file_may_say_it_for_a_log_that_has_the_columns(
    replayed_without, no_velocity_file, tmp_path, says
):
    # GIVEN a platform file with velocity = false, or without their sigma WHEN the log with the columns is replayed
    no_velocity_file.write_text(no_velocity_file.read_text().replace("velocity = false\n", says))
    whole = DATA / "multisine_eccentric.csv.gz"
    by_file = replay_log(whole, no_velocity_file, None, None, tmp_path / "by_file.csv")
    # THEN they do not count, AND that is said
    np.testing.assert_array_equal(replayed_without["value"], by_file["value"])
    np.testing.assert_array_equal(replayed_without["sigma"], by_file["sigma"])
    assert any("velocities left out" in remark and "velocity_sigma_m_s" in remark for remark in by_file["remarks"])
    # AND of a log without velocities there is nothing to say
    assert not replayed_without["remarks"]


def test_sample_by_sample_and_over_a_log_are_the_same_bits(multisine_log, no_velocity_file):
    log = read_log(multisine_log)
    rows = slice(1500)
    run = hexload.replay(log.t_s[rows], log.displacement_m[rows], None, log.force_n[rows], UNKNOWN)
    estimator = hexload.Estimator(no_velocity_file)
    steps = [estimator.step(dl, None, f) for dl, f in zip(log.displacement_m[rows], log.force_n[rows])]
    assert np.array_equal([step.value for step in steps], run.value)
    assert np.array_equal([step.sigma for step in steps], run.sigma)
    load = hexload.identify(log.t_s[rows], log.displacement_m[rows], None, log.force_n[rows], UNKNOWN)
    assert np.array_equal(load.value, run.value[-1])


def test_a_sample_without_velocities_is_refused_where_there_are_sensors(multisine_log):
    log = read_log(multisine_log)
    with pytest.raises(InputError, match=r"vl: found None, .* velocity = false"):
        hexload.Estimator(UNKNOWN).step(log.displacement_m[0], None, log.force_n[0])


def test_the_sigma_of_derived_speeds_is_the_firmwares(no_velocity_file):
    machine = hexload.Platform.of(no_velocity_file).native()
    assert not machine.has_velocity
    assert machine.velocity_sigma_m_s == pytest.approx(20e-6 / 1e-3 / np.sqrt(182.0))


def test_a_tare_is_refused_with_what_to_do(multisine_log):
    log = read_log(multisine_log)
    with pytest.raises(InputError, match="hexload commission"):
        hexload.tare(log.t_s, log.displacement_m, None, log.force_n, UNKNOWN)


def test_a_can_log_without_velocities_reads_as_one(tmp_path):
    # GIVEN a candump of FD frames whose velocities are one step below the range
    native = project.native_module()
    lines = []
    for tick in range(3):
        frames, _ = native.bus.encode_sample("fd", tick, [0.01] * 6, [np.nan] * 6, [1000.0] * 6)
        lines += [
            f"({tick / 1000:.6f}) vcan0 {identifier:03X}##1{data.hex().upper()}" for identifier, _, data in frames
        ]
    path = tmp_path / "bus.log"
    path.write_text("\n".join(lines) + "\n")
    # WHEN it is read THEN it is a log without velocities
    log = read_any_log(path)
    assert not log.has_velocity and len(log.t_s) == 3
    np.testing.assert_allclose(log.displacement_m, 0.01, atol=1e-7)


def test_an_lcm_log_without_velocities_reads_as_one(tmp_path):
    path = tmp_path / "events.lcm"
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for tick in range(3):
        message = project.message_type("leg_sample_t")()
        message.sequence = message.tick = tick
        message.displacement_m, message.velocity_m_s, message.force_n = [0.01] * 6, [np.nan] * 6, [1000.0] * 6
        log.write_event(tick, "HEXLOAD_LEG_SAMPLE", message.encode())
    log.close()
    assert not read_any_log(path).has_velocity


def test_a_rig_without_velocity_sensors_is_commissioned_and_its_load_found(platform):  # noqa: F811
    # GIVEN a rig as of test_commission, its logs without velocities
    machine = machine_of(platform)
    empty = write_log(platform.parent / "bare_empty.csv", log_of(machine, multisine(1, 12.0), EMPTY, 2))
    loaded = write_log(platform.parent / "bare_load.csv", log_of(machine, multisine(3, 14.0), LOAD, 4, load_from_s=7.0))
    rig = platform.parent / "bare_rig.toml"
    # WHEN it is commissioned, and a load that comes at 7 s replayed
    assert commission(Wish(empty, platform, rig))["rig"]["velocity_delay_s"] == 0.0
    found = replay_log(loaded, platform, None, None, platform.parent / "bare.csv", rig=rig)
    # THEN it is as good as with velocities: mass within half a percent, all ten within four sigmas, one change within 60 ms
    error = found["value"][-1] - LOAD
    assert load_changes_s(found) == pytest.approx([7.03], abs=0.03)
    assert abs(error[0]) < 0.005 * LOAD[0]
    assert (np.abs(error) < 4.0 * found["sigma"][-1]).all()


def write_log(path: Path, log: tuple) -> Path:
    t_s, displacement_m, _, force_n = log
    columns = np.column_stack((t_s, displacement_m, force_n))
    np.savetxt(path, columns, delimiter=",", header=",".join(WITHOUT_VELOCITY), comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize("name", ["multisine_no_velocity", "work_no_velocity"])
def test_a_campaign_has_classes_without_velocity_sensors(name):
    # GIVEN a short case WHEN it is simulated and judged THEN it comes to an end without alarms
    case = cases.Case(name, 1, 4.0)
    assert not cases.draw(case).scenario["sensors"]["velocity_sensor"]
    result = run_case(case, None)
    assert result["alarms_s"] == []
    assert result["estimators"]["momentum"]["nees"] < 60.0  # chi-square with ten degrees of freedom: 4e-9
