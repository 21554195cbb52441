"""The limits of budget.toml: memory, stack and instructions of the estimator on a Cortex-M7, and what it is linked with."""

import json
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import hexload_native
import numpy as np
import pytest

from call_graph import deepest_chain, read_call_graph
from hexload.io.log_file import read_log
from hexload_dev import target
from hexload_dev.full_rig import DIRECTIONS, with_full_rig
from hexload_dev.hard_inputs import hard_samples
from hexload_dev.uncertain_estimates import early_covariances, estimates

HERE = Path(__file__).parent
DATA = HERE.parent / "data"
BUDGET = tomllib.loads((HERE / "budget.toml").read_text())
LIBRARY = BUDGET["library_stack_bytes"]
PORT = "__indirect_call"  # what gcc calls a call through a pointer: here the functions of a port
PRESETS = (*target.CORTEX_M7.values(), "target-cortex-m4f", "target-cortex-r5f")
TICK_S = 1e-3
MOMENTUM_TICKS = 1500  # of the motion, with the momentum filter on a bus; momentum_runs have all of it

MOMENTUM_PROGRAMS = ("momentum", "momentum_effects")
TILTED = "tilt_sigma_rad = 0.01\n"  # goes on in the last section, [estimator]

# What the issue of the controller targets allows, whatever stands in budget.toml; of the momentum estimator, which has
# taken a rig's own parameters in, that of real machines.
MOST_MOMENTUM_TEXT = 32 * 1024  # without what looks whether the input is to be believed
MOST_BYTES = {
    "core_text": 24 * 1024,
    "estimator": 2 * 1024,
    "momentum_estimator": 20 * 1024,
}
MOST_STACK_BYTES = 3 * 1024
MOST_PAPER_INSTRUCTIONS = 6_000  # a whole sample of a motion at -O3
MOST_MOMENTUM_INSTRUCTIONS = {"-O2": 44_000, "-O3": 34_000}  # of any input
MOST_CONSIDERED_INSTRUCTIONS = 10_000  # more, for what a rig's constants leave open
MOST_EFFECTS_INSTRUCTIONS = 60_000  # of a tick with any input and all effects, at -O3
MOST_PROTECTION_INSTRUCTIONS = 1_000  # more, for checksums and counters of a sample's frames and its answer's
MOST_TEST_INSTRUCTIONS = 2_000  # more, for contradictions of the input and residuals that tell mismatch from noise

# What a program does not link that uses one of the three estimators; that with actuator effects needs the other's too.
PAPER_SOURCES = ("wrench.c", "rate_noise.c", "paper_model.c", "paper_filter.c", "paper_tolerances.c",
                 "known_mass.c", "hum_test.c", "paper_supervisor.c", "paper.c")  # fmt: skip
MOMENTUM_SOURCES = ("loose_plug.c", "rig.c", "smoother.c", "speed_noise.c", "transient.c", "motion_directions.c", "momentum_model.c",
                    "attenuation.c", "momentum_filter.c", "consider.c", "tolerances.c", "jackknife.c", "wrench_monitor.c", "load_monitor.c",
                    "leg_or_weight.c", "frozen_channels.c", "momentum_supervisor.c", "oscillation_test.c", "pseudo_inertia.c", "momentum.c")  # fmt: skip
EFFECTS_SOURCES = ("actuator_effects.c", "gain_errors.c", "identifiability.c", "momentum_effects.c")
# What only those link who ask for it: names of fields, states and faults, the default configuration and what sets parts of it; the load as a
# body, traces, the interface over all kinds and its differentiator. A configuration of `hexload export` needs none of it.
WORD_SOURCES = ("status.c", "config_names.c", "config_default.c", "momentum_config.c")
# What looks whether the input is to be believed, and answers for what no log tells: part of every estimator.
CHECK_SOURCES = (
    "plausibility.c",
    "residual_test.c",
    "oscillation_test.c",
    "lost_channels.c",
    "loose_plug.c",
    "leg_or_weight.c",
    "frozen_channels.c",
    "speed_noise.c",
    "attenuation.c",
    "tolerances.c",
)
ASKED_SOURCES = (*WORD_SOURCES, "input_fault.c", "body.c", "nearest_body.c", "trace.c", "differentiator.c", "hexload.c")
LEFT_OUT = {
    "core": (*MOMENTUM_SOURCES, *EFFECTS_SOURCES, *ASKED_SOURCES),
    "momentum": (*PAPER_SOURCES, *EFFECTS_SOURCES, *ASKED_SOURCES),
    "momentum_effects": (*PAPER_SOURCES, *ASKED_SOURCES),
}


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


@pytest.fixture(scope="module")
def momentum_runs(tmp_path_factory) -> dict[str, dict[str, dict[str, tuple[int, np.ndarray]]]]:
    """Both momentum estimators on the same inputs, by program and optimisation level: bytes of the instance, answers."""
    folder = tmp_path_factory.mktemp("momentum")
    config = hexload_native.config_bytes(platform(), TICK_S)
    hard = hard_samples(hexload_native, platform(), recorded())
    inputs = {"motion": (config, recorded()), "hard": (config, hard)}
    (folder / "tilted.toml").write_text((DATA / "paper_load.toml").read_text() + TILTED)
    tilted = hexload_native.config_bytes(hexload_native.load_platform(folder / "tilted.toml"), TICK_S)
    more = {"momentum": {}, "momentum_effects": {"tilted": (tilted, hard)}}  # the hard inputs with more states
    return {
        program: {
            optimisation: {
                name: target.replay_momentum(preset, settings, samples, folder, program)
                for name, (settings, samples) in (inputs | more[program]).items()
            }
            for optimisation, preset in target.CORTEX_M7.items()
        }
        for program in MOMENTUM_PROGRAMS
    }


NodeRuns = dict[str, dict[str, dict[str, dict[str, target.NodeRun]]]]


@pytest.fixture(scope="module")
def node_runs(tmp_path_factory) -> NodeRuns:
    """The same inputs as frames, by optimisation level, filter and bus profile."""
    folder = tmp_path_factory.mktemp("node")
    config = hexload_native.config_bytes(platform(), TICK_S)
    hard = hard_samples(hexload_native, platform(), recorded())
    inputs = {
        "paper": {"motion": recorded(), "hard": hard},
        "momentum": {"motion": recorded()[:MOMENTUM_TICKS], "hard": hard},
    }
    return {
        optimisation: {
            filter_name: {
                profile: {
                    name: target.run_node(preset, profile, filter_name, config, samples, folder)
                    for name, samples in inputs[filter_name].items()
                }
                for profile in target.PROFILES
            }
            for filter_name in target.FILTERS
        }
        for optimisation, preset in target.CORTEX_M7.items()
    }


@cache
def call_graph(preset: str):
    """Core, bus and application. The codec is inline in the bus."""
    firmware = target.directory(preset) / "firmware"
    objects = ("CMakeFiles/firmware.dir", "bus/CMakeFiles/hexload_bus.dir", "app/CMakeFiles/hexload_app.dir")
    return read_call_graph(*(firmware / name for name in objects))


def test_limits_are_within_those_of_the_issue():
    for what, most in MOST_BYTES.items():
        assert BUDGET["bytes"][what] <= most, what
    assert BUDGET["bytes"]["momentum_text"] - BUDGET["bytes"]["checks_text"] <= MOST_MOMENTUM_TEXT
    for start in ("hexload_paper_tick", "hexload_momentum_tick"):
        assert BUDGET["stack_bytes"][start] <= MOST_STACK_BYTES, start
    more = MOST_TEST_INSTRUCTIONS + MOST_PROTECTION_INSTRUCTIONS
    for profile in target.PROFILES:
        nodes = {name: BUDGET["node_instructions"][name][profile] for name in target.FILTERS}
        assert nodes["paper"]["-O3"]["motion"]["whole sample"] <= MOST_PAPER_INSTRUCTIONS + more
        for optimisation, most in MOST_MOMENTUM_INSTRUCTIONS.items():
            assert nodes["momentum"][optimisation]["worst"]["whole sample"] <= most + more, optimisation
    compensated = BUDGET["rig_instructions"]["compensated"]["worst"]
    assert compensated <= MOST_MOMENTUM_INSTRUCTIONS["-O3"] + more
    considered = BUDGET["rig_instructions"]["considered"]["worst"]
    assert considered <= MOST_MOMENTUM_INSTRUCTIONS["-O3"] + MOST_CONSIDERED_INSTRUCTIONS
    assert (
        max(BUDGET["momentum_effects_instructions"]["-O3"].values())
        <= MOST_EFFECTS_INSTRUCTIONS + MOST_TEST_INSTRUCTIONS
    )


def test_code_and_data_are_within_their_limits():
    preset = target.CORTEX_M7["-O2"]
    core = target.size_of(target.library(preset))
    node = target.size_of(*target.node_libraries(preset))
    for name, left_out in LEFT_OUT.items():
        text = core.text - target.size_of(*target.objects(preset, *left_out)).text
        check(f"text of {name}, bytes", text, BUDGET["bytes"][f"{name}_text"])
    checks = target.size_of(*target.objects(preset, *CHECK_SOURCES))
    check("text of checks and tolerances, bytes", checks.text, BUDGET["bytes"]["checks_text"])
    words = target.size_of(*target.objects(preset, *WORD_SOURCES))
    check("text of names and default configuration, bytes", words.text, BUDGET["bytes"]["words_text"])
    body = target.size_of(*target.objects(preset, "body.c", "nearest_body.c"))
    check("text of the load as a body, bytes", body.text, BUDGET["bytes"]["body_text"])
    check("data of the core, bytes", core.data, BUDGET["bytes"]["core_data"])
    check("text of bus and application, bytes", node.text, BUDGET["bytes"]["bus_and_app_text"])
    check("data of bus and application, bytes", node.data, BUDGET["bytes"]["bus_and_app_data"])


def test_instances_and_configuration_are_within_their_limits(replays, momentum_runs, node_runs):
    for program in MOMENTUM_PROGRAMS:
        found_bytes = momentum_runs[program]["-O2"]["motion"][0]
        check(f"hexload_{program}_t, bytes", found_bytes, BUDGET["bytes"][f"{program}_estimator"])
    found = replays["-O2"]["motion"]
    check("hexload_paper_t, bytes", found.estimator_bytes, BUDGET["bytes"]["estimator"])
    check("hexload_config_t, bytes", found.config_bytes, BUDGET["bytes"]["config"])
    check("hexload_node_t, bytes", node_runs["-O2"]["paper"]["fd"]["motion"].node_bytes, BUDGET["bytes"]["node"])


@pytest.mark.parametrize("preset", PRESETS)
def test_nothing_is_needed_from_a_library_but_what_is_listed(preset):
    # GIVEN the archives of core, bus and application WHEN their symbols are listed
    archives = [target.library(preset), *target.node_libraries(preset)]
    listed = subprocess.run(
        ["arm-none-eabi-nm", "--format=posix", *archives], capture_output=True, text=True, check=True
    ).stdout
    symbols = [line.split()[:2] for line in listed.splitlines() if len(line.split()) >= 2]
    defined = {name for name, kind in symbols if kind != "U"}
    needed = {name for name, kind in symbols if kind == "U"} - defined
    # THEN there is no heap, no printing, no arithmetic in software (__aeabi_d..., __aeabi_f...) and no mathematics
    assert {"hexload_paper_tick", "hexload_bus_encode_answer", "hexload_node_receive"} <= defined
    assert needed == set(LIBRARY) - {PORT}


@pytest.mark.parametrize("preset", PRESETS)
def test_no_function_has_an_unbounded_stack(preset):
    functions = call_graph(preset)
    assert len(functions) > 20
    assert [name for name, function in functions.items() if not function.is_bounded] == []
    largest = max(function.stack_bytes for function in functions.values())
    check(f"{preset}: largest frame, bytes", largest, BUDGET["stack_bytes"]["largest_frame"])


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("start", [name for name in BUDGET["stack_bytes"] if name != "largest_frame"])
def test_deepest_chain_of_calls_is_within_its_limit(preset, start):
    # GIVEN all calls WHEN they are followed from where an application enters THEN there is no recursion, no
    # call of an unknown function, and the chain that needs most is within its limit
    depth, chain = deepest_chain(call_graph(preset), LIBRARY, start)
    check(
        f"{preset}: {' -> '.join(name.rsplit('/', 1)[-1] for name in chain)}, bytes",
        depth,
        BUDGET["stack_bytes"][start],
    )


def test_stack_that_the_ticks_used_is_that_of_the_chain(replays):
    for optimisation, preset in target.CORTEX_M7.items():
        # GIVEN the stack that ticks of all kinds have left behind WHEN it is compared with the call graph's
        used = max(replayed.answers["tick_stack_bytes"].max() for replayed in replays[optimisation].values())
        depth, _ = deepest_chain(call_graph(preset), LIBRARY, "hexload_paper_tick")
        # THEN the calls have missed nothing, and count little that is not used
        print(f"{optimisation}: {used} bytes used of {depth}")
        assert 0.9 * depth < used <= depth


@pytest.mark.parametrize("filter_name, start", [("paper", "hexload_paper_tick"), ("momentum", "hexload_momentum_tick")])
def test_stack_that_whole_samples_used_is_within_that_of_the_chains(node_runs, filter_name, start):
    for optimisation, preset in target.CORTEX_M7.items():
        tick, _ = deepest_chain(call_graph(preset), LIBRARY, start)
        depth, _ = deepest_chain(call_graph(preset), LIBRARY, "hexload_node_receive")
        for profile, runs in node_runs[optimisation][filter_name].items():
            # GIVEN the stack that samples have left behind WHEN it is compared with the call graph's
            used = max(run.answers["stack_bytes"].max() for run in runs.values())
            # THEN it is more than the tick's alone, and not more than that of the deepest chain
            print(f"{optimisation}, {filter_name}, {profile}: {used} bytes used, tick {tick}, of {depth}")
            assert tick < used <= depth


@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_are_within_their_limits(optimisation, replays):
    limits = BUDGET["instructions"][optimisation]
    motion = replays[optimisation]["motion"].answers[1:]
    hard = replays[optimisation]["hard"].answers
    for kind, answers in {"motion": motion, "worst": np.concatenate([motion, hard])}.items():
        for stage, found in zip(target.STAGES, answers["stage_instructions"].max(axis=0), strict=True):
            check(f"{optimisation}, {kind}, {stage}, instructions", found, limits[kind][stage])
        check(f"{optimisation}, {kind}, tick, instructions", answers["tick_instructions"].max(), limits[kind]["tick"])


@pytest.mark.parametrize("program", MOMENTUM_PROGRAMS)
@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_of_a_momentum_estimator_are_within_their_limits(optimisation, program, momentum_runs):
    limits = BUDGET[f"{program}_instructions"][optimisation]
    for kind, (_, answers) in momentum_runs[program][optimisation].items():
        check(f"{optimisation}, {program}, {kind}, instructions", answers["tick_instructions"].max(), limits[kind])
        assert answers["tick_stack_bytes"].max() <= BUDGET["stack_bytes"][f"hexload_{program}_tick"]


@pytest.fixture(scope="module")
def body_runs(tmp_path_factory) -> dict[str, dict[str, np.ndarray]]:
    """Answers for estimates of a filter that has just begun, and for hard ones, a hundred times as wrong."""
    folder = tmp_path_factory.mktemp("bodies")
    random = np.random.default_rng(1)
    unknown_load = hexload_native.load_platform(DATA / "unknown_load.toml")
    log, truth = read_log(DATA / "work_motion.csv.gz"), json.loads((DATA / "work_motion.truth.json").read_text())
    early = early_covariances(hexload_native, unknown_load, log, folder)
    questions = {}
    for kind, times in {"early": 1.0, "hard": 100.0}.items():
        covariances = np.repeat([times**2 * covariance for covariance in early], 100, axis=0)
        drawn = [estimates(random, np.array(truth["segments"][0]["theta"]), times**2 * each, 100) for each in early]
        questions[kind] = (np.concatenate(drawn), covariances)
    return {
        optimisation: {kind: target.run_bodies(preset, *asked, folder) for kind, asked in questions.items()}
        for optimisation, preset in target.CORTEX_M7.items()
    }


@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_of_the_load_as_a_body_are_within_their_limits(optimisation, body_runs):
    limits = BUDGET["body_instructions"][optimisation]
    for kind, answers in body_runs[optimisation].items():
        # GIVEN estimates most of which no body has WHEN they are brought to the nearest that one has THEN that is found
        assert (answers["is_consistent"] == 0).mean() > 0.5
        assert (answers["is_found"] == 1).all()
        # AND within the limits
        check(f"{optimisation}, {kind}, nearest, instructions", answers["nearest_instructions"].max(), limits[kind])
        describe = answers["describe_instructions"].max()
        check(f"{optimisation}, {kind}, describe, instructions", describe, limits["describe"])
        for name in ("describe", "nearest"):
            limit = BUDGET["stack_bytes"][f"hexload_body_{name}"]
            check(f"{optimisation}, {kind}, {name}, stack, bytes", answers[f"{name}_stack_bytes"].max(), limit)


@pytest.mark.parametrize("profile", target.PROFILES)
@pytest.mark.parametrize("filter_name", target.FILTERS)
@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_of_a_whole_sample_are_within_their_limits(optimisation, filter_name, profile, node_runs):
    limits = BUDGET["node_instructions"][filter_name][profile][optimisation]
    runs = node_runs[optimisation][filter_name][profile]
    motion = runs["motion"].answers[1:]
    for kind, answers in {"motion": motion, "worst": np.concatenate([motion, runs["hard"].answers])}.items():
        for part, found in zip(target.NODE_PARTS, answers["instructions"].max(axis=0), strict=True):
            what = f"{optimisation}, {filter_name}, {profile}, {kind}, {part}, instructions"
            check(what, found, limits[kind][part])


@pytest.mark.parametrize("kind, directions", [("compensated", 0), ("considered", DIRECTIONS)])
def test_instructions_of_a_whole_sample_on_a_rig_are_within_their_limits(kind, directions, tmp_path):
    # GIVEN a rig file with all that the firmware takes off, late channels and leg mass among it, and as many directions
    rig = with_full_rig(hexload_native, platform(), tmp_path, directions)
    config = hexload_native.config_bytes(rig, TICK_S)
    hard = hard_samples(hexload_native, platform(), recorded())
    # WHEN samples of a motion and hard ones go through the node THEN each is within its limit
    found = 0
    for name, samples in {"motion": recorded()[:MOMENTUM_TICKS], "worst": hard}.items():
        answers = target.run_node(target.CORTEX_M7["-O3"], "fd", "momentum", config, samples, tmp_path).answers[1:]
        found = max(found, answers["instructions"][:, target.NODE_PARTS.index("whole sample")].max())
        check(f"{kind}, {name}, instructions", found, BUDGET["rig_instructions"][kind][name])


@pytest.mark.parametrize("filter_name", target.FILTERS)
@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_instructions_of_start_and_period_are_within_their_limits(optimisation, filter_name, node_runs):
    limits = BUDGET["node_instructions"][filter_name]["start_and_period"][optimisation]
    runs = [profile["motion"] for profile in node_runs[optimisation][filter_name].values()]
    what = f"{optimisation}, {filter_name}"
    check(f"{what}, start, instructions", max(run.start_instructions for run in runs), limits["start"])
    check(f"{what}, period, instructions", max(run.period_instructions for run in runs), limits["period"])
    codes = BUDGET["code_instructions"]
    check(f"{what}, a command's code, instructions", max(run.code_instructions for run in runs), codes["command"])
    for profile, run in zip(node_runs[optimisation][filter_name], runs):
        check(f"{profile}, a sample's code, mean, instructions", run.proof_instructions, codes[profile]["mean"])
        check(f"{profile}, a sample's code, longest, instructions", run.longest_proof, codes[profile]["longest"])
        answers = codes["answers"][filter_name][profile]
        check(f"{profile}, an answer's code, mean, instructions", run.answer_proof, answers["mean"])
        check(f"{profile}, an answer's code, longest, instructions", run.longest_answer_proof, answers["longest"])


@pytest.mark.parametrize("filter_name", target.FILTERS)
@pytest.mark.parametrize("optimisation", target.CORTEX_M7)
def test_every_sample_of_the_motion_is_estimated_and_answered(optimisation, filter_name, node_runs):
    # GIVEN a motion as frames WHEN the node has taken it THEN its counts are those of a node that estimates: three
    # frames for each sample, or a page for every second
    of_filter = node_runs[optimisation][filter_name]
    sent = {profile: runs["motion"].answers["frames_sent"] for profile, runs in of_filter.items()}
    assert (sent["fd"] == 3).all()
    assert (sent["classic"] == np.arange(len(sent["classic"])) % 2 ^ 1).all()
    for runs in of_filter.values():
        assert set(runs["motion"].answers["state"]) <= {2, 3}  # ESTIMATING, CONVERGED


def test_hard_inputs_lead_everywhere(replays):
    # GIVEN the inputs of the worst case WHEN their answers are looked through
    answers = replays["-O2"]["hard"].answers
    accepted = answers[answers["status"] == 0]
    health = np.bitwise_or.reduce(accepted["health"])
    # THEN every refusal of a sample is among them, and every health bit but INCONSISTENT (7), for which parameters have to be
    # beyond any sigma, FILTER_RESTARTED (8), to which no sample leads that is not refused, and LOAD_CHANGED (10), which the
    # paper's estimator does not have
    assert set(answers["status"]) == {0, -2, -3, -4, -5}
    assert health == 0b111101001111111
    # AND Newton's search has gone to its limit, 8 steps, of which a usual tick needs one beside the rest of its work
    one_step = np.median(accepted["stage_instructions"][:, target.STAGES.index("kinematics")])
    assert answers["stage_instructions"][:, target.STAGES.index("kinematics")].max() > 5 * one_step
