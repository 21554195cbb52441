"""`hexload test`: builds the test presets, runs their tests with ctest, and sums up ctest's JUnit files.

While one preset is tested the next ones are built, on what the tests leave of the processors. What failed is said last,
with the words of its assertions.
"""

import os
import re
import subprocess
import xml.etree.ElementTree as ElementTree
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload_dev import build


@dataclass(frozen=True)
class Plan:
    labels: (
        str | None
    )  # of ctest (unit, install, properties, crosscheck, sil, hil, target, budget, static, fuzz), a regex; None: all
    targets: tuple[str, ...] = ()  # that are built; none: all


@dataclass(frozen=True)
class Selection:
    """Of a preset's tests those whose name and one of whose labels match; None: any."""

    regex: str | None = None
    labels: str | None = None

    def targets(self, plan: Plan) -> tuple[str, ...]:
        return UNIT_TARGETS if self.labels == "unit" else plan.targets


PLANS = {
    "host": Plan(None),
    "asan-ubsan": Plan("unit|properties|fuzz"),  # all is built: its compiler warns of what gcc does not
}
UNIT_TARGETS = ("tests/unit/all",)  # what the unit tests run, and the libraries that one of them installs
JUNIT = project.BUILD / "junit"
ERROR_LINES = 4  # of one failed pytest
LAST_LINES = 40  # of one failed ctest
LONGEST_LINE = 240


@dataclass(frozen=True)
class Outcome:
    preset: str
    passed: int
    failed: tuple[str, ...]  # names; a test that did not run counts as failed
    seconds: float
    skipped: tuple[str, ...] = ()  # names; only tests that said so: of CAN without vcan0, of the page without a browser
    reasons: dict[str, tuple[str, ...]] = field(default_factory=dict)  # of failures, by name: lines of their output


def run_tests(presets: list[str] | None, regex: str | None, labels: str | None = None) -> int:
    """Returns the exit status: 0 only when at least one test ran and none failed."""
    chosen = _checked(presets)
    selection = Selection(regex, labels)
    builder = ThreadPoolExecutor(max_workers=1)
    try:
        builds = [builder.submit(_build, preset, selection, preset != chosen[0]) for preset in chosen]
        outcomes = [_run_preset(preset, selection, built) for preset, built in zip(chosen, builds, strict=True)]
    finally:
        builder.shutdown(cancel_futures=True)
    _print_summary(outcomes)
    _print_failures(outcomes)
    passed = sum(outcome.passed for outcome in outcomes)
    failed = sum(len(outcome.failed) for outcome in outcomes)
    skipped = sum(len(outcome.skipped) for outcome in outcomes)
    print(f"{passed} passed, {failed} failed" + (f", {skipped} skipped" if skipped else ""), flush=True)
    return 0 if passed and not failed else 1


def _build(preset: str, selection: Selection, is_beside_tests: bool) -> None:
    if is_beside_tests:
        _leave_processors_to_tests()
    build.build(preset, *selection.targets(PLANS[preset]))


def _leave_processors_to_tests() -> None:
    """For this thread and the programs that it starts: a test that wakes up has its processor at once."""
    try:
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    except OSError:  # not every container lets it
        os.nice(19)


def _checked(presets: list[str] | None) -> list[str]:
    for preset in presets or ():
        if preset not in PLANS:
            raise InputError(f"--preset: found '{preset}', expected one of: {', '.join(PLANS)}")
    return presets or list(PLANS)


def _run_preset(preset: str, selection: Selection, built: Future[None]) -> Outcome:
    try:
        built.result()
    except ToolFailed as error:
        print(f"hexload: {str(error).splitlines()[0]}", flush=True)
        return Outcome(preset, 0, ("build",), 0.0, reasons={"build": tuple(str(error).splitlines()[-LAST_LINES:])})
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
    for labels in (PLANS[preset].labels, selection.labels):  # a test must match each
        command += ["--label-regex", labels] if labels else []
    command += ["--tests-regex", selection.regex, "--verbose"] if selection.regex else []
    print(f"[hexload] testing {preset} ...", flush=True)
    status = subprocess.run(command, cwd=project.ROOT).returncode
    outcome = read_junit(preset, junit)
    if status != 0 and not outcome.failed:
        return replace(outcome, failed=("ctest",))
    return outcome


def read_junit(preset: str, junit: Path) -> Outcome:
    """ctest writes no file when no test matched; a status other than "run" means failed, not run, or skipped.

    A test has been skipped only when its program ended with the status for that; one that cannot be started has failed.
    """
    if not junit.exists():
        return Outcome(preset, 0, (), 0.0)
    cases = list(ElementTree.parse(junit).getroot().iter("testcase"))
    results = [(case.get("name", "?"), _status(case), float(case.get("time", 0.0))) for case in cases]
    outputs = {case.get("name", "?"): case.findtext("system-out") or "" for case in cases}
    failed = tuple(name for name, status, _ in results if status not in ("run", "skipped"))
    return Outcome(
        preset=preset,
        passed=sum(status == "run" for _, status, _ in results),
        failed=failed,
        seconds=sum(seconds for _, _, seconds in results),
        skipped=tuple(name for name, status, _ in results if status == "skipped"),
        reasons={name: reasons_of(outputs[name]) for name in failed},
    )


def reasons_of(output: str) -> tuple[str, ...]:
    """The lines of a failed test's output that say what failed: of pytest each test's name and the first words of its
    errors, of Unity the failed assertions, of others the last lines."""
    reasons, errors = [], 0
    for line in output.splitlines():
        if re.match(r"_{2,} .+ _{2,}$", line) or re.search(r":FAIL\b|^(FAILED|ERROR) ", line):
            reasons.append(line)
            errors = 0
        elif re.match(r"E +\S", line) and errors < ERROR_LINES:
            reasons.append(line)
            errors += 1
    return tuple(line[:LONGEST_LINE] for line in (reasons or output.splitlines())[-LAST_LINES:])


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


def _print_failures(outcomes: list[Outcome]) -> None:
    for outcome in outcomes:
        for name in outcome.failed:
            print(f"\nfailed: {name} of preset {outcome.preset}")
            for line in outcome.reasons.get(name, ()):
                print(f"  {line}")
