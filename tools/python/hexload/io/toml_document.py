"""TOML tables as Python dicts, read and written: the little of TOML that platform and scenario files use."""

import json
import tomllib
from pathlib import Path

Table = dict[str, "str | float | list | Table"]


def read_toml(path: Path) -> Table:
    with path.open("rb") as file:
        return tomllib.load(file)


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
