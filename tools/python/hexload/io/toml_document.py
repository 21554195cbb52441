"""TOML tables as Python dicts, read and written: the little of TOML that platform and scenario files use."""

import codecs
import json
import tomllib
from collections.abc import Sequence
from pathlib import Path

from hexload.errors import InputError

GUESSED = "guessed:"  # in the comment of a key of which hexload platform new was told less than it writes
Table = dict[str, "str | float | list | Table"]


def read_toml(path: Path) -> Table:
    """Raises InputError for another encoding than UTF-8, in the words of firmware/platform_file; OSError, TOMLDecodeError."""
    raw = path.read_bytes()
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise InputError(f"{path}:1: found text in UTF-16, {_expected(path, 'utf-16')}")
    try:
        return tomllib.loads(raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = 1 + raw.count(b"\n", 0, error.start)
        found = f"found byte 0x{raw[error.start]:02x}, which is no UTF-8 but may be Latin-1"
        raise InputError(f"{path}:{line}: {found}, {_expected(path, 'latin1')}") from None


def _expected(path: Path, encoding: str) -> str:
    return f"expected UTF-8: iconv -f {encoding} -t utf-8 {path.name} > utf8-{path.name}"


def guessed_in_words(path: Path, keys: Sequence[str], name: str | None = None) -> str:
    """Which of a platform file's keys are marked as guessed; nothing where none is. `name`: of the file."""
    lines = (
        line.partition("=") for line in path.read_text(encoding="utf-8-sig").splitlines() if f"# {GUESSED}" in line
    )
    found = [key.strip() for key, _, _ in lines if key.strip() in keys]
    return f"{', '.join(found)} in {name or path} {'was' if len(found) == 1 else 'were'} guessed" if found else ""


def to_toml(table: Table) -> str:
    """A document with keys, tables and arrays of tables, the two latter one level deep."""
    lines = [f"{key} = {_value(value)}" for key, value in table.items() if not _is_table(value)]
    for name, value in table.items():
        if not _is_table(value):
            continue
        heading, tables = (f"[[{name}]]", value) if isinstance(value, list) else (f"[{name}]", [value])
        for entries in tables:
            lines += ["", heading, *(f"{key} = {_value(entry)}" for key, entry in entries.items())]
    return "\n".join([*lines, ""])


def _is_table(value: object) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _value(value: object) -> str:
    return json.dumps(value, allow_nan=False)  # strings, numbers, booleans and lists of them are written alike in both
