"""Each fault does to a recording what it says, and nothing else; what acts on the platform obeys mechanics."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hexload.campaign import cases, one_case
from hexload.estimation.rig_model import body_forces
from hexload.faults import load_faults, machine_faults, recording, sensor_faults, timing_faults
from hexload.faults.kinds import KINDS
from hexload.faults.recording import channels_of, in_channel
from hexload.io.log_file import CHANNEL_KEYS, read_log

SEED, DURATION_S = 3, 4.0
SIGMAS = {"displacement": 20e-6, "velocity": 1e-3, "force": 5.0}
# Accelerations are differences of the true twist over two ticks: rms of the forces' error, N, of 800 N rms.
DIFFERENCES_N = 0.06
INNER = slice(10, -10)  # the first difference spans the start


def simulated(folder, class_name="multisine", **tables):
    """A recording of the simulator, with more tables in its scenario."""
    setup = cases.draw(cases.Case(class_name, SEED, DURATION_S))
    setup.scenario.update(tables)
    run = one_case.simulate_setup(setup, "test", folder)
    loads = json.loads((run / "meta.json").read_text())["loads"]
    recording.write_recording(folder / "recording.npz", run, loads, read_log(run / "log.csv"))
    return recording.read_recording(folder / "recording.npz", setup.platform)


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("clean"))


@pytest.fixture
def random():
    return np.random.default_rng(SEED)


def rigid_forces(of):
    """Leg forces that the motion takes with platform and load as they are told, by Newton and Euler."""
    return np.einsum("nij,nj->ni", body_forces(of.motion, of.gravity_m_s2), of.total_theta())


def rms(values):
    return float(np.sqrt(np.mean(values[INNER] ** 2)))


def touched(before, after):
    """(channel, leg) whose readings differ."""
    pairs = zip(CHANNEL_KEYS, channels_of(before.log), channels_of(after.log))
    return {
        (channel, leg)
        for channel, old, new in pairs
        for leg in range(6)
        if not np.array_equal(old[:, leg], new[:, leg])
    }


def only_leg(before, after, channel):
    """The one leg that is touched, of the one channel."""
    ((found, leg),) = touched(before, after)
    assert found == channel
    return leg


def added_wrench(before, after):
    """(n, 6) about O_A in platform axes: what acts beside the legs."""
    force = after.clean.force_n - before.clean.force_n
    return -np.einsum("nji,nj->ni", before.motion.jacobian, force)


def test_a_clean_recording_is_its_own_model(clean):
    # GIVEN a run of the simulator WHEN Newton's forces of its true motion are taken THEN they are the legs' forces
    assert rms(clean.clean.force_n) > 500.0
    assert rms(clean.clean.force_n - rigid_forces(clean)) < DIFFERENCES_N
    # AND the sensors' noise is the stated one: of 24,000 values the standard deviation is known to 0.5 %
    for channel, sigma in SIGMAS.items():
        assert recording.noise_of(clean, channel).std() == pytest.approx(sigma, rel=0.025)


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.is_fault])
def test_every_fault_changes_something_and_is_the_same_for_the_same_seed(clean, name):
    # GIVEN a kind WHEN its largest size is put in twice, from one seed
    kind = KINDS[name]
    told = replace(clean, platform=clean.platform | {"load": {"known_mass_kg": 400.0}})
    first, second = (kind.apply(told, kind.sizes[-1], np.random.default_rng(1)) for _ in range(2))
    # THEN the estimator is given something else than before, both times the same
    same_log = np.array_equal(first.log.t_s, told.log.t_s) and not touched(told, first)
    assert not same_log or first.platform != told.platform
    for one, two in zip((first.log.t_s, *channels_of(first.log)), (second.log.t_s, *channels_of(second.log))):
        assert np.array_equal(one, two, equal_nan=True)
    assert first.platform == second.platform
    # AND the true load changes where the list says so, and only there; no reading is lost but those that are to be
    assert np.array_equal(first.theta, told.theta) != kind.changes_truth
    assert name.endswith("_nan") or all(np.isfinite(part).all() for part in channels_of(first.log))


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_a_stuck_leg_repeats_its_value_for_as_long_as_it_is_stuck(clean, random, channel):
    after = sensor_faults.stuck(clean, 0.5, random, channel)
    leg = only_leg(clean, after, channel)
    rows = np.flatnonzero(in_channel(after, channel)[:, leg] != in_channel(clean, channel)[:, leg])
    assert len(np.unique(in_channel(after, channel)[rows, leg])) == 1
    assert rows[-1] - rows[0] == 498  # 500 rows, of which the first has its own value


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_a_dead_leg_shows_zero(clean, random, channel):
    after = sensor_faults.dead(clean, sensor_faults.REST_S, random, channel)
    leg = only_leg(clean, after, channel)
    rows = np.flatnonzero(in_channel(after, channel)[:, leg] == 0.0)
    assert 0.35 <= rows[0] / 4000 <= 0.6 and np.array_equal(rows, np.arange(rows[0], len(clean.t_s)))


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_errors_of_one_leg(clean, channel):
    # GIVEN faults of a leg's scale and zero WHEN each is put in THEN its readings are off by just that
    def after(fault, size):
        result = fault(clean, size, np.random.default_rng(5), channel)
        leg = only_leg(clean, result, channel)
        return in_channel(clean, channel)[:, leg], in_channel(result, channel)[:, leg]

    old, new = after(sensor_faults.negated, 1.0)
    assert np.array_equal(new, -old)
    old, new = after(sensor_faults.bias_one, 3.0)
    assert np.abs(new - old) == pytest.approx(3.0)
    old, new = after(sensor_faults.drift, 2.0)
    assert np.abs(new - old)[[0, 1000, 4000]] == pytest.approx([0.0, 2.0, 8.0])
    old, new = after(sensor_faults.gain_one, 0.1)
    assert np.abs(new / old - 1.0) == pytest.approx(0.1)
    old, new = after(sensor_faults.saturated, 0.6)
    reach = 0.6 * np.abs(old - old.mean()).max()
    assert np.abs(new - old.mean()).max() == pytest.approx(reach)
    assert np.array_equal(new[np.abs(old - old.mean()) < reach], old[np.abs(old - old.mean()) < reach])
    # AND spikes are rare: 8 +- 3 of 4,001 rows, up and down
    old, new = after(sensor_faults.spikes, 7.0)
    hit = new != old
    assert 1 <= hit.sum() <= 20 and np.abs((new - old)[hit]) == pytest.approx(7.0)
    # AND from somewhere in the middle on the zero is elsewhere, or the gain another one
    for fault in (sensor_faults.zero_step, sensor_faults.gain_step):
        old, new = after(fault, 0.1)
        off = new - old if fault is sensor_faults.zero_step else new / old - 1.0
        hit = np.flatnonzero(new != old)
        assert 0.35 <= hit[0] / 4000 <= 0.6 and hit[-1] == 4000
        assert np.abs(off[hit]) == pytest.approx(0.1) and np.ptp(off[hit]) == pytest.approx(0.0, abs=1e-9)
    # AND a loose plug shows zero for 50 ms, some four times in 4 s
    old, new = after(sensor_faults.loose, 0.05)
    begins = np.flatnonzero(np.diff((new == 0.0).astype(int)) == 1)
    assert 1 <= len(begins) <= 12 and np.array_equal(new[new != 0.0], old[new != 0.0])
    assert (new[begins[0] + 1 : begins[0] + 51] == 0.0).all()
    # AND a bent scale is off by 3 % where the reading is largest, to one side, and by half of that at half of it
    old, new = after(sensor_faults.bent, 0.03)
    error, share = new - old, np.abs(old) / np.abs(old).max()
    assert np.abs(error) == pytest.approx(0.03 * share * np.abs(old)) and np.ptp(np.sign(error[error != 0.0])) == 0.0
    # AND a share of the rows is no number
    old, new = after(sensor_faults.not_numbers, 0.05)
    assert np.isnan(new).mean() == pytest.approx(0.05, abs=0.015) and not np.isnan(new[0])


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_zeros_that_wander_go_by_the_root_of_time(clean, random, channel):
    # GIVEN zeros that are off by 3 after a second WHEN their ways are taken apart THEN steps of 1 ms have 3 sqrt(1e-3)
    after = sensor_faults.wander(clean, 3.0, random, channel)
    off = in_channel(after, channel) - in_channel(clean, channel)
    assert touched(clean, after) == {(channel, leg) for leg in range(6)}
    assert np.diff(off, axis=0).std() == pytest.approx(3.0 * np.sqrt(1e-3), rel=0.025)
    # AND each leg goes its own way
    assert np.abs(np.corrcoef(np.diff(off, axis=0).T) - np.eye(6)).max() < 0.1


def test_sensors_that_lag_behind_themselves(clean, random):
    # GIVEN a play of 0.5 mm WHEN legs turn round THEN displacements stand behind by half of it at most, on either side
    after = sensor_faults.backlash(clean, 5e-4, random)
    behind = after.log.displacement_m - clean.log.displacement_m
    assert np.abs(behind).max() == pytest.approx(2.5e-4, rel=1e-6)
    moving = np.abs(clean.clean.velocity_m_s) > 0.05
    assert np.mean(np.sign(behind[moving]) == -np.sign(clean.clean.velocity_m_s[moving])) > 0.9
    # AND of forces with a hysteresis of 0.5 % the same, of the largest force
    after = sensor_faults.hysteresis(clean, 5e-3, random)
    behind = after.log.force_n - clean.log.force_n
    assert np.abs(behind).max() == pytest.approx(5e-3 * np.abs(clean.clean.force_n).max(), rel=1e-6)
    # AND each force shows 3 % of the next leg's
    after = sensor_faults.crosstalk(clean, 0.03, random)
    assert after.log.force_n[:, 5] - clean.log.force_n[:, 5] == pytest.approx(0.03 * clean.log.force_n[:, 0])


def test_velocities_that_are_differences_are_the_displacements_and_late(clean, random):
    # GIVEN differences through a low-pass of 30 Hz, whose group delay is sqrt(2) / (2 pi 30 Hz), and half a tick of a difference
    after = timing_faults.differentiated(clean, 30.0, random)
    late_s = np.sqrt(2.0) / (2.0 * np.pi * 30.0) + 0.5e-3
    # WHEN they are compared with the true velocities of then THEN what is left is the displacements' noise: white noise of 20 um that
    # is differentiated up to 30 Hz has some 20 um / 1 ms sqrt(2 (2 pi 30 ms)^3 / (6 pi)) = 0.5 mm/s
    rows = np.arange(200, 4000)
    then = np.array(
        [np.interp(clean.t_s[rows] - late_s, clean.t_s, clean.clean.velocity_m_s[:, leg]) for leg in range(6)]
    )
    assert np.std(after.log.velocity_m_s[rows] - then.T) < 1.5e-3 < 0.05 * clean.clean.velocity_m_s.std()
    assert {channel for channel, _ in touched(clean, after)} == {"velocity"}


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_errors_of_all_legs(clean, random, channel):
    def readings(fault, size):
        after = fault(clean, size, random, channel)
        assert {found for found, _ in touched(clean, after)} == {channel}
        return in_channel(after, channel)

    old = in_channel(clean, channel)
    assert np.ptp(readings(sensor_faults.bias_all, 2.0) - old) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(readings(sensor_faults.gain_all, 0.1) / old - 1.0) == pytest.approx(0.1)
    assert readings(sensor_faults.unit, 1e3) == pytest.approx(1e3 * old)
    steps = readings(sensor_faults.quantised, 10.0 * SIGMAS[channel]) / (10.0 * SIGMAS[channel])
    assert steps == pytest.approx(np.round(steps))
    for size in (0.25, 4.0):
        after = sensor_faults.noise(clean, size, random, channel)
        assert recording.noise_of(after, channel).std() == pytest.approx(size * SIGMAS[channel], rel=0.025)
    hum = readings(sensor_faults.hum, 2.0) - old
    spectrum = np.abs(np.fft.rfft(hum[:4000], axis=0)) / 2000.0
    assert (spectrum.argmax(axis=0) == 200).all()  # 50 Hz of 4 s
    assert spectrum.max(axis=0) == pytest.approx(2.0)


def test_exchanged_plugs_are_one_channels_exchanged_legs_all(clean):
    after = sensor_faults.swapped(clean, 3.0, np.random.default_rng(1), "force")
    legs = sorted(leg for _, leg in touched(clean, after))
    assert legs[1] - legs[0] == 3 and {channel for channel, _ in touched(clean, after)} == {"force"}
    assert np.array_equal(in_channel(after, "force")[:, legs], in_channel(clean, "force")[:, legs[::-1]])
    both = sensor_faults.exchanged_legs(clean, 3.0, np.random.default_rng(1))
    assert touched(clean, both) == {(channel, leg) for channel in CHANNEL_KEYS for leg in legs}


def test_renumbered_and_mirrored_legs_are_so_in_all_channels(clean, random):
    # GIVEN legs counted from the third one WHEN counted on four more THEN they are what they were
    after = sensor_faults.renumbered(clean, 2.0, random)
    assert len(touched(clean, after)) == 18
    assert np.array_equal(after.log.force_n[:, 2], clean.log.force_n[:, 0])
    assert not touched(clean, sensor_faults.renumbered(after, 4.0, random))
    # AND mirrored twice likewise
    after = sensor_faults.mirrored(clean, 1.0, random)
    assert np.array_equal(after.log.velocity_m_s[:, 5], clean.log.velocity_m_s[:, 0])
    assert not touched(clean, sensor_faults.mirrored(after, 1.0, random))


@pytest.mark.parametrize("channel", CHANNEL_KEYS)
def test_late_channels_show_what_was(clean, random, channel):
    # GIVEN a channel late by three ticks THEN without its noise it is the clean one, three rows on
    after = timing_faults.late(clean, 3e-3, random, channel)
    shown = in_channel(after, channel) - recording.noise_of(clean, channel)
    true = getattr(clean.clean, CHANNEL_KEYS[channel])
    assert shown[3:] == pytest.approx(true[:-3], rel=1e-6, abs=1e-9)
    # AND one leg may be late alone
    one = timing_faults.late_leg(clean, 3e-3, np.random.default_rng(1), channel)
    leg = only_leg(clean, one, channel)
    assert in_channel(one, channel)[:, leg] == pytest.approx(in_channel(after, channel)[:, leg])


def test_a_filter_takes_off_noise_and_is_late(clean, random):
    # GIVEN forces behind a second-order low-pass of 20 Hz, which lets 1.11 x 20 / 500 of white noise's power through
    after = timing_faults.low_pass(clean, 20.0, random, "force")
    late_s = np.sqrt(2.0) / (2.0 * np.pi * 20.0)
    expected = timing_faults.late(clean, late_s, random, "force").log.force_n - recording.noise_of(clean, "force")
    # THEN they are the clean ones of sqrt(2) / (2 pi f) s ago
    assert rms((after.log.force_n - expected)[500:]) < 0.1 * rms((after.log.force_n - clean.clean.force_n)[500:])


def test_clocks(clean, random):
    log = clean.log
    drifted_s = timing_faults.clock(clean, 0.02, random).log.t_s
    assert np.abs(drifted_s[1:] / log.t_s[1:] - 1.0) == pytest.approx(0.02)
    jumped = timing_faults.clock_jump(clean, 0.5, random).log.t_s
    assert np.sort(np.diff(jumped))[[-2, -1]] == pytest.approx([1e-3, 0.501])
    # AND jitter moves what is read by speed times sigma: of the displacements 0.5 ms of 0.1 m/s
    shown = timing_faults.jitter(clean, 5e-4, random).log.displacement_m - log.displacement_m
    speed = np.sqrt(np.mean(clean.clean.velocity_m_s**2))
    assert np.sqrt(np.mean(shown**2)) == pytest.approx(5e-4 * speed, rel=0.05)
    assert not np.any(np.diff(log.t_s) <= 0)


def test_rows_that_are_held_lost_doubled_shuffled_or_frozen(clean, random):
    log, rows = clean.log, len(clean.t_s)
    held = timing_faults.held(clean, 5.0, random).log
    assert len(held.t_s) == rows and np.array_equal(held.force_n[7], log.force_n[5])
    assert {channel for channel, _ in touched(clean, timing_faults.held_channel(clean, 5.0, random, "force"))} == {
        "force"
    }
    slow = timing_faults.slow_sampling(clean, 5.0, random).log
    assert np.diff(slow.t_s) == pytest.approx(5e-3) and np.array_equal(slow.force_n[1], log.force_n[5])
    lost = timing_faults.lost(clean, 0.2, random).log
    assert len(lost.t_s) / rows == pytest.approx(0.8, abs=0.03) and np.isin(lost.t_s, log.t_s).all()
    gap = timing_faults.lost_stretch(clean, 0.3, random).log
    assert np.diff(gap.t_s).max() == pytest.approx(0.301)
    bursts = timing_faults.lost_bursts(clean, 0.03, random).log
    gaps_s = np.diff(bursts.t_s)[np.diff(bursts.t_s) > 1.5e-3]
    assert 2 <= len(gaps_s) <= 20 and gaps_s.min() == pytest.approx(0.031) and bursts.t_s[0] == log.t_s[0]
    doubled = timing_faults.doubled(clean, 0.5, random).log
    assert (np.diff(doubled.t_s) == 0.0).mean() == pytest.approx(1.0 / 3.0, abs=0.03)
    repeated = timing_faults.repeated(clean, 0.2, random).log
    assert np.array_equal(repeated.t_s, log.t_s)
    assert (repeated.force_n != log.force_n).all(axis=1).mean() == pytest.approx(0.2, abs=0.03)
    shuffled = timing_faults.shuffled(clean, 0.2, random).log
    assert (np.diff(shuffled.t_s) < 0.0).mean() == pytest.approx(0.2, abs=0.03)
    assert np.array_equal(np.sort(shuffled.t_s), log.t_s)
    values = timing_faults.shuffled_values(clean, 0.2, random).log
    assert np.array_equal(values.t_s, log.t_s)
    assert np.array_equal(np.sort(values.force_n, axis=0), np.sort(log.force_n, axis=0))
    frozen = timing_faults.frozen(clean, 0.5, random).log
    assert (np.diff(frozen.force_n, axis=0) == 0.0).all(axis=1).sum() == 499


@pytest.mark.parametrize(
    "name", [name for name, kind in KINDS.items() if kind.group in ("hinges", "platform, gravity")]
)
def test_what_the_platform_file_tells_wrongly_is_in_the_file_alone(clean, random, name):
    told = replace(clean, platform=clean.platform | {"load": {"known_mass_kg": 400.0}})
    after = KINDS[name].apply(told, KINDS[name].sizes[-1], random)
    assert after.log is told.log
    assert sum(after.platform[table] != told.platform[table] for table in told.platform) == 1


def test_sizes_in_the_platform_file(clean, random):
    def entry(fault, size, table, key):
        tables = (fault(clean, size, random).platform, clean.platform)
        return np.array(tables[0][table][key]), np.array(tables[1][table][key])

    new, old = entry(machine_faults.platform_mass, 0.05, "platform", "mass_kg")
    assert abs(new / old - 1.0) == pytest.approx(0.05)
    new, old = entry(machine_faults.platform_centre, 0.01, "platform", "com_m")
    assert np.linalg.norm(new - old) == pytest.approx(0.01)
    new, old = entry(machine_faults.gravity, 0.01, "environment", "gravity_m_s2")
    assert abs(new / old - 1.0) == pytest.approx(0.01)
    new, old = entry(machine_faults.one_hinge, 5e-3, "geometry", "platform_hinges_m")
    assert np.sort(np.linalg.norm(new - old, axis=1)) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.0, 5e-3])
    new, old = entry(machine_faults.hinges, 1e-3, "geometry", "base_hinges_m")
    assert np.std(new - old) == pytest.approx(1e-3, rel=0.5)
    new, old = entry(sensor_faults.stated_noise, 3.0, "sensors", "force_sigma_n")
    assert new == pytest.approx(3.0 * old)


def test_a_tilted_base_is_that_of_the_simulator(tmp_path):
    # GIVEN a simulated machine off level by 10 mrad about x and 20 mrad about y
    x, y = 0.010, -0.020
    run = simulated(tmp_path, machine={"tilt_rad": [x, y]})
    g = 9.81 * np.array([np.sin(y), -np.cos(y) * np.sin(x), -np.cos(y) * np.cos(x)])
    # WHEN the tilt's wrench is added to the forces of a level machine THEN they are the simulator's
    tilted = recording.with_wrench(run, machine_faults.weight_wrench(run, g - run.gravity_m_s2))
    added = tilted.clean.force_n - run.clean.force_n
    assert rms(run.clean.force_n - rigid_forces(run)) > 30.0
    assert rms(run.clean.force_n - rigid_forces(run) - added) < DIFFERENCES_N
    # AND the fault has the size that it says: horizontal weight of 20 mrad
    level = replace(run, clean=replace(run.clean, force_n=rigid_forces(run)))
    wrench = added_wrench(level, machine_faults.tilt(level, 0.02, np.random.default_rng(1)))
    up = np.einsum("nji,nj->ni", run.motion.to_platform, wrench[:, :3])
    assert np.hypot(up[:, 0], up[:, 1]) == pytest.approx(0.02 * 9.81 * run.total_theta()[:, 0])


def test_legs_with_mass_are_those_of_the_simulator(tmp_path):
    # GIVEN a simulated machine with legs of 20 kg
    rod_m, cylinder_m = machine_faults.LEG_LENGTHS_M
    legs = {"rod_mass_kg": 7.0, "rod_length_m": rod_m, "cylinder_mass_kg": 13.0, "cylinder_length_m": cylinder_m}
    run = simulated(tmp_path, legs=legs)
    # WHEN the fault is added to the forces of one without THEN they are the simulator's
    added = machine_faults.leg_mass(run, 20.0, np.random.default_rng(1)).clean.force_n - run.clean.force_n
    assert rms(run.clean.force_n - rigid_forces(run)) > 50.0
    assert rms(run.clean.force_n - rigid_forces(run) - added) < DIFFERENCES_N


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.group == "friction"])
def test_friction_takes_power(clean, random, name):
    # GIVEN a law of friction WHEN it is added THEN the legs have to give more power than before, over the run
    after = KINDS[name].apply(clean, KINDS[name].sizes[-1], random)
    power = (after.clean.force_n - clean.clean.force_n) * clean.clean.velocity_m_s
    assert power.sum(axis=1).mean() > 0.0
    # AND without presliding, which stores some, at every tick; but for rounding
    if name != "lugre":
        assert power.sum(axis=1).min() > -1e-9


def test_levels_of_friction(clean):
    def force(fault, size):
        """Of each leg over the level that it was drawn, between 0.8 and 1.2."""
        added = fault(clean, size, np.random.default_rng(1)).clean.force_n - clean.clean.force_n
        return added / np.random.default_rng(1).uniform(0.8, 1.2, 6)

    speed = clean.clean.velocity_m_s
    fast, slow = np.abs(speed) > 0.05, (np.abs(speed) > 3e-3) & (np.abs(speed) < 4e-3)
    assert np.abs(force(machine_faults.coulomb, 60.0)[fast]) == pytest.approx(60.0)
    assert force(machine_faults.viscous, 300.0) == pytest.approx(300.0 * speed)
    assert np.abs(force(machine_faults.stribeck, 60.0)[fast]) == pytest.approx(60.0)
    assert np.abs(force(machine_faults.stribeck, 60.0)[slow]).mean() == pytest.approx(82.0, rel=0.05)
    # AND bristles end on Stribeck's curve: 60 N when fast, nearly 90 N where slow, never more
    bristles = force(machine_faults.lugre, 60.0)
    assert 75.0 < np.abs(bristles).max() < 90.0 + 1e-6
    assert np.median(np.abs(bristles[fast])) == pytest.approx(60.0, rel=0.01)
    growing = force(machine_faults.growing_with_force, 0.02)
    assert np.abs(growing[fast]) == pytest.approx(0.02 * np.abs(clean.clean.force_n)[fast])
    warm = np.abs(force(machine_faults.warming_up, 80.0))
    level = 80.0 * (0.5 + 0.5 * np.exp(-clean.t_s / machine_faults.WARM_UP_S))
    assert warm[fast] == pytest.approx(np.broadcast_to(level[:, None], speed.shape)[fast])


def test_a_force_from_outside_acts_where_and_as_long_as_it_says(clean, random):
    # GIVEN 100 N for half a second THEN as long the platform feels 100 N with an arm of BESIDE_M at most
    wrench = added_wrench(clean, load_faults.contact(clean, 100.0, random))
    size = np.linalg.norm(wrench[:, :3], axis=1)
    acts = size > 1e-6
    assert acts.sum() == 500 and size[acts] == pytest.approx(100.0)
    assert np.linalg.norm(wrench[acts, 3:], axis=1).max() <= 100.0 * load_faults.BESIDE_M * (1.0 + 1e-9)
    assert np.sum(wrench[:, :3] * wrench[:, 3:], axis=1) == pytest.approx(0.0, abs=1e-6)  # a force, no couple
    # AND hoses pull in proportion to the way from home
    wrench = added_wrench(clean, load_faults.hoses(clean, 500.0, random))
    way = np.einsum("nij,nj->ni", clean.motion.to_platform, clean.position_m)
    assert wrench == pytest.approx(np.hstack([-500.0 * way, np.zeros_like(way)]), abs=1e-6)
    # AND an end stop pushes one way only, up to its size
    size = np.linalg.norm(added_wrench(clean, load_faults.end_stop(clean, 500.0, random))[:, :3], axis=1)
    assert size.max() == pytest.approx(500.0) and 0.5 < (size < 1e-6).mean() < 1.0


def test_wind_blows_from_all_sides_and_lasts_for_a_second(clean, random):
    # GIVEN gusts of 60 N WHEN they blow THEN all of it acts SAIL_M above the platform
    wrench = added_wrench(clean, load_faults.wind(clean, 60.0, random))
    assert wrench[:, 3:] == pytest.approx(np.cross([0.0, 0.0, load_faults.SAIL_M], wrench[:, :3]), abs=1e-6)
    # AND from tick to tick it changes by sqrt(2 dt / GUST_S) of its size: 2.7 N, known to 0.7 % from 12,000 steps
    steps = np.diff(to_base(clean, wrench[:, :3]), axis=0)
    assert steps.std() == pytest.approx(60.0 * np.sqrt(2e-3 / load_faults.GUST_S), rel=0.03)


def test_a_wheel_that_spins_resists_turning_and_takes_no_power(clean, random):
    wrench = added_wrench(clean, load_faults.rotor(clean, 50.0, random))
    turn = clean.motion.twist[:, 3:]
    assert wrench[:, :3] == pytest.approx(0.0, abs=1e-6)
    assert np.sum(wrench[:, 3:] * turn, axis=1) == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(wrench[:, 3:], axis=1) == pytest.approx(50.0 * np.hypot(turn[:, 0], turn[:, 1]), abs=1e-6)


def test_legs_that_give_are_longer_by_the_sensors_than_between_their_hinges(clean, random):
    # GIVEN springs of 1e7 N/m THEN 1 kN is 0.1 mm, and the velocities are those of the displacements
    after = machine_faults.elastic_legs(clean, 1e7, random)
    longer = after.log.displacement_m - clean.log.displacement_m
    assert longer == pytest.approx(clean.clean.force_n / 1e7, abs=1e-12)
    faster = after.log.velocity_m_s - clean.log.velocity_m_s
    assert np.sum(faster[1:-1] * 1e-3, axis=0) == pytest.approx(longer[-2] - longer[0], abs=2e-6)


def test_a_shaking_base_is_gravity_that_turns(clean, random):
    wrench = added_wrench(clean, load_faults.shaking_base(clean, 0.5, random))
    force = np.einsum("nji,nj->ni", clean.motion.to_platform, wrench[:, :3])
    assert force[:, 2] == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(force, axis=1).max() == pytest.approx(0.5 * clean.total_theta()[0, 0], rel=1e-3)


def to_base(clean, vectors):
    return np.einsum("nji,nj->ni", clean.motion.to_platform, vectors)


def test_a_pendulum_is_pulled_along_its_rod_and_keeps_its_energy(clean, random, monkeypatch):
    # GIVEN a fifth of the load on a rod without damping, and the force F on the platform that the fault adds to that
    # of the rigid part
    monkeypatch.setattr(load_faults, "PENDULUM_DAMPING", 0.0)
    mass, centre = 0.2 * clean.theta[0], clean.theta[1:4] / clean.theta[0]
    pivot = centre + [0.0, 0.0, load_faults.PENDULUM_M]
    g = clean.gravity_m_s2
    added = added_wrench(clean, load_faults.pendulum(clean, 0.2, random))
    rigid = mass * (clean.motion.to_platform @ g - recording.point_acceleration(clean.motion, centre))
    force = added[:, :3] + rigid
    # THEN F acts at the pivot
    assert added[:, 3:] + np.cross(np.broadcast_to(centre, rigid.shape), rigid) == pytest.approx(
        np.cross(np.broadcast_to(pivot, force.shape), force), abs=1e-6
    )
    # WHEN the mass goes where F and gravity take it, from rest under the pivot: a = g - F / m
    dt = recording.TICK_S
    twist = clean.motion.twist
    pivot_speed = to_base(clean, twist[:, :3] + np.cross(twist[:, 3:], pivot))
    acceleration = g - to_base(clean, force) / mass
    relative = acceleration - to_base(clean, recording.point_acceleration(clean.motion, pivot))
    rod_speed = np.cumsum(relative, axis=0) * dt  # half a tick ahead, as leap-frog has it
    rod = np.vstack(
        [
            [0.0, 0.0, -load_faults.PENDULUM_M],
            [0.0, 0.0, -load_faults.PENDULUM_M] + np.cumsum(rod_speed, axis=0)[:-1] * dt,
        ]
    )
    # THEN it keeps its distance from the pivot to 0.1 %, although it swings out by more than 3 degrees
    assert np.linalg.norm(rod, axis=1) == pytest.approx(load_faults.PENDULUM_M, rel=1e-3)
    assert np.abs(rod[:, :2]).max() > 0.05 * load_faults.PENDULUM_M
    # AND F is along the rod
    pull = to_base(clean, force)
    sine = np.linalg.norm(np.cross(pull, rod), axis=1) / np.linalg.norm(pull, axis=1) / load_faults.PENDULUM_M
    assert sine.max() < 2e-3
    # AND its energy is what the pivot gives: the work of -F, to 2 % of all that goes to and fro
    speed = pivot_speed + rod_speed - 0.5 * dt * relative
    height = np.cumsum(pivot_speed[:, 2]) * dt + rod[:, 2]
    energy = 0.5 * mass * np.sum(speed**2, axis=1) - mass * g[2] * height
    work = np.cumsum(-np.sum(pull * pivot_speed, axis=1)) * dt
    balance = energy - energy[0] - (work - work[0])
    assert np.abs(balance).max() < 0.02 * np.ptp(energy)


def test_springs_answer_as_oscillators_do():
    # GIVEN a spring-mass of 5 Hz, 5 % damping WHEN driven by 1 m/s^2 at 2 Hz
    t_s = np.arange(0.0, 20.0, recording.TICK_S)
    drive = np.sin(2.0 * np.pi * 2.0 * t_s)[:, None] * [1.0, 0.0, 0.0]
    moved, rate = load_faults.oscillation(drive, 5.0, 0.05)
    # THEN it ends with the amplitude of the formula, and its acceleration is the second derivative of its way
    w0, w = 2.0 * np.pi * 5.0, 2.0 * np.pi * 2.0
    amplitude = 1.0 / abs(w0**2 - w**2 + 2j * 0.05 * w0 * w)
    last = slice(-2000, None)
    assert np.abs(moved[last, 0]).max() == pytest.approx(amplitude, rel=1e-3)
    assert np.abs(rate[last, 0]).max() == pytest.approx(w**2 * amplitude, rel=1e-3)
    assert rate[100:-100] == pytest.approx(
        np.gradient(np.gradient(moved, recording.TICK_S, axis=0), recording.TICK_S, axis=0)[100:-100], abs=2e-3
    )
    # AND a constant drive, as of a tilted tank, holds it off by drive / w0^2 from the start
    moved, rate = load_faults.oscillation(np.ones((1000, 3)), 5.0, 0.05)
    assert moved == pytest.approx(1.0 / w0**2, rel=1e-6) and np.abs(rate).max() < 1e-9


def test_stiff_mounts_and_still_tanks_are_rigid(clean, random):
    # GIVEN a mount of 400 Hz, a hundred times the motion's 4 Hz THEN the load is rigid to (4 / 400)^2 of its force
    added = load_faults.soft_mount(clean, 400.0, random).clean.force_n - clean.clean.force_n
    assert rms(added) < 1e-3 * rms(clean.clean.force_n)
    assert rms(load_faults.soft_mount(clean, 4.0, random).clean.force_n - clean.clean.force_n) > 10.0
    # GIVEN a platform that stands THEN neither tank nor pendulum does anything
    still = replace(clean, motion=_still(clean))
    for fault in (load_faults.sloshing, load_faults.pendulum):
        assert rms(fault(still, 0.3, random).clean.force_n - still.clean.force_n) < 1e-6


def _still(clean):
    """The motion's first pose, held."""
    motion, rows = clean.motion, len(clean.t_s)
    level = np.broadcast_to(np.eye(3), (rows, 3, 3))
    rest = np.zeros((rows, 6))
    return replace(motion, to_platform=level, twist=rest, acceleration=rest)


def test_liquid_leans_on_the_wall(clean, random):
    # GIVEN a tank on a platform that is tilted and held THEN of the liquid's weight nothing is lost, and its place
    # moves by g sin(tilt) / w0^2 down the slope
    tilt, rows = 0.02, len(clean.t_s)
    slope = np.broadcast_to(
        [[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]], (rows, 3, 3)
    )
    held = replace(clean, motion=replace(_still(clean), to_platform=slope))
    wrench = added_wrench(held, load_faults.sloshing(held, 0.3, random))
    assert wrench[:, :3] == pytest.approx(0.0, abs=1e-6)
    moved_m = 9.81 * np.sin(tilt) / (2.0 * np.pi * load_faults.SLOSH_HZ) ** 2
    weight_n = 0.3 * clean.theta[0] * 9.81 * np.cos(tilt)
    assert np.abs(wrench[:, 3]) == pytest.approx(moved_m * weight_n, rel=1e-6)
    assert (np.sign(wrench[:, 3]) == np.sign(tilt)).all()  # down the slope of a positive roll is -y


@pytest.mark.parametrize("name", ["falling", "two_changes"])
def test_loads_that_change_take_the_forces_of_what_is_left(clean, random, name):
    # GIVEN a change WHEN the true load of each tick is asked THEN forces and load belong together
    after = KINDS[name].apply(clean, KINDS[name].sizes[-1], random)
    assert len(after.changes_s) == len(after.loads) - 1 > 0
    assert rms(after.clean.force_n - rigid_forces(after)) < DIFFERENCES_N
    assert rms(after.clean.force_n - rigid_forces(clean)) > 10.0
    # AND the noise is that of before
    assert recording.noise_of(after, "force") == pytest.approx(recording.noise_of(clean, "force"))


def test_a_load_that_slides_stands_elsewhere_at_the_end(clean, random):
    # GIVEN a load that slides by 10 cm WHEN its last parameters are seen from its old place's side THEN about its own centre of mass
    # they are those of before
    after = load_faults.sliding(clean, 0.1, random)
    back = load_faults._moved(after.theta, -0.1)
    assert back == pytest.approx(clean.theta) and after.theta[1] == pytest.approx(clean.theta[1] + 0.1 * clean.theta[0])
    # AND they are those of the particles that such a body is made of
    points, masses = random.normal(size=(8, 3)), random.uniform(1.0, 2.0, 8)

    def parameters(places):
        x, y, z = places.T
        moments = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
        return np.array([masses.sum(), *(masses @ places), *(masses @ np.array(moments).T)])

    assert load_faults._moved(parameters(points), 0.3) == pytest.approx(parameters(points + [0.3, 0.0, 0.0]))
    # AND the last forces are those of where it then stands: in the last 20 of 2,667 ticks it slides by 0.75 % of the way
    at_end = rigid_forces(replace(after, loads=(replace(after.loads[0], theta=after.theta),)))
    whole = np.abs(at_end - clean.clean.force_n)[-20:-10].max()
    assert np.abs(after.clean.force_n - at_end)[-20:-10].max() < 0.015 * whole + 3.0 * DIFFERENCES_N


def test_a_leaking_load_is_lighter_at_the_end(clean, random):
    # GIVEN a leak of 10 kg/s from the later of a third of the run and a second after its start
    after = load_faults.leaking(clean, 10.0, random)
    start_s = max(1.0, DURATION_S / 3.0)
    left = clean.theta[0] - 10.0 * (DURATION_S - start_s)
    assert after.theta == pytest.approx(left / clean.theta[0] * clean.theta)
    # THEN the last forces are those of what is left, and the change lasts to the end
    at_end = rigid_forces(replace(after, loads=(replace(after.loads[0], theta=after.theta),)))
    assert np.abs(after.clean.force_n - at_end)[-20:-10].max() < 2.0  # 0.2 kg leak in the 20 ticks
    assert after.changes_s == ((pytest.approx(start_s), pytest.approx(DURATION_S)),)


def test_changes_wait_for_the_load(tmp_path, random):
    # GIVEN a run in which the load is picked up THEN a part of it falls off at least a second later
    run = simulated(tmp_path, "multisine_pick_up")
    picked_s = run.loads[-1].at_s
    assert picked_s > 1.5
    after = load_faults.falling(run, 0.5, random)
    assert after.loads[-1].at_s >= picked_s + 1.0
    assert after.theta[0] == pytest.approx(0.5 * run.theta[0])


def test_stated_noise_is_noise_alone(clean):
    # GIVEN a platform that states its sensors' noise and its tick WHEN it states three times the noise
    before = clean.platform["sensors"]
    after = sensor_faults.stated_noise(clean, 3.0, np.random.default_rng(1)).platform["sensors"]
    # THEN its tick is what it was
    assert {key: after[key] / before[key] for key in before} == {
        key: pytest.approx(3.0 if "_sigma_" in key else 1.0) for key in before
    }
    assert "tick_s" in before
