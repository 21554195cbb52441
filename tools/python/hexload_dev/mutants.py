"""Mutants of C sources: small faults of the kind that slip in, each of which some unit test should notice."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

SWAPS = {
    "relation": {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="},
    "arithmetic": {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "*=": "/=", "%": "*"},
    "logic": {"&&": "||", "||": "&&", "&": "|", "|": "&", "<<": ">>", ">>": "<<", "|=": "&=", "&=": "|="},
}
OPERATOR = re.compile(r"(?<= )(<=|>=|==|!=|&&|\|\||<<|>>|\+=|-=|\*=|\|=|&=|[<>+\-*/%&|])(?= )")  # binary: spaces around
NUMBER = re.compile(r"(?<![\w.])(?:\d+\.\d*(?:e-?\d+)?f?|\d+e-?\d+|\d+)u?(?![\w.])")
WORD = re.compile(r"\b(true|false)\b")
CONDITION = re.compile(r"\bif \(")
LVALUE = r"[A-Za-z_][\w.]*(?:(?:->|\[[^\]]*\]|\.)[\w.]*)*"
STATEMENT = re.compile(
    rf"^(?P<space>[ \t]+)(?P<text>(?:\(void\))?(?:\*?{LVALUE} (?:[-+*/|&]|<<|>>)?= |{LVALUE}(?:\+\+|--);|\w+\()[^;{{}}]*;|{LVALUE}(?:\+\+|--);)$",
    re.MULTILINE,
)
NOT_CODE = re.compile(
    r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'|^\s*#\s*(?!define)[^\n]*", re.S | re.M
)
ROOM = re.compile(
    r"^ +(?:static |const )*\w+ \w+(?:\[[^\]]*\])+[;,]", re.MULTILINE
)  # of an array: more of it is no fault
NO_STATEMENT = re.compile(r"(?:return|else|while|for|if|switch|_Static_assert|sizeof)\b")


@dataclass(frozen=True)
class Mutant:
    file: str  # from the project's folder
    start: int  # characters
    end: int
    replacement: str
    kind: str  # of fault
    line: int
    before: str  # the line, or lines, without spaces around
    after: str

    def of(self, source: str) -> str:
        return source[: self.start] + self.replacement + source[self.end :]

    def key(self, source: str) -> str:
        return hashlib.sha256(f"{self.file}:{self.of(source)}".encode()).hexdigest()[:24]


def mutants_of(root: Path, file: str) -> list[Mutant]:
    source = (root / file).read_text(encoding="utf-8")
    code = NOT_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), source)
    found = [*_swapped(code), *_renumbered(code), *_negated(code), *_removed(code)]
    return [_mutant(file, source, *each) for each in sorted(found)]


def _mutant(file: str, source: str, start: int, end: int, replacement: str, kind: str) -> Mutant:
    first = source.rfind("\n", 0, start) + 1
    last = source.find("\n", end)
    after = source[first:start] + replacement + source[end:last]
    line = source.count("\n", 0, start) + 1
    return Mutant(file, start, end, replacement, kind, line, _one_line(source[first:last]), _one_line(after))


def _one_line(text: str) -> str:
    return " ".join(text.split())


Found = list[tuple[int, int, str, str]]


def _swapped(code: str) -> Found:
    return [
        (found.start(), found.end(), table[found[0]], kind)
        for found in OPERATOR.finditer(code)
        for kind, table in SWAPS.items()
        if found[0] in table
    ]


def _renumbered(code: str) -> Found:
    rooms = [range(room.start(), room.end()) for room in ROOM.finditer(code)]
    found = [
        (number.start(), number.end(), _other(number[0]), "constant")
        for number in NUMBER.finditer(code)
        if not any(number.start() in room for room in rooms)
    ]
    words = {"true": "false", "false": "true"}
    return found + [(word.start(), word.end(), words[word[0]], "constant") for word in WORD.finditer(code)]


def _other(number: str) -> str:
    """One more of a count; of a measure half as much again, of none one."""
    digits = number.rstrip("uf")
    if digits.isdigit():
        return str(int(digits) + 1) + number[len(digits) :]
    value = float(digits)
    other = repr(1.5 * value if value else 1.0)  # has a point or an exponent
    return other + number[len(digits) :]


def _negated(code: str) -> Found:
    found = []
    for condition in CONDITION.finditer(code):
        start, depth = condition.end(), 1
        end = start
        while depth:
            depth += {"(": 1, ")": -1}.get(code[end], 0)
            end += 1
        found.append((start, end - 1, f"!({code[start : end - 1]})", "condition"))
    return found


def _removed(code: str) -> Found:
    return [
        (found.start("text"), found.end("text"), ";", "statement")
        for found in STATEMENT.finditer(code)
        if not NO_STATEMENT.match(found["text"])
    ]
