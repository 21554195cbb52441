"""`hexload mutate`: small faults put into the firmware, one at a time; which of them do the unit tests notice?

A mutant is one translation unit compiled anew, or those that include a header, the test's own among them, and linked in
front of the libraries. One whose object code is that of the source is none. It is shown to the programs that have what it has, until one fails, and that
one up to its first failure: first to those that have noticed most faults of that file, then to those with a like name; and,
when none in float does, compiled for the reference in double to some of its programs. A program counts only when it passes
with the source itself compiled in the same way, and has ten times the processor time that it took then. What cannot be told
from the source stands in accepted_mutants.toml, with the reason. Results are kept in build/mutation, so that a run that was
stopped goes on, and one with new tests shows the survivors to the programs that are new or others than they were.
"""

import hashlib
import json
import os
import random
import re
import shlex
import signal
import subprocess
import tempfile
import tomllib
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload_dev import build, coverage
from hexload_dev.mutants import Mutant, mutants_of

TESTS = "tests/unit/"
ACCEPTED = project.ROOT / TESTS / "accepted_mutants.toml"
RESULTS = project.BUILD / "mutation" / "outcomes.json"
COMPILER = "clang-19"  # it can be told to read the mutant in the source's place
# An index beyond an array is an error; without debug information, so that objects can be compared.
OWN_FLAGS = ["-O2", "-w", "-fsanitize=bounds", "-fsanitize-trap=bounds"]
TAKEN = re.compile(r"-[DI]|-isystem|-std=|-m|-f(?!callgraph|peel)")  # words of the build's own command
IN_DOUBLE = ("symmetry_double",)  # programs that bound by rounding alone: in double they see what it hides in float
START_S = 0.1  # of processor time, to link a program and start it
LONGER = 10  # times the source's own processor time, which a fault may take, and a second
KILLED, SURVIVED, SAME, INVALID = "killed", "survived", "same object", "does not compile"


@dataclass(frozen=True)
class Program:
    path: Path
    link: list[str]
    symbols: frozenset[str]  # that it has inside
    fingerprint: str

    @property
    def name(self) -> str:
        return self.path.name.removeprefix("test_")

    @property
    def source(self) -> str:
        return f"{TESTS}test_{self.name.removesuffix('_double')}.c"


@dataclass(frozen=True)
class Precision:
    programs: list[Program]
    compile: dict[str, list[str]]  # command without output, by source of the firmware
    tests: dict[str, list[str]]  # likewise, by source of a test


@dataclass(frozen=True)
class Bench:
    directory: Path  # of the build
    precisions: list[Precision]  # float, then the double-precision reference
    includers: dict[str, list[str]]  # sources that read a file
    killers: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))  # of a file's mutants
    originals: dict[tuple[str, ...], bytes] = field(default_factory=dict)  # object code of sources, by command
    passes: dict[tuple[str, str], bool] = field(default_factory=dict)  # program with a file's originals in it
    seconds: dict[str, float] = field(default_factory=dict)  # of processor, of a program as it was built


def run_mutate(count: int, seed: int, file: str | None, jobs: int | None) -> int:
    """Returns the exit status: 0 when all of the sample were noticed, or are accepted."""
    mutants = all_mutants(file)
    mutants = random.Random(seed).sample(mutants, min(count, len(mutants)))
    build.build(project.DEFAULT_PRESET, "tests/unit/all")
    outcomes = try_mutants(prepare(project.preset_directory(project.DEFAULT_PRESET)), mutants, jobs or os.cpu_count())
    left = not_accepted(outcomes)
    Console(width=coverage.WIDTH).print(_table(outcomes, set(left)))
    print(*map(described, left), sep="\n")
    return 1 if left else 0


def all_mutants(file: str | None = None) -> list[Mutant]:
    """Of the firmware's sources, or of those with `file` in their name."""
    names = sorted(
        path.relative_to(project.ROOT).as_posix()
        for folder in coverage.FOLDERS
        for path in (project.ROOT / folder).rglob("*.[ch]")
    )
    mutants = [mutant for name in names if file is None or file in name for mutant in mutants_of(project.ROOT, name)]
    if not mutants:
        raise InputError(f"--file: found no source of the firmware with '{file}' in its name")
    return mutants


def steady_sample(share: float) -> list[Mutant]:
    """About this share of the mutants of sources, drawn by the text of their lines: those of a line that stays, stay."""
    limit = int(share * 2**32)

    def drawn(mutant: Mutant) -> bool:
        text = f"{mutant.file}\n{mutant.before}\n{mutant.after}"
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4]) < limit

    return [mutant for mutant in all_mutants() if mutant.file.endswith(".c") and drawn(mutant)]


def not_accepted(outcomes: dict[Mutant, str]) -> list[Mutant]:
    """The survivors that are not in the list."""
    listed = tomllib.loads(ACCEPTED.read_text(encoding="utf-8")).get("mutant", [])
    accepted = {(each["file"], each["before"], each["after"]) for each in listed}
    return [
        mutant
        for mutant, outcome in outcomes.items()
        if outcome == SURVIVED and (mutant.file, mutant.before, mutant.after) not in accepted
    ]


def described(mutant: Mutant) -> str:
    return f"{mutant.file}:{mutant.line}: {mutant.kind}\n  - {mutant.before}\n  + {mutant.after}"


def prepare(directory: Path) -> Bench:
    """Of a build that has its unit tests."""
    precisions = [Precision([], {}, {}), Precision([], {}, {})]
    for entry in json.loads((directory / "compile_commands.json").read_text()):
        source = os.path.relpath(entry["file"], project.ROOT)
        if source.startswith((*coverage.FOLDERS, TESTS)):
            words = shlex.split(entry["command"])
            taken = [word for before, word in pairwise(words) if TAKEN.match(word) or before == "-isystem"]
            precision = precisions["-DHEXLOAD_REFERENCE_DOUBLE" in words]
            commands = precision.tests if source.startswith(TESTS) else precision.compile
            commands.setdefault(source, [COMPILER, *taken, *OWN_FLAGS, "-c", str(project.ROOT / source)])
    paths = coverage.unit_programs(directory)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for program in pool.map(lambda path: _program(directory, path), paths):
            if program.name in IN_DOUBLE or not program.name.endswith("_double"):
                precisions[program.name in IN_DOUBLE].programs.append(program)
    return Bench(directory, precisions, _includers(directory, set(precisions[0].compile) | set(precisions[0].tests)))


def _program(directory: Path, path: Path) -> Program:
    target = os.path.relpath(path, directory)
    listing = subprocess.run(["ninja", "-C", directory, "-t", "commands", target], capture_output=True, text=True)
    words = shlex.split(listing.stdout.splitlines()[-1])
    words = [word for word in words if word not in (":", "&&", "ccache") and not word.endswith("/ccache")]
    return Program(path, words, _symbols(path, "TtDdBbRr"), hashlib.sha256(path.read_bytes()).hexdigest()[:16])


def _symbols(path: Path, kinds: str) -> frozenset[str]:
    """Of functions and data, by nm's letters: of what is hidden, capitals in an object and small ones in a program."""
    listing = subprocess.run(["nm", "--defined-only", path], capture_output=True, text=True, check=True).stdout
    return frozenset(line.split()[2] for line in listing.splitlines() if line.split()[1] in kinds)


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


def try_nearest(bench: Bench, mutants: list[Mutant], most: int) -> dict[Mutant, str]:
    """Outcomes when each is shown to so many of the nearest programs. Nothing is kept."""
    with tempfile.TemporaryDirectory(prefix="hexload-mutant-") as name:
        return {mutant: _try(bench, mutant, Path(name), set(), most)[0] for mutant in mutants}


def try_mutants(bench: Bench, mutants: list[Mutant], jobs: int) -> dict[Mutant, str]:
    """Outcomes when each is shown to all programs, of which the answers are kept."""
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for each in known.values():
        bench.killers[each["file"]][each["killer"]] += 1
    outcomes: dict[Mutant, str] = {}
    with ThreadPoolExecutor(jobs) as pool:
        for mutant, outcome in zip(mutants, pool.map(lambda each: _outcome(bench, each, known), mutants), strict=True):
            outcomes[mutant] = outcome
            _keep(known)
    return outcomes


def _keep(known: dict[str, dict]) -> None:
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    new = RESULTS.with_suffix(".new")
    new.write_text(json.dumps(dict(known)))
    new.replace(RESULTS)


def _outcome(bench: Bench, mutant: Mutant, known: dict[str, dict]) -> str:
    key = mutant.key((project.ROOT / mutant.file).read_text(encoding="utf-8"))
    before = known.get(key)
    if before is not None and before["outcome"] not in (SURVIVED, INVALID):
        return before["outcome"]
    blind = set(before.get("blind", ()) if before is not None else ())
    with tempfile.TemporaryDirectory(prefix="hexload-mutant-") as name:
        outcome, killer = _try(bench, mutant, Path(name), blind, None)
    bench.killers[mutant.file][killer] += 1
    known[key] = {"outcome": outcome, "file": mutant.file, "killer": killer}
    if outcome == SURVIVED:
        known[key]["blind"] = sorted(blind)
    return outcome


def _try(bench: Bench, mutant: Mutant, folder: Path, blind: set[str], most: int | None) -> tuple[str, str]:
    """The outcome, and the program that noticed the fault. What survives in float may be noticed in double.

    `blind` has the fingerprints of programs that are known not to notice it, and gets those of others that do not.
    """
    outcome, killer = _try_precision(bench, bench.precisions[0], mutant, folder, blind, most)
    if outcome == SURVIVED:
        in_double, killer = _try_precision(bench, bench.precisions[1], mutant, folder, blind, most)
        outcome = KILLED if in_double == KILLED else SURVIVED
    return outcome, killer


def _try_precision(
    bench: Bench, precision: Precision, mutant: Mutant, folder: Path, blind: set[str], most: int | None
) -> tuple[str, str]:
    """Of a header's mutant, each source that reads it is tried by itself, which is a fault, too, and then all together."""
    sources = [source for source in bench.includers[mutant.file] if source in precision.compile]
    objects: dict[str, Path] = {}  # that differ, by source
    for source in sources:
        output = folder / f"mutant{len(objects)}.o"
        original = _original(bench, precision.compile[source], folder)
        if not _compile(bench, precision.compile[source], output, mutant):
            return INVALID, ""
        if output.read_bytes() == original:
            continue
        objects[source] = output
        if len(sources) > 1:
            for program in _nearest(bench, precision, source, [output])[:1]:
                if _is_noticed(bench, precision, program, {source: output}, folder):
                    return KILLED, program.name
    if not objects:
        return SAME, ""
    for program in _nearest(bench, precision, mutant.file, list(objects.values()))[:most]:
        own = _own_object(bench, precision, program, mutant, folder)
        if program.fingerprint not in blind and _is_noticed(bench, precision, program, objects | own, folder):
            return KILLED, program.name
        blind.add(program.fingerprint)
    return SURVIVED, ""


def _own_object(bench: Bench, precision: Precision, program: Program, mutant: Mutant, folder: Path) -> dict[str, Path]:
    """Of a test that reads the mutant's header: what it calls inline is in its own object."""
    if program.source not in bench.includers[mutant.file] or program.source not in precision.tests:
        return {}
    output = folder / "test.o"
    return {program.source: output} if _compile(bench, precision.tests[program.source], output, mutant) else {}


def _original(bench: Bench, command: list[str], folder: Path) -> bytes:
    key = tuple(command)
    if key not in bench.originals:
        output = folder / "original.o"
        if not _compile(bench, command, output, None):
            raise ToolFailed(f"{command[-1]} does not compile with {COMPILER}")
        bench.originals[key] = output.read_bytes()
    return bench.originals[key]


def _compile(bench: Bench, command: list[str], output: Path, mutant: Mutant | None) -> bool:
    words = []
    if mutant is not None:
        path = project.ROOT / mutant.file
        text = output.with_suffix(".c")
        text.write_text(mutant.of(path.read_text(encoding="utf-8")))
        overlay = {"version": 0, "roots": [{"type": "file", "name": str(path), "external-contents": str(text)}]}
        output.with_suffix(".json").write_text(json.dumps(overlay))
        words = ["-ivfsoverlay", output.with_suffix(".json")]
    return (
        subprocess.run([*command, *words, "-o", output], cwd=bench.directory, stderr=subprocess.DEVNULL).returncode == 0
    )


def _nearest(bench: Bench, precision: Precision, file: str, objects: list[Path]) -> list[Program]:
    """The programs that have something of the objects or read the file, the likeliest to notice a fault of it first."""
    symbols = frozenset().union(*(_symbols(path, "TDBR") for path in objects))
    words = set(Path(file).stem.split("_"))

    def distance(program: Program) -> tuple[float, float, str]:
        own = set(program.name.split("_"))
        noticed_per_second = bench.killers[file][program.name] / (START_S + bench.seconds.get(program.name, 0.0))
        return -noticed_per_second, -len(words & own) / len(words | own), program.name

    readers = bench.includers[file]
    able = (each for each in precision.programs if each.symbols & symbols or each.source in readers)
    return sorted(able, key=distance)


def _is_noticed(bench: Bench, precision: Precision, program: Program, objects: dict[str, Path], folder: Path) -> bool:
    if program.name not in bench.seconds:
        passes, bench.seconds[program.name] = _run(program.path, folder, None)
        if not passes:
            raise ToolFailed(f"{program.name} fails without any fault")
    limit_s = int(LONGER * bench.seconds[program.name]) + 1
    linked = _link(bench, program, objects, folder)
    if linked is None:
        return True  # what a caller needs is no longer there
    passes, _ = _run(linked, folder, limit_s)
    linked.unlink()
    return not passes and _passes_with(bench, precision, program, objects, folder)


def _passes_with(bench: Bench, precision: Precision, program: Program, objects: dict[str, Path], folder: Path) -> bool:
    """Whether the program passes with the sources of these objects compiled as mutants are, but without a fault."""
    key = program.name, " ".join(objects)
    if key not in bench.passes:
        originals = {}
        for source in objects:
            originals[source] = folder / f"source{len(originals)}.o"
            command = precision.tests[source] if source == program.source else precision.compile[source]
            originals[source].write_bytes(_original(bench, command, folder))
        linked = _link(bench, program, originals, folder)
        bench.passes[key] = linked is not None and _run(linked, folder, None)[0]
    return bench.passes[key]


def _link(bench: Bench, program: Program, objects: dict[str, Path], folder: Path) -> Path | None:
    """With these, by source, in front of the libraries, or in place of the program's own. None: it cannot be linked."""
    words = list(program.link)
    output = words.index("-o") + 1
    words[output] = str(folder / program.path.name)
    own = next(at for at, word in enumerate(words) if word.endswith(f"{Path(program.source).name}.o"))
    kept = [] if program.source in objects else [words[own]]
    command = [*words[:own], *objects.values(), *kept, *words[own + 1 :]]
    result = subprocess.run(command, cwd=bench.directory, stderr=subprocess.DEVNULL)
    return Path(words[output]) if result.returncode == 0 else None


def _run(program: Path, folder: Path, limit_s: int | None) -> tuple[bool, float]:
    """Whether it passes, and its processor time. It is stopped at its first failure, or at the limit."""
    limits = ["prlimit", "--core=0", *([] if limit_s is None else [f"--cpu={limit_s}"])]
    command = [*limits, "stdbuf", "-oL", program]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        failed = any(b":FAIL" in line for line in process.stdout)
        if failed:
            os.kill(process.pid, signal.SIGKILL)  # not kill(), which may reap it, and its processor time is lost
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return not failed and process.returncode == 0, usage.ru_utime + usage.ru_stime


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
