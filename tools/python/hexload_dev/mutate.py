"""`hexload mutate`: small faults put into the firmware, one at a time; which of them do the unit tests notice?

A mutant is one translation unit compiled anew, or those that include a header, and linked in front of the libraries. It is
shown to the programs that run its lines, the shortest first, until one fails. One whose object code is that of the source is
none; one that cannot be told from it stands in accepted_mutants.toml, with the reason. Results are kept in build/mutation, so
that a run that was stopped goes on, and one with new tests looks at the survivors only.
"""

import hashlib
import json
import os
import random
import shlex
import subprocess
import tempfile
import time
import tomllib
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import InputError
from hexload_dev import build, coverage
from hexload_dev.mutants import Mutant, mutants_of

ACCEPTED = project.ROOT / "tests" / "unit" / "accepted_mutants.toml"
RESULTS = project.BUILD / "mutation" / "results.json"
# Without counters and debug information, so that objects can be compared; an index beyond an array is an error.
OWN_FLAGS = ["-fsanitize=bounds", "-fsanitize-trap=bounds", "-w", "-g0"]
NOT_OURS = ("-fprofile", "-fcoverage", "-g", "-Werror", "-MD", "ccache")
KILLED, SURVIVED, SAME, INVALID = "killed", "survived", "same object", "does not compile"


@dataclass(frozen=True)
class Program:
    path: Path
    seconds: float
    lines: dict[str, set[int]]  # of each file, that it runs
    link: list[str]


@dataclass(frozen=True)
class Bench:
    directory: Path
    programs: list[Program]  # the shortest first
    compile: dict[str, list[str]]  # command without output, by source
    includers: dict[str, list[str]]  # sources that read a file
    tests: str  # fingerprint


def run_mutate(count: int, seed: int, file: str | None, jobs: int | None) -> int:
    """Returns the exit status: 0 when all of the sample were noticed, or are accepted."""
    mutants = _sample(count, seed, file)
    bench = _prepare()
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    outcomes: dict[Mutant, str] = {}
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        for mutant, outcome in zip(mutants, pool.map(lambda each: _outcome(bench, each, known), mutants), strict=True):
            outcomes[mutant] = outcome
            _keep(known)
    survivors = [mutant for mutant, outcome in outcomes.items() if outcome == SURVIVED]
    accepted = {(each["file"], each["before"], each["after"]) for each in _accepted()}
    left = [each for each in survivors if (each.file, each.before, each.after) not in accepted]
    Console(width=coverage.WIDTH).print(_table(outcomes, set(left)))
    for mutant in left:
        print(f"{mutant.file}:{mutant.line}: {mutant.kind}\n  - {mutant.before}\n  + {mutant.after}")
    return 1 if left else 0


def _sample(count: int, seed: int, file: str | None) -> list[Mutant]:
    files = sorted(
        path.relative_to(project.ROOT).as_posix()
        for folder in coverage.FOLDERS
        for path in (project.ROOT / folder).rglob("*.[ch]")
    )
    mutants = [mutant for name in files if file is None or file in name for mutant in mutants_of(project.ROOT, name)]
    if not mutants:
        raise InputError(f"--file: found no source of the firmware with '{file}' in its name")
    return random.Random(seed).sample(mutants, min(count, len(mutants)))


def _accepted() -> list[dict[str, str]]:
    return tomllib.loads(ACCEPTED.read_text(encoding="utf-8")).get("mutant", [])


def _prepare() -> Bench:
    build.build(coverage.PRESET, "tests/unit/all")
    directory = project.preset_directory(coverage.PRESET)
    commands = json.loads((directory / "compile_commands.json").read_text())
    compile_commands = {}
    for entry in commands:
        source = os.path.relpath(entry["file"], project.ROOT)
        if source.startswith(coverage.FOLDERS) and source not in compile_commands:  # the float one comes first
            compile_commands[source] = _own_command(entry["command"])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        programs = list(pool.map(lambda path: _measure(directory, path), coverage.unit_programs(directory)))
    tests = hashlib.sha256(b"".join(program.path.read_bytes() for program in programs)).hexdigest()[:24]
    includers = _includers(directory, set(compile_commands))
    return Bench(directory, sorted(programs, key=lambda each: each.seconds), compile_commands, includers, tests)


def _own_command(command: str) -> list[str]:
    words = [word for word in shlex.split(command) if not word.startswith(NOT_OURS)]
    for option in ("-o", "-MT", "-MF"):
        if option in words:
            at = words.index(option)
            del words[at : at + 2]
    return words + OWN_FLAGS


def _measure(directory: Path, path: Path) -> Program:
    """How long the program takes, which lines it runs, and how it is linked."""
    profile = coverage.profile_of(directory, path)
    begin = time.perf_counter()
    subprocess.run([path], env={**os.environ, "LLVM_PROFILE_FILE": str(profile)}, stdout=subprocess.DEVNULL, check=True)
    seconds = time.perf_counter() - begin
    lines = {name: {line for line, runs in counts.items() if runs} for name, counts in coverage.lines_of(profile, path)}
    target = os.path.relpath(path, directory)
    listing = subprocess.run(["ninja", "-C", directory, "-t", "commands", target], capture_output=True, text=True)
    words = shlex.split(listing.stdout.splitlines()[-1])
    words = [word for word in words if word not in (":", "&&", "ccache") and not word.endswith("/ccache")]
    return Program(path, seconds, lines, words)


def _includers(directory: Path, sources: set[str]) -> dict[str, list[str]]:
    """From ninja's record of what each object was made of."""
    listing = subprocess.run(["ninja", "-C", directory, "-t", "deps"], capture_output=True, text=True).stdout
    includers: dict[str, list[str]] = defaultdict(list)
    for block in listing.split("\n\n"):
        read = [os.path.relpath(directory / line.strip(), project.ROOT) for line in block.splitlines()[1:]]
        own = [name for name in read if name in sources]
        for name in read if own else []:
            if own[0] not in includers[name]:
                includers[name].append(own[0])
    return includers


def _keep(known: dict[str, dict]) -> None:
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    new = RESULTS.with_suffix(".new")
    new.write_text(json.dumps(dict(known)))
    new.replace(RESULTS)


def _outcome(bench: Bench, mutant: Mutant, known: dict[str, dict]) -> str:
    key = mutant.key((project.ROOT / mutant.file).read_text(encoding="utf-8"))
    before = known.get(key)
    if before is not None and (before["outcome"] != SURVIVED or before["tests"] == bench.tests):
        return before["outcome"]
    with tempfile.TemporaryDirectory(prefix="hexload-mutant-") as name:
        outcome = _try(bench, mutant, Path(name))
    known[key] = {"outcome": outcome, "tests": bench.tests}
    return outcome


def _try(bench: Bench, mutant: Mutant, folder: Path) -> str:
    sources = bench.includers[mutant.file]
    (folder / "mutant.c").write_text(mutant.of((project.ROOT / mutant.file).read_text(encoding="utf-8")))
    overlay = {
        "version": 0,
        "roots": [
            {"type": "file", "name": str(project.ROOT / mutant.file), "external-contents": str(folder / "mutant.c")}
        ],
    }
    (folder / "overlay.json").write_text(json.dumps(overlay))
    objects, is_same = [], True
    for number, source in enumerate(sources):
        pair = [folder / f"{kind}{number}.o" for kind in ("source", "mutant")]
        for output, more in zip(pair, ([], ["-ivfsoverlay", str(folder / "overlay.json")]), strict=True):
            command = [*bench.compile[source], *more, "-o", str(output)]
            if subprocess.run(command, cwd=bench.directory, stderr=subprocess.DEVNULL).returncode != 0:
                return INVALID
        is_same = is_same and pair[0].read_bytes() == pair[1].read_bytes()
        objects.append(str(pair[1]))
    if is_same:
        return SAME
    for program in _who_runs(bench, mutant):
        if _is_noticed(bench, program, objects, folder):
            return KILLED
    return SURVIVED


def _who_runs(bench: Bench, mutant: Mutant) -> list[Program]:
    """The programs that run the mutant's line; of a line without code, a macro's or a table's, that run the file."""
    runners = [each for each in bench.programs if mutant.line in each.lines.get(mutant.file, ())]
    return runners or [each for each in bench.programs if any(each.lines.get(s) for s in bench.includers[mutant.file])]


def _is_noticed(bench: Bench, program: Program, objects: list[str], folder: Path) -> bool:
    words = list(program.link)
    output = words.index("-o") + 1
    words[output] = str(folder / program.path.name)
    own = next(at for at, word in enumerate(words) if word.endswith(".c.o"))
    linked = subprocess.run([*words[:own], *objects, *words[own:]], cwd=bench.directory, stderr=subprocess.DEVNULL)
    if linked.returncode != 0:
        return True  # what a caller needs is no longer there
    environment = {**os.environ, "LLVM_PROFILE_FILE": str(folder / "profile")}
    try:
        result = subprocess.run(
            [words[output]], env=environment, cwd=folder, timeout=10 * program.seconds + 10,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return True
    finally:
        Path(words[output]).unlink()
    return result.returncode != 0


def _table(outcomes: dict[Mutant, str], left: set[Mutant]) -> Table:
    table = Table(title="Mutants, and what the unit tests made of them", title_justify="left")
    for heading in ("file", "mutants", "killed", "survived", "accepted", "same object", "rate, %"):
        table.add_column(heading, justify="left" if heading == "file" else "right")
    by_file = defaultdict(list)
    for mutant, outcome in outcomes.items():
        if outcome != INVALID:
            by_file[mutant.file].append((mutant, outcome))
    for name, found in sorted(by_file.items()):
        table.add_row(name.removeprefix("firmware/"), *_cells(found, left))
    table.add_section()
    table.add_row("all", *_cells([each for found in by_file.values() for each in found], left))
    return table


def _cells(found: list[tuple[Mutant, str]], left: set[Mutant]) -> list[str]:
    killed = sum(outcome == KILLED for _, outcome in found)
    same = sum(outcome == SAME for _, outcome in found)
    survived = sum(mutant in left for mutant, _ in found)
    rate = f"{100 * killed / (killed + survived):.1f}" if killed + survived else ""
    numbers = (len(found), killed, survived, len(found) - killed - same - survived, same)
    return [*(f"{number:,}" for number in numbers), rate]
