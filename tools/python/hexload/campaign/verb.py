"""`hexload campaign`: checks what is asked, runs the cases that are not done yet, writes page and summary."""

import json
import subprocess
from pathlib import Path

from hexload import project
from hexload.campaign import campaign_report, terminal
from hexload.campaign.cases import CLASSES, DEFAULT_CLASSES, Case
from hexload.campaign.one_case import FAILURE, run_case
from hexload.campaign.progress import complete
from hexload.campaign.schedule import Cluster
from hexload.campaign.statistics import failed_cases, summarise
from hexload.campaign.store import Settings, Store, plain
from hexload.errors import InputError
from hexload.io.atomic_file import replaced_when_done

DEFAULT_OUT = project.RUNS / "campaign"
TABLE_WIDTH = 150  # where there is no terminal to ask
TICK_S = (0.25e-3, 5e-3)
DURATION_S = (1.0, 3600.0)  # the baselines leave out a tenth of a second at both ends, the load may change at 40 %


def parse_classes(text: str | None) -> tuple[str, ...]:
    """Names with commas between them, or all."""
    if text is None:
        return DEFAULT_CLASSES
    names = tuple(CLASSES) if text == "all" else tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in CLASSES:
            raise InputError(f"--classes: found '{name}', expected all, or some of: {', '.join(CLASSES)}")
    return tuple(dict.fromkeys(names))


def choose_seeds(base: int | None) -> int:
    """The seed of the first case: the one that is asked for, or the date of the last commit in s. Raises InputError."""
    if base is not None:
        return base
    command = ["git", "-C", str(project.ROOT), "log", "-1", "--format=%ct"]
    try:
        date = subprocess.run(command, capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL).stdout
        base = int(date)
    except (OSError, subprocess.CalledProcessError, ValueError):
        raise InputError("--seed-base: found no commit whose date gives fresh seeds, expected a number") from None
    print(f"seeds: from {base} on, the date of the last commit; --seed-base {base} repeats them")
    return base


def run_campaign(settings: Settings, out: Path, cluster: Cluster | None, keep: bool, restart: bool) -> Path:
    """Returns the page. Prints the summary; progress and remarks go to stderr."""
    if not DURATION_S[0] <= settings.duration_s <= DURATION_S[1]:
        low, high = DURATION_S
        raise InputError(f"--duration: found {settings.duration_s:g} s, expected {low:g} to {high:g} s")
    if not TICK_S[0] <= settings.tick_s <= TICK_S[1]:
        low, high = TICK_S
        raise InputError(f"--tick: found {settings.tick_s:g} s, expected {low:g} to {high:g} s")
    project.ensure_built("hexload_sim_app", "hexload_native")
    code = project.code_version()
    store = Store(out)
    remarks = store.open(settings, code, restart)
    done = complete(settings.cases(), run_case, code, store, remarks, cluster, _kept(out) if keep else None)
    return _conclude(settings, done, out)


def _kept(out: Path) -> Path:
    folder = out / "runs"
    folder.mkdir(exist_ok=True)
    return folder.resolve()


def _conclude(settings: Settings, done: dict[Case, dict], out: Path) -> Path:
    by_class = {name: [done[case] for case in settings.cases() if case.class_name == name] for name in settings.classes}
    failed = {name: failed_cases(results) for name, results in by_class.items()}
    judged = {name: results for name, results in by_class.items() if len(results) > len(failed[name])}
    statistics = [summarise(name, results) for name, results in judged.items()]
    summary = [plain(entry) for entry in statistics]
    summary += [{"name": name, "runs": 0, "failed": plain(failed[name])} for name in by_class if name not in judged]
    with replaced_when_done(out / "summary.json") as temporary:
        temporary.write_text(json.dumps(summary, indent=1) + "\n")
    page = out / "report.html"
    with_numbers = {name: [result for result in results if FAILURE not in result] for name, results in judged.items()}
    with replaced_when_done(page) as temporary:
        text = campaign_report.render(settings, statistics, with_numbers, failed)
        temporary.write_text(text, encoding="utf-8")
    console = terminal.console(TABLE_WIDTH)
    console.print(*terminal.in_parts(campaign_report.terminal_table(statistics, failed), console.width))
    if (rigs := campaign_report.rig_table(statistics)) is not None:
        console.print(*terminal.in_parts(rigs, console.width))
    for case in (case for cases in failed.values() for case in cases):
        console.print(f"failed: {case.name}: {case.reason}", markup=False, highlight=False)
    return page
