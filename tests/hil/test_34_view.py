"""The live page on a bus and on LCM: it sees samples, estimates and truth, its buttons reach the controller, and nothing of
the run is lost by its listening."""

import time

import numpy as np
import pytest

from bus_frames import DBC
from hexload import project
from hexload.io.run_directory import read_run
from hexload.theory.bound import THETA_NAMES
from hexload.view import picture
from hexload.view.live import KINDS
from hexload.view.verb import live_page
from lcm_listener import private_url

SCENARIO = project.SCENARIOS / "multisine.toml"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
PATIENCE_S = 60.0


def wait_until(is_so, what):
    until = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < until, f"not within {PATIENCE_S:g} s: {what}"
        time.sleep(0.02)


def words_of(live):
    return [event.words for event in live.events()]


def press(page, label):
    """In the browser where there is one, else as its click does."""
    if picture.browser() is None:
        page.source.command(label)
        return
    with picture.opened(page.url, (1000, 800)) as tab:
        button = f"[...document.querySelectorAll('button')].find(found => found.innerText === '{label}')"
        tab.wait_for(f"{button} !== undefined")
        tab.evaluate(f"{button}.click()")
        wait_until(lambda: f"sent: {label}" in words_of(page.source), "the click")


def test_commands_are_the_contracts():
    # GIVEN the DBC WHEN its commands are read THEN the page has the same
    choices = DBC.get_message_by_name("Command").get_signal_by_name("command").choices
    assert KINDS == {str(word): code for code, word in choices.items()}


@pytest.mark.parametrize("profile", ["fd", "classic"])
def test_on_a_bus_a_button_reaches_the_controller_and_samples_are_shown(start, ecu, free_bus, profile):
    # GIVEN a controller on UDP multicast, and the page on the same bus
    program = start(ecu, "--bus", free_bus, "--profile", profile, "--platform", PLATFORM, "--estimator", "momentum")
    program.wait_for("ready on")
    with live_page(PLATFORM, free_bus, profile, None, port=0) as page:
        # WHEN the button start is pressed THEN the controller says that it is armed
        press(page, "start") if profile == "fd" else page.source.command("start")
        wait_until(lambda: "controller: done, armed" in words_of(page.source), "the acknowledge")
        program.wait_for("armed")
        # WHEN samples of the platform at rest come THEN they are shown, with the estimate that answers them
        send_samples(free_bus, profile, ticks=200)
        wait_until(lambda: page.source.frame().estimate is not None, "an estimate")
        frame = page.source.frame()
        assert frame.estimate.names == tuple(THETA_NAMES)
        np.testing.assert_allclose(frame.displacement_m, np.arange(6) * 1e-3, atol=1e-6)
        np.testing.assert_allclose(frame.force_n, 1074.0, atol=0.5)


def send_samples(bus, profile, ticks):
    from hexload.view.bus_listener import can, open_bus

    encode = project.native_module().bus.encode_sample
    with open_bus(bus, profile) as sender:
        for tick in range(ticks):
            frames, _ = encode(profile, tick, np.arange(6) * 1e-3, np.zeros(6), np.full(6, 1074.0))
            for identifier, is_fd, data in frames:
                message = can.Message(arbitration_id=identifier, is_extended_id=False, is_fd=is_fd, data=data)
                sender.send(message)
            time.sleep(1e-3)


def test_on_lcm_estimate_and_truth_are_shown_and_the_run_loses_nothing(start, ecu, simulator, tmp_path):
    # GIVEN a run by the clock over LCM that publishes its truth, and the page
    url = private_url()
    start(ecu, "--feed", f"lcm:{url}", "--platform", PLATFORM, "--estimator", "momentum").wait_for("ready on LCM")
    with live_page(PLATFORM, None, None, url, port=0) as page:
        out = tmp_path / "run"
        options = ["--out", out, "--duration", "2", "--real-time", "--estimator", "momentum"]
        program = start(simulator, SCENARIO, *options, "--feed", f"lcm:{url}", "--publish", f"lcm:{url}")
        # WHEN the run has ended
        assert program.wait() == 0, program.output
        # THEN the page has seen its end: the true load, an estimate near it, and curves of both
        wait_until(lambda: page.source.frame().t_s > 1.5, "the run's end")
        frame = page.source.frame()
        np.testing.assert_allclose(frame.truth.theta[:4], [500.0, 30.0, -20.0, 150.0])
        assert np.abs(frame.estimate.value[:4] - frame.truth.theta[:4]).max() < 1.0
        wait_until(lambda: page.chart("m") is not None and len(page.chart("m")[0]) > 5, "a curve")
        # and every tick was recorded
        run = read_run(out)
        assert len(run.log.t_s) == 2001 and run.meta["missing"] == 0
