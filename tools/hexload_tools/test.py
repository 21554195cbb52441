"""`hexload test`: builds the test presets, runs their tests with ctest, and sums up ctest's JUnit files."""

import os
import subprocess
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload_tools import build, project
from hexload_tools.errors import InputError, ToolFailed

# What runs where, as a regex of ctest labels (unit, properties, crosscheck, sil, hil, target, budget, static); None: everything.
PRESET_LABELS = {
    "host": None,
    "host-double": "unit|sil",
    "host-clang": "unit|properties",
    "asan-ubsan": "unit|properties",
}
JUNIT = project.BUILD / "junit"


@dataclass(frozen=True)
class Outcome:
    preset: str
    passed: int
    failed: tuple[str, ...]  # names; a test that did not run counts as failed
    seconds: float
    skipped: tuple[str, ...] = ()  # names; only tests that said so: of CAN, on a machine that can have no vcan0


def run_tests(presets: list[str] | None, regex: str | None) -> int:
    """Returns the exit status: 0 only when at least one test ran and none failed."""
    outcomes = [_run_preset(preset, regex) for preset in _checked(presets)]
    _print_summary(outcomes)
    passed = sum(outcome.passed for outcome in outcomes)
    failed = sum(len(outcome.failed) for outcome in outcomes)
    skipped = sum(len(outcome.skipped) for outcome in outcomes)
    print(f"{passed} passed, {failed} failed" + (f", {skipped} skipped" if skipped else ""), flush=True)
    return 0 if passed and not failed else 1


def _checked(presets: list[str] | None) -> list[str]:
    for preset in presets or ():
        if preset not in PRESET_LABELS:
            raise InputError(f"--preset: found '{preset}', expected one of: {', '.join(PRESET_LABELS)}")
    return presets or list(PRESET_LABELS)


def _run_preset(preset: str, regex: str | None) -> Outcome:
    try:
        build.build(preset)
    except ToolFailed as error:
        print(f"hexload: {error}", flush=True)
        return Outcome(preset, 0, ("build",), 0.0)
    junit = JUNIT / f"{preset}.xml"
    junit.parent.mkdir(parents=True, exist_ok=True)
    junit.unlink(missing_ok=True)
    command = [
        "ctest",
        "--test-dir",
        str(project.preset_directory(preset)),
        "--output-on-failure",
        "--parallel",
        str(os.cpu_count()),
        "--no-tests=ignore",
        "--output-junit",
        str(junit),
    ]
    command += ["--label-regex", PRESET_LABELS[preset]] if PRESET_LABELS[preset] else []
    command += ["--tests-regex", regex, "--verbose"] if regex else []
    print(f"[hexload] testing {preset} ...", flush=True)
    status = subprocess.run(command, cwd=project.ROOT).returncode
    outcome = read_junit(preset, junit)
    if status != 0 and not outcome.failed:
        return Outcome(preset, outcome.passed, ("ctest",), outcome.seconds)
    return outcome


def read_junit(preset: str, junit: Path) -> Outcome:
    """ctest writes no file when no test matched; a status other than "run" means failed, not run, or skipped.

    A test has been skipped only when its program ended with the status for that; one that cannot be started has failed.
    """
    if not junit.exists():
        return Outcome(preset, 0, (), 0.0)
    cases = ElementTree.parse(junit).getroot().iter("testcase")
    results = [(case.get("name", "?"), _status(case), float(case.get("time", 0.0))) for case in cases]
    return Outcome(
        preset=preset,
        passed=sum(status == "run" for _, status, _ in results),
        failed=tuple(name for name, status, _ in results if status not in ("run", "skipped")),
        seconds=sum(seconds for _, _, seconds in results),
        skipped=tuple(name for name, status, _ in results if status == "skipped"),
    )


def _status(case: ElementTree.Element) -> str | None:
    skipped = case.find("skipped")
    if skipped is not None and skipped.get("message", "").startswith("SKIP_RETURN_CODE"):
        return "skipped"
    return case.get("status")


def _print_summary(outcomes: list[Outcome]) -> None:
    table = Table()
    for heading in ("preset", "passed", "failed", "test seconds", "failures and skips"):
        table.add_column(heading, justify="left" if heading in ("preset", "failures and skips") else "right")
    for outcome in outcomes:
        table.add_row(
            outcome.preset,
            str(outcome.passed),
            str(len(outcome.failed)),
            f"{outcome.seconds:.1f}",
            ", ".join([*outcome.failed, *(f"{name} (skipped)" for name in outcome.skipped)]),
        )
    Console().print(table)
