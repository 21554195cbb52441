"""A log of candump, played back by canplayer, does to a controller what the simulator did."""

import pytest

from bus_frames import PROFILES, answers_of
from loop import SHORT_S, SHORT_TICKS

pytestmark = pytest.mark.vcan

SIMULATOR_ONLY = ("010:7FF", "07F:7FF", "080:7F8")  # Command, SampleTick, leg samples


@pytest.mark.needs("real time")
@pytest.mark.parametrize("profile", PROFILES)
def test_a_played_log_gives_the_recorded_answers(loop, start, short_run, profile, tmp_path):
    # GIVEN a run, recorded twice: all frames, and with candump's filters the simulator's only
    recorded = short_run(profile)
    controller = loop.controller("--profile", profile)
    recorder = loop.recorder(*SIMULATOR_ONLY)
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--profile", profile, "--duration", SHORT_S)
    assert simulation.wait() == 0
    assert {frame.id for frame in loop.finish(recorder)} <= {0x010, *range(0x07F, 0x088)}
    assert controller.interrupt() == 0
    # WHEN canplayer sends that log, in its own time, to a fresh controller
    fresh = loop.controller("--profile", profile)
    answers = loop.recorder("101:7FF", "102:7FE", "104:7FF")
    player = start("canplayer", "-I", recorder.log, f"{loop.interface}={loop.interface}")
    assert player.wait() == 0
    fresh.wait_for(": idle$")  # the log ends with STOP
    # THEN every answer is the recorded one, byte for byte, to the last
    played = loop.finish(answers)
    assert len(played) == {"fd": 3 * SHORT_TICKS, "classic": (SHORT_TICKS + 1) // 2}[profile]
    assert played == answers_of(recorded.frames)
