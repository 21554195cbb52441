"""How `hexload test` counts: a test that failed, did not run, or was skipped is never counted as passed."""

from itertools import pairwise
from subprocess import CompletedProcess
from threading import Event

import pytest

from hexload_dev import test as verb

PATIENCE_S = 60.0


def junit(tmp_path, *statuses):
    """As ctest --output-junit writes it: one test case per status."""
    cases = "".join(f'<testcase name="t{k}" time="0.5" status="{status}"/>' for k, status in enumerate(statuses))
    path = tmp_path / "host.xml"
    path.write_text(f'<?xml version="1.0"?><testsuite name="host" tests="{len(statuses)}">{cases}</testsuite>')
    return path


@pytest.fixture
def presets(monkeypatch, tmp_path):
    """Replaces the building and running of presets by outcomes that the test chooses."""
    chosen = {}
    monkeypatch.setattr(verb, "_run_preset", lambda preset, selection, built: chosen[preset])
    monkeypatch.setattr(verb.build, "build", lambda preset, *targets: None)
    return chosen


def outcome(preset, passed, *failed):
    return verb.Outcome(preset, passed, failed, 1.0)


def test_passed_failed_and_not_run_tests_are_told_apart(tmp_path):
    # GIVEN a ctest result of two passes, a failure, a test that did not run and a disabled one
    path = junit(tmp_path, "run", "run", "fail", "notrun", "disabled")
    # WHEN it is read
    result = verb.read_junit("host", path)
    # THEN only the two that ran well have passed
    assert (result.passed, result.failed, result.seconds) == (2, ("t2", "t3", "t4"), 2.5)


def test_only_a_test_that_says_so_has_been_skipped(tmp_path):
    # GIVEN a ctest result of a test that ended with the status for a skip, and of one whose program is missing
    path = tmp_path / "host.xml"
    messages = ("SKIP_RETURN_CODE=77", "Unable to find executable")
    cases = "".join(f'<testcase name="{m[:6]}" status="notrun"><skipped message="{m}"/></testcase>' for m in messages)
    path.write_text(f"<testsuite>{cases}</testsuite>")
    # WHEN it is read THEN the first has been skipped and the second has failed
    result = verb.read_junit("host", path)
    assert (result.skipped, result.failed) == (("SKIP_R",), ("Unable",))


def test_skips_are_in_the_last_line(presets, capsys):
    presets["host"] = verb.Outcome("host", 5, (), 1.0, ("hil_vcan",))
    assert verb.run_tests(["host"], None) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "5 passed, 0 failed, 1 skipped"


def test_no_result_file_means_that_no_test_ran(tmp_path):
    assert verb.read_junit("host", tmp_path / "none.xml").passed == 0


def test_the_last_line_sums_over_the_presets(presets, capsys):
    # GIVEN two presets that pass
    presets.update({"host": outcome("host", 5), "asan-ubsan": outcome("asan-ubsan", 3)})
    # WHEN they are run THEN the status is 0 and the last line has the sum
    assert verb.run_tests(["host", "asan-ubsan"], None) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "8 passed, 0 failed"


def test_one_failure_fails_the_whole_run(presets, capsys):
    # GIVEN a preset with a failure
    presets.update({"host": outcome("host", 5), "asan-ubsan": outcome("asan-ubsan", 2, "unit.wrench")})
    # WHEN both are run THEN the status is 1, and the failure is counted and named
    assert verb.run_tests(["host", "asan-ubsan"], None) == 1
    output = capsys.readouterr().out
    assert output.splitlines()[-1] == "7 passed, 1 failed"
    assert "unit.wrench" in output


def test_what_failed_is_named_with_the_words_of_its_assertions_before_the_last_line(presets, tmp_path, capsys):
    # GIVEN ctest's output of pytests of which one has failed, of an assertion of Unity, and of a program that crashed
    outputs = {
        "hil_host": """tests/hil/test_32.py::test_load PASSED
=================================== FAILURES ===================================
_____________________________ test_load[classic-52] _____________________________
>       assert 24 == 25
E       assert 24 == 25
tests/hil/test_32.py:99: AssertionError
=========================== short test summary info ============================
FAILED tests/hil/test_32.py::test_load[classic-52]""",
        "unit_wrench": "wrench.c:5:test_a:PASS\nwrench.c:9:test_b:FAIL: Expected 1 Was 2\n-----\n2 Tests 1 Failures",
        "crash": "first\nSegmentation fault",
    }
    case = '<testcase name="{}" status="fail"><system-out>{}</system-out></testcase>'
    cases = "".join(case.format(name, output) for name, output in outputs.items())
    junit = tmp_path / "host.xml"
    junit.write_text(f"<testsuite>{cases}</testsuite>")
    # WHEN the run is summed up
    presets["host"] = verb.read_junit("host", junit)
    assert verb.run_tests(["host"], None) == 1
    # THEN its last lines name each, with what it said
    lines = capsys.readouterr().out.splitlines()
    assert lines[lines.index("failed: hil_host of preset host") :] == [
        "failed: hil_host of preset host",
        "  _____________________________ test_load[classic-52] _____________________________",
        "  E       assert 24 == 25",
        "  FAILED tests/hil/test_32.py::test_load[classic-52]",
        "",
        "failed: unit_wrench of preset host",
        "  wrench.c:9:test_b:FAIL: Expected 1 Was 2",
        "",
        "failed: crash of preset host",
        "  first",
        "  Segmentation fault",
        "0 passed, 3 failed",
    ]


def test_a_run_of_no_test_fails(presets, capsys):
    # GIVEN presets in which no test matched WHEN they are run THEN that is a failure
    presets.update({"host": outcome("host", 0)})
    assert verb.run_tests(["host"], "nothing") == 1
    assert capsys.readouterr().out.splitlines()[-1] == "0 passed, 0 failed"


def test_a_label_narrows_the_presets_own_labels_and_units_build_nothing_else(monkeypatch, capsys):
    # GIVEN a preset with labels of its own
    built, commands = [], []
    monkeypatch.setattr(verb.build, "build", lambda preset, *targets: built.append(targets))
    monkeypatch.setattr(
        verb.subprocess, "run", lambda command, **_: commands.append(command) or CompletedProcess(command, 0)
    )
    # WHEN tests of a label are wanted
    verb.run_tests(["asan-ubsan"], None, "unit")
    verb.run_tests(["asan-ubsan"], None, "properties")
    # THEN ctest is given both, of which a test must match each; and of units alone the programs are built
    labels = [[word for option, word in pairwise(command) if option == "--label-regex"] for command in commands]
    assert labels == [["unit|properties|fuzz", "unit"], ["unit|properties|fuzz", "properties"]]
    assert built == [("tests/unit/all",), ()]


def test_a_build_that_fails_is_counted_and_the_other_presets_still_run(monkeypatch, capsys):
    # GIVEN a compiler that refuses everything
    def refuse(preset, *targets):
        raise verb.ToolFailed(f"building {preset} failed\nerror: found nothing, expected ';'")

    monkeypatch.setattr(verb.build, "build", refuse)
    # WHEN two presets are run THEN both are tried and counted, and the compiler's words are shown
    assert verb.run_tests(["host", "asan-ubsan"], None) == 1
    output = capsys.readouterr().out
    assert output.count("expected ';'") == 2
    assert output.splitlines()[-1] == "0 passed, 2 failed"


def test_the_next_preset_is_built_while_one_is_tested(monkeypatch, capsys):
    # GIVEN tests of the first preset that last until the second one has been built
    built = {"host": Event(), "asan-ubsan": Event()}
    monkeypatch.setattr(verb.build, "build", lambda preset, *targets: built[preset].set())

    def tests_of(preset, selection, build):
        build.result()
        return outcome(preset, int(built["asan-ubsan"].wait(PATIENCE_S)))

    monkeypatch.setattr(verb, "_run_preset", tests_of)
    # WHEN both are run THEN the tests of both end well
    verb.run_tests(["host", "asan-ubsan"], None)
    assert capsys.readouterr().out.splitlines()[-1] == "2 passed, 0 failed"
