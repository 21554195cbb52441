"""Checker of EQUATIONS.md: paper equation -> symbol -> function -> test -> deviation.

The file holds tables whose headers have the columns `equation`, `function`, `test`, `deviation` (others are free),
entries of deviations, and prose that derives what is not the paper's. In the tables:

    equation    `(7)`, `(1), (2)` or `(13)-(15)`; rows of unnumbered items (a table, a text) are welcome; `(M3)`, `(A1)`
                for equations that stand in the prose, where a line ends in their number
    function    `name` (path), one or more; path from the top of the repository; a test of the row must reach it
    test        `name` (path), one or more; the name of a function, or the sentence of a TEST_CASE; registered
    deviation   D1, D2, ... or -

A deviation's entry starts a line, as a list item, a heading or a table row: `- **D1**`, `### D1`, `| D1 |`. In the prose
(`name`, path) and `name` (path) are references as in the tables; other names and paths must exist.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from call_names import CallNames, without_comments

EQUATIONS = range(1, 38)
COLUMNS = ("equation", "function", "test", "deviation")
REFERENCE = re.compile(r"`([^`]+)`\s*\(`?([\w./+-]+)`?\)")
NUMBERS = re.compile(r"\((\d+)\)(?:\s*[-–]\s*\((\d+)\))?")
OWN_NUMBER = re.compile(r"\(([MA]\d+)\)")
DERIVED = re.compile(r"\(([MA]\d+)\)$", re.MULTILINE)
PROSE_REFERENCES = re.compile(r"((?:`[\w.]+`,\s+)+)([\w./-]+\.(?:c|h|cpp|hpp|py))\b")
CODE_NAME = re.compile(r"`(\w*[A-Za-z0-9]_\w+)(?:\(\))?`")
CODE_PATH = re.compile(r"(?<![\w/.(])(?:firmware|host_sim|tests|tools)/[\w./-]*\w")
DEVIATION = re.compile(r"\bD(\d+)\b")
DEVIATION_ENTRY = re.compile(r"^\s*(?:[-*]|#+|\|)\s*\**D(\d+)\b", re.MULTILINE)
CITATION = re.compile(r"EQUATIONS\.md[,:]?\s+((?:D\d+(?:,\s*|\s+and\s+)?)+)")
SOURCES = (".c", ".h", ".cpp", ".hpp", ".py", ".md", ".toml", ".jinja")
SOURCE_FOLDERS = ("firmware", "host_sim", "tests", "tools")


@dataclass(frozen=True)
class Row:
    line: int
    cells: dict[str, str]


def find_faults(text: str, root: Path) -> list[str]:
    """What is wrong with the text of EQUATIONS.md in the repository at root, a sentence each; empty: nothing."""
    rows = _table(text)
    if not rows:
        return [f"found no table, expected one with the columns {', '.join(COLUMNS)}"]
    calls = CallNames(root, SOURCE_FOLDERS)
    dangling = _dangling_references(rows, root)
    return [
        *_missing_equations(rows),
        *_unmatched_numbers(rows, text),
        *dangling,
        *([] if dangling else _unreached_functions(rows, calls)),
        *_dangling_prose(text, root, calls),
        *_unmatched_deviations(rows, text),
    ]


def find_dangling_citations(text: str, root: Path) -> list[str]:
    """Sources that cite a deviation which EQUATIONS.md has no entry for."""
    entries = set(DEVIATION_ENTRY.findall(text))
    faults = []
    for path in _sources(root):
        for citation in CITATION.findall(_uncommented_lines(path.read_text(encoding="utf-8"))):
            faults += [
                f"{path.relative_to(root)}: cites D{number}, which has no entry"
                for number in DEVIATION.findall(citation)
                if number not in entries
            ]
    return faults


def _table(text: str) -> list[Row]:
    rows, columns = [], None
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.lstrip().startswith("|"):
            columns = None
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]
        names = [cell.lower() for cell in cells]
        if set(COLUMNS) <= set(names):
            columns = names
        elif columns and not set("".join(cells)) <= set("-: "):
            rows.append(Row(number, dict(zip(columns, cells, strict=False))))
    return rows


def _missing_equations(rows: list[Row]) -> list[str]:
    named = set()
    for row in rows:
        for first, last in NUMBERS.findall(row.cells["equation"]):
            named |= set(range(int(first), int(last or first) + 1))
    missing = [f"equation ({number}) has no row" for number in EQUATIONS if number not in named]
    unknown = [f"equation ({number}) is not in the paper" for number in sorted(named) if number not in EQUATIONS]
    return missing + unknown


def _unmatched_numbers(rows: list[Row], text: str) -> list[str]:
    """Of the equations that are not the paper's: each has its row and its line in the prose, once."""
    named = [number for row in rows for number in OWN_NUMBER.findall(row.cells["equation"])]
    derived = DERIVED.findall(_prose(text))
    return [
        *(f"equation ({number}) has no row" for number in derived if number not in named),
        *(f"equation ({number}) does not stand in the prose" for number in named if number not in derived),
        *(f"equation ({number}) stands twice" for number in sorted({n for n in derived if derived.count(n) > 1})),
    ]


def _unreached_functions(rows: list[Row], calls: CallNames) -> list[str]:
    """Functions that no test of their row reaches, and tests that reach no function of theirs."""
    faults = []
    for row in rows:
        functions = [(file, name.removesuffix("()")) for name, file in REFERENCE.findall(row.cells["function"])]
        tests = [(file, name.removesuffix("()")) for name, file in REFERENCE.findall(row.cells["test"])]
        reached = {(test, goal) for test in tests for goal in functions if calls.reaches(test, goal)}
        faults += [
            f"line {row.line}: no test of the row reaches `{goal[1]}`"
            for goal in functions
            if all((test, goal) not in reached for test in tests)
        ]
        faults += [
            f"line {row.line}: `{test[1]}` reaches no function of the row"
            for test in tests
            if all((test, goal) not in reached for goal in functions)
        ]
    return faults


def _dangling_prose(text: str, root: Path, calls: CallNames) -> list[str]:
    prose = _prose(text)
    referred = [
        (name, file) for names, file in PROSE_REFERENCES.findall(prose) for name in re.findall(r"`([^`]+)`", names)
    ]
    referred += REFERENCE.findall(prose)
    faults = [fault for name, file in referred if (fault := _dangling(name, file, root))]
    faults += [
        fault for name, file in referred if name.startswith("test_") and (fault := _unregistered(name, file, root))
    ]
    faults += [f"found no file {path}" for path in CODE_PATH.findall(prose) if not (root / path).exists()]
    with_file = {name for name, _ in referred}
    names = dict.fromkeys(name for name in CODE_NAME.findall(prose) if name not in with_file)
    return faults + [f"found no `{name}` in the sources" for name in names if not calls.is_defined(name)]


def _prose(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.splitlines() if not line.lstrip().startswith("|"))


def _dangling_references(rows: list[Row], root: Path) -> list[str]:
    faults = []
    for row in rows:
        for column in ("function", "test"):
            references = REFERENCE.findall(row.cells.get(column, ""))
            if not references:
                faults.append(f"line {row.line}: found no {column} `name` (file)")
            for name, file in references:
                fault = _dangling(name, file, root)
                if fault is None and column == "test":
                    fault = _unregistered(name, file, root)
                faults += [f"line {row.line}: {fault}"] if fault else []
    return faults


def _dangling(name: str, file: str, root: Path) -> str | None:
    path = root / file
    if not path.is_file():
        return f"found no file {file}"
    source = path.read_text(encoding="utf-8")
    identifier = re.escape(name.removesuffix("()"))
    if path.suffix == ".py":
        exists = re.search(rf"^\s*def {identifier}\(", source, re.MULTILINE)
    else:  # a definition starts at the left margin, a call is indented
        source = without_comments(source)
        exists = re.search(rf"^(?:\S.*)?\b{identifier}\s*\(", source, re.MULTILINE) or f'"{name}"' in source
    return None if exists else f"found no `{name}` in {file}"


def _unregistered(name: str, file: str, root: Path) -> str | None:
    """A Unity test must be run by its program, and each file by the CMakeLists.txt of its folder, by its name."""
    path = root / file
    if path.suffix == ".c" and f"RUN_TEST({name})" not in without_comments(path.read_text(encoding="utf-8")):
        return f"`{name}` is not run by {file}"
    listed = path.with_name("CMakeLists.txt")
    words = re.split(
        r"[\s().]+", re.sub(r"#[^\n]*", "", listed.read_text(encoding="utf-8")) if listed.is_file() else ""
    )
    if {path.stem, path.stem.removeprefix("test_")} & set(words):
        return None
    return f"{file} is not registered in {listed.relative_to(root)}"


def _unmatched_deviations(rows: list[Row], text: str) -> list[str]:
    named = {number for row in rows for number in DEVIATION.findall(row.cells.get("deviation", ""))}
    entries = DEVIATION_ENTRY.findall(text)
    repeated = {number for number in entries if entries.count(number) > 1}
    return [
        *(f"deviation D{number} is named in the table but has no entry" for number in _sorted(named - set(entries))),
        *(f"deviation D{number} has an entry but no row names it" for number in _sorted(set(entries) - named)),
        *(f"deviation D{number} has {entries.count(number)} entries" for number in _sorted(repeated)),
    ]


def _sorted(numbers: set[str]) -> list[str]:
    return sorted(numbers, key=int)


def _sources(root: Path) -> list[Path]:
    paths = (path for folder in SOURCE_FOLDERS for path in sorted((root / folder).rglob("*")))
    return [path for path in paths if path.suffix in SOURCES and path.name != "EQUATIONS.md"]


def _uncommented_lines(source: str) -> str:
    """The text with its comment markers taken off, so that a citation may run over a line."""
    return re.sub(r"\n\s*(?:///?|\*|#)?\s*", " ", source)
