"""The page's texts: what is estimated, what has happened, how source and controller are."""

from html import escape

import numpy as np

from hexload.estimation.load_summary import DIGITS, SYMBOLS, digits_of, each_once, in_words, unit_of_parameter
from hexload.view import colours
from hexload.view.frame import SIGMAS, Event, Frame, Health

LATEST = 8  # events that are shown
VERDICTS = {
    "converged": "converged: every parameter is known to its sigma",
    "converging": "converging: the sigmas are still getting smaller",
    "not_excited": "not excited: this motion does not tell all parameters",
    "misfit": "misfit: the machine is not as its platform file says; sigmas cover it",
    "inconsistent": "inconsistent: the machine or its sensors do not fit the model",
}
VERDICT_COLOURS = {
    "converged": (0, 114, 178),
    "converging": (90, 90, 90),
    "misfit": (176, 58, 0),
    "inconsistent": (176, 58, 0),
}
DIGITS_OF_TEN = 3
STYLE = "font: 12px sans-serif; margin: 0 12px 6px"


def status(frame: Frame) -> str:
    """Time, verdict and a table of the parameters."""
    head = f"<div style='font-size: 22px; font-variant-numeric: tabular-nums'>t = {frame.t_s:.2f} s</div>"
    estimate = frame.estimate
    if estimate is None:
        return f"<div style='{STYLE}'>{head}<p>no estimate yet</p></div>"
    colour = colours.css(VERDICT_COLOURS.get(estimate.verdict, (90, 90, 90)))
    words = VERDICTS.get(estimate.verdict, estimate.verdict)
    verdict = f"<div style='color: {colour}; font-weight: 600; margin: 2px 0 6px'>{escape(words)}</div>"
    cells = "".join(_row(frame, k) for k in range(len(estimate.names)))
    headings = ("estimate", "± 3σ", "truth" if frame.truth is not None else "", "")
    heading = "".join(f"<th style='text-align: right; font-weight: 500'>{text}</th>" for text in headings)
    table = (
        "<table style='width: 100%; border-spacing: 0; font-variant-numeric: tabular-nums'>"
        f"<tr><th></th>{heading}</tr>{cells}</table>"
    )
    return f"<div style='{STYLE}'>{head}{verdict}{table}{_reasons(frame)}</div>"


def _row(frame: Frame, k: int) -> str:
    estimate, truth = frame.estimate, frame.truth
    name = estimate.names[k]
    spread = SIGMAS * estimate.sigma[k]
    is_of_ten = name not in DIGITS or len(estimate.names) >= 10
    digits = digits_of(spread, DIGITS_OF_TEN) if is_of_ten else max(DIGITS[name] - 2, 2)
    numbers = [f"{estimate.value[k]:z.{digits}f}", f"{spread:.{digits}f}"]
    known = truth is not None and np.isfinite(truth.value[k])
    numbers.append(f"{truth.value[k]:.{digits}f}" if known else "")
    cells = "".join(f"<td style='text-align: right'>{number}</td>" for number in numbers)
    unit = unit_of_parameter(name).replace("kg m^2", "kg m²")
    return f"<tr><td>{SYMBOLS.get(name, name)}</td>{cells}<td style='padding-left: 5px; color: #666'>{unit}</td></tr>"


def _reasons(frame: Frame) -> str:
    """Of the parameters whose own verdict asks for something."""
    estimate = frame.estimate
    said = [
        (SYMBOLS.get(name, name), in_words(name, verdict))
        for name, verdict in zip(estimate.names, estimate.parameter_verdict)
        if verdict in ("not_excited", "misfit", "inconsistent")
    ]
    asked = [f"<div>{names}: {escape(words)}</div>" for names, words in each_once(said, len(estimate.names))]
    return f"<div style='margin-top: 6px; color: #444'>{''.join(asked)}</div>" if asked else ""


def events(found: list[Event]) -> str:
    lines = "".join(f"<div>{event.t_s:.3f} s &nbsp; {escape(event.words)}</div>" for event in found[: -LATEST - 1 : -1])
    return f"<div style='{STYLE}; font-variant-numeric: tabular-nums'>{lines or 'none'}</div>"


def health(found: Health) -> str:
    return f"<div style='{STYLE}'>{''.join(f'<div>{escape(line)}</div>' for line in found.lines)}</div>"


def legend(words: str, low: float, high: float, has_truth: bool) -> str:
    middle = (low + high) / 2
    bar = (
        f"<div>{escape(words)}</div><div style='height: 10px; background: {colours.gradient_css()}'></div>"
        "<div style='display: flex; justify-content: space-between'>"
        f"<span>{low:.0f}</span><span>{middle:.0f}</span><span>{high:.0f}</span></div>"
    )
    estimated = _key(
        colours.ESTIMATE, "estimated load: centre of mass, its 3σ ellipsoid, box of equal mass and inertia"
    )
    true = _key(colours.TRUTH, "true load, from the simulator") if has_truth else ""
    change = _key(colours.CHANGE, "in the curves: another load detected")
    return f"<div style='{STYLE}'>{bar}{estimated}{true}{change}<div>grid: 0.2 m</div></div>"


def _key(colour: colours.Rgb, words: str) -> str:
    square = f"<span style='flex: none; width: 10px; height: 10px; margin: 3px 6px 0 0; background: {colours.css(colour)}'></span>"
    return f"<div style='display: flex; margin-top: 3px'>{square}<span>{escape(words)}</span></div>"
