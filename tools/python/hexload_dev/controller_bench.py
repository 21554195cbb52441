"""What a tick costs on a Cortex-M7, beside other filters: the second half of `hexload bench`."""

import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.io.log_file import read_log
from hexload_dev import build, target
from hexload_dev.hard_inputs import hard_samples

DATA = project.ROOT / "tests" / "data"
REFERENCE = Path(__file__).with_name("reference_filters.toml")
MOTION_S = 10.0
TICK_S = 1e-3
MOMENTUM = {"momentum": "momentum", "momentum_effects": "momentum with bias and friction"}  # programs, what they run
RIVALS = {"dense": ("dense and generic", "dense_filter.c"), "eigen": ("Eigen, block-structured", "eigen_filter.cpp")}
RIVAL_BYTES = 4 * (7 + 7 * 7)  # state and covariance


NodeKind = tuple[str, str]  # filter and profile
NODE_KINDS: list[NodeKind] = [(name, profile) for name in target.FILTERS for profile in target.PROFILES]


@dataclass(frozen=True)
class Momentum:
    estimator_bytes: int
    motion: np.ndarray  # answers
    hard: np.ndarray

    @property
    def stack_bytes(self) -> int:
        return max(run["tick_stack_bytes"].max() for run in (self.motion, self.hard))


@dataclass(frozen=True)
class Measured:
    motion: target.Replayed
    hard: target.Replayed
    rivals: dict[str, np.void]
    nodes: dict[NodeKind, tuple[target.NodeRun, target.NodeRun]]  # motion, hard
    momentum: dict[str, Momentum]  # by program
    core: target.Size
    bus_and_app: target.Size


def print_controller_tables() -> dict[str, list[dict[str, str]]]:
    """Returns them too: rows_of each, by title."""
    measured = _measure()
    console, tables = Console(), (_stage_table(measured), _filter_table(measured), _memory_table(measured))
    for table in tables:
        console.print(table)
    return {str(table.title): rows_of(table) for table in tables}


def rows_of(table: Table) -> list[dict[str, str]]:
    """A row as its cells by heading."""
    headings = [str(column.header) for column in table.columns]
    return [dict(zip(headings, map(str, cells))) for cells in zip(*(column.cells for column in table.columns))]


def _measure() -> dict[str, Measured]:
    build.ensure_built("hexload_native")
    native = project.native_module()
    platform = native.load_platform(DATA / "paper_load.toml")
    config = native.config_bytes(platform, TICK_S)
    recorded = target.samples_of(read_log(DATA / "paper_noisy.csv.gz"), MOTION_S)
    hard = hard_samples(native, platform, recorded)
    measured = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for optimisation, preset in target.CORTEX_M7.items():
            target.build_preset(preset)
            measured[optimisation] = Measured(
                target.replay(preset, config, recorded, folder),
                target.replay(preset, config, hard, folder),
                target.run_rivals(preset, folder),
                {
                    (name, profile): (
                        target.run_node(preset, profile, name, config, recorded, folder),
                        target.run_node(preset, profile, name, config, hard, folder),
                    )
                    for name, profile in NODE_KINDS
                },
                {program: _measure_momentum(preset, config, recorded, hard, folder, program) for program in MOMENTUM},
                target.size_of(target.library(preset)),
                target.size_of(*target.node_libraries(preset)),
            )
    return measured


def _measure_momentum(
    preset: str, config: bytes, recorded: np.ndarray, hard: np.ndarray, folder: Path, program: str
) -> Momentum:
    size, motion = target.replay_momentum(preset, config, recorded, folder, program)
    return Momentum(size, motion, target.replay_momentum(preset, config, hard, folder, program)[1])


def _stage_table(measured: dict[str, Measured]) -> Table:
    table = _table(
        f"Instructions on a Cortex-M7: longest tick found in {MOTION_S:g} s of motion, and in hard input", "stage"
    )
    for optimisation in measured:
        table.add_column(f"{optimisation}, motion", justify="right")
        table.add_column(f"{optimisation}, hard input", justify="right")
    for row, stage in enumerate(target.STAGES):
        counts = [answers["stage_instructions"][:, row].max() for each in measured.values() for answers in _both(each)]
        table.add_row(stage, *(f"{count:,}" for count in counts))
    ticks = [answers["tick_instructions"].max() for each in measured.values() for answers in _both(each)]
    table.add_row("whole tick", *(f"{count:,}" for count in ticks))
    for program, name in MOMENTUM.items():
        momentum = [each.momentum[program] for each in measured.values()]
        ticks = [run["tick_instructions"].max() for each in momentum for run in (each.motion, each.hard)]
        table.add_row(f"whole tick, {name}", *(f"{count:,}" for count in ticks))
    for kind in NODE_KINDS:
        for column, part in enumerate(target.NODE_PARTS):
            counts = [
                answers["instructions"][:, column].max()
                for each in measured.values()
                for answers in _node_both(each, kind)
            ]
            table.add_row(f"{part}, {', '.join(kind)}", *(f"{count:,}" for count in counts))
    for name in ("start", "period"):
        counts = [
            max(getattr(motion, f"{name}_instructions") for motion, _ in each.nodes.values())
            for each in measured.values()
        ]
        table.add_row(f"hexload_node: {name}", *(word for count in counts for word in ("", f"{count:,}")))
    return table


def _both(measured: Measured) -> tuple[np.ndarray, np.ndarray]:
    motion = measured.motion.answers[1:]
    return motion, np.concatenate([motion, measured.hard.answers])


def _node_both(measured: Measured, kind: NodeKind) -> tuple[np.ndarray, np.ndarray]:
    motion, hard = (run.answers for run in measured.nodes[kind])
    return motion[1:], np.concatenate([motion[1:], hard])


def _filter_table(measured: dict[str, Measured]) -> Table:
    table = _table(
        "One filter step, 7 states, 3 measurements; others at -O3 with -ffast-math; * by this call", "filter"
    )
    for heading in ("-O2", "-O3", "text, B", "RAM, B"):
        table.add_column(heading, justify="right")
    preset = target.CORTEX_M7["-O2"]
    own_bytes = measured["-O2"].motion.filter_bytes
    stage = target.STAGES.index("filter")

    def add(name: str, instructions: list[int], sources: tuple[str, ...], ram_bytes: int) -> None:
        text_bytes = target.size_of(*target.objects(preset, *sources)).text
        table.add_row(name, *(f"{number:,}" for number in (*instructions, text_bytes, ram_bytes)))

    whole = [_both(each)[0]["stage_instructions"][:, stage].max() for each in measured.values()]
    for name, filter_name in (("time and measurement update", "kalman"), ("with gate, bounds, noise effects", "own")):
        counts = [each.rivals[filter_name]["instructions"] for each in measured.values()]
        add(f"* hexload, {name}", counts, ("paper_filter.c",), own_bytes)
    add("* hexload, with model and noise", whole, ("paper_filter.c", "paper_model.c"), own_bytes)
    for rival, (name, source) in RIVALS.items():
        add(f"* {name}", [each.rivals[rival]["instructions"] for each in measured.values()], (source,), RIVAL_BYTES)
    for row in tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["filter"]:
        table.add_row(row["name"], *(f"{row[key]:,}" if key in row else "" for key in ("o2", "o3", "text", "ram")))
    return table


def _memory_table(measured: dict[str, Measured]) -> Table:
    table = _table("Memory on a Cortex-M7 in bytes", "what")
    for optimisation in measured:
        table.add_column(optimisation, justify="right")
    rows = {
        "code and constants of the core, all estimators": [each.core.text for each in measured.values()],
        "an estimator": [each.motion.estimator_bytes for each in measured.values()],
        **{
            f"an estimator, {name}": [each.momentum[program].estimator_bytes for each in measured.values()]
            for program, name in MOMENTUM.items()
        },
        "its configuration": [each.motion.config_bytes for each in measured.values()],
        "stack of a tick": [_both(each)[1]["tick_stack_bytes"].max() for each in measured.values()],
        **{
            f"stack of a tick, {name}": [each.momentum[program].stack_bytes for each in measured.values()]
            for program, name in MOMENTUM.items()
        },
        "code and constants of bus and application": [each.bus_and_app.text for each in measured.values()],
        "a bus node, either estimator included": [
            each.nodes[NODE_KINDS[0]][0].node_bytes for each in measured.values()
        ],
    }
    for name in target.FILTERS:
        kinds = [kind for kind in NODE_KINDS if kind[0] == name]
        rows[f"stack of a whole sample, {name}"] = [
            max(_node_both(each, kind)[1]["stack_bytes"].max() for kind in kinds) for each in measured.values()
        ]
    for name, numbers in rows.items():
        table.add_row(name, *(f"{number:,}" for number in numbers))
    return table


def _table(title: str, first_heading: str) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column(first_heading)
    return table
