"""Stack and calls of compiled functions, from the files that gcc writes with -fcallgraph-info=su,da (*.ci)."""

import re
from dataclasses import dataclass, field
from pathlib import Path

NODE = re.compile(r'node: \{ title: "(?P<name>[^"]+)" label: "(?P<label>[^"]*)"')
EDGE = re.compile(r'edge: \{ sourcename: "(?P<caller>[^"]+)" targetname: "(?P<callee>[^"]+)"')
STACK = re.compile(r"(?P<bytes>\d+) bytes \((?P<kind>[^)]*)\)")
DYNAMIC = re.compile(r"(?P<count>\d+) dynamic objects")


@dataclass
class Function:
    stack_bytes: int
    is_bounded: bool
    callees: set[str] = field(default_factory=set)


def read_call_graph(*folders: Path) -> dict[str, Function]:
    """All functions with a body in the objects below `folders`; what they call may lie elsewhere."""
    texts = [path.read_text() for folder in folders for path in sorted(folder.rglob("*.ci"))]
    functions = {}
    for text in texts:
        for node in NODE.finditer(text):
            stack = STACK.search(node["label"])
            if stack:
                is_bounded = stack["kind"] == "static" and DYNAMIC.search(node["label"])["count"] == "0"
                functions[node["name"]] = Function(int(stack["bytes"]), is_bounded)
    for text in texts:
        for edge in EDGE.finditer(text):
            functions[edge["caller"]].callees.add(edge["callee"])
    return functions


def deepest_chain(functions: dict[str, Function], library: dict[str, int], start: str) -> tuple[int, list[str]]:
    """Bytes of stack below the call of `start`, and the chain of calls that needs them.

    Raises ValueError for recursion, and for a call of a function that neither `functions` nor `library` has.
    """

    def descend(name: str, chain: tuple[str, ...]) -> tuple[int, list[str]]:
        if name in chain:
            raise ValueError(f"recursion: {' -> '.join((*chain, name))}")
        if name in library:
            return library[name], [name]
        if name not in functions:
            raise ValueError(f"unknown function: {' -> '.join((*chain, name))}")
        below = [descend(callee, (*chain, name)) for callee in functions[name].callees]
        depth, deepest = max(below, default=(0, []))
        return functions[name].stack_bytes + depth, [name, *deepest]

    return descend(start, ())
