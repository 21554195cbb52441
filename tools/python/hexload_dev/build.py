"""Configures and builds a CMake preset: silent when nothing is to do, one line and a log file otherwise.

`python -m hexload_dev.build TARGET...` builds targets (none: all) of the default preset; only the standard library is used.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TextIO

from hexload import project
from hexload.errors import ToolFailed

LOGS = project.BUILD / "setup"
UNITY = project.BUILD / "deps" / "unity"


def ensure_built(*targets: str) -> None:
    """Builds `targets` of the default preset, unless ctest has chosen a build."""
    if project.chosen_build() is None:
        build(project.DEFAULT_PRESET, *targets)


def build(preset: str, *targets: str) -> None:
    """Builds `targets` (none: all) of `preset`. Raises ToolFailed with the tail of the compiler's output."""
    directory = project.preset_directory(preset)
    _configure(preset, directory)
    if _nothing_to_do(directory, targets):
        return
    command = ["cmake", "--build", str(directory)]
    command += ["--target", *targets] if targets else []
    _stage(f"building {preset}", command, LOGS / f"build-{preset}.log")


def _configure(preset: str, directory: Path) -> None:
    generated = directory / "build.ninja"
    presets = project.ROOT / "CMakePresets.json"
    interpreter = Path(sys.prefix) / "pyvenv.cfg"  # newer than the build when the environment has been remade
    is_new = generated.exists() and generated.stat().st_mtime > max(
        presets.stat().st_mtime, interpreter.stat().st_mtime
    )
    if is_new and not _lacks_jdk(directory) and not _lacks_tests(preset, directory):
        return
    definitions = [f"-DPython_EXECUTABLE={sys.executable}", f"-DUNITY_ROOT={UNITY}"]
    if preset == project.DEFAULT_PRESET:  # before `hexload test` nothing is set up for tests
        definitions.append(f"-DHEXLOAD_TESTS={'ON' if UNITY.is_dir() else 'OFF'}")
    command = ["cmake", "--preset", preset, *definitions]
    _stage(f"configuring {preset}", command, LOGS / f"configure-{preset}.log")
    generated.touch()


def _lacks_jdk(directory: Path) -> bool:
    """The build was configured before there was a JDK, without lcm-spy's types."""
    cache = (directory / "CMakeCache.txt").read_text()
    return "Java_JAVAC_EXECUTABLE-NOTFOUND" in cache and shutil.which("javac") is not None


def _lacks_tests(preset: str, directory: Path) -> bool:
    """The build was configured for other verbs than `hexload test`, and now there is what the tests need."""
    cache = (directory / "CMakeCache.txt").read_text()
    return preset == project.DEFAULT_PRESET and UNITY.is_dir() and "HEXLOAD_TESTS:BOOL=OFF" in cache


def _nothing_to_do(directory: Path, targets: tuple[str, ...]) -> bool:
    dry_run = subprocess.run(["ninja", "-C", directory, "-n", *targets], capture_output=True, text=True)
    return dry_run.returncode == 0 and "no work to do" in dry_run.stdout


def _stage(title: str, command: list[str], log: Path) -> None:
    """One line; on a terminal with ninja's count of steps, [37/120]."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w") as output:
        if sys.stderr.isatty():
            status = _counted(title, command, output)
        else:
            print(f"[hexload] {title} ...", file=sys.stderr, flush=True)
            status = subprocess.run(command, cwd=project.ROOT, stdout=output, stderr=subprocess.STDOUT).returncode
    if status != 0:
        tail = "\n".join(log.read_text(errors="replace").splitlines()[-40:])
        raise ToolFailed(f"{title} failed\n{tail}\n  whole output:  {log}\n  repeat with:   {' '.join(command)}")


def _counted(title: str, command: list[str], output: TextIO) -> int:
    print(f"[hexload] {title} ...", end="", file=sys.stderr, flush=True)
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "errors": "replace"}
    with subprocess.Popen(command, cwd=project.ROOT, **options) as process:
        for line in process.stdout:
            output.write(line)
            if step := re.match(r"\[\d+/\d+\]", line):
                print(f"\r[hexload] {title} ... {step[0]}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr, flush=True)
    return process.returncode


if __name__ == "__main__":
    try:
        build(project.DEFAULT_PRESET, *sys.argv[1:])
    except ToolFailed as error:
        sys.exit(error.exit_code)
