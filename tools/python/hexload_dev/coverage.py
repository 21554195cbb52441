"""`hexload coverage`: lines, branches and conditions of the firmware that the unit tests run, by clang's own counters.

A condition is covered as MC/DC wants it: some pair of runs shows that it alone turns its decision. What a header's inline
function leaves out in one file and runs in another counts as run.
"""

import json
import os
import subprocess
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev import build

PRESET = "coverage"
VERSION = "19"  # of clang, as in CMakePresets.json: others count otherwise
FOLDERS = ("firmware/src", "firmware/bus", "firmware/app")
UNCOVERED = project.ROOT / "tests" / "unit" / "uncovered.toml"
WIDTH = 120  # of the table, also in a file
KINDS = ("lines", "branches", "conditions")

Place = tuple[int, int, int, int]  # first line and column, last line and column


@dataclass
class Coverage:
    """Of one file: how many there are of a kind, and a line of text for each that was not run."""

    total: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    missing: dict[str, list[str]] = field(default_factory=lambda: {kind: [] for kind in KINDS})


def run_coverage() -> int:
    """Returns the exit status: 0 when nothing is left out but what is listed."""
    build.build(PRESET, "tests/unit/all")
    directory = project.preset_directory(PRESET)
    programs = unit_programs(directory)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda program: _run(directory, program), programs))
    files = read_coverage(directory)
    Console(width=WIDTH).print(_table(files))
    faults = compare(files, tomllib.loads(UNCOVERED.read_text(encoding="utf-8")))
    print(*faults, sep="\n")
    return 1 if faults else 0


def unit_programs(directory: Path) -> list[Path]:
    """The programs of the unit tests, as ctest knows them."""
    listing = subprocess.run(
        ["ctest", "--test-dir", directory / "tests" / "unit", "--show-only=json-v1"], capture_output=True, check=True
    )
    commands = [test["command"] for test in json.loads(listing.stdout)["tests"]]
    return [Path(command[0]) for command in commands if len(command) == 1]


def profile_of(directory: Path, program: Path) -> Path:
    return directory / "profiles" / "unit" / f"{program.name}.profraw"


def _run(directory: Path, program: Path) -> None:
    environment = {**os.environ, "LLVM_PROFILE_FILE": str(profile_of(directory, program))}
    result = subprocess.run([program], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if result.returncode != 0:
        raise ToolFailed(f"{program.name} failed\n{result.stdout}")


def read_coverage(directory: Path) -> dict[str, Coverage]:
    """Of each file of the firmware, from what the unit tests in `directory` have left there."""
    programs = unit_programs(directory)
    merged = directory / "profiles" / "unit.profdata"
    profiles = [profile_of(directory, program) for program in programs]
    _tool("llvm-profdata", "merge", "-sparse", *profiles, "-o", merged)
    options = ["-instr-profile", merged, *(word for program in programs for word in ("-object", program))]
    files: dict[str, Coverage] = defaultdict(Coverage)
    for name, lines in _lines(_tool("llvm-cov", "export", "-format=lcov", *options)):
        files[name].total["lines"] = len(lines)
        files[name].missing["lines"] = [f"line {line} is not run" for line, count in sorted(lines.items()) if not count]
    for entry in json.loads(_tool("llvm-cov", "export", *options))["data"][0]["files"]:
        name = _name(entry["filename"])
        if name is not None:
            source = (project.ROOT / name).read_text(encoding="utf-8").splitlines()
            _add_branches(files[name], entry["branches"], source)
            _add_conditions(files[name], entry["mcdc_records"], source)
    return dict(sorted(files.items()))


def lines_of(profile: Path, program: Path) -> Iterator[tuple[str, dict[int, int]]]:
    """File and how often each of its lines was run, of one program alone."""
    merged = profile.with_suffix(".profdata")
    _tool("llvm-profdata", "merge", "-sparse", profile, "-o", merged)
    yield from _lines(_tool("llvm-cov", "export", "-format=lcov", "-instr-profile", merged, program))


def _tool(name: str, *arguments: str | Path) -> str:
    result = subprocess.run([f"{name}-{VERSION}", *arguments], capture_output=True, text=True)
    if result.returncode != 0:
        raise ToolFailed(f"{name}-{VERSION}: {result.stderr}")
    return result.stdout


def _name(path: str) -> str | None:
    """Of a file of the firmware, from the project's folder; None: of another one."""
    if not Path(path).is_relative_to(project.ROOT):
        return None
    name = Path(path).relative_to(project.ROOT).as_posix()
    return name if name.startswith(FOLDERS) else None


def _lines(lcov: str) -> Iterator[tuple[str, dict[int, int]]]:
    """File and how often each of its lines was run."""
    name, lines = None, {}
    for text in lcov.splitlines():
        word, _, rest = text.partition(":")
        if word == "SF":
            name, lines = _name(rest), {}
        elif word == "DA":
            line, count = map(int, rest.split(",")[:2])
            lines[line] = max(count, lines.get(line, 0))
        elif word == "end_of_record" and name is not None:
            yield name, lines


def _add_branches(file: Coverage, branches: list[list[int]], source: list[str]) -> None:
    counts: dict[Place, list[int]] = defaultdict(lambda: [0, 0])
    for *place, true, false, _, _, _ in branches:
        counts[tuple(place)][0] += true
        counts[tuple(place)][1] += false
    file.total["branches"] += 2 * len(counts)
    for place, both in sorted(counts.items()):
        for count, word in zip(both, ("true", "false"), strict=True):
            if count == 0:
                file.missing["branches"].append(f"line {place[0]} is never {word}: {_text(place, source)}")


def _add_conditions(file: Coverage, records: list[list], source: list[str]) -> None:
    decisions: dict[Place, list[bool]] = {}
    for *place, _, _, conditions in records:
        before = decisions.get(tuple(place), [False] * len(conditions))
        decisions[tuple(place)] = [one or other for one, other in zip(before, conditions, strict=True)]
    for place, conditions in sorted(decisions.items()):
        file.total["conditions"] += len(conditions)
        file.missing["conditions"] += [
            f"line {place[0]}: condition {number} alone turns nothing: {_text(place, source)}"
            for number, is_covered in enumerate(conditions, start=1)
            if not is_covered
        ]


def _text(place: Place, source: list[str]) -> str:
    first, column, last, end = place
    lines = source[first - 1 : last]
    lines[-1] = lines[-1][: end - 1]
    return " ".join([lines[0][column - 1 :], *lines[1:]]) if first == last else " ".join(line.strip() for line in lines)


def compare(files: dict[str, Coverage], listed: dict[str, dict]) -> list[str]:
    """What is wrong, a line each: more is left out of a file than the list allows, or the list allows what is not."""
    faults = [f"{UNCOVERED.name} lists {name}, which is no file that was run" for name in listed.keys() - files.keys()]
    for name, file in files.items():
        for kind in KINDS:
            missing, allowed = len(file.missing[kind]), listed.get(name, {}).get(kind, 0)
            if missing != allowed:
                faults.append(f"{name}: {missing} {kind} not covered, {UNCOVERED.name} says {allowed}")
                faults += [f"    {place}" for place in file.missing[kind]] if missing > allowed else []
    return faults


def _table(files: dict[str, Coverage]) -> Table:
    table = Table(title=f"Run by the unit tests, of {', '.join(FOLDERS)}", title_justify="left")
    table.add_column("file")
    for kind in KINDS:
        table.add_column(kind, justify="right")
        table.add_column("%", justify="right")
    sums = Coverage()
    for name, file in files.items():
        table.add_row(name.removeprefix("firmware/"), *_cells(file))
        for kind in KINDS:
            sums.total[kind] += file.total[kind]
            sums.missing[kind] += file.missing[kind]
    table.add_section()
    table.add_row("all", *_cells(sums))
    return table


def _cells(file: Coverage) -> list[str]:
    cells = []
    for kind in KINDS:
        total = file.total[kind]
        run = total - len(file.missing[kind])
        cells += [f"{run:,} of {total:,}", f"{100 * run / total:.1f}"] if total else ["", ""]
    return cells
