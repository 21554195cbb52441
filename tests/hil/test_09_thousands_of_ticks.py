"""Thousands of ticks in lockstep: nothing is lost, doubled or out of order, and the speed is told."""

import re

import pytest

from bus_frames import PROFILES, sent_with_the_ticks, tick_of_fd
from loop import PAPER_TICKS, SHORT_S, SHORT_TICKS

pytestmark = pytest.mark.vcan


@pytest.mark.needs("fd")
def test_each_fd_tick_has_one_sample_and_one_answer_in_order(paper_run):
    # GIVEN the paper's scenario over the bus WHEN names and ticks are read in the order of each sender
    frames = paper_run("fd").frames
    # THEN the simulator has sent one sample per tick
    samples = sent_with_the_ticks(frames, "SIMULATOR")
    ticks = range(PAPER_TICKS["fd"])
    assert [(frame.name, tick_of_fd(frame)) for frame in samples] == [("LegSampleFd", tick) for tick in ticks]
    # and the controller one answer of three frames
    order = ("EstimateFd", "SigmaFd", "HealthFd")
    answers = [(frame.name, tick_of_fd(frame)) for frame in sent_with_the_ticks(frames, "CONTROLLER")]
    assert answers == [(name, tick) for tick in ticks for name in order]


def test_each_classic_tick_has_six_legs_and_each_even_one_a_page_in_order(paper_run):
    # GIVEN the paper's scenario over the bus WHEN names are read in the order of each sender
    frames = paper_run("classic").frames
    samples = sent_with_the_ticks(frames, "SIMULATOR")
    legs, ticks = [f"LegSample{leg}" for leg in range(1, 7)], range(PAPER_TICKS["classic"])
    # THEN the simulator has sent each leg of each tick, and the whole tick with every sixteenth
    assert [frame.name for frame in samples] == [
        name for tick in ticks for name in ["SampleTick"] * (tick % 16 == 0) + legs
    ]
    lows = [frame.data[1] & 15 for frame in samples if frame.name != "SampleTick"]
    assert lows == [tick % 16 for tick in ticks for _ in legs]
    # and the controller one page for each even tick, whose low 12 bits stand above the counter
    pages = sent_with_the_ticks(frames, "CONTROLLER")
    assert [int.from_bytes(page.data[1:3], "little") >> 4 for page in pages] == [tick % 4096 for tick in ticks[::2]]


@pytest.mark.parametrize("profile", PROFILES)
def test_the_metadata_counts_no_loss(paper_run, profile):
    # GIVEN the paper's scenario over the bus WHEN its metadata is read THEN every tick was sent and answered
    meta = paper_run(profile).meta
    bus, ticks = meta["bus"], PAPER_TICKS[profile]
    answers = {"fd": ticks, "classic": (ticks + 1) // 2}[profile]
    assert (bus["samples"], bus["answers_expected"], bus["answers"]) == (ticks, answers, answers)
    assert bus["answers_missing"] == bus["answers_late"] == bus["unsent"] == bus["saturated"] == 0
    assert meta["missing"] == meta["refused"] == 0


@pytest.mark.needs("fd")
def test_the_speed_is_told_and_nobodys_listening_changes_the_run(short_run, loop, tmp_path):
    # GIVEN a run over the bus, recorded WHEN it is run again without the recorder
    recorded = short_run("fd")
    loop.controller()
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--duration", SHORT_S)
    assert simulation.wait() == 0
    # THEN the run directory is the same
    for path in recorded.directory.iterdir():
        assert path.read_bytes() == (tmp_path / "run" / path.name).read_bytes(), path.name
    # and the speed is told, not judged: the machine may have other work
    for how, output in (("recorded", recorded.output), ("alone", simulation.output)):
        elapsed_s = float(re.search(r"([\d.]+) s, \d+ x real time", output).group(1))
        print(f"lockstep, fd, {how}: {SHORT_TICKS} ticks in {elapsed_s:.2f} s, {SHORT_S / elapsed_s:.2f} x real time")
