"""The limits of budget.toml: memory, stack and instructions of the estimator on a Cortex-M7, and what it is linked with."""

import subprocess
import tomllib
from functools import cache
from pathlib import Path

import hexload_native
import numpy as np
import pytest
from call_graph import deepest_chain, read_call_graph
from hexload_tools import target
from hexload_tools.hard_inputs import hard_samples
from hexload_tools.log_file import read_log

HERE = Path(__file__).parent
DATA = HERE.parent / "data"
BUDGET = tomllib.loads((HERE / "budget.toml").read_text())
LIBRARY = BUDGET["library_stack_bytes"]
PRESETS = (*target.CORTEX_M7.values(), "target-cortex-m4f", "target-cortex-r5f")
TICK_S = 1e-3

# What the issue of the controller targets allows, whatever stands in budget.toml.
MOST_BYTES = {"core_text": 24 * 1024, "estimator": 2 * 1024}
MOST_TICK_STACK_BYTES = 3 * 1024


def check(what: str, found: int, limit: int) -> None:
    print(f"{what}: {found} of {limit}")
    assert found <= limit, what


@cache
def platform():
    return hexload_native.load_platform(DATA / "paper_load.toml")


@cache
def recorded() -> np.ndarray:
    return target.samples_of(read_log(DATA / "paper_noisy.csv.gz"), 10.0)


@pytest.fixture(scope="module")
def replays(tmp_path_factory) -> dict[str, dict[str, target.Replayed]]:
    """By optimisation level: the recorded motion, and the hard inputs."""
    folder = tmp_path_factory.mktemp("replay")
    config = hexload_native.config_bytes(platform(), TICK_S)
    inputs = {"motion": recorded(), "hard": hard_samples(hexload_native, platform(), recorded())}
    return {
        optimisation: {name: target.replay(preset, config, samples, folder) for name, samples in inputs.items()}
        for optimisation, preset in target.CORTEX_M7.items()
    }


@cache
def call_graph(preset: str):
    return read_call_graph(target.directory(preset) / "firmware" / "CMakeFiles" / "firmware.dir")


def test_limits_are_within_those_of_the_issue():
    for what, most in MOST_BYTES.items():
        assert BUDGET["bytes"][what] <= most, what
    assert BUDGET["stack_bytes"]["hexload_tick"] <= MOST_TICK_STACK_BYTES


def test_code_and_data_of_the_core_are_within_their_limits():
    size = target.size_of(target.library(target.CORTEX_M7["-O2"]))
    check("text of the core, bytes", size.text, BUDGET["bytes"]["core_text"])
    check("data of the core, bytes", size.data, BUDGET["bytes"]["core_data"])


def test_instance_and_configuration_are_within_their_limits(replays):
    found = replays["-O2"]["motion"]
    check("hexload_t, bytes", found.estimator_bytes, BUDGET["bytes"]["estimator"])
    check("hexload_config_t, bytes", found.config_bytes, BUDGET["bytes"]["config"])


@pytest.mark.parametrize("preset", PRESETS)
def test_core_needs_nothing_from_a_library_but_what_is_listed(preset):
    # GIVEN the core's archive WHEN its symbols are listed
    listed = subprocess.run(
        ["arm-none-eabi-nm", "--format=posix", target.library(preset)], capture_output=True, text=True, check=True
    ).stdout
    symbols = [line.split()[:2] for line in listed.splitlines() if len(line.split()) >= 2]
    defined = {name for name, kind in symbols if kind != "U"}
    needed = {name for name, kind in symbols if kind == "U"} - defined
    # THEN there is no heap, no printing, no arithmetic in software (__aeabi_d..., __aeabi_f...) and no mathematics
    assert len(defined) > 20
    assert needed == set(LIBRARY)


@pytest.mark.parametrize("preset", PRESETS)
def test_no_function_of_the_core_has_an_unbounded_stack(preset):
    functions = call_graph(preset)
    assert len(functions) > 20
    assert [name for name, function in functions.items() if not function.is_bounded] == []
    largest = max(function.stack_bytes for function in functions.values())
    check(f"{preset}: largest frame, bytes", largest, BUDGET["stack_bytes"]["largest_frame"])


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("start", [name for name in BUDGET["stack_bytes"] if name != "largest_frame"])
def test_deepest_chain_of_calls_is_within_its_limit(preset, start):
    # GIVEN all calls of the core WHEN they are followed from where an application enters THEN there is no recursion, no
    # call of an unknown function, and the chain that needs most is within its limit
    depth, chain = deepest_chain(call_graph(preset), LIBRARY, start)
    check(f"{preset}: {' -> '.join(name.rsplit('/', 1)[-1] for name in chain)}, bytes", depth, BUDGET["stack_bytes"][start])


def test_stack_that_the_ticks_used_is_that_of_the_chain(replays):
    for optimisation, preset in target.CORTEX_M7.items():
        # GIVEN the stack that ticks of all kinds have left behind WHEN it is compared with the call graph's
        used = max(replayed.answers["tick_stack_bytes"].max() for replayed in replays[optimisation].values())
        depth, _ = deepest_chain(call_graph(preset), LIBRARY, "hexload_tick")
        # THEN the calls have missed nothing, and count little that is not used
        print(f"{optimisation}: {used} bytes used of {depth}")
        assert 0.9 * depth < used <= depth


@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_are_within_their_limits(optimisation, replays):
    limits = BUDGET["instructions"][optimisation]
    motion = replays[optimisation]["motion"].answers[1:]
    hard = replays[optimisation]["hard"].answers
    for kind, answers in {"motion": motion, "worst": np.concatenate([motion, hard])}.items():
        for stage, found in zip(target.STAGES, answers["stage_instructions"].max(axis=0), strict=True):
            check(f"{optimisation}, {kind}, {stage}, instructions", found, limits[kind][stage])
        check(f"{optimisation}, {kind}, tick, instructions", answers["tick_instructions"].max(), limits[kind]["tick"])


def test_hard_inputs_lead_everywhere(replays):
    # GIVEN the inputs of the worst case WHEN their answers are looked through
    answers = replays["-O2"]["hard"].answers
    accepted = answers[answers["status"] == 0]
    health = np.bitwise_or.reduce(accepted["health"])
    # THEN every refusal of a sample is among them, and every health bit but FILTER_RESTARTED (8), to which no sample
    # leads that is not refused
    assert set(answers["status"]) == {0, -2, -3, -4, -5}
    assert health == 0b1011111111
    # AND Newton's search has gone to its limit from the last pose and from home, 8 steps each
    one_step = np.median(accepted["stage_instructions"][:, target.STAGES.index("kinematics")])
    assert answers["stage_instructions"][:, target.STAGES.index("kinematics")].max() > 8 * one_step
