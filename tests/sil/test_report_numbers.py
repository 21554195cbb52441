"""The numbers in the report, against values that follow from how the synthetic run is made."""

import numpy as np
import pytest

from hexload.diagnosis.finding import Finding
from hexload.estimation import load_summary
from hexload.io.run_directory import read_run
from hexload.report import claims, table3
from hexload.report.charts import LEG_COLOURS, decimate, decode, encode, unit_for
from hexload.report.figures import innovation, load_estimates
from hexload.theory import nis
from synthetic_run import TILT_RAD, write_run

TWO_PERIODS = 4001  # of (23), 2 s each, both ends included


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return read_run(write_run(tmp_path_factory.mktemp("runs") / "synthetic", rows=TWO_PERIODS))


def rms_of_sine(amplitude):
    """Over whole periods; the tolerance below covers the one sample more than that."""
    return amplitude / np.sqrt(2.0)


# One extra sample in 4001 and central differences at 1 ms (relative error (pi 1 ms)^2 / 6) stay below this.
RELATIVE = 5e-4


def test_tilt_and_angular_acceleration_are_those_of_the_motion(run):
    # GIVEN a harmonic tilt at 0.5 Hz about both axes and no commanded tilt
    # WHEN the excitation is computed
    excitation = claims.excitation(run)
    # THEN rms angle and acceleration are those of a sine
    assert excitation.reference_tilt_max_rad == 0.0
    assert excitation.tilt_rms_rad == pytest.approx([rms_of_sine(TILT_RAD)] * 2, rel=RELATIVE)
    acceleration = rms_of_sine(TILT_RAD * np.pi**2)
    assert excitation.angular_acceleration_rms_rad_s2 == pytest.approx([acceleration] * 2, rel=RELATIVE)
    assert excitation.load_inertia_moment_rms_n_m == pytest.approx([25.0 * acceleration] * 2, rel=RELATIVE)


def test_the_gravity_moment_is_1_57_times_the_inertial_moment_at_half_a_hertz(run):
    # GIVEN the paper's load, 500 kg at 0.3 m with 25 kg m^2, on the paper's platform
    # WHEN gravity and inertial moments are computed
    excitation = claims.excitation(run)
    # THEN their ratio is m g c / ((I_platform + I_load + m c^2) omega^2) = 1471.5 / (95 pi^2)
    expected = 500 * 9.81 * 0.3 / ((25 + 25 + 500 * 0.3**2) * np.pi**2)
    measured = np.divide(excitation.gravity_moment_rms_n_m, excitation.inertial_moment_rms_n_m)
    assert excitation.gravity_ratio_at_paper_frequency == pytest.approx(expected, rel=1e-12)
    # The yaw of 0.2 degrees turns the arm and the tensor by at most 3.5e-3 of their small cross components.
    assert measured == pytest.approx([expected] * 2, rel=5e-3)


def test_the_start_error_is_counted_in_the_filters_own_sigmas(run):
    # GIVEN a start at zero with sigma sqrt(500) + 0.5 (the synthetic run's), and the paper's printed variance of 10
    start = claims.start_error(run)
    # THEN the errors are 25 / sigma; the first estimate lies half a final sigma, 0.25, above zero
    assert start.this_run_sigmas == pytest.approx((25.0 - 0.25) / (np.sqrt(500.0) + 0.5), rel=1e-6)
    assert start.printed_prior_sigmas == pytest.approx(25.0 / np.sqrt(10.0))


def test_table_3_shows_truth_paper_and_the_last_estimate(run):
    # WHEN the run is compared with the paper
    rows = {row.name: row for row in table3.compare(run)}
    # THEN the row of Ixx has the paper's printed figures and the end of the run: half a sigma of 0.5 above 25
    assert rows["Ixx"].truth == 25.0
    assert rows["Ixx"].paper == (25.94, 3.76)
    assert rows["Ixx"].estimate == pytest.approx(25.25, rel=1e-6)
    assert rows["Ixx"].error_percent == pytest.approx(1.0, rel=1e-4)
    assert rows["Ixx"].error_sigmas == pytest.approx(0.5, rel=1e-4)


def test_convergence_is_the_time_after_which_the_estimate_stays_within_five_percent(run):
    # GIVEN dz(t) = 0.3 (1 - exp(-t / 0.2 s)) + 1.5e-5
    row = next(row for row in table3.compare(run) if row.name == "dz")
    # THEN it stays within 5 % from the first tick after t = 0.2 s ln(0.3 / (0.015 + 1.5e-5))
    assert row.converged_at_s == pytest.approx(0.2 * np.log(0.3 / (0.015 + 1.5e-5)), abs=1.001e-3)


def test_an_estimate_that_ends_outside_five_percent_never_converged(tmp_path):
    # GIVEN a run so short, 0.2 s, that dz has reached 63 % of the truth
    run = read_run(write_run(tmp_path / "short", rows=200))
    # WHEN compared THEN no time is given
    assert next(row for row in table3.compare(run) if row.name == "dz").converged_at_s is None


def test_another_load_is_not_compared_with_the_papers_figures(tmp_path):
    # GIVEN a run with a load of 400 kg
    load = {
        "at_s": 0.0,
        "mass_kg": 400.0,
        "com_m": [0, 0, 0.3],
        "inertia_com_kg_m2": [25.0, 25.0, 25.0, 0, 0, 0],
        "theta": [400.0, 0, 0, 120.0, 61.0, 61.0, 25.0, 0, 0, 0],
    }
    run = read_run(write_run(tmp_path / "other", rows=500, loads=[load]))
    # WHEN compared THEN the paper's column is empty
    assert not table3.has_paper_load(run)
    assert all(row.paper is None for row in table3.compare(run))


def test_without_sensor_noise_there_is_no_bound(tmp_path):
    # GIVEN a run whose sensors are perfect
    sensors = {"displacement_sigma_m": 0.0, "velocity_sigma_m_s": 0.0, "force_sigma_n": 0.0}
    run = read_run(write_run(tmp_path / "clean", rows=500, sensors=sensors))
    # WHEN compared THEN no bound is stated
    assert all(row.bound is None for row in table3.compare(run))


def test_true_parameters_step_where_the_load_changes(tmp_path):
    # GIVEN a load that changes at 0.1 s
    def load(at_s, dz):
        return {
            "at_s": at_s,
            "mass_kg": 500.0,
            "com_m": [0, 0, dz],
            "inertia_com_kg_m2": [25.0] * 3 + [0.0] * 3,
            "theta": [500.0, 0, 0, 500 * dz, 70.0, 70.0, 25.0, 0, 0, 0],
        }

    run = read_run(write_run(tmp_path / "change", rows=300, loads=[load(0.0, 0.3), load(0.1, 0.4)]))
    # WHEN the truth is asked for THEN the new load counts from its tick on
    np.testing.assert_array_equal(run.load_parameters(np.array([0.0, 0.099, 0.1, 0.2]))["dz"], [0.3, 0.3, 0.4, 0.4])


def test_nis_of_a_consistent_filter_lies_in_its_band_at_the_stated_rate():
    # GIVEN 20,000 draws from chi-square with 3 degrees of freedom, the NIS of a consistent filter
    draws = np.random.default_rng(5).chisquare(3, 20_000)
    # WHEN summarised
    summary = nis.summarise(np.arange(20_000) * 1e-3, draws, 3)
    # THEN mean and rates are the ideal ones within 4 sigma: sqrt(6 / n), and sqrt(0.95 0.05 / n) with n ticks, windows
    assert summary.mean == pytest.approx(3.0, abs=4 * np.sqrt(6 / 20_000))
    assert summary.ticks_in_band == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 20_000))
    assert summary.windows_in_band == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 200))


def test_nis_of_an_overconfident_filter_leaves_its_band():
    # GIVEN innovations twice as large as the filter believes: NIS four times as large
    draws = 4.0 * np.random.default_rng(6).chisquare(3, 20_000)
    # WHEN summarised THEN no window of 100 ticks is left inside
    assert nis.summarise(np.arange(20_000) * 1e-3, draws, 3).windows_in_band == 0.0


def test_decimation_keeps_a_spike_of_one_tick_and_the_order_of_time():
    # GIVEN 100,000 samples of a slow wave with one spike up and one down
    t = np.arange(100_000) * 1e-3
    y = np.sin(t)
    y[12_345], y[67_890] = 9.0, -9.0
    # WHEN decimated to 700 stretches
    t_kept, y_kept = decimate(t, y, 2 * 700)
    # THEN both spikes, the ends and the order are there, in at most two points a stretch and the two ends
    assert len(t_kept) <= 2 * 700 + 2
    assert (y_kept.max(), y_kept.min()) == (9.0, -9.0)
    assert (t_kept[0], t_kept[-1]) == (t[0], t[-1])
    assert np.all(np.diff(t_kept) > 0)


@pytest.mark.parametrize("truth", [0.0, -20.0, 500.0])
def test_an_axis_shows_the_truth_and_the_band_of_the_settled_ticks_and_no_more(truth):
    # GIVEN estimates that begin far off, at each of two loads, and settle beside the truth with a band of +- 3
    ticks = np.arange(2000)
    known = np.where(ticks < 1000, truth, truth + 5.0)[:, None] * np.ones(10)
    value = known + np.where(ticks % 1000 < 40, 500.0, 1.0)[:, None]
    # WHEN they are drawn, with the truth and without it
    for shown in (known, None):
        chart = load_estimates(ticks * 1e-3, value, np.ones((2000, 10)), shown, [1.0])
        whole, last = (panel for panel in chart.panels if panel.title.startswith("m"))
        # THEN the axis holds both bands, from truth - 2 to truth + 9, and a quarter of them beside at most
        low, high = whole.y_range
        assert truth - 2.0 - 0.25 * 11.0 < low < truth - 2.0 and truth + 9.0 < high < truth + 9.0 + 0.25 * 11.0
        # and another one the last load's band alone, from truth + 3 to truth + 9
        low, high = last.y_range
        assert last.title == "m since 1.000 s, kg"
        assert truth + 3.0 - 0.25 * 6.0 < low < truth + 3.0 and truth + 9.0 < high < truth + 9.0 + 0.25 * 6.0


def test_an_axis_has_one_unit_in_plain_numbers():
    # GIVEN a height that is known to some hundredths of a millimetre WHEN its axis asks for a unit THEN it is that of its
    # largest number, which then needs no power of ten
    assert unit_for("m", 2e-4) == (1e6, "µm")
    assert unit_for("m", 0.3) == (1e3, "mm")
    assert unit_for("m", 2.0) == (1.0, "m")
    assert unit_for("kg m²", 25.0) == (1.0, "kg m²")
    assert unit_for("kg m²", 2e-3) == (1e3, "g m²")


def test_points_of_a_curve_are_told_to_a_thousandth_of_a_pixel_and_gaps_stay():
    # GIVEN numbers with a gap WHEN they are coded as the page has them, and read as its script does
    values = np.append(np.random.default_rng(1).uniform(-3.0, 5.0, 1000), np.nan)
    back = decode(encode(values, (-3.0, 5.0)), (-3.0, 5.0))
    # THEN they are the same to half a step of 65,534 over their range, where a panel has some hundred pixels
    np.testing.assert_allclose(back, values, atol=0.5 * 8.0 / 65534 * 1.001)
    # and what is beyond the range is at its end
    assert decode(encode(np.array([9.0]), (-3.0, 5.0)), (-3.0, 5.0)) == 5.0


# What eyes without one kind of cone see of linear RGB (Vienot, Brettel, Mollon 1999, Color Research and Application 24).
SEEN = {
    "without red": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "without green": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}


def lab(colour, seen):
    """CIE L*a*b* (D65) of #rrggbb as such eyes see it."""
    srgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ np.clip(np.array(seen) @ linear, 0.0, 1.0) / (to_xyz @ np.ones(3))
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("eyes", SEEN)
def test_eyes_without_red_or_green_tell_the_legs_apart(eyes):
    # GIVEN the legs' six colours as these eyes see them WHEN compared pair by pair
    seen = [lab(colour, SEEN[eyes]) for colour in LEG_COLOURS]
    nearest = min(np.linalg.norm(a - b) for k, a in enumerate(seen) for b in seen[:k])
    # THEN each two differ by several times the 2.3 of L*a*b* that can just be told apart (Mahy et al. 1994)
    assert nearest > 4 * 2.3


def test_a_start_that_is_far_off_does_not_hide_the_rest_of_the_nis():
    # GIVEN a NIS that is 10,000 in the first hundredth and 6 in what follows WHEN drawn
    values = np.where(np.arange(10_000) < 100, 1e4, 6.0)
    t = np.arange(10_000) * 1e-3
    tick, window = innovation(t, values, nis.summarise(t, values, nis.LOAD_MEASUREMENTS)).panels
    # THEN both axes show the band and little more
    assert 6.0 < window.y_range[1] < tick.y_range[1] < 30.0


@pytest.mark.parametrize(
    "sigma, digits", [(119.2, 0), (39.7, 0), (9.9, 1), (0.98, 2), (0.0124, 3), (1e-9, 4), (0.0, 4), (np.nan, 4), (np.inf, 4), (None, 4)]
)  # fmt: skip
def test_a_number_has_the_digits_that_its_sigma_knows(sigma, digits):
    # GIVEN a sigma WHEN digits after the point are asked for, four at most THEN they show two digits of it
    assert load_summary.digits_of(sigma, 4) == digits


def test_what_is_said_of_many_parameters_is_said_once():
    said = [("m", "misfit: so"), ("hx", "not excited"), ("hz", "misfit: so")]
    assert load_summary.each_once(said, 10) == [("m, hz", "misfit: so"), ("hx", "not excited")]
    assert load_summary.each_once(said[::2], 2) == [("all", "misfit: so")]


def test_the_nis_of_a_misfit_leaves_its_band_in_sight():
    # GIVEN a NIS that is 3000 throughout, whose linear axis would draw the band less than a pixel high
    values, t = np.full(10_000, 3e3), np.arange(10_000) * 1e-3
    tick, window = innovation(t, values, nis.summarise(t, values, nis.LOAD_MEASUREMENTS)).panels
    # WHEN drawn THEN the axis is logarithmic, from below the band's mean to above the values
    for panel in (tick, window):
        assert panel.y_log and 0.0 < panel.y_range[0] < nis.LOAD_MEASUREMENTS < 3e3 < panel.y_range[1]


def test_moments_and_health_bits_are_told_in_words():
    assert load_summary.moments_in_words([6.1]) == "at 6.100 s"
    assert load_summary.moments_in_words([6.1, 8.0]) == "at 6.100 s, 8.000 s"
    assert load_summary.moments_in_words(np.arange(48.0)) == "48 times, first at 0.000 s, last at 47.000 s"
    assert load_summary.health_in_words({"late": 0, "not excited": 120, "load changed": 1}) == (
        "not excited in 120 ticks, load changed in 1 tick"
    )
    assert load_summary.health_in_words({"late": 0}) == ""


def test_another_load_where_something_pushes_is_told_as_the_push():
    # GIVEN a push from 7.06 to 7.56 s, and another cause WHEN other loads are detected before, in and after it
    push = Finding("push", "something pushes", "look for what touches it", size=7.06, until_s=7.56)
    friction = Finding("dry friction", "it rubs", "commission it", size=7.0)
    words = list(load_summary.pushes_in_words([6.5, 7.002, 7.7], (friction, push)))
    # THEN the one in it, or as much before as the diagnosis may find it late, is told as a push
    assert words == ["at 7.002 s rather that push: along the weight it is a load as long as it lasts"]


def test_what_a_load_too_new_to_be_known_leaves_is_no_misfit_of_the_machine():
    # GIVEN 3 s at 1 ms in which another load is told at 1 s, and a misfit from there on
    result = {"t": 1e-3 * np.arange(3000), "health_counts": {"load changed": 1, "model misfit": 70}}
    changed, is_misfit = np.arange(3000) == 1000, np.arange(3000) >= 1000
    for misfit_ends, ticks in ((1070, 0), (2000, 2000 - 1251)):
        # WHEN it is over after 70 ms THEN it is none of the machine, and of one that lasts for a second all but its first quarter
        result["health"] = changed + 2 * (is_misfit & (np.arange(3000) < misfit_ends))
        assert load_summary.misfit_ticks(result) == ticks


def test_a_machine_that_does_not_fit_is_to_be_commissioned():
    # GIVEN ticks with and without the misfit WHEN the last verdict is looked at THEN the mend is named where there is one
    assert "hexload commission" in load_summary.mend_in_words(3, "inconsistent")
    assert load_summary.mend_in_words(3, "converged") == ""
    assert load_summary.mend_in_words(0, "inconsistent") == ""
