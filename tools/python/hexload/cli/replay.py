"""`hexload replay` on the terminal."""

import math
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hexload.diagnosis.finding import Finding, plain
from hexload.estimation import load_summary
from hexload.estimation.input_check import mend_of

UNFIT = ("misfit", "inconsistent")  # verdicts beyond which sigma need not hold


def is_believed(result: dict) -> bool:
    """Neither do the log's channels contradict each other at the end, nor do machine, log and estimate."""
    return not result["input_words"] and result["verdict"][-1] not in UNFIT


def figures(result: dict) -> dict:
    """What the summary says, for programs."""
    keys = ("unit", "value", "sigma", "own_sigma")
    rows = {row.name: {key: getattr(row, key) for key in keys} for row in load_summary.parameters(result)}
    for name, verdict in zip(result["names"], result["parameter_verdict"]):
        rows[name]["verdict"] = verdict
    body = None
    if "body" in result:
        numbers = load_summary.body_numbers(result["body"])
        body = {"is_consistent": result["body"]["is_consistent"]}
        body |= {row.name: {"unit": row.unit, "value": row.value, "sigma": row.sigma} for row in numbers}
    return {
        "verdict": result["verdict"][-1],
        "is_believed": is_believed(result),
        "ticks": result["ticks"],
        "refused": result["refused"],
        "parameters": rows,
        "body": body,
        "load_changes_s": load_summary.load_changes_s(result),
        "health_ticks": {name: ticks for name, ticks in result["health_counts"].items() if ticks},
        "causes": result["diagnosis"].findings,
        "input_faults": [{"t_s": t_s, "words": words} for t_s, words in result["input_faults"]],
        "remarks": result["remarks"],
        "guessed": result["guessed"],
        "mend": mend_of(result),
    }


def print_summary(
    result: dict, out: Path, bodies: Path | None = None, report: Path | None = None, trace: Path | None = None
) -> None:
    """The final estimates on the terminal, and the files that have been written."""
    table = Table()
    for heading in ("parameter", "estimate", "sigma", "filter's own", "verdict"):
        table.add_column(heading, justify="left" if heading in ("parameter", "verdict") else "right")
    mend = mend_of(result)
    rows = load_summary.parameters(result)
    for row in rows:
        value, sigma = (f"{number:z.{row.digits}f}" for number in (row.value, row.sigma))
        own_sigma = f"{row.own_sigma:.{row.own_digits}f}"
        table.add_row(f"{row.symbol}, {row.unit}", value, sigma, own_sigma, row.verdict)
    Console().print(table)
    for names, words in load_summary.reasons(rows):
        if not (mend and words.startswith("inconsistent")):  # the last line says why
            print(f"{names}: {words}")
    if "body" in result:
        Console().print(_body_table(result["body"]))
        print(f"body:      {load_summary.consistent_in_words(result['body'])}")
    print(f"verdict:   {result['verdict'][-1]} after {result['ticks']} ticks")
    print(f"health:    {load_summary.health_in_words(result['health_counts']) or 'no remark'}")
    if "followed" in result:
        print(f"legs:      {result['followed'].words}")
    for finding in result["diagnosis"].findings:
        print(f"cause:     {finding.words}{_how_much(finding)}{_if_harmless(finding)}")
    for t_s, words in result["input_faults"]:
        print(f"input:     from {t_s:.3f} s on: {words}")
    if times_s := load_summary.load_changes_s(result):
        print(f"new load:  detected {load_summary.moments_in_words(times_s)}")
        for words in load_summary.pushes_in_words(times_s, result["diagnosis"].findings):
            print(f"           {words}")
    if result["refused"]:
        print(f"refused:   {result['refused']} samples, the first at {result['first_refusal']}")
    for remark in result["remarks"]:
        print(f"log:       {remark}")
    if result["guessed"]:
        print(
            f"guessed:   {result['guessed']}: what the guess is off, the load is; the first suspect of a contradiction"
        )
    print(f"estimates: {out}")
    if bodies is not None:
        print(f"bodies:    {bodies}")
    if trace is not None:
        print(f"trace:     {trace}")
    if report is not None:
        print(f"page:      {report}")
    if mend:  # the last line: it matters more than all above, unless the estimate stands as it is
        print(f"{'beside it:' if is_believed(result) else 'mend:     '} {mend}")


def _if_harmless(finding: Finding) -> str:
    if not finding.is_harmless:
        return ""
    return f"; {finding.why_harmless or 'too small to matter'}"


def _how_much(finding: Finding) -> str:
    """What it does, in brackets."""
    if math.isnan(finding.rms_n):
        return ""
    doubt = f"; {', '.join(finding.alternatives)} would explain as much" if finding.alternatives else ""
    return f" ({plain(finding.rms_n)} N rms; left out, it moves the mass by {plain(abs(finding.mass_kg))} kg{doubt})"


def _body_table(body: dict) -> Table:
    """The load as a body: what is not known is a dash."""
    table = Table()
    table.add_column("load as a body")
    headings = {"value": "estimate", "sigma": "sigma"}
    if not body["is_consistent"]:
        headings["nearest"] = "nearest consistent"
    for heading in headings.values():
        table.add_column(heading, justify="right")
    for row in load_summary.body_numbers(body):
        numbers = (getattr(row, key) for key in headings)
        words = ("-" if number is None else f"{number:z.{row.digits}f}" for number in numbers)
        table.add_row(f"{row.name}, {row.unit}", *words)
    return table
