"""clang-tidy and cppcheck with the MISRA addon over firmware/: nothing but what is written down as a deviation.

A newer program finds other things. The deviations are those of the versions below; what other versions find is printed
and not judged.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])
DEVIATIONS = Path(__file__).with_name("deviations.txt")
FOLDERS = [folder for folder in ("src", "bus", "app") if (ROOT / "firmware" / folder).is_dir()]
SOURCES = sorted(str(path.relative_to(ROOT)) for folder in FOLDERS for path in (ROOT / "firmware" / folder).glob("*.c"))
JOBS = "2"
JUDGED = {"clang-tidy": r"version 14\.", "cppcheck": r"Cppcheck 2\.10\b"}


def run(*command: str | Path) -> tuple[int, str]:
    result = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.returncode, result.stdout


def judge(program: str, path: str, findings: list[str]) -> None:
    _, version = run(path, "--version")
    print(f"{program}: {len(findings)} findings in {len(SOURCES)} files by {' '.join(version.split())}", *findings, sep="\n")
    if re.search(JUDGED[program], version):
        assert findings == []


def test_clang_tidy_finds_nothing():
    # GIVEN the commands with which the firmware is compiled WHEN clang-tidy reads every source
    program = shutil.which("clang-tidy-14") or "clang-tidy"
    flags = ["-p", str(BUILD), "--quiet", "--extra-arg=-Wno-ignored-optimization-argument"]
    # xargs, as clang-tidy itself takes one file after the other
    result = subprocess.run(
        ["xargs", "--max-args=3", f"--max-procs={JOBS}", program, *flags],
        cwd=ROOT, input="\n".join(SOURCES), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    findings = [line for line in result.stdout.splitlines() if re.search(r" (warning|error): ", line)]
    # THEN it finds nothing: .clang-tidy lists the checks that are off, with reasons
    assert result.returncode == 0 or findings, result.stdout
    judge("clang-tidy", program, findings)


def test_cppcheck_and_misra_find_nothing_but_the_listed_deviations(tmp_path):
    # GIVEN all sources WHEN cppcheck and its MISRA addon read them
    status, output = run(
        "cppcheck", "--std=c11", "--addon=misra", "--enable=warning,style,performance,portability,information",
        "--quiet", "--template={file}:{line}: {id}: {message}", "--error-exitcode=0", "-j", JOBS,
        f"--cppcheck-build-dir={tmp_path}", f"--suppressions-list={DEVIATIONS}",
        "-I", "firmware/include", "-I", "firmware/src", "-I", "firmware", *SOURCES,
    )  # fmt: skip
    # THEN they find nothing new, and nothing in the list is out of date
    assert status == 0, output
    findings = [line for line in output.splitlines() if re.search(r": \w", line)]
    judge("cppcheck", "cppcheck", findings)


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
