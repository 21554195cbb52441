"""In lockstep the same scenario gives the same bytes on the bus and in the run directory, every time."""

import pytest

from bus_frames import PROFILES, sent_with_the_ticks
from loop import PAPER_S, SHORT_S, SHORT_TICKS, one_processor

pytestmark = pytest.mark.vcan

SENDERS = ("SIMULATOR", "CONTROLLER")


@pytest.mark.parametrize("profile", PROFILES)
def test_two_runs_in_lockstep_are_the_same_to_the_byte(short_run, loop, profile, tmp_path):
    # GIVEN a run on one processor WHEN it is run again on all, both programs fresh
    with one_processor():
        first = short_run(profile)
    second = loop.record(tmp_path / "run", profile, "--duration", SHORT_S)
    # THEN each program has sent the same frames in the same order, but for those that go by the clock
    for sender in SENDERS:
        frames = [sent_with_the_ticks(run.frames, sender) for run in (first, second)]
        assert len(frames[0]) > SHORT_TICKS // 2  # classic pages are the fewest: one for each even tick
        assert frames[0] == frames[1], sender
    # and every file of the run directory is the same
    files = sorted(path.name for path in first.directory.iterdir())
    assert files == sorted(path.name for path in second.directory.iterdir())
    for name in files:
        assert (first.directory / name).read_bytes() == (second.directory / name).read_bytes(), name


def test_a_longer_run_begins_as_the_shorter_one(short_run, paper_run, any_profile):
    # GIVEN the beginning of the scenario and more of it WHEN their frames are compared THEN they begin alike
    for sender in SENDERS:
        short, longer = (sent_with_the_ticks(run(any_profile).frames, sender) for run in (short_run, paper_run))
        assert len(longer) > (PAPER_S[any_profile] / SHORT_S - 1) * len(short)
        assert longer[: len(short)] == short, sender
