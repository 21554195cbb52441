"""The live loop of the emulated Cortex-M7 over its serial line, as SLCAN: with python-can and with the simulator.

No clock of the host judges anything here: in lockstep each side waits for the other.
"""

import json
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from socket import IPPROTO_TCP, TCP_NODELAY, create_server, socket

import numpy as np
import pytest

from hexload import project
from hexload.io.log_file import LegLog, read_log
from hexload.io.run_directory import PAPER_PARAMETERS, read_run
from hexload.simulation.virtual_controller import running_controller
from hexload_dev import mps2, target
from recorded import log_of, on_rig
from slcan_peer import ANSWER_PERIOD, CONTRACT, FILTERS, Peer, decode

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
SCENARIO = project.SCENARIOS / "paper.toml"
SECOND = 1000  # ticks
TICKS = 5000
MOMENTUM_TICKS = 2000
# Of an answer, in sending order.
PAGES = {"paper": tuple(range(13)), "momentum": (0, *range(13, 33), 9, 10, 11, 12, 33)}
LOAD_PARAMETERS = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
NAMES = {"paper": PAPER_PARAMETERS, "momentum": tuple(f"load_{name}" for name in LOAD_PARAMETERS)}  # of signals
STATUS_PAGES = len(CONTRACT.get_message_by_name("ControllerStatus").get_signal_by_name("page").choices)
IDLE, ARMED, ESTIMATING, CONVERGED = 0, 1, 2, 3
CLASSIC = 1
STEP_OF = {"displacement": "displacement_m", "velocity": "velocity_m_s", "force": "force_n"}


@contextmanager
def line() -> Iterator[tuple[int, int]]:
    """Two local ports; what the one that connects to the first writes, the one at the second reads, and vice versa."""
    with create_server(("127.0.0.1", 0)) as one, create_server(("127.0.0.1", 0)) as other:
        threading.Thread(target=_pass_on_between, args=(one, other), daemon=True).start()
        yield one.getsockname()[1], other.getsockname()[1]


def _pass_on_between(*servers: socket) -> None:
    """Until one of the two ends its connection."""
    one, other = (server.accept()[0] for server in servers)
    for end in (one, other):
        end.setsockopt(IPPROTO_TCP, TCP_NODELAY, 1)
    partner = {one: other, other: one}
    with one, other:
        while True:
            for end in select(partner, [], [])[0]:
                data = end.recv(4096)
                if not data:
                    return
                partner[end].sendall(data)


@pytest.fixture
def built_in(tmp_path) -> Path:
    """The platform file of the paper with the tolerances of a real machine: the configuration that is built into the
    controller."""
    path = tmp_path / "built_in.toml"
    path.write_text(re.sub(r"\[tolerances\][^\[]*", "", PLATFORM.read_text()))
    return path


@pytest.fixture
def unknown_load(built_in, tmp_path) -> Path:
    """The same without the load's mass, for a filter that needs none."""
    text = built_in.read_text()
    assert text.count("known_mass_kg = 500.0") == text.count('kind = "paper"') == 1
    path = tmp_path / "unknown_load.toml"
    path.write_text(text.replace("known_mass_kg = 500.0", "").replace('kind = "paper"', 'kind = "momentum"'))
    return path


def answers(peer: Peer, filter_name: str, samples: np.ndarray) -> list[bytes]:
    """Of a fresh run in lockstep over the samples: the data of every page."""
    selected, started = peer.start(filter_name)
    assert (selected["result"], selected["state"]) == (0, IDLE)
    assert (started["result"], started["state"], started["profile"]) == (0, ARMED, CLASSIC)
    begin = time.monotonic()
    pages = [page for sample in samples if (page := peer.ask(sample)) is not None]
    print(f"{len(samples) / (time.monotonic() - begin):.0f} samples/s with python-can")
    return pages


@pytest.mark.parametrize("filter_name", FILTERS)
def test_the_controller_answers_as_the_hosts_firmware_does_to_the_byte(filter_name, built_in, unknown_load, tmp_path):
    # GIVEN a second of a recorded log, and the controller as a process of this machine
    samples = target.samples_of(log_of("paper_noisy"), 1.0)[: SECOND + 1]
    platform = {"paper": built_in, "momentum": unknown_load}[filter_name]
    with line() as (near, far), Peer(f"socket://127.0.0.1:{near}") as peer:
        with running_controller(
            platform, ("--without-authentication", "--bus", f"slcan:127.0.0.1:{far}", "--profile", "classic")
        ):
            host = answers(peer, filter_name, samples)
    # WHEN python-can sends the same frames to the emulated Cortex-M7
    with mps2.running_mps2(tmp_path) as controller, Peer(controller.python_can_channel) as peer:
        pages = answers(peer, filter_name, samples)
        status = {name: value for _ in range(STATUS_PAGES) for name, value in peer.status().items()}
    # THEN all bytes of all pages are the same: every second tick has one, in rounds
    codes = PAGES[filter_name]
    assert len(pages) == len(samples[::ANSWER_PERIOD])
    assert pages == host
    decoded = [decode("AnswerPage", page) for page in pages]
    assert [page["page"] for page in decoded] == [codes[n % len(codes)] for n in range(len(pages))]
    # AND they say that it estimates, from the first answer on, and what
    of_health = [page for page in decoded if page["page"] == 0]
    assert {page["state"] for page in of_health} <= {ESTIMATING, CONVERGED}
    assert {page["filter"] for page in of_health} == {FILTERS.index(filter_name)}
    last = {name: value for page in decoded[-len(codes) :] for name, value in page.items()}
    print({name: float(f"{last[name]:.5g}") for name in NAMES[filter_name]})
    assert all(last[name] != 0 and last[f"sigma_{name}"] > 0 for name in NAMES[filter_name])
    # AND nothing was lost or refused
    assert (status["samples_missing"], status["frames_refused"], status["samples_refused"]) == (0, 0, 0)
    print(f"least time left in a period: {status['time_margin']:.0f} us; {status['overruns']:.0f} periods late")


def quantised(log: LegLog) -> list[np.ndarray]:
    """What arrives of a log: the nearest number of steps, in the codec's float32 arithmetic."""
    legs = []
    for channel, name in STEP_OF.items():
        step = np.float32(CONTRACT.get_message_by_name("LegSample1").get_signal_by_name(channel).scale)
        steps = getattr(log, name).astype(np.float32) / step
        legs.append((np.trunc(steps + np.copysign(np.float32(0.5), steps)) * step).astype(float))
    return legs


def simulate(bus: str, directory: Path, ticks: int, *options) -> Path:
    """The paper's scenario in closed loop; the run directory."""
    command = [
        project.simulator(),
        SCENARIO,
        "--out",
        directory,
        "--bus",
        bus,
        "--profile",
        "classic",
        "--any-configuration",
        *options,
    ]
    result = subprocess.run([*command, "--duration", str(ticks / 1000)], capture_output=True, text=True)
    print(result.stdout)
    assert result.returncode == 0, result.stderr
    return directory


def assert_estimates_are_the_firmwares(directory: Path, platform, rows: int) -> None:
    """Each estimate that came, one in a round of pages, is that of the host's firmware over the quantised samples."""
    native, log = project.native_module(), read_log(directory / "log.csv")
    replayed = directory.with_name("replayed.csv")
    native.replay(platform, None, None, log.t_s, *quantised(log), str(replayed))
    header, *lines = (line.split(",") for line in replayed.read_text().splitlines())
    carried = [k for k, name in enumerate(header) if not name.startswith("n_")]  # a bus has no own sigmas
    own = {line[0]: ",".join(line[k] for k in carried) for line in lines}
    received = estimate_lines(directory / "estimates.csv")
    assert len(received) == rows
    assert received == [own[line.split(",")[0]] for line in received]


def estimate_lines(path: Path) -> list[str]:
    return path.read_text().splitlines()[1:]


def test_the_simulator_closes_the_loop_over_five_thousand_ticks_without_a_loss(built_in, tmp_path):
    # GIVEN the emulated controller WHEN the paper's scenario runs against it in lockstep
    with mps2.running_mps2(tmp_path) as controller:
        run = read_run(simulate(controller.bus, tmp_path / "run", TICKS))
    # THEN every sample was sent, and every second one answered
    bus = json.loads((run.directory / "meta.json").read_text())["bus"]
    expected = TICKS // ANSWER_PERIOD + 1
    assert (bus["samples"], bus["answers_expected"], bus["answers"]) == (TICKS + 1, expected, expected)
    assert bus["answers_missing"] == bus["answers_late"] == bus["unsent"] == bus["saturated"] == 0
    assert run.meta["missing"] == run.meta["refused"] == 0
    # AND each estimate that came is that of the host's firmware
    platform = project.native_module().load_platform(str(built_in))
    assert_estimates_are_the_firmwares(run.directory, platform, expected // len(PAGES["paper"]))
    # AND they have come to the load
    truth = run.load_parameters(run.estimates["t"][-1:])
    for name in PAPER_PARAMETERS:
        estimate, sigma = run.estimates[name][-1], run.estimates[f"s_{name}"][-1]
        print(f"{name}: {estimate:.5g} +- {sigma:.2g}, truth {truth[name][0]:.5g}")
        assert abs(estimate - truth[name][0]) < 4 * sigma, name
        assert sigma < 0.5 * run.estimates[f"s_{name}"][0], name


def test_the_momentum_filter_closes_the_loop_on_the_cortex_m7_that_knows_its_rig(unknown_load, tmp_path):
    # GIVEN the emulated controller with the configuration of a commissioned rig in its boot options
    native = project.native_module()
    platform = on_rig(native.load_platform(str(unknown_load)), tmp_path / "rig.toml")
    config = native.config_bytes(platform, 1e-3)
    # WHEN a short run against it, in lockstep, selects the momentum filter
    with mps2.running_mps2(tmp_path, config=config) as controller:
        directory = simulate(controller.bus, tmp_path / "run", MOMENTUM_TICKS, "--estimator", "momentum")
    # THEN nothing was lost, and each estimate that came, of all ten, is that of the host's firmware
    bus = json.loads((directory / "meta.json").read_text())["bus"]
    expected = MOMENTUM_TICKS // ANSWER_PERIOD + 1
    assert (bus["samples"], bus["answers"], bus["answers_missing"]) == (MOMENTUM_TICKS + 1, expected, 0)
    assert_estimates_are_the_firmwares(directory, platform, expected // len(PAGES["momentum"]))
    # AND the load's weight is known by then, to what a rig that is none takes off
    header = (directory / "estimates.csv").read_text().splitlines()[0].split(",")
    last = dict(zip(header, estimate_lines(directory / "estimates.csv")[-1].split(",")))
    assert tuple(header[1:11]) == LOAD_PARAMETERS
    print(f"m: {last['m']} +- {last['s_m']}")
    assert abs(float(last["m"]) - 500.0) < 5.0
