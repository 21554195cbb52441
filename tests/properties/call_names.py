"""Which functions a test reaches: a graph of who names whom in the sources, cheap enough for every test run.

No compiler and no run: a function reaches what its text calls, C and C++ by name, Python by its imports, and from Python to
C++ by the names that the extension module gives. A name stands for every function of that name that can be seen from there,
so some edges are taken by no run; but a function that is not reached here is not reached by the test either.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

NATIVE = (".c", ".h", ".cpp", ".hpp")
CALL = re.compile(r"\b(hexload_\w+)|(?:&|\b)([A-Za-z_]\w*)\s*(?=\()|&\s*(?:\w+::)*([A-Za-z_]\w*)")
# At the left margin: what comes before the first bracket, then parameters and a body.
HEAD = re.compile(
    r"^(?!#|struct\b|class\b|enum\b|namespace\b|typedef\b|using\b|return\b)[A-Za-z][^;={}()]*?\b([A-Za-z_]\w*)\s*\(",
    re.MULTILINE,
)
SENTENCE_HEAD = re.compile(r'^(?:TEST_CASE|SCENARIO)\("([^"]*)"', re.MULTILINE)
METHOD_HEAD = re.compile(
    r"^[ \t]+(?!return\b|else\b|new\b)[A-Za-z][\w:<>,&* ]*?[ &*]([A-Za-z_]\w*)\([^;{}]*\)[^;{}]*\{", re.MULTILINE
)
BOUND_NAME = re.compile(r"\bdef(?:_\w+)?\(\s*\"(\w+)\"")
KEYWORDS = {"if", "for", "while", "switch", "TEST_CASE", "SCENARIO"}

Node = tuple[str, str]  # file, name


class CallNames:
    """The graph of the sources below `folders` of `root`."""

    def __init__(self, root: Path, folders: Iterable[str]):
        self._calls: dict[Node, set[Node]] = defaultdict(set)
        self._text: dict[Node, str] = {}  # of C and C++ functions
        self._by_name: dict[str, set[Node]] = defaultdict(set)  # of C and C++ that other files can name
        self._bound: dict[str, set[Node]] = defaultdict(set)
        self._modules: dict[str, ast.Module] = {}
        paths = sorted(path for folder in folders for path in (root / folder).rglob("*"))
        for path in paths:
            file = path.relative_to(root).as_posix()
            if path.suffix in NATIVE:
                self._add_native(file, without_comments(path.read_text(encoding="utf-8")))
            elif path.suffix == ".py":
                self._modules[file] = ast.parse(path.read_text(encoding="utf-8"))
        for node, text in self._text.items():
            self._calls[node] |= set(self._named_by(node[0], text))
        for file, module in self._modules.items():
            self._add_python(file, module)

    def defines(self, file: str, name: str) -> bool:
        return (file, name) in self._calls

    def is_defined(self, name: str) -> bool:
        return any(node[1] == name for node in self._calls)

    def reaches(self, start: Node, goal: Node) -> bool:
        """Whether `start`, or what it reaches, calls `goal`. Unity runs setUp before each test of its file."""
        seen = {start}
        waiting = [start, (start[0], "setUp")]
        while waiting:
            for node in self._calls.get(waiting.pop(), ()):
                if node == goal:
                    return True
                if node not in seen:
                    seen.add(node)
                    waiting.append(node)
        return False

    def _add_native(self, file: str, source: str) -> None:
        for name, text, is_local in _native_functions(source):
            node = (file, name)
            self._text[node] = self._text.get(node, "") + text
            if not is_local:
                self._by_name[name].add(node)
        for match in BOUND_NAME.finditer(source):
            node = (file, f"def {match[1]}")
            text = _to_closing(source, source.index("(", match.start()), "()")
            self._text[node] = self._text.get(node, "") + text
            self._bound[match[1]].add(node)

    def _named_by(self, file: str, text: str) -> Iterator[Node]:
        for name in {name for groups in CALL.findall(text) for name in groups if name}:
            if (file, name) in self._text:
                yield file, name
            else:
                yield from (node for node in self._by_name[name] if _can_see(file, node[0]))

    def _add_python(self, file: str, module: ast.Module) -> None:
        imports = dict(self._imports(file, module))
        for definition in module.body:
            if isinstance(definition, ast.ClassDef):
                for method in definition.body:
                    if isinstance(method, ast.FunctionDef):
                        self._calls[file, definition.name].add((file, method.name))
                        self._add_python_function(file, method, imports)
            elif isinstance(definition, ast.FunctionDef):
                self._add_python_function(file, definition, imports)

    def _imports(self, file: str, module: ast.Module) -> Iterator[tuple[str, tuple[str, str]]]:
        """The name that stands in this file -> file, name there; no name: the module itself."""
        for node in ast.walk(module):
            if isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    whole = self._find_module(file, f"{node.module}.{alias.name}")
                    yield (
                        alias.asname or alias.name,
                        (whole, "")
                        if whole
                        else (
                            self._find_module(file, node.module),
                            alias.name,
                        ),
                    )
            elif isinstance(node, ast.Import):
                for alias in node.names:
                    yield alias.asname or alias.name, (self._find_module(file, alias.name), "")

    def _find_module(self, file: str, module: str) -> str:
        """Its file, of those that have the name's ending the one beside `file` if there is one; empty: none of ours."""
        path = module.replace(".", "/")
        found = [known for known in self._modules if f"/{known}".endswith((f"/{path}.py", f"/{path}/__init__.py"))]
        return min(found, key=lambda known: Path(known).parent != Path(file).parent, default="")

    def _add_python_function(self, file: str, function: ast.FunctionDef, imports: dict[str, tuple[str, str]]) -> None:
        called = self._calls[file, function.name]
        fixtures = {argument.arg for argument in function.args.args}
        for node in ast.walk(function):
            if isinstance(node, ast.Attribute):
                home = imports.get(node.value.id) if isinstance(node.value, ast.Name) else None
                if home is None or home == ("", ""):  # of an object, or of a module that is none of ours
                    called |= self._bound[node.attr]
                elif not home[1]:
                    called.add((home[0], node.attr))
                else:
                    called.add((home[0], home[1]))
            elif isinstance(node, ast.Name):
                called.add(imports.get(node.id, (file, node.id)))
        for name in fixtures:
            called |= {(file, name), (Path(file).with_name("conftest.py").as_posix(), name)}


def without_comments(source: str) -> str:
    """C and C++ without comments, so that a mention is no definition and no call."""
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL)


def _can_see(file: str, other: str) -> bool:
    """The firmware knows no plant, programs know no tests, and tests of one folder none of another."""
    top, other_top = file.split("/")[0], other.split("/")[0]
    if other_top == "tests":
        return top == "tests" and file.split("/")[1] == other.split("/")[1]
    return top != "firmware" or other_top == "firmware"


def _native_functions(source: str) -> Iterator[tuple[str, str, bool]]:
    """Name, text from the parameters on, and whether no other file can name it."""
    for match in SENTENCE_HEAD.finditer(source):
        yield match[1], _to_margin(source, match.end()), True
    for match in HEAD.finditer(source):
        text = _to_margin(source, match.end())
        if ";" not in text.partition("{")[0] and match[1] not in KEYWORDS:
            words = match[0].split()
            yield match[1], text, "static" in words and "inline" not in words
    for match in METHOD_HEAD.finditer(source):
        if match[1] not in KEYWORDS:
            yield match[1], _to_closing(source, match.end() - 1, "{}"), False


def _to_margin(source: str, start: int) -> str:
    end = re.compile(r"^\}", re.MULTILINE).search(source, start)
    return source[start : end.start()] if end else source[start:]


def _to_closing(source: str, start: int, brackets: str) -> str:
    depth = 0
    for at in range(start, len(source)):
        depth += (source[at] == brackets[0]) - (source[at] == brackets[1])
        if depth == 0:
            return source[start : at + 1]
    return source[start:]
