"""Watching a run on LCM: every tick arrives, what is told is the truth, and lcm-logger's file replays."""

import subprocess
import sys
from pathlib import Path

import lcm
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import ended_programs
from hexload import project
from hexload.io.run_directory import read_run
from lcm_listener import Controller, Listener, private_url
from loop import PATIENT

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
TICKS = 3001
TRUTH = ("platform_state_t", "load_truth_t", "wrench_t")
# A socket's receive buffer (net.core.rmem_default, 208 KiB) takes as many messages, of at most 1280 bytes with what the
# kernel adds, of one channel out of four, even when nobody reads.
SURE_TO_COME = 208 * 1024 // 1280 // 4


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """The load changes after one and after two seconds."""
    text = (project.SCENARIOS / "load_change.toml").read_text()
    for found, wanted in (("at_s = 8.0", "at_s = 1.0"), ("at_s = 16.0", "at_s = 2.0")):
        assert text.count(found) == 1
        text = text.replace(found, wanted)
    path = tmp_path_factory.mktemp("scenario") / "load_change.toml"
    path.write_text(text.replace("platforms/paper.toml", str(PLATFORM)))
    return path


@pytest.fixture(scope="module")
def watched(simulator, scenario, tmp_path_factory):
    """A published run whose listener sets the pace, and lcm-logger's file of it: (run directory, messages by type, log)."""
    url, folder = private_url(), tmp_path_factory.mktemp("watched")
    log, out = folder / "lcmlog", folder / "run"
    with ended_programs(folder, []) as start:
        logger = start(Path(sys.prefix) / "bin" / "lcm-logger", f"--lcm-url={url}", "--flush-interval=100", log)
        logger.wait_for("Opening log file")
        listener = Controller(url, told_per_tick=TRUTH)
        options = ["--out", out, "--duration", "3", "--feed", f"lcm:{url}", "--publish", f"lcm:{url}", *PATIENT]
        program = start(simulator, scenario, *options)
        listener.run_with(program.process)
        assert program.wait() == 0, program.output
        logger.interrupt()
    return out, listener.messages, log


def power(state, wrench):
    """Of a wrench in platform axes on a body whose twist is told in base axes."""
    to_base = Rotation.from_euler("xyz", state.roll_pitch_yaw_rad).as_matrix()
    return to_base @ wrench.force_n @ state.velocity_m_s + to_base @ wrench.moment_n_m @ state.angular_velocity_rad_s


def test_every_tick_of_a_published_run_arrives_and_is_the_truth(watched):
    run_directory, messages, _ = watched
    run = read_run(run_directory)

    # THEN each channel has every tick once and without a gap
    for name in ("leg_sample_t", *TRUTH):
        assert [message.tick for message in messages[name]] == list(range(TICKS)), name
        assert [message.sequence for message in messages[name]] == list(range(TICKS)), name

    # the samples are those of the log, to the bit
    for field in ("displacement_m", "velocity_m_s", "force_n"):
        told = np.array([getattr(message, field) for message in messages["leg_sample_t"]])
        np.testing.assert_array_equal(told, getattr(run.log, field).astype(np.float32))

    # the truth is that of the run
    truth = np.genfromtxt(run_directory / "truth.csv", delimiter=",", names=True)
    states = messages["platform_state_t"]
    position = np.array([message.position_m + message.roll_pitch_yaw_rad for message in states])
    motion = np.array([message.velocity_m_s + message.angular_velocity_rad_s for message in states])
    for index, (pose, twist) in enumerate(
        zip(("x", "y", "z", "roll", "pitch", "yaw"), ("vx", "vy", "vz", "wx", "wy", "wz"))
    ):
        np.testing.assert_array_equal(position[:, index], truth[pose])
        np.testing.assert_array_equal(motion[:, index], truth[twist])

    # the wrench does the work of the legs: wrench x twist = force x rate
    bodies = [power(state, wrench) for state, wrench in zip(states, messages["wrench_t"])]
    legs = sum(truth[f"f{leg}"] * truth[f"vl{leg}"] for leg in range(1, 7))
    np.testing.assert_allclose(bodies, legs, rtol=1e-9, atol=1e-9 * np.abs(legs).max())

    # the load is the scenario's, also where it changes
    loads = messages["load_truth_t"]
    assert [(loads[tick].mass_kg, *loads[tick].com_m) for tick in (0, 999, 1000, 1999, 2000)] == [
        (0, 0, 0, 0),
        (0, 0, 0, 0),
        (500, 0, 0, 0.3),
        (500, 0, 0, 0.3),
        (250, 0.05, 0, 0.2),
    ]
    assert loads[2000].inertia_kg_m2 == (12, 10, 8, 0, 0, 0)


def test_lcm_loggers_file_replays_to_the_estimates_of_the_run_in_process(watched, start, simulator, scenario, tmp_path):
    run_directory, _, log = watched
    # GIVEN the same run in process, with its CSV log
    inproc = tmp_path / "inproc"
    assert start(simulator, scenario, "--out", inproc, "--duration", "3").wait() == 0
    header, *rows = (inproc / "log.csv").read_text().splitlines(keepends=True)
    # WHEN lcm-logger's file is replayed
    recorded = recorded_ticks(log)
    platform = run_directory / "platform.toml"
    remarks = replay(log, platform, tmp_path / "lcm.csv")
    # THEN the estimates are those of the CSV log's same rows, to the byte, and what the logger lost, if anything, is told
    assert len(recorded) > SURE_TO_COME
    (tmp_path / "same.csv").write_text(header + "".join(rows[tick] for tick in recorded))
    replay(tmp_path / "same.csv", platform, tmp_path / "csv.csv")
    assert (tmp_path / "lcm.csv").read_bytes() == (tmp_path / "csv.csv").read_bytes()
    lost = recorded[-1] - recorded[0] + 1 - len(recorded)
    told = [f"{lost} messages of HEXLOAD_LEG_SAMPLE were lost before the log was written"] if lost else []
    assert remarks[:1] == told  # then where
    if len(recorded) == TICKS:
        assert (tmp_path / "lcm.csv").read_bytes() == (inproc / "estimates.csv").read_bytes()


def recorded_ticks(log):
    leg_sample_t = project.message_type("leg_sample_t")
    events = lcm.EventLog(str(log), "r")
    return [leg_sample_t.decode(event.data).tick for event in events if event.channel == "HEXLOAD_LEG_SAMPLE"]


def replay(log, platform, out):
    """The remarks on the log."""
    words = ["replay", log, "--platform", platform, "--out", out]
    result = subprocess.run([sys.executable, "-m", "hexload_dev", *map(str, words)], capture_output=True, text=True)
    assert result.returncode == 3, result.stderr  # the load is another one at the end than the paper's filter is told
    lines = result.stdout.splitlines()
    return [line.removeprefix("log:").strip() for line in lines if line.startswith("log:")]


def test_a_run_by_the_clock_is_told_with_its_losses_countable(start, simulator, scenario, tmp_path):
    # GIVEN a listener that does not hold up the run
    url = private_url()
    listener = Listener(url)
    options = ["--out", tmp_path / "run", "--duration", "3", "--real-time", "--publish", f"lcm:{url}"]
    program = start(simulator, scenario, *options)
    listener.listen_until(lambda: program.process.poll() is not None)
    # THEN what has come is in order, and the sequence numbers account for every tick
    assert program.wait() == 0
    for name in ("leg_sample_t", *TRUTH):
        ticks = [message.tick for message in listener.messages[name]]
        assert ticks == sorted(set(ticks)) and SURE_TO_COME <= len(ticks) <= TICKS
        assert [message.sequence for message in listener.messages[name]] == ticks
    print(f"lost {TICKS - len(listener.messages['leg_sample_t'])} of {TICKS} samples by the clock")
