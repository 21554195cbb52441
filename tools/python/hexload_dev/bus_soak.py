"""`hexload soak --faults`: hours in which everything goes wrong now and then, between the plant's sensors and the estimates that a
simulator takes: faults of sensors that come and go, loads that change, and a bus between the simulator's link and the
controller's node that loses, doubles, forges ... frames (host_sim/apps/hexload_bus_soak). Judged every second by the rules of
`hexload faults`."""

import hashlib
import json
import subprocess
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hexload import project
from hexload.campaign import cases, one_case
from hexload.campaign.progress import complete
from hexload.campaign.statistics import ALARM_DUE_S
from hexload.campaign.store import Store, plain
from hexload.errors import ToolFailed
from hexload.faults import recording, score, slices
from hexload.faults.kinds import KINDS
from hexload.faults.recording import TICK_S, Recording
from hexload.faults.score import Reported, Truth
from hexload.io.log_file import read_log
from hexload.io.toml_document import to_toml
from hexload_dev import build

PROGRAM = "hexload_bus_soak"
DEFAULT_OUT = project.RUNS / "soak"
ESTIMATOR = "momentum"
MOTIONS = ("multisine", "work", "multisine_pick_up")
LINKS = tuple(
    (profile, codes) for profile in ("fd", "classic") for codes in (False, True)
)  # each has the whole of a case
RUN_S = 60.0
LOOK_S = 1.0  # from look to look
PAUSE_S, FAULT_S = (
    (1.0, 30.0),
    (0.05, 8.0),
)  # between faults of sensors, and their length; evenly on a logarithmic scale
CHANGES = ("none", "none", "falling", "two_changes")  # of the load; "none" as often as the two together
PARAMETERS = 10
ANSWER_TICKS = {"fd": 1, "classic": 52}  # from whole answer to whole answer
NO_ANSWER = "no answer"  # for half of the last 3 s or more
OUTCOMES = ("right", "said", "weak", "silent", "false_alarm", NO_ANSWER)
WORST = "silent"
# What else there was besides faults of the bus: at a look, in the 3 s before it, at any time before.
BUS_ALONE, BEFORE, NOW = "faults of the bus alone", "after a fault of sensors", "in a fault of sensors"


@dataclass(frozen=True)
class SoakSettings:
    hours: float
    seed: int
    run_s: float = RUN_S

    def cases(self) -> list["SoakCase"]:
        count = max(1, round(3600.0 * self.hours / (len(LINKS) * self.run_s)))
        return [SoakCase(seed, self.run_s) for seed in range(self.seed, self.seed + count)]


@dataclass(frozen=True)
class SoakCase:
    seed: int
    run_s: float

    @property
    def name(self) -> str:
        return f"{self.seed}-{self.run_s:g}"


@dataclass(frozen=True)
class PassingFault:
    name: str
    begin_s: float
    end_s: float


def run_soak(settings: SoakSettings, out: Path, restart: bool) -> dict:
    """Goes on with the folder `out`, prints a table and a verdict; returns the figures."""
    build.ensure_built(PROGRAM, "hexload_sim_app", "hexload_native")
    store, code = Store(out), code_version()
    remarks = store.open(settings, code, restart)
    results = list(complete(settings.cases(), run_case, code, store, remarks, None, None).values())
    figures = summary(results)
    _print(figures)
    return figures


def code_version() -> str:
    digest = hashlib.sha256(project.code_version().encode())
    for path in (_program(), Path(__file__), Path(slices.__file__)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _program() -> Path:
    return project.build_directory() / "host_sim" / PROGRAM


def run_case(case: SoakCase, _folder: Path | None) -> dict:
    random = np.random.default_rng([0x50AC, case.seed])
    clean = _with_changes(_simulated(case, random), random)
    faulty, passing = with_passing_faults(clean, random)
    runs = [_run(case, faulty, passing, *link) for link in LINKS]
    return {"code": code_version(), "case": asdict(case), "sensor_faults": plain(passing), "runs": runs}


def _simulated(case: SoakCase, random: np.random.Generator) -> Recording:
    setup = cases.draw(cases.Case(str(random.choice(MOTIONS)), case.seed, case.run_s))
    with tempfile.TemporaryDirectory(prefix="hexload-soak-") as name:
        run = one_case.simulate_setup(setup, case.name, Path(name))
        loads = json.loads((run / "meta.json").read_text())["loads"]
        path = Path(name) / "recording.npz"
        recording.write_recording(path, run, loads, read_log(run / "log.csv"))
        base = recording.read_recording(path, setup.platform)
    return replace(base, platform={key: table for key, table in base.platform.items() if key != "tolerances"})


def _with_changes(base: Recording, random: np.random.Generator) -> Recording:
    kind = KINDS[str(random.choice(CHANGES))]
    return base if base.theta[0] < 1.0 else kind.apply(base, float(random.choice(kind.sizes)), random)


def with_passing_faults(clean: Recording, random: np.random.Generator) -> tuple[Recording, list[PassingFault]]:
    """One after the other, from all kinds that can come and go."""
    faulty, passing = clean, []
    names = [name for name, kind in KINDS.items() if kind.is_fault and ESTIMATOR in kind.estimators]
    end_s = float(clean.t_s[-1])
    begin_s = _drawn_s(random, PAUSE_S)
    while (last_s := begin_s + _drawn_s(random, FAULT_S)) < end_s:
        kind = KINDS[str(random.choice(names))]
        rows = slice(round(begin_s / TICK_S), round(last_s / TICK_S))
        has_change = any(begin_s <= from_s + ALARM_DUE_S and to_s <= last_s for from_s, to_s in clean.changes_s)
        size = float(random.choice(kind.sizes))
        new = None if has_change else slices.with_passing_fault(faulty, kind, size, rows, random)
        if new is not None:
            faulty = new
            passing.append(PassingFault(kind.name, begin_s, last_s))
            begin_s = last_s + _drawn_s(random, PAUSE_S)
        else:
            begin_s += 1.0
    return faulty, passing


def _drawn_s(random: np.random.Generator, limits_s: tuple[float, float]) -> float:
    return float(np.exp(random.uniform(*np.log(limits_s))))


def _run(case: SoakCase, faulty: Recording, passing: Sequence[PassingFault], profile: str, codes: bool) -> dict:
    """All looks of a run over one kind of bus."""
    with tempfile.TemporaryDirectory(prefix="hexload-soak-") as name:
        samples, rows, platform = (Path(name) / part for part in ("samples", "rows", "platform.toml"))
        np.hstack(recording.channels_of(faulty.log)).astype(np.float32).astype(np.float64).tofile(samples)
        platform.write_text(to_toml(faulty.platform))
        seed = 4 * case.seed + LINKS.index((profile, codes))
        command = [_program(), platform, samples, rows, profile, str(seed), str(int(codes))]
        finished = subprocess.run(command, capture_output=True, text=True)
        if finished.returncode != 0:
            raise ToolFailed(f"case {case.name}: {finished.stderr.strip()}")
        report = json.loads(finished.stdout)
        answers = np.fromfile(rows).reshape(-1, 3 + 3 * PARAMETERS)
    looks = _looks(answers, report, faulty, passing, profile)
    tally = {
        label: dict(Counter(outcome for _, seen, outcome, _ in looks if seen == label))
        for label in (BUS_ALONE, BEFORE, NOW)
    }
    worst = [
        {"t_s": t_s, "label": label, "last": last_fault(passing, t_s), "wrong": plain(wrong)}
        for t_s, label, outcome, wrong in looks
        if outcome == WORST
    ]
    counts = {name: report[name] for name in ("starts", "rejoins", "faults", "ends")}
    return {"profile": profile, "codes": codes, "looks": tally, "worst": worst, **counts}


def _looks(answers, report: dict, faulty: Recording, passing: Sequence[PassingFault], profile: str) -> list[tuple]:
    """(time, label, outcome, wrong parameters) of each second from the third on, but where a change of the load is so young
    that it need not be known yet."""
    t_s = answers[:, 0] * TICK_S
    looks = []
    for end_s in np.arange(score.LAST_S, float(faulty.t_s[-1]), LOOK_S):
        if any(from_s - TICK_S <= end_s <= to_s + ALARM_DUE_S for from_s, to_s in faulty.changes_s):
            continue
        window = answers[(t_s > end_s - score.LAST_S) & (t_s <= end_s)]
        due = score.LAST_S / (TICK_S * ANSWER_TICKS[profile])
        if len(window) < 0.5 * due:
            looks.append((float(end_s), label_of(passing, end_s), NO_ANSWER, ()))
            continue
        found = score.score(_reported(window, report), _truth(faulty, end_s))
        looks.append((float(end_s), label_of(passing, end_s), found.outcome, found.wrong))
    return looks


def _reported(window, report: dict) -> Reported:
    """A lost answer is nothing that a user is told: as if none had been due."""
    health, t_s = window[:, 2].astype(np.int64), window[:, 0] * TICK_S
    verdicts = np.array(report["verdicts"])
    last = window[-1, 3:].reshape(3, PARAMETERS)
    return Reported(
        names=tuple(report["parameters"]),
        value=last[1],
        sigma=last[2],
        parameter_verdict=tuple(verdicts[last[0].astype(int)]),
        t_s=t_s,
        verdict=verdicts[window[:, 1].astype(int)].tolist(),
        bits={name: (health >> bit & 1).astype(bool) for bit, name in enumerate(report["bits"])},
        sample_t_s=t_s,
    )


def _truth(faulty: Recording, t_s: float) -> Truth:
    theta = slices.load_at(faulty, t_s)
    return Truth(theta, score.load_scale(theta, faulty.own_theta), faulty.changes_s)


def label_of(passing: Sequence[PassingFault], t_s: float) -> str:
    if any(fault.begin_s <= t_s and t_s - score.LAST_S <= fault.end_s for fault in passing):
        return NOW
    return BEFORE if any(fault.end_s <= t_s for fault in passing) else BUS_ALONE


def last_fault(passing: Sequence[PassingFault], t_s: float) -> str | None:
    begun = [fault.name for fault in passing if fault.begin_s <= t_s]
    return begun[-1] if begun else None


def summary(results: Sequence[Mapping]) -> dict:
    """Of all cases together."""
    runs = [run for result in results for run in result["runs"]]
    looks = {label: Counter() for label in (BUS_ALONE, BEFORE, NOW)}
    faults, ends = Counter(), Counter()
    for run in runs:
        faults.update(run["faults"])
        ends.update(run["ends"])
        for label, counts in run["looks"].items():
            looks[label].update(counts)
    hours = sum(result["case"]["run_s"] for result in results) * len(LINKS) / 3600.0
    worst = [
        {"seed": result["case"]["seed"], "profile": run["profile"], "codes": run["codes"], **look}
        for result in results
        for run in result["runs"]
        for look in run["worst"]
    ]
    return {
        "found": looks[BUS_ALONE][WORST],
        "hours": hours,
        "looks": {label: {outcome: counts[outcome] for outcome in OUTCOMES} for label, counts in looks.items()},
        "worst": worst,
        "bus_faults": dict(faults),
        "sensor_faults": sum(len(result["sensor_faults"]) for result in results) * len(LINKS),
        "simulators_ended": dict(ends),
        "rejoins": sum(run["rejoins"] for run in runs),
    }


def _print(figures: dict) -> None:
    table = Table("looks, one a second", *OUTCOMES)
    for label, counts in figures["looks"].items():
        table.add_row(label, *(str(counts[outcome]) for outcome in OUTCOMES))
    console = Console()
    console.print(table)
    print(
        f"{figures['hours']:.2f} simulated h; {figures['sensor_faults']} faults of sensors; {figures['rejoins']} rejoins"
    )
    for title, counts in (
        ("faults of the bus", figures["bus_faults"]),
        ("simulators ended", figures["simulators_ended"]),
    ):
        print(f"{title}: {'; '.join(f'{count} {words}' for words, count in sorted(counts.items())) or 'none'}")
    by_last = Counter(f"{look['label']}: {look['last'] or 'none'}" for look in figures["worst"])
    for words, count in by_last.most_common():
        print(f"wrong with a good verdict, {words}: {count}")
    words = f"{len(figures['worst'])} looks found a wrong estimate with a good verdict"
    print(f"verdict: {words}, {figures['found']} of them with {BUS_ALONE}")
