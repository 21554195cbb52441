"""Every equation is traced to a function and to a test that runs and reaches it; every deviation has its reason."""

import os
from pathlib import Path

import pytest

from equations import find_dangling_citations, find_faults

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
EQUATIONS_MD = ROOT / "firmware" / "EQUATIONS.md"


def test_equations_md_has_no_fault():
    # GIVEN the project's EQUATIONS.md WHEN it is checked against the paper's numbers and the sources
    # THEN no equation is missing, no reference dangles, each test runs and reaches its function, and no deviation lacks
    # its entry or its row
    assert find_faults(EQUATIONS_MD.read_text(encoding="utf-8"), ROOT) == []


def test_no_source_cites_a_deviation_without_an_entry():
    assert find_dangling_citations(EQUATIONS_MD.read_text(encoding="utf-8"), ROOT) == []


GOOD = """\
# Equations

| equation | symbol | function | test | deviation |
|---|---|---|---|---|
| (1)-(3) | L_i | `legs_of_pose` (firmware/legs.c) | `test_legs` (tests/test_legs.c) | D1 |
| (4), (5) | l | `load_arm` (firmware/legs.c) | `load arm turns with R` (tests/arm.cpp) | - |
| (6)–(37) | x | `step()` (`firmware/legs.c`), `load_arm` (firmware/legs.c) | `test_step` (tests/test_step.py) | D1, D2 |
| Table 2 | P0 | `step` (firmware/legs.c) | `test_step` (tests/test_step.py) | D2 |

## Deviations

- **D1** the reason
- **D2** another, see D1

## Beyond

| equation | function | test | deviation |
|---|---|---|---|
| (M1) | `load_arm` (firmware/legs.c) | `load arm turns with R` (tests/arm.cpp) | - |

**Arm** (`load_arm`, firmware/legs.c; `test_legs`, tests/test_legs.c). With `legs_of_pose`, in firmware/legs.c,

    l = R c                                (M1)
"""


@pytest.fixture
def repository(tmp_path) -> Path:
    files = {
        "firmware/legs.c": "int legs_of_pose(int a) { return a;\n}\nint load_arm(void) {\n    return 1;\n}\n"
        "/* forgotten() */ // lost()\nvoid step (void) {\n    load_arm();\n}\nvoid idle(void) {\n}\n",
        "tests/CMakeLists.txt": "foreach(stage legs)\nadd_executable(arm arm.cpp)\nhexload_add_pytest(step test_step.py)\n",
        "tests/test_legs.c": "static int turned(void) {\n    return legs_of_pose(1);\n}\n"
        "static void test_legs(void) {\n    turned();\n}\nint main(void) {\n    RUN_TEST(test_legs);\n}\n",
        "tests/arm.cpp": 'TEST_CASE("load arm turns with R") {\n    load_arm();\n}\n',
        "tests/test_step.py": "import native\n\n\ndef test_step(stepped):\n    pass\n\n\ndef stepped():\n"
        "    return native.run()\n",
        "tools/bind.cpp": 'void bind() {\n    m.def("run", [] { step(); });\n}\n',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_sound_file_has_no_fault(repository):
    assert find_faults(GOOD, repository) == []


@pytest.mark.parametrize(
    ("found", "replaced_by", "fault"),
    [
        ("(6)–(37)", "(6)–(36)", "equation (37) has no row"),
        ("(1)-(3)", "(1), (3)", "equation (2) has no row"),
        ("(6)–(37)", "(6)–(38)", "equation (38) is not in the paper"),
        ("`legs_of_pose` (firmware/legs.c)", "`legs_of_pose` (firmware/leg.c)", "line 5: found no file firmware/leg.c"),
        ("`legs_of_pose` (firmware", "`leg_of_pose` (firmware", "line 5: found no `leg_of_pose` in firmware/legs.c"),
        ("`legs_of_pose` (firmware", "`of_pose` (firmware", "line 5: found no `of_pose` in firmware/legs.c"),
        ("`legs_of_pose` (firmware", "`forgotten` (firmware", "line 5: found no `forgotten` in firmware/legs.c"),
        ("`legs_of_pose` (firmware", "`lost` (firmware", "line 5: found no `lost` in firmware/legs.c"),
        ("`legs_of_pose` (firmware", "`called` (firmware", "line 5: found no `called` in firmware/legs.c"),
        ("`legs_of_pose` (firmware/legs.c)", "legs_of_pose", "line 5: found no function `name` (file)"),
        ("`test_legs` (tests/test_legs.c)", "-", "line 5: found no test `name` (file)"),
        ("arm turns with R` (", "arm turns` (", "line 6: found no `load arm turns` in tests/arm.cpp"),
        (", `load_arm` (firmware", ", `load_arms` (firmware", "line 7: found no `load_arms` in firmware/legs.c"),
        (
            "`load arm turns with R` (tests/arm.cpp) | - |\n| (6)",
            "`test_legs` (tests/test_legs.c) | - |\n| (6)",
            "line 6: no test of the row reaches `load_arm`",
        ),
        (
            "`load_arm` (firmware/legs.c) | `load",
            "`idle` (firmware/legs.c) | `load",
            "line 6: `load arm turns with R` reaches no function of the row",
        ),
        ("| (M1) |", "| (M2) |", "equation (M1) has no row"),
        ("| (M1) |", "| (M1), (M2) |", "equation (M2) does not stand in the prose"),
        ("R c                                (M1)", "R c  (M1)\n\n    l = 0  (M1)", "equation (M1) stands twice"),
        ("(`load_arm`, firmware", "(`load_arms`, firmware", "found no `load_arms` in firmware/legs.c"),
        ("With `legs_of_pose`", "With `legs_of_poses`", "found no `legs_of_poses` in the sources"),
        ("in firmware/legs.c,", "in firmware/leg.c,", "found no file firmware/leg.c"),
        ("| D1 |", "| D3 |", "deviation D3 is named in the table but has no entry"),
        ("- **D2**", "- **D3**", "deviation D3 has an entry but no row names it"),
        ("- **D2** another", "- **D1** again", "deviation D1 has 2 entries"),
    ],
)
def test_each_fault_is_found(repository, found, replaced_by, fault):
    # GIVEN a sound file WHEN one thing in it is broken THEN that is what the checker says
    assert GOOD.count(found) >= 1
    assert fault in find_faults(GOOD.replace(found, replaced_by, 1), repository)


def test_a_file_without_a_table_of_tests_is_refused(repository):
    fault = "found no table, expected one with the columns equation, function, test, deviation"
    assert find_faults(GOOD.replace("| test |", "| tests |"), repository) == [fault]


@pytest.mark.parametrize(
    ("file", "found", "replaced_by", "fault"),
    [
        ("tests/test_legs.c", "RUN_TEST(test_legs);", "", "`test_legs` is not run by tests/test_legs.c"),
        ("tests/test_legs.c", "    RUN_TEST", "    // RUN_TEST", "`test_legs` is not run by tests/test_legs.c"),
        ("tests/test_legs.c", "legs_of_pose(1)", "1", "line 5: no test of the row reaches `legs_of_pose`"),
        (
            "tests/CMakeLists.txt",
            "stage legs",
            "stage arms",
            "tests/test_legs.c is not registered in tests/CMakeLists.txt",
        ),
        ("tests/CMakeLists.txt", "arm.cpp", "", None),
        (
            "tests/CMakeLists.txt",
            "hexload_add",
            "# hexload_add",
            "tests/test_step.py is not registered in tests/CMakeLists.txt",
        ),
        ("tests/test_step.py", "native.run()", "1", "line 7: no test of the row reaches `step`"),
        (
            "tests/test_step.py",
            "test_step(stepped)",
            "test_step()",
            "line 7: `test_step` reaches no function of the row",
        ),
        ("tools/bind.cpp", "step();", "idle();", "line 8: no test of the row reaches `step`"),
        ("firmware/legs.c", "    load_arm();", "", "line 7: no test of the row reaches `load_arm`"),
    ],
)
def test_a_test_that_does_not_run_or_not_reach_is_found(repository, file, found, replaced_by, fault):
    # GIVEN a sound file WHEN a source behind it changes so that a test no longer runs, or runs something else THEN it is said
    source = (repository / file).read_text()
    assert source.count(found) == 1
    (repository / file).write_text(source.replace(found, replaced_by))
    faults = "\n".join(find_faults(GOOD, repository))
    assert fault in faults if fault else faults == ""


def test_a_citation_of_a_deviation_without_entry_is_found(repository):
    # GIVEN sources that cite deviations, one of them over a line break
    firmware = repository / "firmware"
    (firmware / "good.h").write_text("/// the safe start (EQUATIONS.md, D2).\n")
    (firmware / "bad.h").write_text("/// the safe start (EQUATIONS.md,\n/// D1, D14).\n")
    # WHEN they are checked THEN only the one without an entry is reported
    assert find_dangling_citations(GOOD, repository) == ["firmware/bad.h: cites D14, which has no entry"]
