"""`hexload fuzz`: clang's fuzzer on what reads from outside, and on every estimator's tick; and damaged logs for the reader.

Inputs that lead somewhere new are kept in build/fuzz, so that the next run begins where this one has ended.
"""

import gzip
import random
import re
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.errors import InputError
from hexload.io.log_file import read_log
from hexload_dev import build

PRESET = "fuzz"
KEPT = project.BUILD / "fuzz"
PLATFORMS = project.SCENARIOS / "platforms"
DATA = project.ROOT / "tests" / "data"
LONGEST = {"platform_file": 4096}  # bytes of an input; others: DEFAULT_LONGEST
DEFAULT_LONGEST = 512
SLOWEST_S = 10  # of one input
LOG_ROWS = 40  # of a good log, which the damaged ones are made of


@dataclass(frozen=True)
class Result:
    runs: int
    seconds: float
    finding: str  # empty: none


def run_fuzz(target: list[str] | None, runs: int, seed: int) -> int:
    """Returns the exit status: 0 when no target has found anything."""
    sources = sorted((project.ROOT / "tests" / "fuzz").glob("fuzz_*.c*"))
    known: dict[str, Callable[[int, int], Result]] = {
        name: lambda runs, seed, name=name: _run_target(name, runs, seed)
        for name in (source.stem.removeprefix("fuzz_") for source in sources)
    }
    known["log_file"] = _damage_logs
    chosen = target or list(known)
    for name in chosen:
        if name not in known:
            raise InputError(f"--target: found '{name}', expected one of: {', '.join(known)}")
    build.build(PRESET, *(f"fuzz_{name}" for name in chosen if name != "log_file"))
    table = Table(title="Inputs without a finding", title_justify="left")
    for heading in ("target", "inputs", "s", "finding"):
        table.add_column(heading, justify="right" if heading in ("inputs", "s") else "left")
    results = {name: known[name](runs, seed) for name in chosen}
    for name, result in results.items():
        table.add_row(name, f"{result.runs:,}", f"{result.seconds:.1f}", result.finding or "none")
    Console().print(table)
    return 1 if any(result.finding for result in results.values()) else 0


def _run_target(name: str, runs: int, seed: int) -> Result:
    corpus, findings = KEPT / name, KEPT / "findings"
    for folder in (corpus, findings):
        folder.mkdir(parents=True, exist_ok=True)
    program = project.preset_directory(PRESET) / "tests" / "fuzz" / f"fuzz_{name}"
    options = {
        "runs": runs,
        "seed": seed + 1,  # of libFuzzer, for which 0 is none
        "max_len": LONGEST.get(name, DEFAULT_LONGEST),
        "timeout": SLOWEST_S,
        "artifact_prefix": f"{findings}/{name}-",
        "print_final_stats": 1,
    }
    seeds = [PLATFORMS] if name == "platform_file" else []
    command = [program, *(f"-{key}={value}" for key, value in options.items()), corpus, *seeds]
    begin = time.monotonic()
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    seconds = time.monotonic() - begin
    (KEPT / f"{name}.log").write_text(result.stdout)
    done = re.search(r"number_of_executed_units: (\d+)", result.stdout)
    finding = "" if result.returncode == 0 else _finding(result.stdout)
    return Result(int(done[1]) if done else 0, seconds, finding)


def _finding(output: str) -> str:
    words = re.search(r"(broken: .*|runtime error: .*|ERROR: .*)", output)
    file = re.search(r"Test unit written to (\S+)", output)
    return f"{words[1] if words else output[-200:]}; input in {file[1] if file else '?'}"


def _damage_logs(runs: int, seed: int) -> Result:
    """A good log with bytes changed, lines doubled, cut or left out: read, or refused with words."""
    source = random.Random(seed)
    good = "\n".join(_good_log().splitlines()[: LOG_ROWS + 1]).encode() + b"\n"
    begin = time.monotonic()
    count = max(1, runs // 100)  # slower by as much as the others
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            path = Path(folder) / "log.csv"
            path.write_bytes(_damaged(good, source))
            try:
                read_log(path)
            except InputError:
                pass
            except Exception as error:  # what no reader may let through
                kept = KEPT / "findings" / "log_file.csv"
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(path.read_bytes())
                return Result(number, time.monotonic() - begin, f"{error!r}; input in {kept}")
    return Result(count, time.monotonic() - begin, "")


def _good_log() -> str:
    with gzip.open(DATA / "paper_noisy.csv.gz", "rt") as stream:
        return "".join(stream.readline() for _ in range(LOG_ROWS + 1))


def _damaged(good: bytes, source: random.Random) -> bytes:
    lines = good.split(b"\n")
    for _ in range(source.randint(1, 4)):
        at = source.randrange(len(lines))
        kind = source.randrange(6)
        line = bytearray(lines[at])
        if kind == 0 and line:
            line[source.randrange(len(line))] = source.randrange(256)
        elif kind == 1:
            line = line[: source.randint(0, len(line))]
        elif kind == 2:
            line += source.choice([b",", b",1e999", b"nan", b'"', b"\r", b"\x00", b"-", b"9" * 400])
        elif kind == 3:
            line = bytearray(lines[source.randrange(len(lines))])
        elif kind == 4:
            cells = line.split(b",")
            words = [b"", b"nan", b"inf", b"-1e38", b"1e-46", b"x", b" 1", b"0x1p3", b"1_0", b"4294967296"]
            cells[source.randrange(len(cells))] = bytearray(source.choice(words))
            line = bytearray(b",".join(cells))
        else:
            line += bytes(source.randrange(256) for _ in range(source.randint(0, 8)))
        lines[at] = bytes(line)
    return b"\n".join(lines)
