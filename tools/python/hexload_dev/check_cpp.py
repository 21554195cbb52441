"""`hexload check-cpp`: clang-tidy over the C++, with the checks of host_sim/.clang-tidy.

Sources are read as they are compiled: those that are joined for the build, joined. What only tests compile is left out.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev import build

CHECKS = project.ROOT / "host_sim" / ".clang-tidy"
VERSION = "14"  # whose findings are judged: others have other checks
TARGETS = ("hexload_sim_app", "hexload_ecu", "hexload_bridge", "hexload_native", "hexload_soak", "hexload_bus_soak")
FOLDERS = ("host_sim", "firmware", "lcm_types", "tools/native")
OTHERS = re.compile(r"_double\.dir|nanobind|cmake_pch")  # the same once more, and what is not ours
GCC_ONLY = re.compile(r"--param=|-fpeel-loops|-fcallgraph-info")
FINDING = re.compile(r"^\S+:\d+:\d+: (?:warning|error): .*$", re.MULTILINE)


def run_check() -> int:
    """Returns the exit status: 0 when nothing is found."""
    build.ensure_built(*TARGETS)
    commands = compile_commands()
    found = findings(commands)
    print(*found, sep="\n")
    print(f"clang-tidy: {len(found)} findings in {len(commands)} compilations of the C++")
    return 1 if found else 0


def compile_commands() -> list[dict]:
    """How the C++ is compiled, for clang."""
    directory = project.build_directory()
    commands = {}
    for entry in json.loads((directory / "compile_commands.json").read_text(encoding="utf-8")):
        path = Path(entry["file"])
        base = directory if path.is_relative_to(directory) else project.ROOT
        source = str(path.relative_to(base)) if path.is_relative_to(base) else ""
        if path.suffix in (".cpp", ".cxx") and source.startswith(FOLDERS) and not OTHERS.search(entry["command"]):
            words = [word for word in shlex.split(entry["command"]) if not GCC_ONLY.match(word)]
            compiler = 1 if Path(words[0]).name == "ccache" else 0
            commands.setdefault(
                source, {"file": entry["file"], "directory": entry["directory"], "arguments": words[compiler:]}
            )
    return list(commands.values())


def findings(commands: list[dict], jobs: int | None = None) -> list[str]:
    """What clang-tidy finds in these compilations. Raises ToolFailed where there is no clang-tidy, or it fails."""
    with tempfile.TemporaryDirectory(prefix="hexload-check-cpp-") as name:
        (Path(name) / "compile_commands.json").write_text(json.dumps(commands))
        with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
            outputs = list(pool.map(lambda entry: _check(entry["file"], name), commands))
    found = {line for output in outputs for line in FINDING.findall(output)}
    return sorted(line.removeprefix(f"{project.ROOT}/") for line in found)


def program() -> str:
    path = shutil.which(f"clang-tidy-{VERSION}") or shutil.which("clang-tidy")
    if path is None:
        raise ToolFailed(f"clang-tidy: found none, expected clang-tidy-{VERSION}: tools/hexload check-cpp installs it")
    return path


def _check(source: str, folder: str) -> str:
    flags = ["-p", folder, "--quiet", f"--config-file={CHECKS}", "--extra-arg=-Wno-ignored-optimization-argument"]
    result = subprocess.run([program(), *flags, source], cwd=project.ROOT, capture_output=True, text=True)
    if result.returncode != 0 and not FINDING.search(result.stdout):
        raise ToolFailed(f"{source}: clang-tidy failed: {result.stderr.strip()}")
    return result.stdout
