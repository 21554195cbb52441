"""Controllers with a key and those who command them: simulator, live page, and what each says when keys are not the same. Over
UDP multicast, on this kernel."""

import pytest

from hexload import project
from hexload.errors import InputError
from hexload.io import authentication
from hexload.io.key_file import new_key, read_key
from hexload.view.listening import listened_to
from loop import OPEN, PATIENCE_S, SLOW_MACHINE
from test_34_view import wait_until, words_of

SCENARIO = project.SCENARIOS / "paper.toml"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
BAD_INPUT, CONTROLLER_FAULT = 2, 7  # exit statuses
NEITHER = "found neither --key nor --without-authentication, expected one"


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "platform.key"
    new_key(path)
    return path


def controller(start, ecu, bus, *options):
    program = start(ecu, *options, *SLOW_MACHINE, "--bus", bus, "--platform", PLATFORM)
    program.wait_for("ready on")
    return program


def simulation(start, simulator, bus, out, *options):
    return start(simulator, SCENARIO, "--out", out, "--bus", bus, "--duration", "0.2", *options)


@pytest.mark.parametrize("pacing", ["--lockstep", "--real-time"])
@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_a_simulator_with_the_controllers_key_runs_as_ever(
    start, ecu, simulator, free_bus, key, tmp_path, profile, pacing
):
    # GIVEN a controller with a key WHEN a simulator with the same runs twice
    program = controller(start, ecu, free_bus, "--key", key, "--profile", profile)
    for out in ("once", "again"):
        options = ("--key", key, "--profile", profile, pacing)
        # THEN RESET, SELECT FILTER, START and STOP are carried out
        run = simulation(start, simulator, free_bus, tmp_path / out, *options)
        assert run.wait() == 0, run.output
    program.wait_for("idle")


@pytest.mark.parametrize(
    ("of_controller", "of_simulator", "words"),
    [
        ("own", "none", "the controller refuses RESET: not authenticated: it has a key; give this simulator the same"),
        ("own", "other", "the controller refuses RESET as not authenticated: give both the same key file"),
        ("none", "own", "the controller has no key: start it with --key too, or this simulator without"),
    ],
)
def test_keys_that_are_not_the_same_are_named(
    start, ecu, simulator, free_bus, key, tmp_path, of_controller, of_simulator, words
):
    # GIVEN a controller and a simulator whose keys are not the same
    other = tmp_path / "other.key"
    new_key(other)
    options = {"own": ("--key", key), "other": ("--key", other), "none": ()}
    controller(start, ecu, free_bus, *(options[of_controller] or (OPEN,)))
    # WHEN the simulator starts THEN it ends and says why
    run = simulation(start, simulator, free_bus, tmp_path / "run", *options[of_simulator])
    assert run.wait() == CONTROLLER_FAULT
    assert words in run.output


def test_a_controller_is_not_left_open_by_an_option_forgotten(start, ecu, free_bus):
    # GIVEN neither a key nor the word that none is wanted WHEN a controller starts THEN it does not
    program = start(ecu, "--bus", free_bus, "--platform", PLATFORM)
    assert program.wait() == BAD_INPUT
    assert NEITHER in program.output


@pytest.mark.parametrize(
    ("text", "mode", "words"),
    [
        ("00112233445566778899aabbccddeeff\n", 0o640, "found mode 640, expected 600"),
        ("00112233445566778899aabbccddee\n", 0o600, "found no key, expected 32 hexadecimal digits"),
        ("00112233445566778899aabbccddeeff00\n", 0o600, "found no key, expected 32 hexadecimal digits"),
        ("00112233445566778899aabbccddeefg\n", 0o600, "found no key, expected 32 hexadecimal digits"),
        (None, 0o600, "expected a key file (hexload key new FILE makes one)"),
    ],
)
def test_a_key_file_that_is_none_or_not_private_is_refused(start, ecu, free_bus, tmp_path, text, mode, words):
    # GIVEN a file that is no key, that others may read, or none
    path = tmp_path / "bad.key"
    if text is not None:
        path.write_text(text)
        path.chmod(mode)
    # WHEN the controller takes it, or a tool in Python THEN both say what they found
    program = start(ecu, "--key", path, "--bus", free_bus, "--platform", PLATFORM)
    assert program.wait() == BAD_INPUT
    assert words in program.output
    with pytest.raises(InputError) as refused:
        read_key(path)
    assert words in str(refused.value)


def test_a_new_key_is_private_and_another_each_time_and_none_is_written_over(tmp_path):
    # GIVEN two new keys THEN they differ, and others may not read them
    first, second = tmp_path / "first.key", tmp_path / "second.key"
    for path in (first, second):
        new_key(path)
        assert path.stat().st_mode & 0o777 == 0o600
    assert read_key(first) != read_key(second)
    # WHEN one is to be written again THEN it stays
    before = first.read_text()
    with pytest.raises(InputError, match="a key is not written over"):
        new_key(first)
    assert first.read_text() == before


def test_commands_of_the_live_page_go_one_by_one_with_the_key(start, ecu, free_bus, key, monkeypatch):
    monkeypatch.setattr(authentication, "PATIENCE_S", PATIENCE_S)  # the controller may wait for a processor
    # GIVEN a controller with a key, and the page's listener with the same
    program = controller(start, ecu, free_bus, "--key", key)
    with listened_to(free_bus, "fd", None, key=read_key(key)) as live:
        # WHEN it gives several commands at once
        live.start_anew(("set known mass", 250.0))
        # THEN each is carried out, in their order
        wait_until(lambda: "controller: done, armed" in words_of(live), "the acknowledge")
        assert [words for words in words_of(live) if words.startswith("controller")] == [
            "controller: done, idle",
            "controller: done, idle",
            "controller: done, armed",
        ]
    program.wait_for("armed")


def test_commands_of_the_live_page_that_no_challenge_comes_for_are_given_up_and_said(start, ecu, free_bus, key):
    # GIVEN a controller without a key, and the page's listener with one
    program = controller(start, ecu, free_bus, OPEN)
    with listened_to(free_bus, "fd", None, key=read_key(key)) as live:
        # WHEN it commands
        live.start_anew()
        # THEN it says what it has not sent
        wait_until(
            lambda: len([words for words in words_of(live) if words.startswith("given up")]) == 2, "two given up"
        )
        assert "given up: stop: no controller with a key has told a challenge within 1 s" in words_of(live)
        assert "given up: start: no controller with a key has told a challenge within 1 s" in words_of(live)
    assert "armed" not in program.output


@pytest.mark.parametrize("pacing", ["--lockstep", "--real-time"])
@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_samples_and_answers_have_codes_and_the_estimates_are_the_same(
    start, ecu, simulator, free_bus, key, tmp_path, profile, pacing
):
    # GIVEN a controller with a key WHEN a simulator gives its samples codes and wants the answers to have them
    program = controller(start, ecu, free_bus, "--key", key, "--profile", profile)
    for out, codes in (("without", ()), ("with", ("--sample-codes", "--answer-codes"))):
        options = ("--key", key, "--profile", profile, pacing, *codes)
        run = simulation(start, simulator, free_bus, tmp_path / out, *options)
        assert run.wait() == 0, run.output
    # THEN the run goes on, and its estimates are those of one without
    program.wait_for("idle")
    assert "fault" not in program.output
    if pacing == "--lockstep":
        assert (tmp_path / "with" / "estimates.csv").read_text() == (tmp_path / "without" / "estimates.csv").read_text()
