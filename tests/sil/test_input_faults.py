"""Channels that contradict each other, on the logs of an independent plant: found, named, and said by every reader."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import hexload_native
import numpy as np
import pytest

import hexload
from hexload.diagnosis import wiring
from hexload.diagnosis.machine import machine_of
from hexload.io.log_file import LegLog, read_log

DATA = Path(__file__).parents[1] / "data"
PLATFORM = {"multisine_eccentric": "unknown_load", "work_motion": "unknown_load", "paper_noisy": "paper_load"}
CLEAN = [("multisine_eccentric", "momentum"), ("work_motion", "momentum_effects"), ("load_pickup", "momentum")]
CLEAN += [("paper_noisy", "paper"), ("paper_clean", "paper"), ("paper_clean", "momentum")]

Legs = tuple[np.ndarray, np.ndarray, np.ndarray]


def recorded(name: str, rows: int | None = None) -> LegLog:
    log = read_log(DATA / f"{name}.csv.gz")
    return LegLog(*(part[:rows] for part in (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)))


def replay(name: str, kind: str, log: LegLog) -> dict:
    platform = hexload_native.load_platform(DATA / f"{PLATFORM.get(name, 'unknown_load')}.toml")
    if kind == "paper":
        platform = hexload_native.load_platform(DATA / "paper_load.toml")
    legs = (log.displacement_m, log.velocity_m_s, log.force_n)
    return hexload_native.replay(platform, kind, None, log.t_s, *map(np.ascontiguousarray, legs), os.devnull)


def of_leg(leg: int, channel: int, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Legs], Legs]:
    """A change of one channel (0 displacement, 1 velocity, 2 force) of one leg, numbered from 1."""

    def changed(legs: Legs) -> Legs:
        parts = [part.copy() for part in legs]
        parts[channel][:, leg - 1] = change(parts[channel][:, leg - 1])
        return tuple(parts)

    return changed


def with_swapped(channel: int, one: int, other: int) -> Callable[[Legs], Legs]:
    def changed(legs: Legs) -> Legs:
        parts = [part.copy() for part in legs]
        parts[channel][:, [one - 1, other - 1]] = parts[channel][:, [other - 1, one - 1]]
        return tuple(parts)

    return changed


def late(ticks: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda part: np.concatenate([np.repeat(part[:1], ticks, axis=0), part[:-ticks]])


# What is done to the log, and how the firmware's sentence begins.
FAULTS = {
    "velocity negated": (of_leg(3, 1, np.negative), "leg 3: velocity has the opposite sign"),
    "displacement negated": (of_leg(3, 0, np.negative), "leg 3: velocity has the opposite sign"),
    "velocity 4 % large": (of_leg(2, 1, lambda v: 1.04 * v), "leg 2: velocity is the displacement's derivative times"),
    "velocity in km/s": (of_leg(4, 1, lambda v: 1e-3 * v), "leg 4: velocity hardly changes"),
    "velocity late": (of_leg(6, 1, late(4)), "leg 6: velocity and displacement are not of the same instant"),
    "velocity stuck": (of_leg(1, 1, lambda v: 0 * v), "leg 1: velocity hardly changes"),
    "displacement stuck": (of_leg(1, 0, lambda d: 0 * d), "leg 1: displacement hardly changes"),
    "velocities swapped": (with_swapped(1, 2, 5), ("leg 2: velocity is that of another", "leg 5: velocity is that of")),
    "clock 5 % slow": (lambda legs: (legs[0], 1.05 * legs[1], legs[2]), "all velocities are the displacements'"),
    "rows doubled": (lambda legs: tuple(np.repeat(p[::2], 2, axis=0)[: len(p)] for p in legs), "samples repeat"),
    "force stuck": (of_leg(1, 2, lambda f: 0 * f + f[0]), "leg 1: force stands still"),
    "forces negated": (lambda legs: (*legs[:2], -legs[2]), "the legs pull the platform down"),
    "forces in kN": (lambda legs: (*legs[:2], 1e-3 * legs[2]), "the legs carry less than the empty platform"),
}


@pytest.mark.parametrize(("name", "kind"), [("multisine_eccentric", "momentum"), ("paper_noisy", "paper")])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named_within_six_seconds_and_never_converged(fault, name, kind):
    # GIVEN a log in brisk motion with a fault WHEN 6 s of it are replayed
    change, words = FAULTS[fault]
    log = recorded(name, 6000)
    result = replay(name, kind, LegLog(log.t_s, *change((log.displacement_m, log.velocity_m_s, log.force_n))))
    # THEN its cause is the last that was found, and no row from then on is converged
    print(fault, name, result["input_faults"])
    assert result["input_fault"].startswith(words)
    assert result["input_faults"][-1][1] == result["input_fault"]
    since_s = result["input_faults"][0][0]
    verdicts = {verdict for t_s, verdict in zip(result["t"], result["verdict"]) if t_s >= since_s}
    assert verdicts <= {"misfit", "inconsistent"}


@pytest.mark.parametrize(("name", "kind"), CLEAN)
def test_a_clean_log_has_none(name, kind):
    # GIVEN the log of sound sensors WHEN it is replayed THEN no window of it contradicts itself
    result = replay(name, kind, recorded(name))
    assert result["input_faults"] == []
    assert result["health_counts"]["input implausible"] == 0


@pytest.mark.parametrize("change", [of_leg(2, 2, lambda f: 1.02 * f), lambda legs: (*legs[:2], late(2)(legs[2]))])
def test_a_machine_that_begins_to_move_with_a_mismatch_is_unfit_and_no_other_load(change):
    # GIVEN a force that is 2 % large, or all of them 2 ms late WHEN the machine begins to move
    log = recorded("multisine_eccentric", 4000)
    result = replay(
        "multisine_eccentric", "momentum", LegLog(log.t_s, *change((log.displacement_m, log.velocity_m_s, log.force_n)))
    )
    # THEN the innovations grow with the motion, which no change of the load does: none is reported, nothing is converged
    assert result["health_counts"]["load changed"] == 0
    assert result["verdict"][-1] == "misfit"


@pytest.mark.parametrize("order", [(4, 5, 0, 1, 2, 3), (2, 3, 4, 5, 0, 1), (5, 4, 3, 2, 1, 0)])
def test_legs_renumbered_or_mirrored_on_a_symmetric_machine_are_another_load_to_the_last_digit(order):
    # GIVEN all channels of legs 1, 2 at legs 3, 4 and so on, or counted the other way round
    log, platform = recorded("multisine_eccentric", 4000), hexload_native.load_platform(DATA / "unknown_load.toml")
    machine = machine_of(platform)
    assert order in wiring.indistinguishable(machine.geometry)
    counted = [part[:, list(order)] for part in (log.displacement_m, log.velocity_m_s, log.force_n)]
    # WHEN both logs are replayed
    own, other = (
        replay("multisine_eccentric", "momentum", LegLog(log.t_s, *parts))
        for parts in ((log.displacement_m, log.velocity_m_s, log.force_n), counted)
    )
    # THEN the innovations are the same within rounding, and the load is turned or mirrored with the machine: no residual
    # of any kind can tell, as each is a function of these
    turn = wiring.turned(machine.geometry, order)
    expected = wiring.turned_body(turn, own["value"][-1] + machine.own_theta) - machine.own_theta
    assert (np.abs(other["value"][-1] - expected) < 0.05 * other["own_sigma"][-1]).all()
    assert np.median(np.abs(other["nis"] - own["nis"])) < 0.01
    assert other["input_faults"] == [] and other["verdict"][-1] == own["verdict"][-1]


def test_the_terminal_ends_with_the_mend_and_status_3(tmp_path):
    # GIVEN a log with one velocity 4 ms late WHEN it is replayed on the terminal
    log = recorded("multisine_eccentric", 6000)
    legs = of_leg(6, 1, late(4))((log.displacement_m, log.velocity_m_s, log.force_n))
    columns = ",".join(["t", *(f"{name}{leg}" for name in ("dl", "vl", "f") for leg in range(1, 7))])
    path = tmp_path / "late.csv"
    np.savetxt(path, np.column_stack([log.t_s, *legs]), "%.9g", ",", header=columns, comments="")
    platform = DATA / "unknown_load.toml"
    command = [sys.executable, "-m", "hexload_dev", "replay", path, "--platform", platform, "--out", tmp_path / "e.csv"]
    done = subprocess.run([*map(str, command), "--report", str(tmp_path / "page.html")], capture_output=True, text=True)
    # THEN the status says that the estimates are not to be believed, and the last line what to do
    assert done.returncode == 3, done.stderr
    last = done.stdout.splitlines()[-1]
    assert last.startswith("mend:      leg 6: velocity is 4 ms late; look at filters")
    # AND the estimates are there, and the page says so too
    assert (tmp_path / "e.csv").stat().st_size > 0
    assert "leg 6: velocity is 4 ms late; look at filters" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_python_says_it_sample_by_sample():
    # GIVEN an estimator in Python WHEN a leg's velocity is negated THEN the estimate says so, in words
    log = recorded("multisine_eccentric", 5000)
    estimator = hexload.Estimator(DATA / "unknown_load.toml")
    estimate = None
    for dl, vl, f in zip(log.displacement_m, log.velocity_m_s * [1, 1, -1, 1, 1, 1], log.force_n):
        estimate = estimator.step(dl, vl, f)
    assert estimate.input_fault.startswith("leg 3: velocity has the opposite sign")
    assert "input implausible" in estimate.health
