"""Answers with codes: somebody between controller and simulator changes them, plays old ones, or leaves the codes out. Over UDP
multicast, on this kernel."""

import time
from collections.abc import Callable
from contextlib import closing
from typing import NamedTuple

import pytest

from bus_frames import BY_ID, Frame, encode, from_message, protected, tick_of_fd, to_message
from hexload import project
from hexload.io.key_file import new_key, read_key
from hexload.view.bus_listener import BusListener
from hexload.view.live import Live
from test_32_lcm_bridge import bus_of_its_own, open_bus

SCENARIO = project.SCENARIOS / "paper.toml"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PATIENCE_S = 60.0
SECOND_CONTROLLER = 5  # exit status
BEGUN = 40  # ticks that are handed on as they are
TICKS = 330  # five times 64 and some
AHEAD = 20  # ticks that answers may be ahead of a listener
OTHERS_CODE, NO_CODES = "their code is not of its key", "they have no codes of its key"
DZ = 8  # byte of EstimateFd
VALUE, PAGE_DZ = 4, 1  # byte of a page, and the page with dz
LAST_FRAME = encode("LoadChange", tick=TICKS + 1)  # no run has one: its load stays

Change = Callable[
    [Frame, int], Frame | None
]  # of the controller's next frame, and the tick it answers; None: it is lost


def as_it_is(frame: Frame, tick: int) -> Frame | None:
    return frame


def forged(frame: Frame, tick: int) -> Frame | None:
    """Another estimate, with its checksum: the value's last bits."""
    place = {"EstimateFd": DZ, "AnswerPage": VALUE}.get(frame.name)
    if place is None or tick < BEGUN or (frame.name == "AnswerPage" and frame.data[3] >> 2 != PAGE_DZ):
        return frame
    data = frame.data[:place] + bytes([frame.data[place] ^ 3]) + frame.data[place + 1 :]
    return frame._replace(data=protected(frame.id, data))


def without_codes(frame: Frame, tick: int) -> Frame | None:
    return forged(frame, tick) if frame.name != "AnswerMac" or tick < BEGUN else None


class Replay:
    """Answers of the run before, code and all, from BEGUN on."""

    def __init__(self):
        self.recorded: dict[tuple[str, int], Frame] = {}

    def record(self, frame: Frame, tick: int) -> Frame | None:
        self.recorded[frame.name, tick] = frame
        return frame

    def play(self, frame: Frame, tick: int) -> Frame | None:
        return self.recorded.get((frame.name, tick), frame) if tick >= BEGUN else frame


class Between:
    """A simulator is on the bus `near`, its controller on `far`."""

    def __init__(self):
        self.near, self.far = bus_of_its_own(), bus_of_its_own()
        self.tick = 0  # that was answered last

    def run(self, process, change: Change, live: Live) -> None:
        """Until the program ends, no faster than a listener hears: a socket that is full loses frames."""
        until = time.monotonic() + PATIENCE_S
        with open_bus(self.near) as near, open_bus(self.far) as far:
            while process.poll() is None:
                self._hand_on(near, far, "SIMULATOR", as_it_is)
                if self.tick - live.frame().t_s * 1000 < AHEAD:
                    self._hand_on(far, near, "CONTROLLER", change)
                time.sleep(0.0002)
                assert time.monotonic() < until

    def wait_until_heard(self, live: Live) -> None:
        """Sends one more frame behind those of the run: a listener that has it has all that came before."""
        until = time.monotonic() + PATIENCE_S
        with open_bus(self.near) as near:
            while not any(event.words == "another load detected" for event in live.events()):
                near.send(to_message(LAST_FRAME))  # again: a socket that is full takes none
                time.sleep(0.02)
                assert time.monotonic() < until

    def _hand_on(self, source, sink, sender: str, change: Change) -> None:
        while (message := source.recv(0)) is not None:
            frame = from_message(message)
            if sender not in BY_ID[frame.id].senders:  # what this one has sent there
                continue
            if frame.name in ("EstimateFd", "HealthFd", "LegSampleFd"):
                self.tick = tick_of_fd(frame)
            elif frame.name == "LegSample6":
                self.tick += 1
            if (changed := change(frame, self.tick)) is not None:
                sink.send(to_message(changed))


class Outcome(NamedTuple):
    status: int
    output: str
    heard: list[str]  # by a listener with the key on the simulator's bus: health and events


@pytest.fixture
def run_between(start, ecu, simulator, tmp_path):
    """run_between(change, profile, *options): a controller with a key, and a run whose answers are changed."""
    key, between = tmp_path / "of.key", Between()
    new_key(key)
    outs = []

    def runner(change: Change, profile: str, *options: str) -> Outcome:
        if not outs:
            program = start(ecu, "--key", key, "--bus", between.far, "--profile", profile, "--platform", PLATFORM)
            program.wait_for("ready on")
        live = Live("a run", 1e-3)
        with closing(BusListener(live, between.near, profile, read_key(key))):
            run = start(
                simulator, SCENARIO, "--out", tmp_path / str(len(outs)), "--bus", between.near, "--profile", profile,
                "--duration", f"{TICKS / 1000:g}", "--key", key, *options,
            )  # fmt: skip
            outs.append(run)
            between.tick = 0
            between.run(run.process, change, live)
            between.wait_until_heard(live)
            return Outcome(run.wait(), run.output, [*live.health().lines, *(event.words for event in live.events())])

    return runner


def says(outcome: Outcome, words: str) -> bool:
    return any(words in line for line in outcome.heard)


@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_honest_answers_are_accepted_by_simulator_and_listener(run_between, profile):
    # GIVEN a controller with a key WHEN a run wants codes of its answers, and all is handed on
    outcome = run_between(as_it_is, profile, "--answer-codes")
    # THEN it ends as ever, and a listener with the key has seen each code match
    assert outcome.status == 0, outcome.output
    codes = -(-TICKS // (16 if profile == "fd" else 64))  # the last one goes before the acknowledge of STOP
    assert says(outcome, f"{codes} codes of answers that are of the controller's key"), outcome.heard
    assert not says(outcome, "not the controller's") and not says(outcome, "not checked")


ATTACKS = {"forged": (forged, OTHERS_CODE), "forged, without codes": (without_codes, NO_CODES)}


@pytest.mark.parametrize("profile", ["fd", "classic"])
@pytest.mark.parametrize("name", ATTACKS)
def test_forged_answers_end_the_run_and_are_told(run_between, name, profile):
    # GIVEN a run whose answers have codes WHEN somebody between puts other estimates in their place, with right checksums
    change, words = ATTACKS[name]
    outcome = run_between(change, profile, "--answer-codes")
    # THEN the simulator ends and says why, and so does a listener with the key
    assert outcome.status == SECOND_CONTROLLER, outcome.output
    assert words in outcome.output
    assert says(outcome, f"answers are not the controller's: {words}"), outcome.heard


def test_recorded_answers_of_the_run_before_are_none_of_this_one(run_between):
    # GIVEN all answers of a run with their codes, and another run of the same motion
    replay = Replay()
    assert run_between(replay.record, "fd", "--answer-codes").status == 0
    # WHEN somebody plays them in their place, frame by frame
    outcome = run_between(replay.play, "fd", "--answer-codes")
    # THEN they are found, although each number is the right one
    assert outcome.status == SECOND_CONTROLLER, outcome.output
    assert OTHERS_CODE in outcome.output and says(outcome, OTHERS_CODE)


def test_without_codes_nobody_would_notice(run_between):
    # GIVEN a run without codes on its answers WHEN estimates are forged THEN checksums do not tell
    outcome = run_between(forged, "fd")
    assert outcome.status == 0, outcome.output
    assert not says(outcome, "codes of answers")
