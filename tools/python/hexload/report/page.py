"""`hexload report`: one self-contained HTML page of one or several runs; nothing is loaded from a network."""

from dataclasses import dataclass
from pathlib import Path

import jinja2
import numpy as np
import plotly.graph_objects as go
import plotly.offline

from hexload import project
from hexload.estimation import load_summary
from hexload.io.atomic_file import replaced_when_done
from hexload.io.log_file import LegLog
from hexload.io.run_directory import POSE, Run, read_run
from hexload.report import claims, figures, load_report, table3
from hexload.report.load_report import LoadEstimate
from hexload.theory import nis
from hexload.theory.bound import THETA_NAMES

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


def default_page(directories: list[Path]) -> Path:
    return directories[0] / "report.html" if len(directories) == 1 else project.RUNS / "report.html"


def write_report(directories: list[Path], out: Path) -> list[Run]:
    """Writes the page to `out`; returns the runs in the order of `directories`."""
    runs = [read_run(directory) for directory in directories]
    with replaced_when_done(out) as temporary:
        page = render([_section(f"run-{number}", run) for number, run in enumerate(runs, start=1)])
        temporary.write_text(page, encoding="utf-8")
    return runs


def render_replay(result: dict, samples: LegLog, title: str, description: str, known_mass_kg: float | None) -> str:
    """The page of a replay of ten parameters. `result`: what hexload_native.replay returns of the samples."""
    load, drawn = load_report.of_replay(result, samples, known_mass_kg)
    return render([LoadSection("run-1", title, description, load, None, [], _all_to_html("run-1", drawn))])


def render(sections: list[Section | LoadSection]) -> str:
    environment = templates()
    environment.filters |= {"moments": load_summary.moments_in_words, "health": load_summary.health_in_words}
    return environment.get_template(TEMPLATE).render(
        sections=sections,
        plotly_js=plotly.offline.get_plotlyjs(),
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


def templates(package: str = "hexload.report") -> jinja2.Environment:
    """A package's templates, with filters for numbers."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(package, "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"fixed": _fixed, "signed": _signed, "percent": _percent}
    return environment


def _fixed(value: float | None, digits: int) -> str:
    """A number with a fixed count of digits; a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def _signed(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:+.{digits}f}"


def _percent(value: float | None, digits: int = 3) -> str:
    """Fewer digits of an error that is large."""
    return _fixed(value, digits if value is None or value < 10.0 else max(0, digits - 2))


def _section(anchor: str, run: Run) -> Section | LoadSection:
    drawn = {
        "tracking": figures.tracking(run),
        "coupling": figures.coupling(run.meta["coupling_matrix_home"]),
    }
    errors = [_tracking_error(run, name) for name in POSE]
    if not run.is_of_paper:
        load, more = load_report.of_run(run)
        html = _all_to_html(anchor, drawn | more)
        return LoadSection(anchor, run.name, run.meta["description"], load, run, errors, html)
    t, values = run.estimates["t"], run.estimates["nis"]
    summary = nis.summarise(t, values, nis.PAPER_MEASUREMENTS)
    drawn |= {
        "legs": figures.leg_signals(run.log),
        "estimates": figures.estimates(run),
        "nis": figures.innovation(t, values, summary),
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
        figures=_all_to_html(anchor, drawn),
    )


def _all_to_html(anchor: str, drawn: dict[str, go.Figure]) -> dict[str, str]:
    return {name: to_html(figure, f"{anchor}-{name}-figure") for name, figure in drawn.items()}


def _tracking_error(run: Run, name: str) -> dict:
    error = run.truth[name] - run.truth[f"ref_{name}"]
    return {
        "name": name,
        "unit": "mm" if name in POSE[:3] else "mrad",
        "rms": 1e3 * claims.rms(error),
        "largest": 1e3 * float(np.abs(error).max()),
        "reach": 1e3 * float(np.abs(run.truth[f"ref_{name}"]).max()),
    }


def to_html(figure: go.Figure, identifier: str) -> str:
    return figure.to_html(
        full_html=False,
        include_plotlyjs=False,
        div_id=identifier,
        default_width="100%",
        default_height=f"{figure.layout.height}px",
        config={"displayModeBar": False, "responsive": True},
    )
