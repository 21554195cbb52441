"""clang-tidy and cppcheck with the MISRA addon over the C of firmware/, ports included: nothing but what is written down
as a deviation; clang-tidy over a part of the C++; ruff over all Python.

A newer program finds other things. The deviations are those of the versions below; what other versions find is printed
and not judged. ruff is of the version that pyproject.toml names.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from hexload import project
from hexload_dev import check_cpp

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])
DEVIATIONS = Path(__file__).with_name("deviations.txt")
PATTERNS = Path(__file__).with_name("misra.toml")
FOLDERS = ("src", "bus", "app", "ports")
SOURCES = sorted(
    str(path.relative_to(ROOT)) for folder in FOLDERS for path in (ROOT / "firmware" / folder).rglob("*.c")
)
PRESETS = ("target-cortex-m7", "target-cortex-r5f")  # with the ports that the host does not compile
GCC_ONLY = re.compile(r"-fcallgraph-info|-fpeel-loops")
JOBS = "2"
# What cppcheck reads is what a board with a fused multiply-add is built from. The other choices of algebra/real.h, of precision
# and rounding, would be four more readings of each file: three times the processor time, and no other finding.
CONFIGURATION = ("-D__GNUC__=12", "-DHEXLOAD_FUSED=1")
SHARE_THAT_IS_LEFT = 0.8  # of the places that a pattern allows: where fewer are left, it allows no more
JUDGED = {"clang-tidy": r"version 14\.", "cppcheck": r"Cppcheck 2\.10\b"}


def run(*command: str | Path) -> tuple[int, str]:
    result = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.returncode, result.stdout


def compile_commands() -> list[dict]:
    """How each source is compiled, for clang: on the host, or else for the target whose port it belongs to."""
    commands = {}
    for directory in (BUILD, *map(project.preset_directory, PRESETS)):
        for entry in json.loads((directory / "compile_commands.json").read_text()):
            source = os.path.relpath(entry["file"], ROOT)
            if source in SOURCES and source not in commands:
                words = [word for word in shlex.split(entry.pop("command")) if not GCC_ONLY.match(word)]
                commands[source] = {**entry, "arguments": [*words, *target_flags(words[0])]}
    return list(commands.values())


def target_flags(compiler: str) -> list[str]:
    """What clang does not know of a bare-metal gcc: its target, and where its C library's headers are."""
    if "arm-none-eabi" not in compiler:
        return []
    _, text = run(compiler, "-xc", "-E", "-v", os.devnull)
    folders = text.partition("#include <...> search starts here:\n")[2].partition("End of search list")[0].split()
    return ["--target=arm-none-eabi", *(f"-isystem{folder}" for folder in folders if "/include" in folder)]


def judge(program: str, path: str, findings: list[str], files: int = len(SOURCES)) -> None:
    _, version = run(path, "--version")
    print(
        f"{program}: {len(findings)} findings in {files} files by {' '.join(version.split())}",
        *findings,
        sep="\n",
    )
    if re.search(JUDGED[program], version):
        assert findings == []


def test_clang_tidy_finds_nothing(tmp_path):
    # GIVEN the commands with which the firmware is compiled WHEN clang-tidy reads every source
    commands = compile_commands()
    assert sorted(os.path.relpath(entry["file"], ROOT) for entry in commands) == SOURCES
    (tmp_path / "compile_commands.json").write_text(json.dumps(commands))
    program = shutil.which("clang-tidy-14") or "clang-tidy"
    flags = ["-p", str(tmp_path), "--quiet", "--extra-arg=-Wno-ignored-optimization-argument"]
    # xargs, as clang-tidy itself takes one file after the other
    result = subprocess.run(
        ["xargs", "--max-args=2", f"--max-procs={JOBS}", program, *flags],
        cwd=ROOT, input="\n".join(SOURCES), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    findings = [line for line in result.stdout.splitlines() if re.search(r" (warning|error): ", line)]
    # THEN it finds nothing: .clang-tidy lists the checks that are off, with reasons
    assert result.returncode == 0 or findings, result.stdout
    judge("clang-tidy", program, findings)


def test_clang_tidy_finds_nothing_in_what_takes_bytes_from_outside():
    # GIVEN the C++ of the CAN transports WHEN clang-tidy reads it THEN it finds nothing; `hexload check-cpp` reads all C++
    transports = re.compile(r"/firmware/transport/(?!lcm)")
    commands = [entry for entry in check_cpp.compile_commands() if transports.search(entry["file"])]
    assert len(commands) == 2
    judge("clang-tidy", check_cpp.program(), check_cpp.findings(commands, int(JOBS)), len(commands))


def test_cppcheck_and_misra_find_nothing_but_the_listed_deviations(tmp_path):
    # GIVEN all sources WHEN cppcheck and its MISRA addon read them
    status, output = run(
        "cppcheck", "--std=c11", "--addon=misra", "--enable=warning,style,performance,portability,information",
        "--quiet", "--template={file}:{line}: {id}: {message}", "--error-exitcode=0", "-j", JOBS,
        f"--cppcheck-build-dir={tmp_path}", f"--suppressions-list={DEVIATIONS}",
        "-I", "firmware/include", "-I", "firmware/src", "-I", "firmware", *CONFIGURATION, *SOURCES,
    )  # fmt: skip
    # THEN they find nothing new, and nothing in the list is out of date
    assert status == 0, output
    findings = [line for line in output.splitlines() if re.search(r": \w", line)]
    judge("cppcheck", "cppcheck", beyond_patterns(findings))


def beyond_patterns(findings: list[str]) -> list[str]:
    """Findings of rules that have no justified pattern, and words for each rule that is deviated from in more places, or in
    far fewer, than its pattern allows.
    """
    patterns = {each["rule"]: each for each in tomllib.loads(PATTERNS.read_text())["pattern"]}
    rules = [re.search(r": misra-c2012-([\d.]+):|$", line)[1] for line in findings]
    counts = Counter(rule for rule in rules if rule in patterns)
    others = [line for line, rule in zip(findings, rules, strict=True) if rule not in patterns]
    print("rule       category  places  at most")
    for rule, pattern in patterns.items():
        print(f"{rule:9}  {pattern['category']:8}  {counts[rule]:6}  {pattern['at_most']:7}")
        if counts[rule] > pattern["at_most"]:
            others += [f"{PATTERNS.name}: rule {rule}: {counts[rule]} places, at most {pattern['at_most']} are allowed"]
            others += [line for line, found in zip(findings, rules, strict=True) if found == rule]
        elif counts[rule] < SHARE_THAT_IS_LEFT * pattern["at_most"]:
            others.append(
                f"{PATTERNS.name}: rule {rule}: {counts[rule]} places, lower at_most {pattern['at_most']} to that"
            )
    return others


@pytest.mark.parametrize("verb", [["check"], ["format", "--check"]], ids=" ".join)
def test_ruff_finds_nothing_in_the_python(verb):
    # GIVEN the environment's ruff WHEN it reads all Python THEN it finds nothing, and would lay out nothing otherwise
    ruff = Path(sys.executable).with_name("ruff")
    status, output = run(ruff, *verb, "--no-cache", "--config", "pyproject.toml", "tools", "tests")
    assert status == 0, output


@pytest.mark.parametrize("folder", [f"firmware/{name}" for name in ("include", *FOLDERS)])
def test_no_source_switches_its_checks_off(folder):
    # GIVEN the sources WHEN they are searched for comments that silence a checker THEN there are none
    silenced = re.compile(r"NOLINT|cppcheck-suppress|#pragma")
    lines = [
        f"{path.name}:{number}: {line.strip()}"
        for path in sorted((ROOT / folder).rglob("*.[ch]"))
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if silenced.search(line)
    ]
    assert lines == []
