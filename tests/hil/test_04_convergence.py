"""The paper's scenario over the bus gives the estimates of the run in process, but for quantised leg samples."""

import subprocess

import numpy as np
import pytest

from bus_frames import DBC, PROFILES
from hexload import project
from hexload.io.log_file import read_log
from hexload.io.run_directory import PAPER_PARAMETERS, read_run
from hexload_dev.bus_document import MOST_QUANTISATION
from loop import PAPER_S, PLATFORM, SCENARIO, estimates

pytestmark = pytest.mark.vcan

CHANNELS = {"displacement": "displacement_m", "velocity": "velocity_m_s", "force": "force_n"}
NOISE = {"displacement": "displacement_sigma_m", "velocity": "velocity_sigma_m_s", "force": "force_sigma_n"}


def step_of(profile: str, channel: str) -> float:
    message, suffix = {"fd": ("LegSampleFd", "_1"), "classic": ("LegSample1", "")}[profile]
    return DBC.get_message_by_name(message).get_signal_by_name(channel + suffix).scale


def quantised(values: np.ndarray, step: float) -> np.ndarray:
    """What arrives of `values`: the nearest number of steps, in the codec's float32 arithmetic."""
    step32 = np.float32(step)
    steps = values.astype(np.float32) / step32
    return np.trunc(steps + np.copysign(np.float32(0.5), steps)) * step32


@pytest.fixture(scope="module")
def in_process(kind, simulator, tmp_path_factory):
    directory = tmp_path_factory.mktemp("inproc") / "run"
    longest_s = max(PAPER_S[profile] for profile in kind.profiles)
    subprocess.run([simulator, SCENARIO, "--duration", str(longest_s), "--out", directory, "--quiet"], check=True)
    return read_run(directory)


@pytest.fixture(scope="module", params=PROFILES)
def over_bus(request, paper_run):
    """Profile and run."""
    return request.param, read_run(paper_run(request.param).directory)


@pytest.mark.needs("fused multiply-add")
@pytest.mark.parametrize("profile", PROFILES)
def test_estimates_are_the_firmwares_on_the_quantised_log_to_the_last_digit(paper_run, profile, tmp_path):
    # GIVEN a run over the bus, and its log quantised to the profile's steps
    recording = paper_run(profile)
    log = read_log(recording.directory / "log.csv")
    legs = [quantised(getattr(log, name), step_of(profile, channel)) for channel, name in CHANNELS.items()]
    # WHEN the firmware runs over it in this process
    native = project.native_module()
    out = tmp_path / "replayed.csv"
    platform = native.load_platform(str(PLATFORM))
    native.replay(platform, None, None, log.t_s, *(part.astype(float) for part in legs), str(out))
    replayed = {line.split(",")[0]: line for line in out.read_text().splitlines()[1:]}
    # THEN every estimate that came over the bus is among its own: all of them, or one in a round of 13 pages
    received = estimates(recording.directory)
    assert len(received) == {"fd": len(log.t_s), "classic": (len(log.t_s) + 1) // 26}[profile]
    assert received == [replayed[line.split(",")[0]] for line in received]


def test_the_bus_moves_an_estimate_by_a_small_part_of_its_sigma(over_bus, in_process):
    # GIVEN the same scenario in process, without quantisation: the plant is not in question
    profile, run = over_bus
    assert np.array_equal(run.log.force_n, in_process.log.force_n[: len(run.log.t_s)])
    # WHEN the last estimates are compared. Rounding to a step adds noise of step / sqrt(12), at most `share` of the
    # sensor's sigma; what it adds to an estimate is then that share of the estimate's own sigma.
    sensors = in_process.platform["sensors"]
    share = max(step_of(profile, channel) / np.sqrt(12) / sensors[NOISE[channel]] for channel in CHANNELS)
    assert share < MOST_QUANTISATION
    row = int(np.searchsorted(in_process.estimates["t"], run.estimates["t"][-1]))
    for name in PAPER_PARAMETERS:
        moved = run.estimates[name][-1] - in_process.estimates[name][row]
        sigma = in_process.estimates[f"s_{name}"][row]
        print(f"{profile} {name}: moved by {moved / sigma:+.4f} sigma")
        # THEN they differ by less than five of those sigmas
        assert abs(moved) < 5 * share * sigma, name


def test_estimates_over_the_bus_are_the_load(over_bus):
    # GIVEN a run over the bus WHEN its last estimates are compared with the load THEN they are within four sigma of it
    profile, run = over_bus
    truth = run.load_parameters(run.estimates["t"][-1:])
    for name in PAPER_PARAMETERS:
        estimate, sigma = run.estimates[name][-1], run.estimates[f"s_{name}"][-1]
        print(f"{profile} {name}: {estimate:.5g} +- {sigma:.2g}, truth {truth[name][0]:.5g}")
        assert abs(estimate - truth[name][0]) < 4 * sigma, name
