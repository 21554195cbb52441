"""Prints the packages of groups for pip, each with its version and its hashes: requirements.py LOCK PYPROJECT... -- GROUP...

A group is an extra, of whichever project has one of this name; "cli" brings the dependencies of hexload itself too. The
lock file (`python -m hexload_dev lock`) has all packages of all groups, and whose sake each is there for: of it, those
that the groups need, directly or not.
Only the standard library is used: tools/hexload asks before anything is installed.
"""

import re
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

OWN = re.compile(r"hexload(?:_dev)?(?:\[([\w,]+)\])?")  # a project's own name, with extras or without
PIN = re.compile(r"([\w.-]+)(?:\[[\w,-]+\])?==(\S+)")


class Locked(NamedTuple):
    """A package at one version; of one name there may be several, for different Pythons."""

    name: str  # as canonical() has it
    version: str
    lines: tuple[str, ...]  # as pip reads them, with the hashes
    needed_by: frozenset[str]  # names


def requirements(projects: list[Path], groups: list[str]) -> list[str]:
    """Sorted, without the projects themselves. Raises KeyError for a group that no project has."""
    tables = [tomllib.loads(path.read_text(encoding="utf-8"))["project"] for path in projects]
    extras = {name: lines for table in tables for name, lines in table["optional-dependencies"].items()}
    found: set[str] = set()
    waiting = list(groups)
    if "cli" in groups:
        found.update(*(table["dependencies"] for table in tables))
    while waiting:
        for line in extras[waiting.pop()]:
            found.add(line)
            own = OWN.fullmatch(line)
            waiting += (own[1] or "").split(",") if own and own[1] else []
    return sorted(line for line in found if not OWN.fullmatch(line))


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def read_lock(text: str) -> list[Locked]:
    """Raises ValueError for a package without a hash."""
    blocks: list[list[str]] = []
    for line in text.splitlines():
        if PIN.match(line):
            blocks.append([])
        if blocks:
            blocks[-1].append(line)
    return [_locked(block) for block in blocks]


def _locked(block: list[str]) -> Locked:
    name, version = PIN.match(block[0]).groups()
    lines = tuple(line for line in block if not line.lstrip().startswith("#"))
    if not any("--hash=sha256:" in line for line in lines):
        raise ValueError(f"lock: {name} {version}: found no hash")
    comments = [line.lstrip(" #").removeprefix("via").strip() for line in block if line.lstrip().startswith("#")]
    return Locked(canonical(name), version, lines, frozenset(canonical(word) for word in comments if word))


def chosen(lock: list[Locked], lines: list[str]) -> list[Locked]:
    """What of the lock these requirements need. Raises KeyError for one that the lock has not."""
    wanted = {canonical(re.match(r"[\w.-]+", line)[0]) for line in lines}
    if missing := wanted - {package.name for package in lock}:
        raise KeyError(f"not in the lock, which `tools/hexload lock` writes anew: {', '.join(sorted(missing))}")
    while more := {package.name for package in lock if package.needed_by & wanted} - wanted:
        wanted |= more
    return [package for package in lock if package.name in wanted]


if __name__ == "__main__":
    split = sys.argv.index("--")
    locked = read_lock(Path(sys.argv[1]).read_text(encoding="utf-8"))
    needed = requirements([Path(name) for name in sys.argv[2:split]], sys.argv[split + 1 :])
    print("\n".join(line for package in chosen(locked, needed) for line in package.lines))
