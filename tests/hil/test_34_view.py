"""The live page on a bus and on LCM: it sees samples, estimates and truth, its buttons reach the controller, and nothing of
the run is lost by its listening."""

import time

import numpy as np
import pytest

from bus_frames import DBC, to_message
from conftest import ended_programs
from hexload import project
from hexload.io.run_directory import read_run
from hexload.theory.bound import THETA_NAMES
from hexload.view import picture
from hexload.view.listening import listened_to
from hexload.view.live import KINDS
from hexload.view.verb import live_page
from lcm_listener import private_url
from loop import OPEN, SLOW_MACHINE
from test_18_attacks import ACKNOWLEDGE, STATUS, damaged, shortened
from test_32_lcm_bridge import open_bus

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
    program = start(
        ecu, OPEN, "--bus", free_bus, "--profile", profile, "--platform", PLATFORM, "--estimator", "momentum"
    )
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


def test_frames_of_a_controller_that_come_damaged_are_counted(free_bus):
    # GIVEN the page's listener WHEN a status and an acknowledge come with a wrong checksum, and a short one
    with listened_to(free_bus, "fd", None) as live, open_bus(free_bus) as sender:
        for frame in (damaged(STATUS), damaged(ACKNOWLEDGE), shortened(ACKNOWLEDGE), STATUS):
            sender.send(to_message(frame))
        # THEN each is counted under what is wrong with it, and the whole one is not
        wait_until(lambda: len([line for line in live.health().lines if "refused" in line]) == 2, "the counts")
        assert "2 frames refused: wrong checksum" in live.health().lines
        assert "1 frames refused: wrong length or format" in live.health().lines


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


@pytest.fixture(scope="module")
def watched(tmp_path_factory):
    """A run by the clock over LCM, watched and commanded: (page's last frame, its words, its curve of m, run)."""
    folder = tmp_path_factory.mktemp("watched")
    url, out = private_url(), folder / "run"
    with ended_programs(folder, []) as start:
        feed = ("--feed", f"lcm:{url}")
        ecu = start(project.controller(), *feed, "--platform", PLATFORM, "--estimator", "momentum", *SLOW_MACHINE)
        ecu.wait_for("ready on LCM")
        with live_page(PLATFORM, None, None, url, port=0) as page:
            live = page.source
            options = ["--out", out, "--duration", "3", "--real-time", "--estimator", "momentum"]
            program = start(project.simulator(), SCENARIO, *options, *feed, "--publish", f"lcm:{url}")
            # another load after a second, and after another one a velocity sensor of the wrong sign
            wait_until(lambda: live.frame().t_s > 1.0, "a second")
            live.plant.set_load(250.0, (0.0, 0.1, 0.2), (12.0, 10.0, 8.0))
            live.plant.set_load(-1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            wait_until(lambda: live.frame().t_s > 2.0, "another second")
            live.plant.set_sensor_fault(3, 0.0, True)
            assert program.wait() == 0, program.output
            wait_until(lambda: live.frame().t_s > 2.5, "the run's end")
            wait_until(lambda: page.chart("m") is not None and len(page.chart("m")[0]) > 5, "a curve")
            yield live.frame(), words_of(live), page.chart("m"), read_run(out), program.output


def test_on_lcm_estimate_and_truth_are_shown_and_the_run_loses_nothing(watched):
    # GIVEN a run by the clock that publishes its truth, and the page WHEN it has ended
    frame, _, chart, run, _ = watched
    # THEN the page has seen the true load, an estimate, and curves of both
    assert frame.truth is not None and frame.estimate.names == tuple(THETA_NAMES)
    assert {500.0, 250.0} >= set(chart[4]) and len(set(chart[4])) == 2
    # and every tick was recorded
    assert len(run.log.t_s) == 3001 and run.meta["missing"] == 0


def test_another_load_is_put_on_and_the_controller_detects_it(watched):
    # GIVEN the command for another load WHEN the run has ended
    frame, words, _, run, output = watched
    # THEN truth and the run's own record have it from one tick on
    np.testing.assert_allclose(frame.truth.theta[:4], [250.0, 0.0, 25.0, 50.0])
    first, second = run.meta["loads"]
    assert first["mass_kg"] == 500.0 and second["mass_kg"] == 250.0 and second["at_s"] > 1.0
    # the controller has detected it, and one of negative mass was refused
    assert "another load detected" in words
    assert run.meta["load_changes_detected_s"][0] == pytest.approx(second["at_s"], abs=0.1)
    assert "load refused: found -1 kg" in output


def test_an_injected_fault_is_in_the_log_from_its_moment_on_and_in_the_runs_record(watched):
    # GIVEN the command that turns the sign of leg 3's velocity sensor WHEN the log is compared with itself
    *_, run, _ = watched
    (fault,) = run.meta["sensor_faults"]
    assert (fault["leg"], fault["velocity_negated"], fault["force_offset_n"]) == (3, True, 0.0)
    row = int(np.searchsorted(run.log.t_s, fault["at_s"] - 1e-6))
    rate = np.gradient(run.log.displacement_m[:, 2], run.log.t_s)
    agreement = np.sign(rate * run.log.velocity_m_s[:, 2])
    # THEN velocity agrees with displacement before, and has the other sign after
    assert agreement[:row].mean() > 0.3 and agreement[row:].mean() < -0.3
