"""Random faults of sensors, loads and bus in lockstep: `hexload soak --faults`, here for two simulated minutes."""

from dataclasses import asdict

import numpy as np
import pytest
from typer.testing import CliRunner

from hexload.campaign.store import Store
from hexload.faults import slices
from hexload.faults.kinds import KINDS
from hexload.faults.recording import channels_of
from hexload_dev import bus_soak
from hexload_dev.bus_soak import BEFORE, BUS_ALONE, NO_ANSWER, NOW, OUTCOMES, PassingFault, SoakCase, SoakSettings
from hexload_dev.cli import app

CASE = SoakCase(seed=1, run_s=30.0)
WORDS = {
    "verdicts": ["converged", "converging", "not_excited", "misfit", "inconsistent"],
    "bits": ["load changed", "frames refused"],
    "parameters": ["m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"],
}
FRAMES_REFUSED = 2  # as health bits


@pytest.fixture(scope="module")
def clean():
    return bus_soak._simulated(SoakCase(seed=3, run_s=8.0), np.random.default_rng(6))  # work, one load


def answers_of(clean, share, health=0):
    """Each tick's, converged, the mass `share` of the true one; sigmas are a tenth of a percent of the scale."""
    theta, scale = clean.theta, bus_soak._truth(clean, 0.0).scale
    value = theta * np.array([share] + [1.0] * 9)
    rows = len(clean.t_s)
    ticks = np.arange(rows, dtype=float)[:, None]
    codes = np.tile([0.0, float(health)], (rows, 1))
    return np.hstack([ticks, codes, np.zeros((rows, 10)), np.tile(value, (rows, 1)), np.tile(1e-3 * scale, (rows, 1))])


def outcomes(answers, clean, passing=()):
    return {outcome for _, _, outcome, _ in bus_soak._looks(answers, WORDS, clean, passing, "fd")}


def test_random_faults_leave_no_wrong_estimate_with_a_good_verdict_behind():
    # GIVEN half a minute of motion with random faults WHEN it goes over all four kinds of bus
    result = bus_soak.run_case(CASE, None)
    # THEN no look finds an estimate wrong and converged without a word
    figures = bus_soak.summary([result])
    assert figures["worst"] == []
    # AND there were looks and faults, and simulator and controller found to one another again
    assert sum(sum(counts.values()) for counts in figures["looks"].values()) >= 4 * 24
    assert sum(counts["right"] for counts in figures["looks"].values()) >= 4 * 12
    assert len(figures["bus_faults"]) >= 5
    assert figures["hours"] == pytest.approx(120.0 / 3600.0)


def test_a_look_finds_what_is_wrong_and_whether_it_was_said(clean):
    # GIVEN converged answers WHEN the mass is right, 5 % off, and that with a health bit THEN each has its outcome
    assert outcomes(answers_of(clean, 1.0), clean) == {"right"}
    assert outcomes(answers_of(clean, 0.8), clean) == {"silent"}
    assert outcomes(answers_of(clean, 0.8, FRAMES_REFUSED), clean) == {"weak"}
    # AND half of the answers are enough, fewer are none
    assert outcomes(answers_of(clean, 0.8)[::2], clean) == {"silent"}
    assert outcomes(answers_of(clean, 0.8)[::3], clean) == {NO_ANSWER}


def test_a_look_tells_what_there_was_before_it(clean):
    # GIVEN a fault of a sensor from 1 s to 2 s WHEN looks are taken THEN they are in it for 3 s more
    passing = [PassingFault("force_bias", 1.0, 2.0)]
    assert [bus_soak.label_of(passing, t_s) for t_s in (0.9, 1.0, 5.0, 5.1)] == [BUS_ALONE, NOW, NOW, BEFORE]
    assert [bus_soak.last_fault(passing, t_s) for t_s in (0.9, 1.0)] == [None, "force_bias"]


@pytest.mark.parametrize("name", ["force_bias", "velocity_dead", "displacement_hum", "contact", "pendulum", "coulomb"])
def test_a_passing_fault_touches_its_rows_alone(clean, name):
    # GIVEN a clean run WHEN a kind of fault is put in a stretch THEN the readings before and after are those of before
    kind, rows = KINDS[name], slice(2000, 5000)
    faulty = slices.with_passing_fault(clean, kind, kind.sizes[-1], rows, np.random.default_rng(5))
    changed = np.zeros(len(clean.t_s), bool)
    for before, after in zip(channels_of(clean.log), channels_of(faulty.log)):
        changed |= (before != after).any(axis=1)
    assert changed[rows].any()
    assert not changed[: rows.start].any() and not changed[rows.stop :].any()
    assert faulty.loads == clean.loads


@pytest.mark.parametrize("name", ["stated_noise", "platform_mass", "lost", "clock", "falling", "leaking"])
def test_what_cannot_pass_is_none(clean, name):
    # GIVEN a kind of the machine as it is stated, of rows and their times, or of the load WHEN it is to pass THEN it does not
    kind = KINDS[name]
    assert slices.with_passing_fault(clean, kind, kind.sizes[-1], slice(2000, 5000), np.random.default_rng(5)) is None


@pytest.mark.parametrize(("silent", "status"), [(0, 0), (3, 1)])
def test_the_command_goes_on_with_its_folder_and_tells_what_was_found(tmp_path, silent, status):
    # GIVEN a folder with the one case of the wish, done
    settings = SoakSettings(hours=0.05, seed=7)
    (case,) = settings.cases()
    code = bus_soak.code_version()
    store = Store(tmp_path / "soak")
    store.open(settings, code, restart=False)
    worst = [{"t_s": 9.0, "label": BUS_ALONE, "last": None, "wrong": []}] * silent
    counts = {"starts": 1, "rejoins": 2, "faults": {"lost": 5}, "ends": {}}
    looks = {BUS_ALONE: {"right": 50, "silent": silent}, BEFORE: {}, NOW: {}}
    run = {"profile": "fd", "codes": True, "looks": looks, "worst": worst, **counts}
    store.write(case, {"code": code, "case": asdict(case), "sensor_faults": [], "runs": [run]})
    # WHEN the command is given again
    finished = CliRunner().invoke(
        app, ["soak", "--faults", "--hours", "0.05", "--seed", "7", "--out", str(tmp_path / "soak")]
    )
    # THEN it runs nothing, and its status says whether the bus alone has made an estimate wrong without a word
    assert finished.exit_code == status, finished.output
    assert f"verdict: {silent} looks found a wrong estimate with a good verdict, {silent} of them" in finished.output
    assert all(outcome in finished.output for outcome in OUTCOMES)
