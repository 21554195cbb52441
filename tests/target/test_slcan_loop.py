"""The live loop of the emulated Cortex-M7 over its serial line, as SLCAN: with python-can and with the simulator.

No clock of the host judges anything here: in lockstep each side waits for the other.
"""

import json
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from socket import IPPROTO_TCP, TCP_NODELAY, create_server, socket

import numpy as np
from hexload_tools import mps2, project, target
from hexload_tools.log_file import LegLog, read_log
from hexload_tools.run_directory import PAPER_PARAMETERS, Run, read_run
from hexload_tools.virtual_controller import running_controller
from recorded import log_of
from slcan_peer import ANSWER_PERIOD, CONTRACT, Peer, decode

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
SCENARIO = project.SCENARIOS / "paper.toml"
SECOND = 1000  # ticks
TICKS = 5000
PAGES = 13
ARMED, ESTIMATING, CONVERGED = 1, 2, 3
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


def answers(peer: Peer, samples: np.ndarray) -> list[bytes]:
    """Of a fresh run in lockstep over the samples: the data of every page."""
    acknowledge = peer.start()
    assert (acknowledge["result"], acknowledge["state"], acknowledge["profile"]) == (0, ARMED, CLASSIC)
    begin = time.monotonic()
    pages = [page for sample in samples if (page := peer.ask(sample)) is not None]
    print(f"{len(samples) / (time.monotonic() - begin):.0f} samples/s with python-can")
    return pages


def test_the_controller_answers_as_the_hosts_firmware_does_to_the_byte(tmp_path):
    # GIVEN a second of a recorded log, and the controller as a process of this machine
    samples = target.samples_of(log_of("paper_noisy"), 1.0)[: SECOND + 1]
    with line() as (near, far), Peer(f"socket://127.0.0.1:{near}") as peer:
        with running_controller(PLATFORM, ("--bus", f"slcan:127.0.0.1:{far}", "--profile", "classic")):
            host = answers(peer, samples)
    # WHEN python-can sends the same frames to the emulated Cortex-M7
    with mps2.running_mps2(tmp_path) as controller, Peer(controller.python_can_channel) as peer:
        pages = answers(peer, samples)
        status = {name: value for _ in range(STATUS_PAGES) for name, value in peer.status().items()}
    # THEN all bytes of all pages are the same: every second tick has one, in rounds of thirteen
    assert len(pages) == len(samples[::ANSWER_PERIOD])
    assert pages == host
    decoded = [decode("AnswerPage", page) for page in pages]
    assert [page["page"] for page in decoded] == [n % PAGES for n in range(len(pages))]
    # AND they say that it estimates, from the first answer on, and what
    assert {page["state"] for page in decoded if page["page"] == 0} <= {ESTIMATING, CONVERGED}
    last = {name: value for page in decoded[-PAGES:] for name, value in page.items()}
    print({name: float(f"{last[name]:.5g}") for name in PAPER_PARAMETERS})
    assert all(last[name] != 0 and last[f"sigma_{name}"] > 0 for name in PAPER_PARAMETERS)
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


def simulate(bus: str, directory: Path) -> Run:
    """The paper's scenario in closed loop."""
    command = [project.simulator(), SCENARIO, "--out", directory, "--bus", bus, "--profile", "classic"]
    result = subprocess.run([*command, "--duration", str(TICKS / 1000)], capture_output=True, text=True)
    print(result.stdout)
    assert result.returncode == 0, result.stderr
    return read_run(directory)


def estimate_lines(path: Path) -> list[str]:
    return path.read_text().splitlines()[1:]


def test_the_simulator_closes_the_loop_over_five_thousand_ticks_without_a_loss(tmp_path):
    # GIVEN the emulated controller WHEN the paper's scenario runs against it in lockstep
    with mps2.running_mps2(tmp_path) as controller:
        run = simulate(controller.bus, tmp_path / "run")
    # THEN every sample was sent, and every second one answered
    bus = json.loads((run.directory / "meta.json").read_text())["bus"]
    expected = TICKS // ANSWER_PERIOD + 1
    assert (bus["samples"], bus["answers_expected"], bus["answers"]) == (TICKS + 1, expected, expected)
    assert bus["answers_missing"] == bus["answers_late"] == bus["unsent"] == bus["saturated"] == 0
    assert run.meta["missing"] == run.meta["refused"] == 0
    # AND each estimate that came, one in a round of pages, is that of the host's firmware over the quantised samples
    native = project.native_module()
    replayed = tmp_path / "replayed.csv"
    native.replay(native.load_platform(str(PLATFORM)), None, None, run.log.t_s, *quantised(run.log), str(replayed))
    own = {line.split(",")[0]: line for line in estimate_lines(replayed)}
    received = estimate_lines(run.directory / "estimates.csv")
    assert len(received) == expected // PAGES
    assert received == [own[line.split(",")[0]] for line in received]
    # AND they have come to the load
    truth = run.load_parameters(run.estimates["t"][-1:])
    for name in PAPER_PARAMETERS:
        estimate, sigma = run.estimates[name][-1], run.estimates[f"s_{name}"][-1]
        print(f"{name}: {estimate:.5g} +- {sigma:.2g}, truth {truth[name][0]:.5g}")
        assert abs(estimate - truth[name][0]) < 4 * sigma, name
        assert sigma < 0.5 * run.estimates[f"s_{name}"][0], name
