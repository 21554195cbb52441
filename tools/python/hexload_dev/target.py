"""The controller under emulation: builds its programs, runs them in QEMU, and says what they computed and executed."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.errors import ToolFailed
from hexload.io.log_file import LegLog
from hexload_dev import build
from hexload_dev.sandbox import QEMU_SANDBOX

CORTEX_M7 = {"-O2": "target-cortex-m7", "-O3": "target-cortex-m7-o3"}  # presets
STAGES = ("leg sample", "kinematics", "plausibility", "wrench", "filter", "supervisor")
RIVALS = ("dense", "eigen", "own", "kalman")
PROFILES = ("fd", "classic")
FILTERS = ("paper", "momentum")
NODE_PARTS = ("decode", "encode", "whole sample")
PATIENCE_S = 300.0  # for a run of seconds

# One instruction takes 64 ns of the board's time, whatever the host is doing.
BOARD = ["qemu-system-arm", *QEMU_SANDBOX]
BOARD += "-machine mps2-an500 -display none -monitor none -serial none -icount shift=6,sleep=off -kernel".split()

# As in tests/target/programs.
HEADER = np.dtype([(name, "<u4") for name in ("config_bytes", "estimator_bytes", "filter_bytes", "nop_instructions")])
SAMPLE = np.dtype([("tick", "<u4"), ("displacement_m", "<f4", 6), ("velocity_m_s", "<f4", 6), ("force_n", "<f4", 6)])
ANSWER = np.dtype(
    [
        ("status", "<i4"),
        ("health", "<u4"),
        ("value", "<f4", 4),
        ("sigma", "<f4", 4),
        ("nis", "<f4"),
        ("nis_mean", "<f4"),
        ("verdict", "<u4"),
        ("parameter_verdict", "<u4", 4),
        ("stage_instructions", "<u4", len(STAGES)),
        ("tick_instructions", "<u4"),
        ("tick_stack_bytes", "<u4"),
    ]
)
MOMENTUM_HEADER = np.dtype([("config_bytes", "<u4"), ("estimator_bytes", "<u4")])
MOMENTUM_ANSWER = np.dtype(
    [
        ("status", "<i4"),
        ("health", "<u4"),
        ("value", "<f4", 10),
        ("sigma", "<f4", 10),
        ("nis", "<f4"),
        ("verdict", "<u4"),
        ("tick_instructions", "<u4"),
        ("tick_stack_bytes", "<u4"),
    ]
)
BODY_QUESTION = np.dtype([("theta", "<f4", 10), ("covariance", "<f4", 55)])
BODY_ANSWER = np.dtype(
    [
        *((name, "<f4") for name in ("mass_kg", "mass_sigma_kg")),
        *((name, "<f4", 3) for name in ("com_m", "com_sigma_m")),
        *((name, "<f4", 6) for name in ("inertia_kg_m2", "inertia_sigma_kg_m2")),
        *((name, "<u4") for name in ("has_com", "has_inertia", "is_consistent")),
        ("nearest", "<f4", 10),
        ("distance_sigmas", "<f4"),
        ("is_found", "<u4"),
        *((name, "<u4") for name in ("describe_instructions", "nearest_instructions")),
        *((name, "<u4") for name in ("describe_stack_bytes", "nearest_stack_bytes")),
    ]
)
RIVAL_ANSWER = np.dtype([("instructions", "<u4"), ("parameter", "<f4", 4)])

NODE_HEADER = np.dtype(
    [
        (name, "<u4")
        for name in (
            "config_bytes",
            "node_bytes",
            "start_instructions",
            "period_instructions",
            "code_instructions",
            "proof_instructions",
            "longest_proof",
            "answer_proof",
            "longest_answer_proof",
        )
    ]
)
NODE_ANSWER = np.dtype(
    [("state", "<u4"), ("frames_sent", "<u4"), ("instructions", "<u4", len(NODE_PARTS)), ("stack_bytes", "<u4")]
)


@dataclass(frozen=True)
class Replayed:
    config_bytes: int
    estimator_bytes: int
    filter_bytes: int
    nop_instructions: int  # counted over a thousand instructions without effect
    answers: NDArray  # of ANSWER, one for each sample


@dataclass(frozen=True)
class NodeRun:
    node_bytes: int
    start_instructions: int  # of the command START
    period_instructions: int  # of the longest hexload_node_period()
    code_instructions: int  # more, of a command to a node with a key
    proof_instructions: int  # more, of a sample with a code: the mean of sixteen
    longest_proof: int  # of them, with the code's frame
    answer_proof: int  # more, of a sample whose answer has a code: the mean
    longest_answer_proof: int  # of them, with the code's frame
    answers: NDArray  # of NODE_ANSWER, one for each sample


@dataclass(frozen=True)
class Size:
    text: int
    data: int  # initialised and zeroed


def samples_of(log: LegLog, seconds: float) -> NDArray:
    """The log's start as the controller's samples."""
    rows = log.t_s <= log.t_s[0] + seconds
    samples = np.zeros(np.count_nonzero(rows), SAMPLE)
    samples["tick"] = np.rint((log.t_s[rows] - log.t_s[0]) / np.median(np.diff(log.t_s)))
    for name in ("displacement_m", "velocity_m_s", "force_n"):
        samples[name] = getattr(log, name)[rows]
    return samples


def replay(preset: str, config: bytes, samples: NDArray, folder: Path) -> Replayed:
    """Runs the program `replay` of a built preset; its files stay in `folder`."""
    (folder / "log").write_bytes(config + samples.tobytes())
    run(preset, "replay", ["log", "out"], folder)
    content = (folder / "out").read_bytes()
    header = np.frombuffer(content, HEADER, count=1)[0]
    answers = np.frombuffer(content, ANSWER, offset=HEADER.itemsize)
    if header["config_bytes"] != len(config) or len(answers) != len(samples):
        raise ToolFailed(f"{preset}: found {len(answers)} answers, expected {len(samples)}")
    return Replayed(*(int(value) for value in header), answers)


def replay_momentum(
    preset: str,
    config: bytes,
    samples: NDArray,
    folder: Path,
    program: Literal["momentum", "momentum_effects"] = "momentum",
) -> tuple[int, NDArray]:
    """Runs the program: bytes of its estimator, and answers of MOMENTUM_ANSWER, one for each sample."""
    (folder / "log").write_bytes(config + samples.tobytes())
    run(preset, program, ["log", "out"], folder)
    content = (folder / "out").read_bytes()
    header = np.frombuffer(content, MOMENTUM_HEADER, count=1)[0]
    answers = np.frombuffer(content, MOMENTUM_ANSWER, offset=MOMENTUM_HEADER.itemsize)
    if header["config_bytes"] != len(config) or len(answers) != len(samples):
        raise ToolFailed(f"{preset}: found {len(answers)} answers, expected {len(samples)}")
    return int(header["estimator_bytes"]), answers


def run_bodies(preset: str, thetas: NDArray, covariances: NDArray, folder: Path) -> NDArray:
    """Runs the program `body` on estimates [n, 10] with covariances [n, 10, 10]: answers of BODY_ANSWER."""
    questions = np.zeros(len(thetas), BODY_QUESTION)
    questions["theta"] = thetas
    questions["covariance"] = np.asarray(covariances)[:, *np.tril_indices(10)]
    (folder / "in").write_bytes(questions.tobytes())
    run(preset, "body", ["in", "out"], folder)
    answers = np.frombuffer((folder / "out").read_bytes(), BODY_ANSWER)
    if len(answers) != len(questions):
        raise ToolFailed(f"{preset}: found {len(answers)} answers, expected {len(questions)}")
    return answers


def run_node(preset: str, profile: str, filter_name: str, config: bytes, samples: NDArray, folder: Path) -> NodeRun:
    """Runs the program `node`: the samples reach the application, with this estimator, as frames of the profile.

    Samples with a number that is not finite are left out, as no frame carries one.
    """
    finite = np.all([np.isfinite(samples[name]).all(axis=1) for name in SAMPLE.names[1:]], axis=0)
    (folder / "log").write_bytes(config + samples[finite].tobytes())
    run(preset, "node", [profile, filter_name, "log", "out"], folder)
    content = (folder / "out").read_bytes()
    header = np.frombuffer(content, NODE_HEADER, count=1)[0]
    answers = np.frombuffer(content, NODE_ANSWER, offset=NODE_HEADER.itemsize)
    if header["config_bytes"] != len(config) or len(answers) != np.count_nonzero(finite):
        raise ToolFailed(f"{preset}: found {len(answers)} answers, expected {np.count_nonzero(finite)}")
    return NodeRun(*(int(header[name]) for name in NODE_HEADER.names[1:]), answers)


def run_rivals(preset: str, folder: Path) -> dict[str, np.void]:
    """Filters on one problem: the instructions of their longest step, and what they identified."""
    run(preset, "rivals", ["out"], folder)
    return dict(zip(RIVALS, np.fromfile(folder / "out", RIVAL_ANSWER), strict=True))


def run(preset: str, program: str, arguments: list[str], folder: Path) -> None:
    """Ends when the program does. Raises ToolFailed for a status other than 0."""
    semihosting = ",".join(["enable=on", "target=native", *(f"arg={word}" for word in (program, *arguments))])
    path = directory(preset) / "tests" / "target" / "programs" / program
    command = [*BOARD, str(path), "-semihosting-config", semihosting]
    result = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, timeout=PATIENCE_S)
    if result.returncode != 0:
        raise ToolFailed(f"{preset}: {program} ended with status {result.returncode}")


def build_preset(preset: str) -> None:
    if shutil.which("arm-none-eabi-gcc") is None:
        raise ToolFailed(f"{preset}: found no arm-none-eabi-gcc; tools/hexload test and bench install it")
    build.build(preset)


def directory(preset: str) -> Path:
    return project.preset_directory(preset)


def objects(preset: str, *sources: str) -> list[Path]:
    """Of sources of the firmware, or else of the programs, found by name."""
    folders = [directory(preset) / name for name in ("firmware", "tests")]
    return [next(path for folder in folders for path in folder.rglob(f"{source}.obj")) for source in sources]


def library(preset: str) -> Path:
    return directory(preset) / "firmware" / "libhexload.a"


def node_libraries(preset: str) -> list[Path]:
    """The bus and the application, which a node links beside library()."""
    firmware = directory(preset) / "firmware"
    return [firmware / "bus" / "libhexload_bus.a", firmware / "app" / "libhexload_app.a"]


def size_of(*files: Path) -> Size:
    """The sum over objects and archives."""
    result = subprocess.run(["arm-none-eabi-size", "--totals", *files], capture_output=True, text=True, check=True)
    text, data, zeroed = (int(word) for word in result.stdout.splitlines()[-1].split()[:3])
    return Size(text, data + zeroed)
