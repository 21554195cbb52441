"""The cause of a mismatch, named: faults put into the logs of an independent plant, whose kind, leg and size are known."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import hexload_native
import numpy as np
import pytest
from scipy.fft import dct
from scipy.signal import butter, sosfilt

import hexload
from hexload.diagnosis import causes, channels, phrases, spectral, wiring
from hexload.diagnosis.bank import Bank, Selected
from hexload.diagnosis.causes import Family
from hexload.diagnosis.diagnose import diagnose
from hexload.diagnosis.dynamics import dynamics_of
from hexload.diagnosis.machine import machine_of
from hexload.diagnosis.record import record_of
from hexload.estimation.arrays import leg_log
from hexload.estimation.rig_model import motion_of_legs
from hexload.faults.kinds import KINDS
from hexload.faults.naming import causes_of
from hexload.io.log_file import LegLog, read_log
from rig_plant import SUBSTEPS, RubbingRig, log_of, without_effects

DATA = Path(__file__).parents[1] / "data"
ROWS = 8000
CLEAN = {"multisine_eccentric": "unknown_load", "work_motion": "unknown_load", "paper_noisy": "paper_load"}
TICK_S = 1e-3
LOW_PASS = butter(2, 60.0, fs=1.0 / TICK_S, output="sos")


def recorded(name: str = "multisine_eccentric", rows: int | None = ROWS) -> LegLog:
    log = read_log(DATA / f"{name}.csv.gz")
    return LegLog(*(part[:rows] for part in (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)))


def machine(name: str = "unknown_load"):
    return machine_of(hexload_native.load_platform(str(DATA / f"{name}.toml")))


def with_leg(log: LegLog, channel: str, leg: int, change) -> LegLog:
    """`leg` from 1."""
    values = getattr(log, channel).copy()
    values[:, leg - 1] = change(values[:, leg - 1])
    return replace(log, **{channel: values})


def with_swapped(log: LegLog, one: int, other: int, *channels: str) -> LegLog:
    order = list(range(6))
    order[one - 1], order[other - 1] = other - 1, one - 1
    return replace(log, **{channel: getattr(log, channel)[:, order] for channel in channels})


def late(values: np.ndarray, ticks: int) -> np.ndarray:
    return np.concatenate([np.repeat(values[:1], ticks, axis=0), values[:-ticks]])


def spiked(values: np.ndarray) -> np.ndarray:
    values = values.copy()
    values[500::700] += 200.0
    return values


def speed(log: LegLog) -> np.ndarray:
    return spectral.low_pass(log.displacement_m, TICK_S, 20.0, 1)[1]


def rubbing(log: LegLog) -> LegLog:
    """60 N in each leg."""
    return replace(log, force_n=log.force_n + 60.0 * np.tanh(speed(log) / 2e-3))


def during(values: np.ndarray, more: float, start: int, end: int | None = None) -> np.ndarray:
    values = values.copy()
    values[start:end] += more
    return values


def bent(values: np.ndarray) -> np.ndarray:
    """Off by 1 % of the largest value there."""
    return values + 0.01 * values**2 / np.abs(values).max()


def dragged(values: np.ndarray) -> np.ndarray:
    """What is slow is behind by 15 N, either way."""
    (slow,) = spectral.low_pass(values, TICK_S, 20.0, 0)
    behind = np.empty_like(slow)
    now = slow[0]
    for k, value in enumerate(slow):
        behind[k] = now = np.clip(now, value - 15.0, value + 15.0)
    return values + behind - slow


def in_bursts(log: LegLog) -> LegLog:
    """Five times the noise of 5 N, for 60 ms in each second."""
    is_burst = (np.arange(len(log.t_s)) % 1000 < 60)[:, None]
    return replace(log, force_n=log.force_n + is_burst * np.random.default_rng(3).normal(0.0, 24.5, log.force_n.shape))


def spinning(log: LegLog) -> LegLog:
    """A rotor of 20 N m s about the platform's z: M = -w x H."""
    way, rate, acceleration = spectral.low_pass(log.displacement_m, TICK_S, 12.0, 2)
    motion = motion_of_legs(machine().geometry, way, rate, acceleration)
    moment = -np.cross(motion.twist[:, 3:], [0.0, 0.0, 20.0])
    wrench = np.hstack([np.zeros_like(moment), moment])
    push = np.linalg.solve(np.swapaxes(motion.jacobian, 1, 2), wrench[:, :, None])[:, :, 0]
    return replace(log, force_n=log.force_n - push)


ALL = ("displacement_m", "velocity_m_s", "force_n")
# What is done to the log, the cause, its legs from 1, its size and how far off that may be.
FAULTS = {
    "friction": (lambda log: with_leg(log, "force_n", 3, lambda f: f + 40.0 * np.tanh(speed(log)[:, 2] / 2e-3)), "dry friction", (3,), 40.0, 2.0),
    "viscous": (lambda log: replace(log, force_n=log.force_n + 100.0 * log.velocity_m_s), "viscous friction", None, 100.0, 5.0),
    "force zero": (lambda log: with_leg(log, "force_n", 5, lambda f: f + 20.0), "force zero", (5,), 20.0, 1.0),
    "force gain": (lambda log: with_leg(log, "force_n", 2, lambda f: 1.01 * f), "force gain", (2,), 0.01, 5e-4),
    "forces late": (lambda log: replace(log, force_n=late(log.force_n, 2)), "force late", None, 2e-3, 1e-4),
    "forces swapped": (lambda log: with_swapped(log, 2, 5, "force_n"), "force swapped", (2, 5), None, None),
    "force negated": (lambda log: with_leg(log, "force_n", 4, np.negative), "force sign", (4,), None, None),
    "three forces round": (lambda log: replace(log, force_n=log.force_n[:, [1, 2, 0, 3, 4, 5]]), "force swapped", (1, 2, 3), None, None),
    "forces swapped, and friction": (lambda log: rubbing(with_swapped(log, 1, 4, "force_n")), "force swapped", (1, 4), None, None),
    "force half": (lambda log: with_leg(log, "force_n", 4, lambda f: 0.5 * f), "force gain", (4,), 0.5, 0.025),
    "force half, and friction": (lambda log: rubbing(with_leg(log, "force_n", 4, lambda f: 0.5 * f)), "force gain", (4,), 0.5, 0.05),
    "force dead": (lambda log: with_leg(log, "force_n", 5, lambda f: np.random.default_rng(1).normal(2.0, 5.0, len(f))), "force dead", (5,), None, None),
    "force in kN": (lambda log: with_leg(log, "force_n", 2, lambda f: 1e-3 * f), "force unit", (2,), None, None),
    "a force that bends": (lambda log: with_leg(log, "force_n", 3, lambda f: f + 0.02 * f**2 / np.abs(log.force_n).max()), "force curve", (3,), 0.02, 2e-3),
    "forces that bend": (lambda log: replace(log, force_n=log.force_n + 0.02 * log.force_n**2 / np.abs(log.force_n).max()), "force curve", None, 0.02, 2e-3),
    "legs exchanged": (lambda log: with_swapped(log, 1, 4, *ALL), "legs exchanged", (1, 4), None, None),
    "displacements swapped": (lambda log: with_swapped(log, 1, 2, "displacement_m"), "displacement swapped", (1, 2), None, None),
    "velocity gain": (lambda log: with_leg(log, "velocity_m_s", 6, lambda v: 1.005 * v), "velocity gain", (6,), 0.005, 2.5e-4),
    "displacement gain": (lambda log: with_leg(log, "displacement_m", 6, lambda d: 1.02 * d), "displacement gain", (6,), 0.02, 1e-3),
    "velocities late": (lambda log: replace(log, velocity_m_s=late(log.velocity_m_s, 2)), "velocity late", None, 2e-3, 1e-4),
    "velocities made of displacements": (lambda log: replace(log, velocity_m_s=sosfilt(LOW_PASS, np.gradient(log.displacement_m, log.t_s, axis=0), axis=0)), "velocity derived", None, 1.0, 0.05),
    "clock": (lambda log: replace(log, t_s=1.01 * log.t_s), "clock", None, 0.01, 5e-4),
    "millimetres": (lambda log: replace(log, displacement_m=1e3 * log.displacement_m), "displacement unit", None, 1e3, 1.0),
    "spikes": (lambda log: with_leg(log, "force_n", 1, spiked), "force spikes", (1,), 200.0, 20.0),
    "force zero off for half a second": (lambda log: with_leg(log, "force_n", 2, lambda f: during(f, 15.0, 3000, 3500)), "force pulse", (2,), 3.0, 0.3),
    "force zero jumps": (lambda log: with_leg(log, "force_n", 3, lambda f: during(f, 10.0, 4000)), "force zero step", (3,), 10.0, 0.5),
    "force gain jumps": (lambda log: with_leg(log, "force_n", 3, lambda f: during(f, 0.02 * f[4000:], 4000)), "force gain step", (3,), 0.02, 1e-3),
    "displacement off for half a second": (lambda log: with_leg(log, "displacement_m", 4, lambda d: during(d, 2e-4, 3000, 3500)), "displacement pulse", (4,), 3.0, 0.01),
    "velocity off for half a second": (lambda log: with_leg(log, "velocity_m_s", 1, lambda v: during(v, 2e-3, 3000, 3500)), "velocity pulse", (1,), 3.0, 0.1),
    "displacement zero jumps": (lambda log: with_leg(log, "displacement_m", 4, lambda d: during(d, 3e-4, 5000)), "displacement zero step", (4,), 3e-4, 3e-5),
    "displacement gain jumps": (lambda log: with_leg(log, "displacement_m", 2, lambda d: during(d, 0.02 * d[5200:], 5200)), "displacement gain step", (2,), 0.02, 2e-3),
    "a screw's turn": (lambda log: replace(log, displacement_m=log.displacement_m + 3e-5 * np.sin(2 * np.pi * log.displacement_m / 4e-3 + np.arange(6))), "displacement periodic", None, 3e-5, 3e-6),
    "a displacement that bends": (lambda log: with_leg(log, "displacement_m", 5, bent), "displacement curve", (5,), 0.01, 1e-3),
    "a velocity that bends": (lambda log: with_leg(log, "velocity_m_s", 5, bent), "velocity curve", (5,), 0.01, 1e-3),
    "bursts of noise": (in_bursts, "force bursts", None, 5.0, 1.0),
    "crosstalk": (lambda log: replace(log, force_n=log.force_n + 0.01 * np.roll(log.force_n, -1, axis=1)), "force crosstalk", None, 0.01, 5e-4),
    "hysteresis": (lambda log: replace(log, force_n=dragged(log.force_n)), "force hysteresis", None, None, None),
    "something spins": (spinning, "spinning part", None, 20.0, 1.0),
    "legs that give": (lambda log: replace(log, displacement_m=log.displacement_m + spectral.low_pass(log.force_n, TICK_S, 20.0, 0)[0] / 2e7), "elastic legs", None, 2e7, 2e6),
    "hum": (lambda log: replace(log, force_n=log.force_n + 10.0 * np.sin(2 * np.pi * 50 * log.t_s)[:, None]), "force hum", None, 50.0, 0.2),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_the_first_cause_is_the_true_one_with_leg_and_size(fault):
    # GIVEN 8 s of multisine with a fault WHEN they are diagnosed
    change, cause, legs, size, tolerance = FAULTS[fault]
    found = diagnose(change(recorded()), machine())
    # THEN the first cause is that fault, of that leg, of about that size: a twentieth of it, some of its own sigmas
    print(fault, [finding.sentence for finding in found.findings])
    first = found.findings[0]
    assert first.cause == cause
    assert legs is None or first.legs == tuple(leg - 1 for leg in legs)
    assert size is None or abs(abs(first.size) - size) < tolerance


@pytest.mark.parametrize("name", CLEAN)
def test_a_clean_log_has_no_cause_and_the_sensors_noise_is_left(name):
    # GIVEN the log of a sound machine WHEN it is diagnosed
    found = diagnose(recorded(name, None), machine(CLEAN[name]))
    # THEN nothing is named, and what is left of the forces is about the noise of the sensors
    assert found.findings == ()
    assert 0.8 < found.misfit < 1.5


def test_a_cause_is_told_from_the_other_that_has_the_same_kinematics():
    # GIVEN a velocity and a displacement of leg 6, each 2 % large: the same ratio, but for its sign
    of_velocity = diagnose(with_leg(recorded(), "velocity_m_s", 6, lambda v: 1.02 * v), machine())
    of_displacement = diagnose(with_leg(recorded(), "displacement_m", 6, lambda d: 1.02 * d), machine())
    # THEN the forces tell which it is, and fit when it is put right
    assert of_velocity.findings[0].cause == "velocity gain"
    assert of_displacement.findings[0].cause == "displacement gain"
    assert of_displacement.misfit < 1.5


def test_what_a_load_explains_is_no_cause():
    # GIVEN forces that are all 2 % large, as those of a load of 2 % more WHEN the log is diagnosed
    log = recorded()
    found = diagnose(replace(log, force_n=1.02 * log.force_n), machine())
    # THEN nothing is named
    assert found.findings == ()


def test_what_is_small_is_judged_by_what_it_does_to_the_load():
    # GIVEN displacements of leg 2 that are 0.2 mm off: less than half of the force sensors' noise in the forces
    log = with_leg(recorded(), "displacement_m", 2, lambda d: d + 2e-4)
    found = diagnose(log, machine())
    assert found.cause is None and found.findings[0].cause == "displacement zero"
    shift = np.abs(found.findings[0].shift)
    # WHEN the published sigmas are larger than what it does to each parameter THEN they cover it, and it says so
    covered = found.beside(1.01 * shift, is_fit=True)
    assert covered.cause is None
    assert covered.findings[0].sentence.endswith("too small to matter: sigma covers what it does to the load")
    # AND WHEN one of them is a third THEN it is a cause that does harm, and by how much
    sigma = 1.01 * shift
    sigma[6] = shift[6] / 3.0
    harmful = found.beside(sigma, is_fit=True).cause.sentence
    assert harmful.endswith("but it moves the load by 3.0 sigmas: calibrate it, or commission the machine")
    # AND WHEN the estimator finds a mismatch, and nothing else is found, THEN it is what there is to mend
    only = found.beside(1.01 * shift, is_fit=False).cause.sentence
    assert only.endswith("but the one misfit that is found: calibrate it, or commission the machine")


def test_a_cause_that_the_sigmas_cover_is_none_where_the_estimator_finds_no_mismatch():
    # GIVEN friction of 60 N in each leg, and sigmas that are as large as what it does
    found = diagnose(rubbing(recorded()), machine())
    assert found.cause.cause == "dry friction"
    sigma = 1.01 * np.abs(found.cause.shift)
    # WHEN the estimator's verdict is a good one THEN there is nothing to do
    covered = found.beside(sigma, is_fit=True)
    assert covered.cause is None and covered.findings[0].cause == "dry friction"
    # AND of a misfit, whose sigmas are widened, it remains the cause
    assert found.beside(sigma, is_fit=False).cause.cause == "dry friction"
    # AND so it does where it moves a parameter by two of its sigmas, but for those of a rig file, which have what is open of
    # these constants: three of them are nothing new
    assert found.beside(0.5 * sigma, is_fit=True).cause.cause == "dry friction"
    assert found.beside(0.5 * sigma, is_fit=True, has_rig=True).cause is None
    assert found.beside(0.3 * sigma, is_fit=True, has_rig=True).cause.cause == "dry friction"


@pytest.mark.parametrize("rows", [120, 2300, 3600])
def test_a_log_that_nothing_explains_is_diagnosed_however_short(rows):
    # GIVEN displacements of one run and forces of another: nothing explains these, nor those of a third of the time, which may be
    # too short to say anything
    log = replace(recorded(rows=rows), force_n=recorded("paper_noisy", rows).force_n)
    # WHEN it is diagnosed THEN it says what it can
    found = diagnose(log, machine())
    assert rows < 2000 or found.findings


def test_sensors_are_judged_by_what_they_have_shown():
    # GIVEN a log without what a rig file says of its friction, which changes sides within a sample: that looks like spikes
    log = recorded()
    mended = with_leg(log, "force_n", 1, spiked)
    assert diagnose(mended, machine()).findings[0].cause == "force spikes"
    # WHEN it is diagnosed with the log as it was recorded THEN the sensor has none
    assert all(finding.cause != "force spikes" for finding in diagnose(mended, machine(), shown=log).findings)


def test_noise_that_is_not_white_is_no_cause():
    # GIVEN slow random noise of 10 N on each force, as correlated as a motion is
    log, random = recorded(), np.random.default_rng(3)
    (slow,) = spectral.low_pass(random.normal(size=log.force_n.shape), TICK_S, 2.0)
    slow *= 10.0 / slow.std()
    found = diagnose(replace(log, force_n=log.force_n + slow), machine())
    # THEN the residual is large, and no cause of the machine is called for it
    print(found.misfit, [finding.words for finding in found.findings])
    assert found.misfit > 5.0
    assert not [finding for finding in found.findings if not finding.is_harmless]


def as_stated(own) -> RubbingRig:
    """A machine that is its model, with noise."""
    geometry = own.geometry
    sigma = {"displacement": own.displacement_sigma_m, "velocity": 1e-3, "force": own.force_sigma_n}
    hinges = (geometry.base_hinges_m, geometry.platform_hinges_m)
    return without_effects(*hinges, float(geometry.home_leg_length_m.mean()), own.own_theta, own.gravity_m_s2, sigma)


@pytest.mark.parametrize("hz", [0.1, 0.15, 0.3])
def test_a_slow_motion_makes_no_load_swing(hz):
    # GIVEN a machine that is its model, with noise, and a load on a motion whose accelerations are the displacements' noise at all
    # frequencies of what hangs or sloshes
    own = machine()
    t_s = np.arange(0.0, 12.0, TICK_S / SUBSTEPS)
    phase = np.arange(6.0)
    pose = np.sin(2.0 * np.pi * hz * t_s[:, None] + phase) * [0.03, 0.03, 0.03, 0.08, 0.08, 0.08]
    load = np.array([120.0, -6.0, 3.6, 26.4, 11.0, 12.0, 6.4, 0.5, -1.5, -0.7])
    # WHEN the log is diagnosed THEN nothing swings
    found = diagnose(leg_log(*log_of(as_stated(own), (t_s, pose), load, 3)), own)
    assert found.findings == ()


def test_a_late_leg_where_all_move_alike_is_late_and_not_swapped():
    # GIVEN a platform that goes up and down alone, so that each leg's velocity is most like any leg's displacement but that of
    # leg 5, which comes 2 ms late
    own = machine()
    t_s = np.arange(0.0, 12.0, TICK_S / SUBSTEPS)
    pose = np.zeros((len(t_s), 6))
    pose[:, 2] = 0.04 * np.sin(2.0 * np.pi * 0.7 * t_s) + 0.02 * np.sin(2.0 * np.pi * 1.3 * t_s)
    load = np.array([120.0, -6.0, 3.6, 26.4, 11.0, 12.0, 6.4, 0.5, -1.5, -0.7])
    log = with_leg(
        leg_log(*log_of(as_stated(own), (t_s, pose), load, 3)), "displacement_m", 5, lambda leg: late(leg, 2)
    )
    # WHEN the log is diagnosed
    found = diagnose(log, own)
    # THEN that is the cause, and no plugs are to be exchanged: none of another leg is where it should not be
    assert "leg 5: displacement is 2" in found.findings[0].sentence
    assert not any("swapped" in finding.sentence for finding in found.findings)


def test_a_symmetric_machine_cannot_tell_five_numberings_and_an_unsymmetric_one_can():
    # GIVEN the symmetric machine, and one with a hinge 2 mm off its place, known
    geometry = machine().geometry
    hinges = geometry.platform_hinges_m.copy()
    hinges[0, 0] += 2e-3
    # WHEN numberings are looked for that leave it congruent to itself
    # THEN there are two turns and three mirrors of the one, none of the other
    assert len(wiring.indistinguishable(geometry)) == 5
    assert wiring.indistinguishable(replace(geometry, platform_hinges_m=hinges)) == []


def test_cosines_are_orthonormal_and_derivatives_those_of_a_sine():
    # GIVEN white numbers and a sine WHEN they are transformed and derived
    values = np.random.default_rng(1).normal(size=(1001, 3))
    t_s = np.arange(4000) * TICK_S
    _, first, second = spectral.low_pass(np.sin(2 * np.pi * t_s), TICK_S, 20.0, 2)
    # THEN the terms are SciPy's to rounding, and derivatives are right to 1e-6 away from the ends
    np.testing.assert_allclose(spectral.cosines(values, 400), dct(values, norm="ortho", axis=0)[:400], atol=1e-12)
    inner = slice(500, -500)
    np.testing.assert_allclose(first[inner], 2 * np.pi * np.cos(2 * np.pi * t_s)[inner], atol=1e-4 * 2 * np.pi)
    np.testing.assert_allclose(second[inner], -((2 * np.pi) ** 2) * np.sin(2 * np.pi * t_s)[inner], atol=1e-3 * 40)


def test_every_kind_of_fault_has_its_cause_or_none():
    # GIVEN the list of faults THEN each has names of causes, but for those that no log can tell or no reader takes
    none = {name for name in KINDS if KINDS[name].is_fault and not causes_of(name)}
    assert none == {
        "force_gain_all", "platform_mass", "platform_centre", "platform_inertia", "known_mass", "doubled", "shuffled",
    }  # fmt: skip


def test_python_has_the_numbers():
    # GIVEN friction in leg 3 WHEN the arrays are diagnosed
    log = FAULTS["friction"][0](recorded())
    platform = str(DATA / "unknown_load.toml")
    found = hexload.diagnose(log.t_s, log.displacement_m, log.velocity_m_s, log.force_n, platform)
    # THEN sentence, size and significance are there
    assert found.cause.sentence.startswith("residual of leg 3 follows the sign of its speed: friction of about 40 N")
    assert found.cause.unit == "N" and found.cause.sigmas > 20.0 and found.misfit > 5.0 * found.left


def test_the_terminal_ends_with_the_cause_and_with_status_3(tmp_path):
    # GIVEN logs with friction, and with the forces of two legs swapped WHEN they are replayed on the terminal
    ends = {}
    for fault in ("friction", "forces swapped"):
        log = FAULTS[fault][0](recorded(rows=5000))
        columns = ",".join(["t", *(f"{name}{leg}" for name in ("dl", "vl", "f") for leg in range(1, 7))])
        path = tmp_path / "log.csv"
        rows = np.column_stack([log.t_s, log.displacement_m, log.velocity_m_s, log.force_n])
        np.savetxt(path, rows, "%.9g", ",", header=columns, comments="")
        options = (
            "--platform",
            DATA / "unknown_load.toml",
            "--out",
            tmp_path / "e.csv",
            "--report",
            tmp_path / "e.html",
        )
        command = [sys.executable, "-m", "hexload_dev", "replay", str(path), *map(str, options)]
        ends[fault] = subprocess.run(command, capture_output=True, text=True)
        print(ends[fault].stdout, ends[fault].stderr)
        # THEN the last line is one statement with the cause and the mend, on the page too, and no parameter repeats it
        last = ends[fault].stdout.splitlines()[-1]
        assert last.startswith("mend:")
        assert last.removeprefix("mend:").strip()[:40].lower() in (tmp_path / "e.html").read_text().lower()
        assert "friction, other noise or another load" not in ends[fault].stdout
    assert "residual of leg 3 follows the sign of its speed" in ends["friction"].stdout.splitlines()[-1]
    assert ends["friction"].returncode == 3
    assert "force sensors of legs 2 and 5 are swapped" in ends["forces swapped"].stdout.splitlines()[-1]
    assert ends["forces swapped"].returncode == 3


def test_steps_through_zero_are_no_loose_plug():
    # GIVEN velocities in steps of 5 mm/s, which stay at zero for rows when they pass it
    log = recorded()
    log = replace(log, velocity_m_s=5e-3 * np.round(log.velocity_m_s / 5e-3))
    # WHEN the log is looked at THEN the steps are named, and no plug
    named = [finding.cause for finding in diagnose(log, machine(), []).findings]
    assert "velocity steps" in named and "velocity loose" not in named
    # AND WHEN leg 4 shows zero for 5 rows at a time while it moves THEN its plug is
    held = log.velocity_m_s.copy()
    for start in np.flatnonzero(np.abs(held[:, 3]) > 0.1)[::500]:
        held[start : start + 5, 3] = 0.0
    found = diagnose(replace(log, velocity_m_s=held), machine(), []).findings
    assert ("velocity loose", (3,)) in [(finding.cause, finding.legs) for finding in found]


@pytest.mark.parametrize("name", CLEAN)
@pytest.mark.parametrize("step_m", [2.5e-5, 1e-4])
def test_coarse_steps_of_an_encoder_are_no_end_of_its_range_and_nothing_else(name, step_m):
    # GIVEN displacements in steps that are larger than the noise WHEN the log is diagnosed
    log = recorded(name)
    coarse = replace(log, displacement_m=step_m * np.round(log.displacement_m / step_m))
    named = [finding.cause for finding in diagnose(coarse, machine(CLEAN[name])).findings]
    # THEN the steps are named first, and no cause that ends a replay
    print(named)
    assert named[0] == "displacement steps"
    assert not any(cause.startswith("displacement") for cause in named[1:])


@pytest.mark.parametrize("size_m_s", [1e-3, 10e-3, 100e-3])
@pytest.mark.parametrize("until_row", [3500, None])
def test_a_zero_of_a_velocity_that_jumps_is_that_of_the_velocity_whatever_its_size(size_m_s, until_row):
    # GIVEN a velocity of leg 4 whose zero is off from 3.000 s on, for half a second or for good
    off = size_m_s * (np.arange(ROWS) >= 3000) * (np.arange(ROWS) < (until_row or ROWS))
    log = with_leg(recorded(), "velocity_m_s", 4, lambda v: v + off)
    # WHEN it is diagnosed
    found = diagnose(log, machine())
    # THEN that is the one cause, with size and time
    assert [each.cause for each in found.findings] == [f"velocity {'pulse' if until_row else 'zero step'}"]
    words = (
        "zero of its velocity is (.*) mm/s off from (?:2.9|3.0). to 3.(?:4|5). s"
        if until_row
        else "zero of its velocity jumps by (.*) mm/s at (?:2.9|3.0). s"
    )
    assert 1e-3 * float(re.search(f"leg 4: {words}", found.cause.words)[1]) == pytest.approx(size_m_s, rel=0.15)


def test_a_servo_that_oscillates_is_no_hum_of_the_forces():
    # GIVEN 10 N at 26.5 Hz in all forces, and the 0.5 mm/s that they move the legs by
    log = recorded()
    turn = 2.0 * np.pi * 26.5 * log.t_s[:, None]
    moved = replace(
        log,
        force_n=log.force_n + 10.0 * np.sin(turn),
        velocity_m_s=log.velocity_m_s - 0.5e-3 * np.cos(turn),
        displacement_m=log.displacement_m - 0.5e-3 / (2.0 * np.pi * 26.5) * np.sin(turn),
    )
    # WHEN it is diagnosed THEN no hum of the forces is named; AND without the motion it is
    assert "force hum" not in [each.cause for each in diagnose(moved, machine()).findings]
    still = replace(log, force_n=moved.force_n)
    assert "force hum" in [each.cause for each in diagnose(still, machine()).findings]


def test_a_hum_of_velocities_is_no_error_of_a_screw():
    # GIVEN velocities that hum with 20 mm/s on the paper's motion, so that their integral repeats with the place too
    log = recorded("paper_noisy", None)
    phase = np.arange(6.0)
    hum = 0.02 * np.sin(2.0 * np.pi * 50.0 * log.t_s[:, None] + phase)
    # WHEN it is diagnosed THEN the hum is named alone
    found = diagnose(replace(log, velocity_m_s=log.velocity_m_s + hum), machine("paper_load"))
    assert [each.cause for each in found.findings] == ["velocity hum"]


def test_a_hum_of_displacements_is_no_error_of_a_screw():
    # GIVEN displacements that hum with 30 um while the legs run at an even speed, so that it repeats with the place too
    log = recorded()
    t_s = log.t_s[:, None]
    way, speed = 0.1 * np.minimum(t_s, 4.0) - 0.2 + np.zeros(6), 0.1 * (t_s < 4.0) + np.zeros(6)
    random = np.random.default_rng(4)
    even = replace(
        log,
        displacement_m=way + random.normal(0.0, 2e-5, way.shape) + 3e-5 * np.sin(2.0 * np.pi * 50.0 * t_s),
        velocity_m_s=speed + random.normal(0.0, 1e-3, way.shape),
    )
    # WHEN it is diagnosed THEN the hum is named and no pitch
    named = [finding.cause for finding in diagnose(even, machine()).findings]
    print(named)
    assert "displacement hum" in named
    assert "displacement periodic" not in named


@pytest.mark.parametrize("name", CLEAN)
def test_sensors_without_noise_have_no_other_fault(name):
    # GIVEN a log from which the noise has been filtered WHEN it is diagnosed
    log = recorded(name)
    way, rate = spectral.low_pass(log.displacement_m, TICK_S, 40.0, 1)
    (force,) = spectral.low_pass(log.force_n, TICK_S, 40.0, 0)
    quiet = replace(log, displacement_m=way, velocity_m_s=rate, force_n=force)
    # THEN it is said that there is less noise than stated, and nothing else
    found = diagnose(quiet, machine(CLEAN[name])).findings
    assert [finding.cause for finding in found] == ["displacement noise", "velocity noise", "force noise"]
    # AND that there is nothing to do: a filter is no other unit
    assert all(finding.is_harmless for finding in found)


@pytest.mark.parametrize("newtons, is_another_unit", [(4.4482216, True), (2.0, False)])
def test_forces_whose_white_noise_is_quiet_may_be_of_another_unit(newtons, is_another_unit):
    # GIVEN a log with forces in lbf, or in a unit that ordinary statements of noise are off by
    log = recorded()
    found = diagnose(replace(log, force_n=log.force_n / newtons), machine()).findings
    (quiet,) = (finding for finding in found if finding.cause == "force noise")
    # WHEN it is diagnosed THEN of the first the unit is to be checked, of the other nothing has to be done
    assert ("check their unit (N)" in quiet.mend) is is_another_unit
    assert quiet.is_harmless is not is_another_unit


def two_legs(log: LegLog, channel: str, change, other) -> LegLog:
    return with_leg(with_leg(log, channel, 2, change), channel, 5, other)


TWO_LEGS = {
    "displacement gain": lambda log: two_legs(log, "displacement_m", lambda d: 1.01 * d, lambda d: 0.99 * d),
    "displacement late": lambda log: two_legs(log, "displacement_m", lambda d: late(d, 2), lambda d: late(d, 3)),
    "displacement sign": lambda log: two_legs(log, "displacement_m", np.negative, np.negative),
}


@pytest.mark.parametrize("cause", TWO_LEGS)
def test_two_legs_with_the_same_fault_are_each_named_once_and_put_right(cause):
    # GIVEN displacements of two legs with a fault each WHEN the log is diagnosed
    found = diagnose(TWO_LEGS[cause](recorded()), machine())
    # THEN these two are named, nothing else, and what is left of the forces is their noise
    print([finding.sentence for finding in found.findings], found.misfit)
    assert [(finding.cause, finding.legs) for finding in found.findings] == [(cause, (1,)), (cause, (4,))]
    assert found.misfit < 1.5


def test_hinges_that_a_load_explains_as_well_move_no_load():
    # GIVEN a clean log, and all hinges off their places by what its noise says: all that move alike are another load
    d = dynamics_of(record_of(recorded()), machine())
    bank = Bank(d, [np.ones(len(d.smooth.t_s))])
    (family,) = (each for each in causes.slow(d, bank.theta(), d.smooth.force) if each.cause == "hinges")
    # WHEN this is taken for the cause THEN it is no further than what noise may tell of the least that it tells, and of the load
    # it moves nothing by more than a tenth of the platform
    hinges = bank.choose(family)
    assert np.abs(hinges.size).max() < 0.02
    assert np.abs(hinges.shift).max() < 0.1 * machine().own_theta[0]
    # AND it explains what a regression on load and hinges does, but for what noise has in those of 36 directions that it leaves
    # out: each has the share 1 / rows of the residual, and three times that
    columns = np.concatenate([bank.base, d.whitened(family.columns)], axis=1)
    columns /= np.linalg.norm(columns, axis=0)
    left = bank.forces - columns @ np.linalg.lstsq(columns, bank.forces, rcond=1e-9)[0]
    assert bank.left < (1.0 + 3.0 * 36.0 / bank.rows) * float(left @ left)


def test_noise_is_no_family_of_causes():
    # GIVEN white noise in the place of the leg forces, whatever a load explains of it
    d = dynamics_of(record_of(recorded()), machine())
    random = np.random.default_rng(5)
    largest = {}
    families = list(causes.quick(d, Bank(d, [np.ones(len(d.smooth.t_s))]).theta()))
    for family in families:
        bank = Bank(d, [np.ones(len(d.smooth.t_s))])
        bank.residual = bank._without(random.normal(size=(len(bank.forces), 1)))[:, 0]
        bank.forces = bank.residual
        # WHEN a family of causes is fitted to it THEN it is as significant as one normal number: of some thirty, 3.5 is one in 70
        largest[family.cause] = max(largest.get(family.cause, 0.0), bank.choose(family).sigmas)
    print(len(families), largest)
    assert len(largest) > 10
    assert max(largest.values()) < 4.0


@pytest.mark.parametrize(("rows", "every"), [(1000, 1), (1000, 10), (ROWS, 5), (ROWS, 20)])
def test_a_short_or_a_slow_log_has_no_jitter(rows, every):
    # GIVEN stretches of a clean log, and rows of it that are 5 to 20 ms apart WHEN they are diagnosed
    log = recorded(rows=None)
    for start in range(0, len(log.t_s) - rows, 2 * rows):
        inside = slice(start, start + rows, every)
        part = LegLog(log.t_s[inside], log.displacement_m[inside], log.velocity_m_s[inside], log.force_n[inside])
        # THEN none of them has been read at other times than it tells
        assert all(finding.cause != "jitter" for finding in diagnose(part, machine()).findings)


@pytest.mark.parametrize("name", ["multisine_eccentric", "load_pickup", "work_motion"])
@pytest.mark.parametrize("gap_ms", [20, 300, 1000, 2000])
def test_rows_that_are_missing_are_no_clock_that_jumps(name, gap_ms):
    # GIVEN a log from which rows are cut, and one whose clock jumps ahead as far, at many moments
    log = recorded(name, None)
    is_moving = np.abs(log.velocity_m_s).max(axis=1) > 0.1
    causes_of_jump = []
    for at in range(1000, len(log.t_s) - gap_ms - 100, 497):
        cut = log.rows(np.r_[0:at, at + gap_ms : len(log.t_s)])
        # WHEN the rows' times are looked at THEN a gap is told as missing samples, in motion and at rest
        assert [finding.cause for finding in channels._rows(cut)] == ["samples missing"]
        jumped = replace(log, t_s=log.t_s + np.where(np.arange(len(log.t_s)) >= at, 1e-3 * gap_ms, 0.0))
        if is_moving[at - 12 : at + 12].all():
            causes_of_jump += [finding.cause for finding in channels._rows(jumped)]
    # AND a jump as that, where the legs move
    assert set(causes_of_jump) == {"clock jumped"}


def test_a_machine_at_rest_does_not_freeze_its_samples():
    # GIVEN a machine that rests for a second, with steps that are coarser than the noise
    log = recorded()
    steps = {"displacement_m": 1e-3, "velocity_m_s": 2e-2, "force_n": 100.0}
    rests = {}
    for channel, step in steps.items():
        values = getattr(log, channel).copy()
        values[4000:5000] = 0.0 if channel == "velocity_m_s" else values[4000]
        values[5000:] = values[5000:] if channel == "velocity_m_s" else values[4000:-1000]
        rests[channel] = step * np.round(values / step)
    # WHEN it is diagnosed THEN its samples have not stopped; where it is somewhere else after them, they have
    causes_at_rest = [finding.cause for finding in diagnose(replace(log, **rests), machine()).findings]
    print(causes_at_rest)
    assert "samples frozen" not in causes_at_rest
    frozen = {channel: getattr(log, channel).copy() for channel in steps}
    for values in frozen.values():
        values[4000:4500] = values[4000]
    assert diagnose(replace(log, **frozen), machine()).findings[0].cause == "samples frozen"


@pytest.mark.parametrize("missing", [slice(None), slice(None, None, 2), np.arange(ROWS) % 10 != 0])
@pytest.mark.parametrize("channel", ["displacement_m", "force_n"])
def test_a_channel_that_is_missing_is_said_to_be_missing_and_nothing_else(channel, missing):
    # GIVEN a channel of leg 3 of which all, every second or nine of ten values are missing
    def lose(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[missing] = np.nan
        return values

    # WHEN the log is diagnosed
    found = diagnose(with_leg(recorded(), channel, 3, lose), machine())
    # THEN that is what is named, of that leg, and nothing that the missing values would make of the others
    print([finding.sentence for finding in found.findings])
    assert [(finding.cause, finding.legs) for finding in found.findings] == [(f"{channel.split('_')[0]} missing", (2,))]


@pytest.mark.parametrize(
    ("cause", "late_by_s", "words"),
    [
        ("force late", 2e-3, "force late by about 2 ms"),
        ("force late", -2e-3, "force early by about 2 ms"),
        ("displacement late", 2e-3, "displacement late by about 2 ms, or force early"),
        ("displacement late", -2e-3, "displacement early by about 2 ms, or force late"),
    ],
)
def test_what_is_late_or_early_is_said_to_be_that(cause, late_by_s, words):
    # GIVEN leg 3 late or early by 2 ms, as the search has selected it WHEN it is worded THEN the direction is the one of the size
    family = Family(cause, np.zeros((1, 6, 1)), (2,))
    selected = Selected(family, 100.0, np.array([late_by_s]), 20.0, 30.0, np.zeros(10), 0.5)
    assert words in phrases.finding_of(selected, (), machine()).words
