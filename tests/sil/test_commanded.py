"""What no log can tell, and what the commanded motion can: legs that are counted from another one, or the other way round."""

from dataclasses import replace
from pathlib import Path

import hexload_native
import numpy as np
import pytest

from hexload.errors import InputError
from hexload.estimation.commanded import COLUMNS, follow
from hexload.io.log_file import LegLog
from hexload.theory import bound

PLATFORM = Path(__file__).parents[1] / "data" / "unknown_load.toml"
TICK_S, LAG_S, BEFORE_S = 1e-3, 0.04, 1.5


def motion(axes, seconds=8.0):
    """(n, 7): sines of six frequencies in these axes, that begin and end at home."""
    t_s = np.arange(0.0, seconds, 0.002)
    rows = np.zeros((len(t_s), 7))
    rows[:, 0] = t_s
    for axis in axes:
        size = 0.03 if axis < 3 else 0.05
        rows[:, 1 + axis] = size * np.sin(np.pi * t_s / seconds) * np.sin(2.0 * np.pi * (0.4 + 0.13 * axis) * t_s)
    return rows


def written(rows, folder):
    path = folder / "motion.csv"
    np.savetxt(path, rows, "%.9g", ",", header=",".join(COLUMNS), comments="")
    return path


def driven(rows, seed=1):
    """What a servo shows that begins later, follows late and loses a tenth; with the sensors' noise."""
    machine = bound.read_platform(PLATFORM)
    platform = hexload_native.load_platform(PLATFORM)
    t_s = np.arange(0.0, rows[-1, 0] + BEFORE_S + 1.0, TICK_S)
    poses = np.stack([np.interp(t_s - BEFORE_S - LAG_S, rows[:, 0], column) for column in rows[:, 1:].T], axis=1)
    arms = np.einsum("nij,lj->nli", bound.rotation_from_rpy(poses[:, 3:]), machine.platform_hinges_m)
    legs = poses[:, None, :3] + [0.0, 0.0, machine.home_height_m] + arms - machine.base_hinges_m
    moved = 0.9 * (np.linalg.norm(legs, axis=2) - np.asarray(platform.home_leg_length_m))
    shown = moved + 20e-6 * np.random.default_rng(seed).normal(size=moved.shape)
    return LegLog(t_s, shown, np.zeros_like(shown), np.zeros_like(shown)), platform


def with_order(log, order):
    return replace(log, displacement_m=log.displacement_m[:, list(order)])


def test_a_log_that_follows_its_command_is_as_commanded(tmp_path):
    # GIVEN a motion of all axes and a servo that is late and small WHEN they are compared
    log, platform = driven(motion(range(6)))
    followed = follow(log, platform, written(motion(range(6)), tmp_path))
    # THEN each leg is its own, and the motion's start with the lag is found within a step
    assert followed.is_as_commanded and followed.contradiction == ""
    assert followed.start_s == pytest.approx(BEFORE_S + LAG_S, abs=0.02)


@pytest.mark.parametrize("order", [(2, 3, 4, 5, 0, 1), (5, 4, 3, 2, 1, 0), (1, 2, 3, 4, 5, 0), (3, 1, 2, 0, 4, 5)])
def test_legs_in_another_order_are_told_with_the_order(order, tmp_path):
    # GIVEN legs counted from another one, the other way round, or two exchanged WHEN they are compared
    log, platform = driven(motion(range(6)))
    followed = follow(with_order(log, order), platform, written(motion(range(6)), tmp_path))
    # THEN the order is told
    assert followed.order == order and set(followed.signs) == {1}
    assert f"follow the commands of legs {', '.join(str(leg + 1) for leg in order)}" in followed.contradiction


def test_a_leg_that_moves_against_its_command_is_told(tmp_path):
    # GIVEN leg 3 with the wrong sign WHEN they are compared THEN it is named
    log, platform = driven(motion(range(6)))
    log.displacement_m[:, 2] *= -1.0
    assert follow(log, platform, written(motion(range(6)), tmp_path)).contradiction.startswith("leg 3 moved against")


def test_a_motion_that_moves_all_legs_alike_tells_nothing(tmp_path):
    # GIVEN heave alone, or a log of another motion WHEN legs are looked for
    log, platform = driven(motion([2]))
    alike = follow(with_order(log, (2, 3, 4, 5, 0, 1)), platform, written(motion([2]), tmp_path))
    other = follow(log, platform, written(motion([0, 3]), tmp_path))
    # THEN nothing is guessed, and what helps is said
    assert alike.contradiction == "" and "raise one leg alone" in alike.words
    assert other.contradiction == "" and "does not show the commanded motion" in other.words


def test_a_file_that_is_no_motion_is_refused(tmp_path):
    # GIVEN another file WHEN it is read THEN it is refused with its name
    log, platform = driven(motion([2]))
    (tmp_path / "motion.csv").write_text("t,dl1\n0,0\n")
    with pytest.raises(InputError, match="motion.csv"):
        follow(log, platform, tmp_path / "motion.csv")
