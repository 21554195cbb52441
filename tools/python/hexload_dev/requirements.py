"""Prints the packages of groups, one per line, for pip: requirements.py PYPROJECT... -- GROUP...

A group is an extra, of whichever project has one of this name; "cli" brings the dependencies of hexload itself too.
Only the standard library is used: tools/hexload asks before anything is installed.
"""

import re
import sys
import tomllib
from pathlib import Path

OWN = re.compile(r"hexload(?:_dev)?(?:\[([\w,]+)\])?")  # a project's own name, with extras or without


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


if __name__ == "__main__":
    split = sys.argv.index("--")
    print("\n".join(requirements([Path(name) for name in sys.argv[1:split]], sys.argv[split + 1 :])))
