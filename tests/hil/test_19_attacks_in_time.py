"""Floods, jumps, restarts and second sources in the middle of a run: what each may do to it. Over UDP multicast, on this
kernel. What one frame may do is in test_18; the table of both is written to attacks.md, beside what the programs said."""

import time
from collections.abc import Callable
from typing import NamedTuple

import pytest

from bus_frames import Frame, encode, encode_command
from loop import OPEN
from test_18_attacks import (
    ATTACKS,
    ESTIMATING,
    FAULT,
    NO_FAULT,
    PLATFORM,
    SECOND_CONTROLLER,
    SECOND_SOURCE,
    SESSION,
    WRONG_PROFILE,
    Source,
    begin_run,
    damaged,
    sample,
)
from test_32_lcm_bridge import open_bus

FLOOD = 1500  # frames: five times what the socket holds
DRAINED_S = 0.02
AGAIN_S = 0.3  # a flood may push a sample out of the socket: the source sends it again
BY_FAULT = {
    NO_FAULT: "the run goes on",
    WRONG_PROFILE: "fault: wrong profile",
    SECOND_CONTROLLER: "fault: second controller",
    SECOND_SOURCE: "fault: second source",
}


class Flood(NamedTuple):
    name: str
    fault: int  # after it
    frames: Callable[[int, int], list[Frame]]  # at a tick; the n-th of the flood


FLOODS = [
    Flood("flood of the last sample", NO_FAULT, lambda tick, n: [sample(tick - 1)]),
    Flood("flood of old samples", SECOND_SOURCE, lambda tick, n: [sample(max(tick - 2 - n % 40, 0))]),
    Flood("flood of damaged samples of the next tick", NO_FAULT, lambda tick, n: [damaged(sample(tick, 1.1))]),
    Flood("flood of samples far ahead, one after the other", NO_FAULT, lambda tick, n: [sample(tick + 2**20 + n)]),
    Flood("flood of damaged commands", NO_FAULT, lambda tick, n: [damaged(encode_command("stop", n, 0.0, SESSION))]),
    Flood(
        "flood of foreign identifiers",
        NO_FAULT,
        lambda tick, n: [encode("LegSampleFd", tick=tick)._replace(id=0x600 + n % 256)],
    ),
]


def answered(source: Source, tick: int, share: float = 1.0) -> dict:
    """As Source.ask(), sent again while there is no answer."""
    until = time.monotonic() + 20.0
    while time.monotonic() < until:
        source.send([sample(tick, share)])
        again = time.monotonic() + AGAIN_S
        while (left := again - time.monotonic()) > 0:
            health = source.receive("HealthFd", left)
            if health is not None and health["tick"] == tick:
                return health
    pytest.fail(f"tick {tick} is not answered")


@pytest.fixture
def controller(start, ecu, free_bus):
    """controller() starts one more on the same bus."""

    def starter():
        program = start(ecu, OPEN, "--bus", free_bus, "--platform", PLATFORM)
        program.wait_for("ready on")
        return program

    return starter


@pytest.fixture
def source(controller, free_bus):
    controller()
    with open_bus(free_bus) as bus:
        source = Source(bus)
        source.command("reset")
        yield source


def test_ticks_behind_a_flood_are_answered(source, artefacts):
    rows = [(attack.name, BY_FAULT[attack.fault]) for attack in ATTACKS]
    for flood in FLOODS:
        # GIVEN a run under way WHEN more than a thousand such frames come at once, and the next tick behind them
        tick = begin_run(source)
        burst = [frame for n in range(FLOOD // 10) for frame in flood.frames(tick, n)]
        for _ in range(10):
            source.send(burst)
            source.receive("Acknowledge", DRAINED_S)  # its own frames, which would push the answer out of its socket
        health = [answered(source, tick + n) for n in range(3)][-1]
        # THEN it is answered as if nothing had been, or with the fault that such a flood is
        assert health["fault"] == flood.fault, flood.name
        assert health["state"] in (FAULT if flood.fault else ESTIMATING), flood.name
        rows.append((flood.name, BY_FAULT[flood.fault]))
    lines = ["| attack | outcome |", "|---|---|", *(f"| {name} | {outcome} |" for name, outcome in rows)]
    (artefacts / "attacks.md").write_text("\n".join(lines) + "\n")


def test_a_source_that_jumps_ahead_goes_on_from_there_and_what_it_left_out_is_counted(source):
    # GIVEN a run under way WHEN the source leaves out so many ticks, once and again
    tick = begin_run(source)
    for jump in (1, 7, 100, 999):
        tick += jump
        health = [answered(source, tick + n) for n in range(5)][-1]
        tick += 5
        # THEN the run goes on from there without a fault
        assert health["fault"] == NO_FAULT, jump
        assert health["state"] in ESTIMATING, jump
        assert health["status"] == 0, jump


def test_a_simulator_that_is_started_again_in_the_middle_begins_a_run_of_its_own(source, free_bus):
    # GIVEN a run that its simulator has left in the middle WHEN another one, of another session, begins one
    begin_run(source)
    with open_bus(free_bus) as bus:
        again = Source(bus)
        again.counter = source.counter  # even with the same counters
        tick = begin_run(again)
        # THEN its ticks are answered as those of a new run
        health = answered(again, tick)
    assert (health["fault"], health["tick"]) == (NO_FAULT, tick)
    assert health["state"] in ESTIMATING


def test_a_controller_that_is_started_again_in_the_middle_says_that_it_runs_nothing(start, ecu, free_bus, controller):
    # GIVEN a run WHEN the controller ends and a new one takes its place
    first = controller()
    with open_bus(free_bus) as bus:
        source = Source(bus)
        tick = begin_run(source)
        first.interrupt()
        controller()
        # THEN it answers no tick with an estimate of the old run
        source.send([sample(tick)])
        health = source.receive("HealthFd", 0.3)
        assert health is None or health["state"] not in ESTIMATING
        # and a new START is a new run
        tick = begin_run(source)
        assert answered(source, tick)["state"] in ESTIMATING


def test_a_second_simulator_beside_the_first_is_a_fault_by_name(source, free_bus):
    # GIVEN a run under way WHEN a second simulator sends its own samples, ten ticks behind, in the middle of it
    tick = begin_run(source)
    faults = set()
    for n in range(20):
        source.send([sample(tick + n - 1, 1.1)])
        faults.add(answered(source, tick + n)["fault"])
    # THEN that is a second source, and no run goes on with the samples of two
    assert SECOND_SOURCE in faults
    assert answered(source, tick + 20)["state"] in FAULT
