"""What a campaign makes of its cases, against examples worked out by hand."""

import numpy as np
import pytest

from hexload.campaign import statistics
from hexload.campaign.one_case import scale_of, settled_at
from hexload.theory.bound import THETA_NAMES

THETA = [500.0, 30.0, -40.0, 150.0, 70.0, 80.0, 30.0, 1.0, -2.0, 0.5]
EMPTY = [0.0] * 10


def result(error, nees=10.0, theta=THETA, changes_s=(), alarms_s=(), within_5=1.0, effects=None, rig=None):
    score = {"error": error, "nees": nees, "nis": 6.0, "within_5": within_5, "within_1": None}
    return {
        "theta": theta,
        "bound": [2.0] * 10,
        "controller": "momentum",
        "effects": effects,
        "rig": rig,
        "estimators": {"momentum": score},
        "changes_s": list(changes_s),
        "alarms_s": list(alarms_s),
        "verdict": "converged",
        "health": {"inconsistent": 3} if nees is not None and nees > 50.0 else {},
    }


def momentum(*results):
    return statistics.summarise("multisine", results).estimators["momentum"]


def test_the_scale_of_each_parameter_is_the_one_agreed():
    # GIVEN hx = 30, hy = -40, so |h| = sqrt(900 + 1600 + 22500), and a mean moment of 60 WHEN asked
    # THEN m, hz and the moments have their own magnitude, hx and hy that of h, the products the mean moment
    h = np.sqrt(25000.0)
    assert scale_of(np.array(THETA)) == pytest.approx([500.0, h, h, 150.0, 70.0, 80.0, 30.0, 60.0, 60.0, 60.0])
    assert scale_of(np.array(EMPTY)) is None


def test_an_estimate_has_settled_when_it_leaves_the_limit_no_more():
    # GIVEN a deviation that is inside at 1 s, outside at 2 s, and inside from 3 s on
    t = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    deviation = np.array([9.0, 0.1, 0.6, 0.5, 0.2])
    # WHEN asked THEN it is 3 s; a limit kept from the start gives the start, one never kept nothing, and nan is outside
    assert settled_at(t, deviation, 0.5) == 3.0
    assert settled_at(t, deviation, 10.0) == 0.0
    assert settled_at(t, deviation, 0.1) is None
    assert settled_at(t, np.array([0.0, 0.0, 0.0, 0.0, np.nan]), 1.0) is None


def test_runs_that_were_called_inconsistent_or_implausible_are_counted_once():
    # GIVEN four runs, of which one was called inconsistent for three ticks, and another's input implausible WHEN summarised
    # THEN two are counted
    implausible = result([0.0] * 10) | {"health": {"input implausible": 5120}}
    runs = [result([0.0] * 10), result([0.0] * 10, nees=60.0), implausible, result([0.0] * 10)]
    assert statistics.summarise("multisine", runs).doubted == 2


def test_rmse_bias_and_their_relation_to_the_bound():
    # GIVEN two runs with errors of 3 and -1 in every parameter, and a bound of 2
    one = momentum(result([3.0] * 10), result([-1.0] * 10))
    # WHEN summarised THEN RMSE = sqrt((9 + 1) / 2), bias = 1 with a standard error of sqrt(8) / sqrt(2) = 2
    assert one.rmse == pytest.approx(np.full(10, np.sqrt(5.0)))
    assert one.bias == pytest.approx(np.ones(10))
    assert one.bias_sigmas == pytest.approx(np.full(10, 0.5))
    assert one.ratio == pytest.approx(np.full(10, np.sqrt(5.0) / 2.0))
    assert one.rmse_percent[0] == pytest.approx(100.0 * np.sqrt(5.0) / 500.0)
    # and the largest error of m is 3 of 500 kg
    assert one.largest_percent[0] == pytest.approx(0.6)


def test_the_machines_effects_are_judged_by_kind_over_runs_and_legs():
    # GIVEN two runs whose biases are off by 3 and -1 N, Coulomb frictions by 2 N, viscous ones by 0, and a bound of 2
    runs = [
        result([0.0] * 10, effects={"error": 6 * [off] + 6 * [2.0] + 6 * [0.0], "bound": 18 * [2.0], "nees": nees})
        for off, nees in ((3.0, 20.0), (-1.0, 40.0))
    ]
    # WHEN summarised THEN RMSE = sqrt((9 + 1) / 2) of the biases, half of it in bounds, and NEES 30 of an ideal 28
    effects = statistics.summarise("multisine_actuator_effects", runs).effects
    assert effects.rmse == pytest.approx({"bias": np.sqrt(5.0), "coulomb": 2.0, "viscous": 0.0})
    assert effects.ratio == pytest.approx({"bias": np.sqrt(5.0) / 2.0, "coulomb": 1.0, "viscous": 0.0})
    assert (effects.nees_mean, effects.nees_ideal) == (30.0, 28)
    # and a class without them has none
    assert statistics.summarise("multisine", [result([0.0] * 10)]).effects is None


def test_rigs_are_judged_by_published_sigmas_over_runs_and_parameters():
    # GIVEN two rigs whose mass is off by 0.1 and 0.3 %, the second with one of its parameters 3.5 sigmas off
    runs = [
        result(
            [0.0] * 10, nees=None, rig={"mass_percent": off, "centre_mm": 1.0, "inertia_percent": 2.0, "sigmas": sigmas}
        )
        for off, sigmas in ((0.1, 10 * [1.0]), (0.3, 9 * [2.0] + [3.5]))
    ]
    # WHEN summarised THEN the median is 0.2 %, 95 % of the way to the larger one is p95, and 19 of 20 are within 3 sigmas
    summary = statistics.summarise("rig_work", runs)
    assert summary.rig.mass_percent == pytest.approx((0.2, 0.29))
    assert (summary.rig.within_3_sigmas, summary.rig.largest_sigmas) == (0.95, 3.5)
    # AND the filter's own covariance says nothing of them
    assert summary.own.nees_mean is None
    # AND a class of machines that are their models has none
    assert statistics.summarise("work", [result([0.0] * 10)]).rig is None


def test_the_worst_parameter_is_named():
    # GIVEN one run whose Iyy is off by 3 bounds, all others by 1 WHEN summarised THEN mean 1.2, worst 3, Iyy
    error = np.full(10, 2.0)
    error[THETA_NAMES.index("Iyy")] = 6.0
    one = momentum(result(error.tolist()))
    assert (one.ratio_mean, one.ratio_worst, one.worst_name) == (pytest.approx(1.2), pytest.approx(3.0), "Iyy")


def test_nees_is_judged_by_the_band_of_chi_square_with_ten_degrees_of_freedom():
    # GIVEN NEES just inside and outside of 3.247 and 20.483, the 2.5 % and 97.5 % points in any table, and a failure
    values = [3.24, 3.25, 20.48, 20.49, 101.0]
    # WHEN summarised THEN two of five are in the band and one has failed
    one = momentum(*(result([0.0] * 10, nees) for nees in values))
    assert one.nees_in_band == pytest.approx(0.4)
    assert one.failures == 1
    assert one.nees_mean == pytest.approx(np.mean(values))
    assert statistics.nees_mean_band(1) == pytest.approx((3.247, 20.483), abs=1e-3)


def test_nees_that_no_covariance_gives_is_a_failure():
    # GIVEN a NEES that is no number, and one below 0, of a matrix that rounding has made indefinite
    # WHEN counted THEN both have failed
    assert momentum(result([0.0] * 10, float("nan"))).failures == 1
    assert momentum(result([0.0] * 10, -109.0)).failures == 1


def test_the_bands_of_many_runs_close_in_on_the_ideal():
    # GIVEN 10 runs WHEN asked THEN the mean NEES lies in chi-square(100) / 10, from tables 74.22 and 129.56, and
    # RMSE / bound in sqrt(chi-square(10) / 10)
    assert statistics.nees_mean_band(10) == pytest.approx((7.422, 12.956), abs=1e-3)
    assert statistics.ratio_band(10) == pytest.approx((np.sqrt(0.3247), np.sqrt(2.0483)), abs=1e-4)


def test_quantiles_of_times_count_a_run_that_never_settles_as_later_than_all():
    # GIVEN 20 runs that settle after 1, 2 ... 20 s WHEN summarised THEN half have by 10 s, 95 % by 19 s
    times = [float(t) for t in range(1, 21)]
    assert statistics.settling(times) == statistics.Times(10.0, 19.0, 0)
    # and GIVEN three runs THEN half of them, rounded up, is two
    assert statistics.settling([3.0, 1.0, 2.0]) == statistics.Times(2.0, 3.0, 0)
    # and GIVEN two that never do THEN no time has 95 % of them
    assert statistics.settling([None, *times[:18], None]) == statistics.Times(10.0, float("inf"), 2)


def test_alarms_are_detected_missed_or_false():
    # GIVEN a change detected after 3 ms and a second time, one detected before it came, one detected 0.6 s after, and a false alarm
    runs = [([4.0], [4.003, 4.2]), ([4.0], [3.999]), ([4.0], [4.6]), ([], [1.0]), ([], [])]
    # WHEN counted THEN one of three is detected, by 3 ms; the rest of the alarms, in four runs, are false
    found = statistics.alarms(runs)
    assert found.delays_s == pytest.approx([0.003])
    assert (found.changes, found.missed, found.false, found.runs_with_false) == (3, 2, 4, 4)


def test_a_case_without_numbers_is_a_failure_and_in_no_figure():
    # GIVEN a run with errors of 3, and a case whose tare was refused
    refused = {"case": {"class_name": "multisine_leg_mass", "seed": 7, "duration_s": 10.0}, "failure": "no motion"}
    # WHEN summarised THEN the figures are the run's, and the case is told with its reason
    entry = statistics.summarise("multisine_leg_mass", [refused, result([3.0] * 10)])
    assert (entry.runs, entry.own.rmse[0]) == (1, 3.0)
    assert entry.failed == (statistics.FailedCase("multisine_leg_mass-7", "no motion"),)


def test_an_empty_platform_has_errors_but_no_percentages():
    one = momentum(result([1.0] * 10, theta=EMPTY))
    assert one.rmse_percent is None
    assert one.ratio == pytest.approx(np.full(10, 0.5))
