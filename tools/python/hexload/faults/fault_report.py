"""Tables and page of a campaign of faults: terminal, Markdown, CSV, self-contained HTML."""

import csv
import io
from collections.abc import Mapping, Sequence

from rich import box
from rich.table import Table

from hexload.campaign.campaign_report import METHODS
from hexload.campaign.statistics import ALARM_DUE_S
from hexload.faults import naming
from hexload.faults.kinds import KINDS
from hexload.faults.one_fault import FaultCase
from hexload.faults.score import LAST_S, OUTCOMES, WRONG_SHARE, WRONG_SIGMAS
from hexload.faults.tally import EstimatorTally, Tally
from hexload.faults.worst_runs import WorstRun
from hexload.report.page import templates

TEMPLATE = "fault_report.html.jinja"
OUTCOME_WORDS = {
    "right": "right within sigma",
    "said": "said",
    "weak": "weak",
    "silent": "silent",
    "indistinguishable": "indistinguishable",
    "refused": "refused",
    "false_alarm": "false alarm",
}
COLOURS = {  # Okabe and Ito's
    "right": "#009e73",
    "said": "#56b4e9",
    "weak": "#e69f00",
    "silent": "#d55e00",
    "indistinguishable": "#c6ccd3",
    "refused": "#6b7280",
    "false_alarm": "#cc79a7",
}
WORDS_INTRODUCTION = """# What a user reads of each fault

One fault at a time in a clean run, default tolerances, nothing commissioned: the verdict at the end, the load changes that `replay` reports, and its last line, what to do; else the first cause that it
prints, which does no harm, or its refusal. *Too small to matter*: it leaves less than half of the force sensors' noise in the forces, and by the log's own
regression each of the load's ten parameters goes off by less than its published sigma.
*True*: whether the cause that the log names first is the one that was put in; a dash where no log can tell it, or the reader refuses it. Written by
`{command}` (words.md).
"""
WORDS_HEADINGS = ("fault", "what is wrong", "verdict at the end", "what `replay` says", "true")
_IS_TRUE = {
    naming.RIGHT: "yes",
    naming.OTHER: "no",
    naming.NOTHING: "not named",
    naming.INDISTINGUISHABLE: "–",
    naming.REFUSED: "–",
}
HEADINGS = ("runs", "right", "said", "weak", "silent", "indistinguishable", "refused", "false", "false changes")


def counts(tally: Tally) -> list[int]:
    """In the order of HEADINGS."""
    return [tally.runs, *(tally.outcomes[outcome] for outcome in OUTCOMES), tally.false_changes]


def named_of(tally: Tally) -> str:
    """Runs whose first cause is the true one, of those in which it can be distinguished; of clean runs those with any cause."""
    reported = sum(tally.named.get(outcome, 0) for outcome in (naming.RIGHT, naming.OTHER, naming.NOTHING))
    return f"{tally.named.get(naming.RIGHT, 0)} of {reported}" if reported else ("" if not tally.named else "–")


def sentence_of(tally: Tally) -> str:
    return next(iter(tally.sentences), "")


def words_of(tally: Tally) -> str:
    return ", ".join(f"{word} ({runs})" for word, runs in tally.words.items())


def terminal_table(entry: EstimatorTally) -> Table:
    """Groups; the kinds of those that have silent runs."""
    title = (
        f"{METHODS[entry.estimator]}: runs by outcome; false changes: runs with a load change reported that was none"
    )
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    named = ("named",) if entry.whole.named else ()

    def row(label: str, tally: Tally, **more: str) -> None:
        table.add_row(label, *map(str, counts(tally)), *(named_of(tally) for _ in named), words_of(tally), **more)

    for heading in ("fault", *HEADINGS, *named, "said most"):
        is_text = heading in ("fault", "said most")
        table.add_column(heading, justify="left" if is_text else "right", no_wrap=heading != "said most")
    for group, tally in entry.groups.items():
        row(group, tally)
        for kind in entry.kinds:
            if KINDS[kind.kind].group == group and kind.whole.outcomes["silent"]:
                row(f"  {kind.kind}", kind.whole, style="dim")
    table.add_section()
    row("all faults", entry.whole)
    return table


def markdown(tallies: Sequence[EstimatorTally]) -> str:
    parts = []
    for entry in tallies:
        rows = [("", "**all faults**", entry.whole)]
        rows += [(KINDS[kind.kind].group, kind.kind, kind.whole) for kind in entry.kinds]
        named = ("named", "the first cause's sentence") if entry.whole.named else ()
        header = ("group", "fault", *HEADINGS, "said most in the last 3 s", "to be read", *named)
        lines = [f"## {METHODS[entry.estimator]}", "", _line(header), _line(["---"] * len(header))]
        for group, name, tally in rows:
            expected = KINDS[name].words if name in KINDS else ""
            cause = (named_of(tally), sentence_of(tally) if name in KINDS else "") if named else ()
            lines.append(_line((group, name, *map(str, counts(tally)), words_of(tally), expected, *cause)))
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def words_page(command: str, results: Mapping[FaultCase, dict]) -> str:
    """What replay says of each kind of fault: of the first case that has it, one size and motion."""
    lines = [WORDS_INTRODUCTION.format(command=command)]
    lines += [_line(WORDS_HEADINGS), _line(["---"] * len(WORDS_HEADINGS))]
    firsts: dict[str, FaultCase] = {}
    for case in results:
        firsts.setdefault(case.kind, case)
    for name in (name for name in KINDS if name in firsts):
        case, kind = firsts[name], KINDS[name]
        named, told = results[case]["named"], results[case]["told"]
        what = ", ".join(text for text in (kind.says, kind.size_in_words(case.size) if kind.is_fault else "") if text)
        said = "; ".join(text for text in (told["new_load"], told["sentence"]) if text)
        lines.append(_line((name, what, told["verdict"], said.replace("|", "/") or "–", _IS_TRUE[named["outcome"]])))
    return "\n".join(lines) + "\n"


def as_csv(results: Mapping[FaultCase, dict]) -> str:
    """A row per case."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(
        ("group", "fault", "size", "unit", "motion", "estimator", "seed", "outcome", "largest_sigmas")
        + ("wrong", "words_last_3_s", "words_before", "false_changes", "to_be_read", "named", "cause")
    )
    for case, result in results.items():
        kind = KINDS[case.kind]
        wrong = " ".join(entry["name"] for entry in result["wrong"])
        cause = result.get("named") or {"outcome": "", "sentence": ""}
        said = ("; ".join(result[name]) for name in ("words", "words_before"))
        writer.writerow(
            (kind.group, case.kind, f"{case.size:g}", kind.unit, case.motion, case.estimator, case.seed)
            + (result["outcome"], result["largest_sigmas"], wrong, *said, len(result["false_changes_s"]), kind.words)
            + (cause["outcome"], cause["sentence"])
        )
    return file.getvalue()


def render(
    settings: object,
    code: str,
    tallies: Sequence[EstimatorTally],
    results: Mapping[FaultCase, dict],
    worst: Sequence[WorstRun],
) -> str:
    environment = templates("hexload.faults")
    environment.filters |= {"counts": counts, "said": words_of, "named": named_of, "sentence": sentence_of}
    return environment.get_template(TEMPLATE).render(
        settings=settings,
        code=code,
        methods=METHODS,
        kinds=KINDS,
        headings=HEADINGS,
        tallies=tallies,
        results=results,
        worst=worst,
        outcome_words=OUTCOME_WORDS,
        outcomes=[(outcome, OUTCOME_WORDS[outcome], COLOURS[outcome]) for outcome in OUTCOMES],
        wrong_sigmas=WRONG_SIGMAS,
        wrong_percent=100.0 * WRONG_SHARE,
        last_s=LAST_S,
        alarm_due_s=ALARM_DUE_S,
    )
