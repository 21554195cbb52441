"""Every equation of the paper is traced to a function and a test that exist, every deviation has its reason."""

import os
from pathlib import Path

import pytest

from equations import find_dangling_citations, find_faults

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
EQUATIONS_MD = ROOT / "firmware" / "EQUATIONS.md"


def test_equations_md_has_no_fault():
    # GIVEN the project's EQUATIONS.md WHEN it is checked against the paper's numbers and the sources
    # THEN no equation is missing, no reference dangles, no deviation lacks its entry or its row
    assert find_faults(EQUATIONS_MD.read_text(encoding="utf-8"), ROOT) == []


def test_no_source_cites_a_deviation_without_an_entry():
    assert find_dangling_citations(EQUATIONS_MD.read_text(encoding="utf-8"), ROOT) == []


GOOD = """\
# Equations

| equation | symbol | function | test | deviation |
|---|---|---|---|---|
| (1)-(3) | L_i | `legs_of_pose` (src/legs.c) | `test_legs` (tests/test_legs.c) | D1 |
| (4), (5) | l | `load_arm` (src/legs.c) | `load arm turns with R` (tests/arm.cpp) | - |
| (6)–(37) | x | `step()` (`src/legs.c`), `load_arm` (src/legs.c) | `test_step` (tests/test_step.py) | D1, D2 |
| Table 2 | P0 | `step` (src/legs.c) | `test_step` (tests/test_step.py) | D2 |

## Deviations

- **D1** the reason
- **D2** another, see D1
"""


@pytest.fixture
def repository(tmp_path) -> Path:
    files = {
        "src/legs.c": "int legs_of_pose(int a) { return a; }\nint load_arm(void);\n"
        "/* forgotten() */ // lost()\nvoid step (void) {\n    called();\n}\n",
        "tests/test_legs.c": "static void test_legs(void) {}\n",
        "tests/arm.cpp": 'TEST_CASE("load arm turns with R") {}\n',
        "tests/test_step.py": "def test_step():\n    pass\n",
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
        ("`legs_of_pose` (src/legs.c)", "`legs_of_pose` (src/leg.c)", "line 5: found no file src/leg.c"),
        ("`legs_of_pose` (src", "`leg_of_pose` (src", "line 5: found no `leg_of_pose` in src/legs.c"),
        ("`legs_of_pose` (src", "`of_pose` (src", "line 5: found no `of_pose` in src/legs.c"),
        ("`legs_of_pose` (src", "`forgotten` (src", "line 5: found no `forgotten` in src/legs.c"),
        ("`legs_of_pose` (src", "`lost` (src", "line 5: found no `lost` in src/legs.c"),
        ("`legs_of_pose` (src", "`called` (src", "line 5: found no `called` in src/legs.c"),
        ("`legs_of_pose` (src/legs.c)", "legs_of_pose", "line 5: found no function `name` (file)"),
        ("`test_legs` (tests/test_legs.c)", "-", "line 5: found no test `name` (file)"),
        ("arm turns with R` (", "arm turns` (", "line 6: found no `load arm turns` in tests/arm.cpp"),
        (", `load_arm` (src", ", `load_arms` (src", "line 7: found no `load_arms` in src/legs.c"),
        ("| D1 |", "| D3 |", "deviation D3 is named in the table but has no entry"),
        ("- **D2**", "- **D3**", "deviation D3 has an entry but no row names it"),
        ("- **D2** another", "- **D1** again", "deviation D1 has 2 entries"),
        ("| test |", "| tests |", "found no table, expected one with the columns equation, function, test, deviation"),
    ],
)
def test_each_fault_is_found(repository, found, replaced_by, fault):
    # GIVEN a sound file WHEN one thing in it is broken THEN that is what the checker says
    assert GOOD.count(found) >= 1
    assert fault in find_faults(GOOD.replace(found, replaced_by, 1), repository)


def test_a_citation_of_a_deviation_without_entry_is_found(repository):
    # GIVEN sources that cite deviations, one of them over a line break
    firmware = repository / "firmware"
    firmware.mkdir()
    (firmware / "good.h").write_text("/// the safe start (EQUATIONS.md, D2).\n")
    (firmware / "bad.h").write_text("/// the safe start (EQUATIONS.md,\n/// D1, D14).\n")
    # WHEN they are checked THEN only the one without an entry is reported
    assert find_dangling_citations(GOOD, repository) == ["firmware/bad.h: cites D14, which has no entry"]
