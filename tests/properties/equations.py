"""Checker of EQUATIONS.md: paper equation -> symbol -> function -> test -> deviation.

The file holds one table whose header has the columns `equation`, `function`, `test`, `deviation` (others are free), and
entries of deviations. In the table:

    equation    `(7)`, `(1), (2)` or `(13)-(15)`; rows of unnumbered items (a table, a text) are welcome
    function    `name` (path), one or more; path from the top of the repository
    test        `name` (path), one or more; the name of a function, or the sentence of a TEST_CASE
    deviation   D1, D2, ... or -

A deviation's entry starts a line, as a list item, a heading or a table row: `- **D1**`, `### D1`, `| D1 |`.
"""

import re
from dataclasses import dataclass
from pathlib import Path

EQUATIONS = range(1, 38)
COLUMNS = ("equation", "function", "test", "deviation")
REFERENCE = re.compile(r"`([^`]+)`\s*\(`?([\w./+-]+)`?\)")
NUMBERS = re.compile(r"\((\d+)\)(?:\s*[-–]\s*\((\d+)\))?")
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
    return [
        *_missing_equations(rows),
        *_dangling_references(rows, root),
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


def _dangling_references(rows: list[Row], root: Path) -> list[str]:
    faults = []
    for row in rows:
        for column in ("function", "test"):
            references = REFERENCE.findall(row.cells.get(column, ""))
            if not references:
                faults.append(f"line {row.line}: found no {column} `name` (file)")
            dangling = (_dangling(name, file, root) for name, file in references)
            faults += [f"line {row.line}: {fault}" for fault in dangling if fault]
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
        source = _without_comments(source)
        exists = re.search(rf"^(?:\S.*)?\b{identifier}\s*\(", source, re.MULTILINE) or f'"{name}"' in source
    return None if exists else f"found no `{name}` in {file}"


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


def _without_comments(source: str) -> str:
    """C and C++ without comments, so that a mention is no definition."""
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)


def _uncommented_lines(source: str) -> str:
    """The text with its comment markers taken off, so that a citation may run over a line."""
    return re.sub(r"\n\s*(?:///?|\*|#)?\s*", " ", source)
