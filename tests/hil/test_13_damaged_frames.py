"""Frames that are missing, late, doubled, damaged or not ours: each is counted and has no other effect."""

import pytest

from bus_frames import LOCKSTEP, PROFILES, Frame, answers_of, decode, garbage, sample_frames_by_tick
from loop import NOTHING_COMES_S, PAPER_S, estimates

pytestmark = pytest.mark.vcan

PAGES = 13
SAMPLE_MISSING = 1 << 1  # health bit
SEED = 20
LOOK_S = 0.1  # between looks at a program that may have ended


@pytest.fixture
def lockstep(loop, peer):
    """lockstep(profile): a controller that has been started in lockstep."""

    def started(profile: str):
        program = loop.controller("--profile", profile)
        assert peer.command("start", LOCKSTEP)["result"] == 0
        return program

    return started


def feed(peer, samples) -> list[Frame]:
    """Sends classic samples from tick 0 on and returns their pages, one to each even tick."""
    pages = []
    for tick, sample in enumerate(samples):
        pages += peer.ask(sample, 1 - tick % 2)
    return pages


def answer_of(pages: list[Frame]) -> dict:
    """The signals of a round of pages."""
    return {name: value for page in reversed(pages) for name, value in decode(page).values.items()}


def test_a_missing_leg_loses_its_sample_and_the_answer_says_which(lockstep, peer, short_run):
    # GIVEN classic samples of which one, before the first of a round of pages, lacks leg 3
    lockstep("classic")
    samples = sample_frames_by_tick(short_run("classic").frames)[: 4 * PAGES]
    samples[2 * PAGES - 1] = [frame for frame in samples[2 * PAGES - 1] if frame.name != "LegSample3"]
    # WHEN they are fed
    pages = feed(peer, samples)
    # THEN the next answer has the bit of a missing sample and the mask of the leg, and the estimator went on
    answer = answer_of(pages[PAGES:])
    assert answer["page"] == 0 and answer["tick_low"] == 2 * PAGES
    assert answer["health"] & SAMPLE_MISSING
    assert answer["missing_legs"] == 0b000100
    assert (answer["status"], answer["fault"], answer["state"]) == (0, 0, 2)
    # and the answer before does not
    before = answer_of(pages[:PAGES])
    assert not before["health"] & SAMPLE_MISSING and before["missing_legs"] == 0
    # and the status counts one sample, and no frame: each that came was good
    assert peer.status("samples_missing") == 1
    assert peer.status("frames_refused") == 0


def test_a_sample_without_legs_3_and_5_is_not_answered(lockstep, peer, short_run):
    # GIVEN a classic sample of an even tick without two legs WHEN it is sent THEN no page comes
    lockstep("classic")
    samples = sample_frames_by_tick(short_run("classic").frames)
    feed(peer, samples[:4])
    peer.send(frame for frame in samples[4] if frame.name not in ("LegSample3", "LegSample5"))
    assert peer.receive("AnswerPage", patience_s=NOTHING_COMES_S) is None
    # and the next one is answered as always
    peer.send(samples[5])
    (page,) = peer.ask(samples[6], 1)
    assert decode(page).values["tick_low"] == 6


def test_doubled_and_late_leg_frames_are_counted_and_change_nothing(lockstep, peer, short_run):
    # GIVEN classic samples with a leg frame twice, and one of the tick before, and one of a whole sample before
    recorded = short_run("classic")
    samples = sample_frames_by_tick(recorded.frames)[: 2 * PAGES]
    disturbed = [list(sample) for sample in samples]
    disturbed[3].insert(2, samples[3][1])  # doubled
    disturbed[5].insert(3, samples[4][2])  # late
    disturbed[9] = samples[8][-6:] + disturbed[9]  # a whole sample again
    # WHEN they are fed THEN the answers are those of the undisturbed run, byte for byte
    lockstep("classic")
    assert feed(peer, disturbed) == answers_of(recorded.frames)[:PAGES]
    # and each such frame is counted
    assert peer.status("frames_refused") == 1 + 1 + 6
    assert peer.status("samples_missing") == 0


@pytest.mark.needs("fd")
def test_doubled_fd_samples_are_refused_and_late_ones_answered_as_refused(lockstep, peer, short_run):
    # GIVEN three FD samples WHEN the last comes again
    lockstep("fd")
    samples = sample_frames_by_tick(short_run("fd").frames)
    for sample in samples[:3]:
        peer.ask(sample, 3)
    (again,) = samples[2]
    peer.send(again)
    # THEN it is not answered, and counted
    assert peer.receive("HealthFd", patience_s=NOTHING_COMES_S / 4) is None
    assert peer.status("frames_refused") == 1
    # WHEN the one before it comes THEN the answer says that its tick is late, and that a sample was refused
    health = decode(peer.ask(samples[1], 3)[2]).values
    assert (health["status"], health["refused"]) == (-3, 1)
    assert peer.status("samples_refused") == 1
    # and the next sample is estimated with as if nothing had come
    answer = peer.ask(samples[3], 3)
    assert answer[:2] == answers_of(short_run("fd").frames)[9:11]


@pytest.mark.needs("fd")
@pytest.mark.parametrize("byte", [0, 17, 58, 59, 60, 63])
def test_a_damaged_sample_is_refused_and_the_next_one_says_that_it_is_missing(lockstep, peer, short_run, byte):
    # GIVEN an FD sample with one bit turned over: in the tick, a leg, the version, the unused byte, the checksum
    lockstep("fd")
    samples = sample_frames_by_tick(short_run("fd").frames)
    peer.ask(samples[0], 3)
    (whole,) = samples[1]
    damaged = whole._replace(data=whole.data[:byte] + bytes([whole.data[byte] ^ 0x10]) + whole.data[byte + 1 :])
    # WHEN it is sent THEN it is not answered, and counted
    peer.send(damaged)
    assert peer.receive("HealthFd", patience_s=NOTHING_COMES_S / 4) is None
    assert peer.status("frames_refused") == 1
    # WHEN the next one comes THEN its answer has the bit of a missing sample
    health = decode(peer.ask(samples[2], 3)[2]).values
    assert health["health"] & SAMPLE_MISSING and health["status"] == 0 and health["tick"] == 2
    assert peer.status("samples_missing") == 1


@pytest.mark.parametrize("profile", PROFILES)
def test_garbage_on_the_bus_does_not_disturb_a_run(loop, peer, paper_run, profile, tmp_path):
    # GIVEN the estimates of an undisturbed run, and a run in lockstep, of seconds: on a busy machine the sender below may
    # have its turn once in fifty ticks
    undisturbed = estimates(paper_run(profile).directory)
    controller = loop.controller("--profile", profile)
    simulation = loop.simulation(tmp_path / "run", "--lockstep", "--profile", profile, "--duration", PAPER_S[profile])
    # WHEN meanwhile frames of random identifiers, lengths and bytes are on the bus, at the pace of the answers
    sent = 0
    frames = garbage(SEED)
    with peer.hearing("HealthFd", "AnswerPage"):
        while simulation.process.poll() is None:
            if peer.can.recv(LOOK_S):
                peer.can.send(next(frames), timeout=1)
                sent += 1
                peer.discard()
    # THEN the run ends well with the undisturbed estimates
    print(f"{profile}: {sent} frames of garbage")
    assert simulation.wait() == 0, simulation.output
    assert sent > 20
    assert estimates(tmp_path / "run") == undisturbed
    assert "fault" not in controller.output
    # and those with an identifier of ours were counted
    assert peer.status("frames_refused") > 0
