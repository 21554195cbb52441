"""`hexload faults`: checks what is asked, runs the cases that are not done yet, writes tables and page."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.table import Table

from hexload import project
from hexload.campaign import terminal
from hexload.campaign.progress import complete
from hexload.campaign.store import PART, Store, delete, own_files, plain
from hexload.errors import InputError
from hexload.faults import fault_report
from hexload.faults.kinds import ESTIMATORS, GROUPS, KINDS, NONE
from hexload.faults.one_fault import MOTIONS, FaultCase, is_possible, run_fault
from hexload.faults.tally import tally
from hexload.faults.worst_runs import worst_runs
from hexload.io.atomic_file import replaced_when_done

DEFAULT_OUT = project.RUNS / "faults"
TABLE_WIDTH = 190  # where there is no terminal to ask
DURATION_S = 16.0
RUNS = 3
LOGS = "logs"
LOG = re.compile(r".+-[0-9a-f]{16}\.(npz|rig\.toml)")  # ends with project.code_version()


@dataclass(frozen=True)
class FaultSettings:
    kinds: tuple[str, ...]
    motions: tuple[str, ...]
    estimators: tuple[str, ...]
    runs: int  # seeds of each kind, size, motion and estimator
    seed: int
    duration_s: float
    one_size: bool  # the middle one of each kind
    is_commissioned: bool  # each machine, with its fault
    names_causes: bool  # each log is diagnosed
    has_own_machine: bool  # each seed, drawn; else the paper's
    has_velocity: bool  # sensors

    def cases(self) -> list[FaultCase]:
        """Those that share a clean run, one after the other."""
        machine = (self.duration_s, self.is_commissioned, self.names_causes, self.has_own_machine, self.has_velocity)
        cases = [
            FaultCase(name, size, motion, estimator, seed, *machine)
            for seed in range(self.seed, self.seed + self.runs)
            for motion in self.motions
            for estimator in self.estimators
            for name in self.kinds
            for size in self._sizes(name)
        ]
        return [case for case in cases if is_possible(case)]

    @property
    def words_command(self) -> str:
        """Makes the page of words again."""
        options = f"--motion {','.join(self.motions)} --estimator {','.join(self.estimators)} --seed-base {self.seed}"
        quick, own = "--quick " if self.one_size else "", "--own-machine " if self.has_own_machine else ""
        own += "" if self.has_velocity else "--no-velocity "
        return f"tools/hexload faults {quick}{own}--name-causes {options} --runs {self.runs}"

    def _sizes(self, name: str) -> tuple[float, ...]:
        sizes = KINDS[name].sizes
        return (sizes[(len(sizes) - 1) // 2],) if self.one_size else sizes


def settings_of(
    kinds: str | None,
    motions: str | None,
    estimators: str | None,
    runs: int | None,
    seed: int,
    quick: bool,
    is_commissioned: bool = False,
    names_causes: bool = False,
    has_own_machine: bool = False,
    has_velocity: bool = True,
) -> FaultSettings:
    """Of the options as they are given. Raises InputError."""
    if is_commissioned and names_causes:
        raise InputError("--name-causes: found it with --rig, expected one of the two: a rig file explains the faults")
    return FaultSettings(
        kinds=_parse_kinds(kinds),
        motions=_parse("--motion", motions, MOTIONS, MOTIONS),
        estimators=_parse("--estimator", estimators, ESTIMATORS, ESTIMATORS[:1] if quick else ESTIMATORS),
        runs=runs or (1 if quick else RUNS),
        seed=seed,
        duration_s=DURATION_S,
        one_size=quick,
        is_commissioned=is_commissioned,
        names_causes=names_causes,
        has_own_machine=has_own_machine,
        has_velocity=has_velocity,
    )


def _parse_kinds(text: str | None) -> tuple[str, ...]:
    """Names of kinds or of their groups; the clean run is always among them."""
    if text is None:
        return tuple(KINDS)
    names = []
    is_whole = ";" in text or any(text.strip() == kind.group for kind in KINDS.values())
    for word in (word.strip() for word in text.split(";" if is_whole else ",")):
        found = [name for name, kind in KINDS.items() if word in (name, kind.group)]
        if not found:
            raise InputError(f"--kind: found '{word}', expected some of those that hexload faults --list prints")
        names += found
    return tuple(dict.fromkeys((NONE, *names)))


def _parse(option: str, text: str | None, known: tuple[str, ...], default: tuple[str, ...]) -> tuple[str, ...]:
    names = default if text is None else tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in known:
            raise InputError(f"{option}: found '{name}', expected some of: {', '.join(known)}")
    return names


def print_list() -> None:
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("fault", "what is wrong", "sizes", "what should be read"):
        table.add_column(heading)
    for group in GROUPS:
        table.add_section()
        table.add_row(f"[bold]{group}[/bold]")
        for kind in (kind for kind in KINDS.values() if kind.group == group and kind.is_fault):
            sizes = "; ".join(kind.size_in_words(size) for size in kind.sizes)
            table.add_row(f"  {kind.name}", kind.says, sizes, kind.words)
    terminal.console(TABLE_WIDTH).print(table)


def _is_log(path: Path) -> bool:
    """Whether a case has written it."""
    return LOG.fullmatch(path.name) is not None or PART.fullmatch(path.name) is not None


def run_faults(settings: FaultSettings, out: Path, restart: bool) -> Path:
    """Returns the page. Prints the tables; progress and remarks go to stderr."""
    project.ensure_built("hexload_sim_app", "hexload_native")
    code = project.code_version()
    store = Store(out)
    logs = out / LOGS
    old_logs = own_files(logs, _is_log) if restart else []
    remarks = store.open(settings, code, restart)
    delete(old_logs)
    logs.mkdir(exist_ok=True)
    cases = settings.cases()
    done = complete(cases, run_fault, code, store, remarks, None, logs.resolve())
    return _conclude(settings, code, {case: done[case] for case in cases}, out)


def _conclude(settings: FaultSettings, code: str, results: Mapping[FaultCase, dict], out: Path) -> Path:
    tallies = tally(results, settings.estimators)
    files = {
        "summary.json": json.dumps(plain(tallies), indent=1) + "\n",
        "table.md": fault_report.markdown(tallies),
        **({"words.md": fault_report.words_page(settings.words_command, results)} if settings.names_causes else {}),
        "cases.csv": fault_report.as_csv(results),
        "report.html": fault_report.render(settings, code, tallies, results, worst_runs(results, out / LOGS)),
    }
    for name, text in files.items():
        with replaced_when_done(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    console = terminal.console(TABLE_WIDTH)
    for entry in tallies:
        console.print(*terminal.in_parts(fault_report.terminal_table(entry), console.width))
    return out / "report.html"
