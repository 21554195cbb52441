"""The campaign's page, self-contained HTML, and its table on the terminal."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

from hexload import project
from hexload.campaign import campaign_figures
from hexload.campaign.cases import CLASSES, TARED
from hexload.campaign.statistics import ALARM_DUE_S, FAILURE_NEES, Alarms, ClassStatistics, FailedCase, Times
from hexload.campaign.store import Settings
from hexload.campaign.worst_runs import worst_run
from hexload.diagnosis.finding import plain
from hexload.estimation.load_summary import EFFECT_UNITS, EFFECT_WORDS
from hexload.report.charts import to_html
from hexload.report.page import templates
from hexload.theory.bound import THETA_NAMES

Array = NDArray[np.float64]

TEMPLATE = "campaign_report.html.jinja"
UNITS = ("kg", "kg m", "kg m", "kg m", *(6 * ["kg m²"]))
METHODS = {
    "momentum": "momentum filter",
    "momentum_effects": "momentum filter with bias and friction",
    TARED: "momentum filter with tare",
    "paper": "paper's filter, mass given",
    "ls_raw": "least squares, raw differences",
    "ls_zero_phase": "least squares, zero-phase filter",
    "rls": "recursive least squares",
    "tls": "total least squares",
    "iv": "instrumental variables",
}
DASH = "–"


def render(
    settings: Settings,
    statistics: Sequence[ClassStatistics],
    by_class: dict[str, list[dict]],
    failed: dict[str, tuple[FailedCase, ...]],
) -> str:
    """`by_class`: results with numbers, of the classes in `statistics`. `failed`: the other cases of every class. Raises
    ToolFailed, InputError."""
    drawn = {}
    if statistics:
        drawn = {
            "ratios": campaign_figures.ratios(statistics),
            "rivals": campaign_figures.rivals(statistics, METHODS),
            "nees": campaign_figures.nees(by_class),
            "settling": campaign_figures.settling(by_class),
        }
    environment = templates("hexload.campaign")
    environment.filters |= {"fixed": fixed, "percent": percent, "time": time}
    environment.filters |= {"alarms": alarm_text, "three": three_digits, "largest": largest}
    return environment.get_template(TEMPLATE).render(
        settings=settings,
        code=project.code_version(),
        classes=CLASSES,
        methods=METHODS,
        names=THETA_NAMES,
        units=UNITS,
        effects={name: f"{words}, {EFFECT_UNITS[name]}" for name, words in EFFECT_WORDS.items()},
        has_tare=any(entry.controller == TARED for entry in statistics),
        has_rigs=any(entry.rig is not None for entry in statistics),
        has_effects=any(entry.effects is not None for entry in statistics),
        statistics=statistics,
        failed=[case for cases in failed.values() for case in cases],
        worst={name: worst_run(results) for name, results in by_class.items()},
        failure_nees=FAILURE_NEES,
        alarm_due_s=ALARM_DUE_S,
        figures={name: to_html(chart, f"{name}-figure") for name, chart in drawn.items()},
    )


HEADINGS = (
    "class", "runs", "/ bound", "worst", "NEES", "in 95 %", "NIS", "failed", "5 %", "p95", "1 %", "max %", "detected",
    "latest ms", "false", "doubted",
)  # fmt: skip


def terminal_table(statistics: Sequence[ClassStatistics], failed: dict[str, tuple[FailedCase, ...]]) -> Table:
    title = (
        "controller's filter: RMSE / bound, mean of ten and worst; NEES (ideal 10), NIS (6); "
        "s to 5 %, to 1 % of scale; largest error in %; alarms; runs called inconsistent or implausible"
    )
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading == "class" else "right", no_wrap=True)
    for entry in statistics:
        table.add_row(*_cells(entry))
    judged = {entry.name for entry in statistics}
    for name, cases in failed.items():
        if name not in judged:
            of_failed = {"class": name, "runs": "0", "failed": str(len(cases))}
            table.add_row(*(of_failed.get(heading, DASH) for heading in HEADINGS))
    return table


def _cells(entry: ClassStatistics) -> tuple[str, ...]:
    """In the order of HEADINGS."""
    one, alarms = entry.own, entry.alarms
    within_5, within_1 = one.times.get("within_5"), one.times.get("within_1")
    return (
        entry.name,
        str(entry.runs),
        fixed(one.ratio_mean, 2),
        f"{one.ratio_worst:.2f} {one.worst_name}",
        fixed(one.nees_mean, 1),
        percent(one.nees_in_band),
        fixed(one.nis_mean, 2),
        str((one.failures or 0) + len(entry.failed)),
        time(within_5, "median"),
        time(within_5, "p95"),
        time(within_1, "median"),
        largest(one.largest_percent),
        f"{len(alarms.delays_s)}/{alarms.changes}",
        fixed(1e3 * alarms.delays_s.max(), 0) if len(alarms.delays_s) else DASH,
        str(alarms.false),
        str(entry.doubted),
    )


def rig_table(statistics: Sequence[ClassStatistics]) -> Table | None:
    """None: no class is one of rigs."""
    rigs = [entry for entry in statistics if entry.rig is not None]
    if not rigs:
        return None
    title = "commissioned rigs: errors, median and p95; parameters within 3 published sigmas, the worst; alarms"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    headings = ("class", "runs", "mass %", "centre mm", "inertia %", "in 3 sigmas", "worst", "failed", "alarms")
    for heading in headings:
        table.add_column(heading, justify="left" if heading in ("class", "alarms") else "right", no_wrap=True)
    for entry in rigs:
        rig = entry.rig
        errors = (rig.mass_percent, rig.centre_mm, rig.inertia_percent)
        table.add_row(
            entry.name,
            str(entry.runs),
            *(f"{fixed(median, 2)}, {fixed(p95, 2)}" for median, p95 in errors),
            f"{100.0 * rig.within_3_sigmas:.1f} %",
            fixed(rig.largest_sigmas, 1),
            str(len(entry.failed)),
            alarm_text(entry.alarms),
        )
    return table


def fixed(value: float | None, digits: int) -> str:
    """A number with a fixed count of decimals, from 100 on with none, in powers of ten where it would be long; a dash where
    there is none."""
    if value is None or not np.isfinite(value):
        return DASH
    digits = digits if abs(value) < 100.0 else 0
    return f"{value:.{digits}f}" if abs(value) < 1e5 else f"{value:.1e}"


def three_digits(value: float | None) -> str:
    return DASH if value is None else plain(value, 3)


def largest(values: Array | None) -> str:
    return three_digits(None if values is None else float(values.max()))


def percent(share: float | None) -> str:
    return DASH if share is None else f"{100.0 * share:.0f} %"


def time(times: Times | None, which: str) -> str:
    if times is None:
        return DASH
    value = getattr(times, which)
    return f"{value:.2f}" if np.isfinite(value) else "never"


def alarm_text(alarms: Alarms) -> str:
    false = f"{alarms.false} false in {alarms.runs_with_false} runs" if alarms.false else "none false"
    if alarms.changes == 0:
        return false
    if len(alarms.delays_s) == 0:
        return f"all {alarms.missed} missed, {false}"
    worst_ms, median_ms = 1e3 * alarms.delays_s.max(), 1e3 * np.median(alarms.delays_s)
    return f"{median_ms:.0f} ms median, {worst_ms:.0f} ms latest, {alarms.missed} of {alarms.changes} missed, {false}"
