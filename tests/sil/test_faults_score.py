"""The score of a run with a fault: each outcome shown, by a run of 10 s and two parameters."""

from dataclasses import replace

import numpy as np
import pytest

from hexload.campaign.statistics import ALARM_DUE_S
from hexload.faults import score
from hexload.faults.score import Reported, Truth, WrongParameter

T_S = np.arange(0.0, 10.0, 0.1)
NONE_SET = np.zeros(len(T_S), bool)
TRUTH = Truth(value=np.array([100.0, 10.0]), scale=np.array([100.0, 50.0]))
RIGHT = Reported(
    names=("m", "hx"),
    value=np.array([100.1, 10.0]),
    sigma=np.array([0.1, 0.05]),
    parameter_verdict=("converged", "converged"),
    t_s=T_S,
    verdict=len(T_S) * ["converged"],
    bits={"load changed": NONE_SET, "sample missing": NONE_SET, "inconsistent": NONE_SET},
    sample_t_s=T_S,
)
WRONG = replace(RIGHT, value=np.array([103.0, 10.0]))  # 30 sigmas and 3 % off


def with_bit(reported, name, *times_s):
    """The run in which a health bit is set at these times."""
    is_set = np.isclose(T_S[:, None], times_s).any(axis=1)
    assert is_set.sum() == len(times_s)
    return replace(reported, bits=reported.bits | {name: is_set})


def with_verdicts(reported, verdict, from_s, to_s):
    verdicts = [verdict if from_s <= t_s <= to_s else word for t_s, word in zip(T_S, reported.verdict)]
    return replace(reported, verdict=verdicts)


def outcome(reported, truth=TRUTH):
    return score.score(reported, truth).outcome


def test_numbers_within_their_sigmas_are_right():
    # GIVEN a mass one sigma off WHEN nothing but a missing sample is said THEN the run is right, with these words
    reported = with_bit(RIGHT, "sample missing", 2.0, 9.0)
    result = score.score(reported, TRUTH)
    assert (result.outcome, result.words, result.words_before) == ("right", ("sample missing",), ())
    assert result.wrong == () and result.largest_sigmas == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("mass", "sigma"),
    [
        (103.0, 0.7),  # 3 % off, but 4.3 sigmas: honestly open
        (101.9, 0.1),  # 19 sigmas, but 1.9 %: of no consequence
    ],
)
def test_both_limits_must_be_passed_to_be_wrong(mass, sigma):
    assert outcome(replace(RIGHT, value=np.array([mass, 10.0]), sigma=np.array([sigma, 0.05]))) == "right"


def test_the_share_is_that_of_the_scale_not_of_the_value():
    # GIVEN hx 8 % off, which is 1.6 % of its scale THEN it is not wrong; with 2.1 % of its scale it is
    assert outcome(replace(RIGHT, value=np.array([100.0, 10.8]))) == "right"
    assert outcome(replace(RIGHT, value=np.array([100.0, 11.05]))) == "silent"


def test_wrong_and_converged_without_a_word_is_silent():
    result = score.score(WRONG, TRUTH)
    assert result.outcome == "silent"
    (wrong,) = result.wrong
    assert wrong == WrongParameter("m", pytest.approx(30.0), pytest.approx(3.0), "converged")


def test_what_no_log_can_show_is_told_apart_only_when_the_twin_is_right():
    # GIVEN a trusted wrong mass in a log that is as well that of a load of 103 kg THEN it is no silent one
    twin = Truth(value=np.array([103.0, 10.0]), scale=TRUTH.scale)
    assert score.score(WRONG, TRUTH, twin).outcome == "indistinguishable"
    # AND where that load is not what is found either, it is; and what is right stays right
    assert score.score(replace(WRONG, value=np.array([106.0, 10.0])), TRUTH, twin).outcome == "silent"
    assert score.score(RIGHT, TRUTH, twin).outcome == "right"


def test_what_was_said_more_than_3_s_before_the_end_is_forgotten():
    # GIVEN a wrong mass WHEN a bit is set 3.1 s before the last sample THEN it is silent; 2.9 s before, weak
    end_s = T_S[-1]
    assert outcome(with_bit(WRONG, "sample missing", end_s - 3.1)) == "silent"
    assert outcome(with_bit(WRONG, "sample missing", end_s - 2.9)) == "weak"
    assert score.score(with_bit(WRONG, "load changed", 1.0), TRUTH).words_before == ("load changed",)


def test_refusals_in_the_last_3_s_are_a_word_too():
    reported = replace(WRONG, t_s=T_S[:-1], verdict=WRONG.verdict[:-1], bits=dict.fromkeys(WRONG.bits, NONE_SET[:-1]))
    result = score.score(reported, TRUTH)
    assert (result.outcome, result.words) == ("weak", ("samples refused",))


@pytest.mark.parametrize("verdict", ["converging", "not_excited", "inconsistent"])
def test_wrong_parameters_of_which_none_is_called_converged_are_said(verdict):
    reported = replace(with_verdicts(WRONG, verdict, 9.0, 10.0), parameter_verdict=(verdict, "converged"))
    result = score.score(reported, TRUTH)
    assert (result.outcome, result.words) == ("said", (verdict.replace("_", " "),))


def test_one_trusted_wrong_parameter_is_enough():
    # GIVEN two wrong parameters of which one is called inconsistent, with its bit THEN the other one makes it weak
    reported = replace(WRONG, value=np.array([103.0, 20.0]), parameter_verdict=("inconsistent", "converged"))
    assert outcome(with_bit(reported, "inconsistent", 9.5)) == "weak"


def test_no_number_is_wrong():
    assert outcome(replace(RIGHT, value=np.array([np.nan, 10.0]))) == "silent"


def test_more_than_half_of_the_samples_refused_is_a_refusal():
    # GIVEN a run of which 60 samples of 100 are refused, or all of the last 2 s of 3
    for kept in (T_S < 4.0, T_S < 8.0):
        bits = {name: is_set[kept] for name, is_set in WRONG.bits.items()}
        reported = replace(WRONG, t_s=T_S[kept], verdict=int(kept.sum()) * ["converged"], bits=bits)
        # THEN there is no answer, whatever the numbers are
        assert outcome(reported) == "refused"
    # AND a log that is refused as a whole has its reason for a word
    assert score.refusal("no such clock").outcome == "refused"
    assert score.refusal("no such clock").words == ("no such clock",)


def test_a_load_change_that_was_none_is_a_false_alarm():
    result = score.score(with_bit(RIGHT, "load changed", 1.0, 4.0), TRUTH)
    assert result.outcome == "false_alarm"
    assert result.false_changes_s == pytest.approx((1.0, 4.0))


def test_inconsistent_numbers_that_are_right_are_a_false_alarm_at_any_time():
    reported = with_verdicts(RIGHT, "inconsistent", 2.0, 2.3)
    result = score.score(reported, TRUTH)
    assert (result.outcome, result.is_called_inconsistent) == ("false_alarm", True)


def test_reports_of_a_true_change_are_no_false_alarm():
    # GIVEN a load that changes at 4 s WHEN change and inconsistency are reported until ALARM_DUE_S later THEN that is right
    truth = replace(TRUTH, changes_s=((4.0, 4.0),))
    assert pytest.approx(0.5) == ALARM_DUE_S
    reported = with_verdicts(with_bit(RIGHT, "load changed", 4.0), "inconsistent", 4.0, 4.4)
    assert outcome(reported, truth) == "right"
    # AND before the change, or later, it is a false alarm
    assert outcome(with_bit(RIGHT, "load changed", 3.9), truth) == "false_alarm"
    assert outcome(with_bit(RIGHT, "load changed", 4.6), truth) == "false_alarm"
    # AND a load that changes all the time may be reported all the time
    leaking = replace(TRUTH, changes_s=((3.0, 9.9),))
    assert outcome(with_bit(RIGHT, "load changed", 3.5, 7.0), leaking) == "right"


def test_scales_are_those_of_the_supervisor():
    # GIVEN an empty platform of 100 kg and 30 kg m^2 mean moment
    platform = np.array([100.0, 0.0, 0.0, 0.0, 25.0, 25.0, 40.0, 0.0, 0.0, 0.0])
    # WHEN the load is large THEN its own values count: |h| for h, the mean moment for products
    theta = np.array([500.0, 3.0, 4.0, 150.0, 90.0, 80.0, 70.0, 1.0, 2.0, 3.0])
    h = np.linalg.norm(theta[1:4])
    assert score.load_scale(theta, platform) == pytest.approx([500.0, h, h, h, 90.0, 80.0, 70.0, 80.0, 80.0, 80.0])
    # AND of no load those of the platform, for h a tenth of its mass times its radius of gyration
    least = 0.1 * np.sqrt(100.0 * 30.0)
    assert score.load_scale(np.zeros(10), platform) == pytest.approx([100.0, *(3 * [least]), *(6 * [30.0])])


def test_named_causes_are_words_of_the_time_at_which_they_stood():
    # GIVEN a cause that was named early, and another that stands at the end
    reported = replace(RIGHT, causes=((2.0, "leg 3: velocity stuck"), (9.9, "clock"), (9.95, "clock")))
    result = score.score(reported, TRUTH)
    # THEN each is reported once, in its place, and a cause alone does not make a run wrong
    assert (result.words, result.words_before) == (("clock",), ("leg 3: velocity stuck",))
    assert result.outcome == "right"
