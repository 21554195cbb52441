"""`hexload report`: one self-contained HTML page of one or several runs; nothing is loaded from a network."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from hexload import project
from hexload.diagnosis.finding import plain
from hexload.estimation import load_summary
from hexload.estimation.firmware_run import load_platform, native_firmware
from hexload.io.atomic_file import replaced_when_done
from hexload.io.run_directory import POSE, Run, read_run
from hexload.report import charts, claims, figures, load_report, motion, table3
from hexload.report.load_report import LoadEstimate
from hexload.theory import nis
from hexload.theory.bound import THETA_NAMES
from hexload.view.recorded import recording_of, recording_of_replay

OWN = "hexload.report"
TEMPLATE = "report.html.jinja"
PAPER_TEMPLATE, LOAD_TEMPLATE = "report_paper.html.jinja", "report_load.html.jinja"


@dataclass(frozen=True)
class Section:
    """All that the page says of one run of the paper's filter."""

    template = PAPER_TEMPLATE
    anchor: str
    run: Run
    table: list[table3.Row]
    paper_load: bool
    tracking_errors: list[dict]
    excitation: claims.Excitation
    start: claims.StartError
    nis: nis.NisSummary
    figures: dict[str, str]  # name -> HTML
    motion: str  # HTML

    @property
    def title(self) -> str:
        return self.run.name

    @property
    def worst(self) -> table3.Row:
        return max(self.table, key=lambda row: row.error_percent)

    @property
    def inside_three_sigma(self) -> int:
        return sum(abs(row.error_sigmas) <= 3.0 for row in self.table)


@dataclass(frozen=True)
class LoadSection:
    """All that the page says of an estimate of ten parameters."""

    template = LOAD_TEMPLATE
    anchor: str
    title: str
    description: str
    load: LoadEstimate
    run: Run | None  # of a replayed log there is none
    tracking_errors: list[dict]
    figures: dict[str, str]
    motion: str


def default_page(directories: list[Path]) -> Path:
    return directories[0] / "report.html" if len(directories) == 1 else project.RUNS / "report.html"


def write_report(directories: list[Path], out: Path) -> list[Run]:
    """Writes the page to `out`; returns the runs in the order of `directories`."""
    runs = [read_run(directory) for directory in directories]
    with replaced_when_done(out) as temporary:
        page = render([_section(f"run-{number}", run) for number, run in enumerate(runs, start=1)])
        temporary.write_text(page, encoding="utf-8")
    return runs


def render_replay(result: dict, platform: Any, title: str, description: str) -> str:
    """The page of a replay. `result`: what replay_log returns; `platform`: hexload_native.Platform."""
    load, drawn = load_report.of_replay(result, result["log"], platform.known_mass_kg)
    moving = motion.to_html(platform, recording_of_replay(title, result), "run-1-motion")
    return render([LoadSection("run-1", title, description, load, None, [], _all_to_html("run-1", drawn), moving)])


def render(sections: list[Section | LoadSection]) -> str:
    environment = templates()
    environment.filters |= {
        "plain": plain,
        "moments": load_summary.moments_in_words,
        "health": load_summary.health_in_words,
    }
    return environment.get_template(TEMPLATE).render(
        sections=sections,
        symbols=load_summary.SYMBOLS,
        units=load_summary.UNITS,
        digits=load_summary.DIGITS,
        paper_digits=table3.PAPER_DIGITS,
        percent_digits=table3.PERCENT_DIGITS,
        converged_percent=100 * table3.CONVERGED_WITHIN,
        degrees=180.0 / np.pi,
        theta_names=THETA_NAMES,
        paper_sections=[section for section in sections if section.template == PAPER_TEMPLATE],
        load_sections=[section for section in sections if section.template == LOAD_TEMPLATE],
        windows_ticks=nis.WINDOW_TICKS,
    )


def templates(package: str = OWN) -> jinja2.Environment:
    """A package's templates and this one's, which all pages share, with filters for numbers."""
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(name, ".") for name in dict.fromkeys((package, OWN))]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"fixed": _fixed, "signed": _signed, "percent": _percent}
    return environment


def _fixed(value: float | None, digits: int) -> str:
    """A number with a fixed count of digits; a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:z.{digits}f}"


def _signed(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:+.{digits}f}"


def _percent(value: float | None, digits: int = 3) -> str:
    """Fewer digits of an error that is large."""
    return _fixed(value, digits if value is None or value < 10.0 else max(0, digits - 2))


def _section(anchor: str, run: Run) -> Section | LoadSection:
    marks = figures.marks_of(run.meta.get("load_changes_detected_s", ()))
    drawn = {"tracking": figures.tracking(run, marks)}
    matrix = figures.coupling(_coupling(run), f"{anchor}-coupling-figure")
    platform = load_platform(native_firmware(), run.directory / "platform.toml")
    moving = motion.to_html(platform, recording_of(run), f"{anchor}-motion")
    errors = [_tracking_error(run, name) for name in POSE]
    if not run.is_of_paper:
        load, more = load_report.of_run(run)
        html = _all_to_html(anchor, drawn | more) | {"coupling": matrix}
        return LoadSection(anchor, run.name, run.meta["description"], load, run, errors, html, moving)
    t, values = run.estimates["t"], run.estimates["nis"]
    summary = nis.summarise(t, values, nis.PAPER_MEASUREMENTS)
    drawn |= {
        "legs": figures.leg_signals(run.log, marks),
        "estimates": figures.estimates(run),
        "nis": figures.innovation(t, values, summary, marks),
    }
    return Section(
        anchor=anchor,
        run=run,
        table=table3.compare(run),
        paper_load=table3.has_paper_load(run),
        tracking_errors=errors,
        excitation=claims.excitation(run),
        start=claims.start_error(run),
        nis=summary,
        figures=_all_to_html(anchor, drawn) | {"coupling": matrix},
        motion=moving,
    )


def _coupling(run: Run) -> list[list[float]]:
    """(19) at home with the last load; meta.json has it with the first. It is linear in the load's parameters."""
    first, last = (np.array(load["theta"]) for load in (run.meta["loads"][0], run.final_load))
    _, hx, hy, hz, *_, xy, xz, yz = last - first
    arm = np.array([[0.0, -hz, hy], [hz, 0.0, -hx], [-hy, hx, 0.0]])
    products = np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
    return (run.meta["coupling_matrix_home"] + np.block([[np.zeros((3, 3)), -arm], [arm, products]])).tolist()


def _all_to_html(anchor: str, drawn: dict[str, charts.Chart]) -> dict[str, str]:
    return {name: charts.to_html(chart, f"{anchor}-{name}-figure") for name, chart in drawn.items()}


def _tracking_error(run: Run, name: str) -> dict:
    error = run.truth[name] - run.truth[f"ref_{name}"]
    return {
        "name": name,
        "unit": "mm" if name in POSE[:3] else "mrad",
        "rms": 1e3 * claims.rms(error),
        "largest": 1e3 * float(np.abs(error).max()),
        "reach": 1e3 * float(np.abs(run.truth[f"ref_{name}"]).max()),
    }
