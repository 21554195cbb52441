"""Logs as people have them: what is wrong with one is said, with the option that mends it; the option mends it.

The table of host_sim/README.md, "Wrong logs", has a row for each of WRONG: what is wrong, the exit status, what is said.
"""

import gzip
import json
import os
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from hexload.cli.replay import is_believed, print_summary
from hexload.errors import InputError
from hexload.estimation import stray
from hexload.estimation.input_check import WayIn
from hexload.estimation.replay import replay_log
from hexload.estimation.tare import make_tare
from hexload.io.log_file import COLUMNS, LegLog, read_log

SOURCE = Path(os.environ["HEXLOAD_SOURCE_DIR"])
DATA = SOURCE / "tests" / "data"
ROWS = 6000
MOST_SIGMAS = 6.0  # of the largest of ten, where channels are rounded or resampled; 3.2 of 1,000 normal ones of ten

Legs = dict[str, np.ndarray]  # t (n,), dl, vl, f (n, 6)


@dataclass(frozen=True)
class Wrong:
    what: str
    status: int
    says: str  # the last line has it
    change: Callable[[Legs], Legs] | None = None  # of the columns
    text: Callable[[str], str | bytes] | None = None  # of the file
    log: str = "multisine_eccentric"
    platform: str = "unknown_load"
    is_mended: bool = True  # by the options of the last line; else it has none
    name: str = "log.csv"
    options: tuple[str, ...] = field(default=())


def scaled(**factors: float) -> Callable[[Legs], Legs]:
    return lambda legs: {name: legs[name] * factors.get(name, 1.0) for name in legs}


def of_leg(channel: str, leg: int, factor: float) -> Callable[[Legs], Legs]:
    return lambda legs: legs | {channel: legs[channel] * np.where(np.arange(6) == leg - 1, factor, 1.0)}


def swapped(channel: str, *legs: int) -> Callable[[Legs], Legs]:
    order = list(range(6))
    order[legs[0] - 1], order[legs[1] - 1] = legs[1] - 1, legs[0] - 1
    return lambda columns: columns | {channel: columns[channel][:, order]}


def moved(factor: float, offset_m: float) -> Callable[[Legs], Legs]:
    return lambda legs: legs | {"dl": factor * (legs["dl"] + offset_m)}


def jittered(legs: Legs) -> Legs:
    """Each row is read up to 0.4 ms late, with its own noise, and says when."""
    late = np.random.default_rng(1).uniform(0.0, 4e-4, (len(legs["t"]), 1))
    speed = {name: smooth_slope(legs[name]) for name in ("vl", "f")} | {"dl": legs["vl"]}
    return {name: legs[name] + speed[name] * late for name in speed} | {"t": legs["t"] + late[:, 0]}


def smooth_slope(values: np.ndarray) -> np.ndarray:
    """Per second, over 21 rows, so that the noise of one is not in it."""
    wide = np.pad(values, ((10, 10), (0, 0)), "edge")
    means = np.cumsum(wide, axis=0)
    means = np.diff(means[20:] - np.vstack([np.zeros(6), means[:-21]]), axis=0, prepend=0.0) / 21
    means[0] = means[1]
    return means / 1e-3


def every(step: int) -> Callable[[Legs], Legs]:
    return lambda legs: {name: values[::step] for name, values in legs.items()}


def without(column: str) -> Callable[[str], str]:
    k = COLUMNS.index(column)
    return lambda text: "".join(
        ",".join(cell for n, cell in enumerate(line.split(",")) if n != k) + "\n" for line in text.splitlines()
    )


def second_line_again(text: str) -> str:
    lines = text.splitlines(keepends=True)
    return "".join([*lines[:3], lines[2], *lines[3:]])


def third_line_first(text: str) -> str:
    lines = text.splitlines(keepends=True)
    return "".join([lines[0], lines[2], lines[1], *lines[3:]])


WRONG = [
    Wrong("displacements in mm", 2, "displacements look like mm", scaled(dl=1e3)),
    Wrong("displacements in cm", 2, "displacements look like cm", scaled(dl=1e2)),
    Wrong("displacements in inches", 2, "displacements look like in", scaled(dl=1 / 0.0254)),
    Wrong(
        "displacements in mm, no velocities",
        2,
        "displacements look like mm",
        scaled(dl=1e3),
        text=None,
        options=("vl = false",),
    ),
    Wrong("displacement of leg 3 in mm", 2, "displacements of leg 3 look like mm", of_leg("dl", 3, 1e3)),
    Wrong("velocities in mm/s", 2, "velocities look like mm/s", scaled(vl=1e3)),
    Wrong("velocity of leg 4 in mm/s", 2, "velocities of leg 4 look like mm/s", of_leg("vl", 4, 1e3)),
    Wrong("all in mm and mm/s", 2, "displacements and velocities look like mm and mm/s", scaled(dl=1e3, vl=1e3)),
    Wrong("absolute leg lengths", 2, "displacements look like absolute leg lengths", moved(1.0, 0.8741)),
    Wrong("absolute leg lengths in mm", 2, "displacements look like absolute leg lengths in mm", moved(1e3, 0.8741)),
    Wrong(
        "displacements from the shortest leg",
        2,
        "displacements look like lengths from the shortest leg",
        moved(1.0, 0.3),
    ),
    Wrong("forces in kN", 2, "forces look like kN", scaled(f=1e-3)),
    Wrong("forces in kgf", 2, "forces look like kgf (or daN, or lbf)", scaled(f=1 / 9.80665)),
    Wrong(
        "forces in lbf, the load's mass known",
        2,
        "forces look like lbf",
        scaled(f=1 / 4.4482216),
        log="paper_noisy",
        platform="paper_load",
    ),
    Wrong("forces in lbf", 3, "check their unit (N)", scaled(f=1 / 4.4482216), is_mended=False),
    Wrong("force of leg 5 in kN", 2, "forces of leg 5 look like kN", of_leg("f", 5, 1e-3)),
    Wrong("forces in kN, with the opposite sign", 2, "forces look like kN, with the opposite sign", scaled(f=-1e-3)),
    Wrong("time in ms", 2, "time looks like ms", scaled(t=1e3)),
    Wrong("time in us", 2, "time looks like us", scaled(t=1e6)),
    Wrong("forces with the opposite sign", 2, "forces have the opposite sign", scaled(f=-1.0)),
    Wrong(
        "velocities with the opposite sign",
        2,
        "velocities have the opposite sign of the displacements' change",
        scaled(vl=-1.0),
    ),
    Wrong(
        "displacements with the opposite sign",
        2,
        "velocities have the opposite sign of the displacements' change",
        scaled(dl=-1.0),
    ),
    Wrong("legs positive when they retract", 2, "legs look positive when they retract", scaled(dl=-1.0, vl=-1.0)),
    Wrong(
        "velocity of leg 3 with the opposite sign",
        2,
        "velocities of leg 3 have the opposite sign",
        of_leg("vl", 3, -1.0),
    ),
    Wrong("velocities of legs 2 and 5 swapped", 2, "legs 2 and 5 look swapped", swapped("vl", 2, 5)),
    Wrong("velocities that are all 0", 2, "velocities are 0 throughout, and the legs move", scaled(vl=0.0)),
    Wrong(
        "forces of legs 1 and 4 swapped",
        3,
        "the force sensors of legs 1 and 4 are swapped",
        swapped("f", 1, 4),
        is_mended=False,
    ),
    Wrong(
        "force of leg 2 with the opposite sign",
        3,
        "leg 2: force has the wrong sign",
        of_leg("f", 2, -1.0),
        is_mended=False,
    ),
    Wrong(
        "displacements and velocities exchanged",
        2,
        "displacements are no displacements",
        lambda legs: legs | {"dl": legs["vl"], "vl": legs["dl"]},
        is_mended=False,
    ),
    Wrong(
        "displacements and forces exchanged",
        2,
        "displacements are no displacements",
        lambda legs: legs | {"dl": legs["f"], "f": legs["dl"]},
        is_mended=False,
    ),
    Wrong("a clock that runs at half its rate", 3, "the log's clock is 50 % slow", scaled(t=0.5), is_mended=False),
    Wrong(
        "force of leg 1 that stands still",
        3,
        "leg 1: force stands still",
        lambda legs: legs | {"f": np.where(np.arange(6) == 0, legs["f"][0], legs["f"])},
        is_mended=False,
    ),
    Wrong("rows 20 ms apart", 2, "too few rows", every(20), is_mended=False),
    Wrong("jittered time", 2, "expected a multiple of the sampling period", jittered),
    Wrong("a row twice", 2, "the same time again", text=second_line_again, is_mended=False),
    Wrong("rows out of order", 2, "time running backwards", text=third_line_first, is_mended=False),
    Wrong("a leg's column missing", 2, "found no column f4 (leg 4)", text=without("f4"), is_mended=False),
    Wrong(
        "columns of other names",
        2,
        "say which is which, --columns",
        text=lambda text: text.replace("dl", "Cylinder "),
        is_mended=False,
    ),
    Wrong(
        "a unit that is none",
        2,
        "found the unit 'furlong', expected m, mm, cm, um, in",
        text=lambda text: text.replace("dl2", "dl2 [furlong]", 1),
        is_mended=False,
    ),
    Wrong("no header", 2, "found no column t", text=lambda text: text.partition("\n")[2], is_mended=False),
    Wrong(
        "a word among the numbers",
        2,
        "column f6: found 'overload', expected a finite number",
        text=lambda text: text.rpartition(",")[0] + ",overload\n",
        is_mended=False,
    ),
    Wrong("a row cut off", 2, "expected 19", text=lambda text: text[:-40], is_mended=False),
    Wrong(
        "a compressed log cut off",
        2,
        "found damaged or incomplete gzip data",
        text=lambda text: gzip.compress(text.encode())[:-4000],
        name="log.csv.gz",
        is_mended=False,
    ),
    Wrong(
        "a workbook",
        2,
        "found a workbook",
        text=lambda _: b"PK\x03\x04\x14\x00\x06\x00\xff\xfe\xfd\n",
        name="log.xlsx",
        is_mended=False,
    ),
    Wrong("an empty file", 2, "found an empty file", text=lambda _: "", is_mended=False),
]


def columns_of(name: str) -> Legs:
    log = read_log(DATA / f"{name}.csv.gz").rows(slice(ROWS))
    return {"t": log.t_s, "dl": log.displacement_m, "vl": log.velocity_m_s, "f": log.force_n}


def text_of(legs: Legs) -> str:
    rows = np.column_stack([legs["t"], legs["dl"], legs["vl"], legs["f"]])
    return "".join([",".join(COLUMNS) + "\n", *(",".join(f"{value:.10g}" for value in row) + "\n" for row in rows)])


@pytest.fixture(scope="module")
def clean() -> dict[str, tuple[Legs, str]]:
    return {name: (legs := columns_of(name), text_of(legs)) for name in ("multisine_eccentric", "paper_noisy")}


def replayed(capsys, path: Path, platform: str, **way_in) -> tuple[int, str, dict]:
    """Status, last line and result of `hexload replay`."""
    out = path.with_name("estimates.csv")
    out.unlink(missing_ok=True)
    try:
        result = replay_log(path, DATA / f"{platform}.toml", None, None, out, way_in=WayIn(**way_in))
    except InputError as error:
        assert not out.exists() and "\n" not in str(error)
        return 2, str(error), {}
    capsys.readouterr()
    print_summary(result, out)
    return 0 if is_believed(result) else 3, capsys.readouterr().out.splitlines()[-1], result


def options_of(line: str) -> dict:
    """The --columns and --resample of a last line."""
    words = shlex.split(" ".join(re.findall(r"--columns '[^']*'|--resample [\d.]+", line)))
    columns = [word for option, word in zip(words, words[1:]) if option == "--columns"]
    resample = [float(word) for option, word in zip(words, words[1:]) if option == "--resample"]
    return {"columns": columns, "resample_s": resample[0] if resample else None}


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.what)
def test_what_is_wrong_with_a_log_is_said_and_mended(wrong, clean, tmp_path, capsys):
    # GIVEN a log with something wrong WHEN it is replayed
    legs, text = clean[wrong.log]
    text = text if wrong.change is None else text_of(wrong.change(legs))
    content = text if wrong.text is None else wrong.text(text)
    path = tmp_path / wrong.name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    status, last, _ = replayed(capsys, path, wrong.platform, columns=wrong.options)
    print(status, last)
    # THEN the status is not 0, and the last line says what is wrong
    assert (status, wrong.says in last) == (wrong.status, True), last
    # AND with the option that it names the log gives what it should
    found = options_of(re.sub(r"\(if it is[^()]*\)", "", last))
    if not wrong.is_mended:
        return
    found["columns"] = [*wrong.options, *found["columns"]]
    status, last, result = replayed(capsys, path, wrong.platform, **found)
    assert status == 0, last
    assert largest_error(result, wrong.log) < MOST_SIGMAS


@pytest.mark.parametrize(
    "channel, value, others, is_taken",
    [
        ("dl", 5.0, "displacement", False),
        ("dl", 1e6, "displacement", False),
        ("vl", -1e6, "velocity", False),
        ("f", 1e9, "force", False),
        ("f", -1e9, "force", False),
        ("f", 2e4, "force", True),  # no range of a sensor excludes it
    ],
)
def test_one_absurd_value_is_called_what_it_is(channel, value, others, is_taken, clean, tmp_path, capsys):
    # GIVEN a log in which one value of one leg is absurd, on a row that ends a block of 32
    legs, row = clean["multisine_eccentric"][0], 4000
    values = legs[channel].copy()
    values[row, 2] = value
    path = tmp_path / "log.csv"
    path.write_text(text_of(legs | {channel: values}))
    # WHEN it is replayed
    status, last, result = replayed(capsys, path, "unknown_load")
    # THEN the value is told with channel, leg and time, and neither units nor wiring of the channel
    told = [words for words in result["remarks"] if words.startswith("one value is far from all others")]
    assert len(told) == 1 and f"{others} of leg 3 at {legs['t'][row]:.9g} s: found {value:.4g}" in told[0]
    assert result["diagnosis"].cause is None
    # AND the load is known as without it; where the estimator has taken the value, that is what is to be mended
    if is_taken:
        assert (status, last) == (3, f"mend:      {told[0]}")
    else:
        assert status == 0, last
        assert largest_error(result, "multisine_eccentric") < MOST_SIGMAS
    # AND what needs every value refuses the log by the same words, with the row
    with pytest.raises(InputError, match=f"row {row + 1}: one value is far .* {others} of leg 3 at 4 s"):
        make_tare(path, DATA / "unknown_load.toml", tmp_path / "tare.toml", 0.25)


def test_a_few_bad_values_do_not_decide_on_units(clean, tmp_path, capsys):
    # GIVEN a log with forces that are absurd for 25 rows, and displacements beyond the stroke in five: too long, and too
    # near, to be single bad values
    legs, _ = clean["multisine_eccentric"]
    force, displacement = legs["f"].copy(), legs["dl"].copy()
    force[2000:2025, 1] = -1e8
    displacement[3000:3005, 4] = 0.36
    path = tmp_path / "log.csv"
    path.write_text(text_of(legs | {"f": force, "dl": displacement}))
    # WHEN it is replayed THEN it is not refused by another unit or sign
    status, last, _ = replayed(capsys, path, "unknown_load")
    assert status != 2, last


def test_values_that_a_motion_reaches_are_not_stray():
    # GIVEN a channel that rests for 99 % of its rows, then swings, and one of coarse steps at rest
    rows = np.arange(10_000)
    swing = np.where(rows > 9_900, 500.0 * np.sin(0.05 * (rows - 9_900)), 0.0)
    noise = np.random.default_rng(1).normal(size=(len(rows), 6))
    steps = 1e-4 * np.round(0.3 * noise)
    log = LegLog(1e-3 * rows, steps, noise * 1e-3, swing[:, None] + 5.0 * noise)
    # WHEN stray values are looked for THEN there is none
    assert stray.strays_of(log, (1e-4, 1e-3, 5.0)) == []
    # AND a short blow is one, row by row
    log.force_n[5_000:5_004, 3] = 400.0
    assert [(each.row, each.leg) for each in stray.strays_of(log, (1e-4, 1e-3, 5.0))] == [
        (r, 3) for r in range(5000, 5004)
    ]
    assert np.isnan(stray.without(log, stray.strays_of(log)).force_n).sum() == 4


def largest_error(result: dict, log: str) -> float:
    """In sigmas."""
    if log == "paper_noisy":
        truth = np.array([0.3, 25.0, 25.0, 25.0])
    else:
        truth = np.array(json.loads((DATA / f"{log}.truth.json").read_text())["segments"][-1]["theta"])
    return float(np.abs((result["value"][-1] - truth) / result["sigma"][-1]).max())


@pytest.mark.parametrize(
    "verdict, believed",
    [("converged", True), ("converging", True), ("not_excited", True), ("misfit", False), ("inconsistent", False)],
)
def test_what_ends_as_no_model_of_the_machine_is_not_believed(verdict, believed):
    # GIVEN a replay whose channels agree WHEN its last verdict says that machine or log are not the model, however narrow sigma is
    # THEN status and `is_believed` say so: nobody knows that sigma holds
    assert is_believed({"verdict": ["converged", verdict], "input_words": ""}) is believed
    # AND channels that contradict each other are never believed
    assert not is_believed({"verdict": [verdict], "input_words": "leg 3: ..."})


def test_the_document_has_a_row_for_each():
    # GIVEN the document of the log's format WHEN its table is read THEN it has these rows and no others
    document = (SOURCE / "host_sim" / "README.md").read_text(encoding="utf-8")
    table = document.partition("## Wrong logs")[2].partition("## ")[0]
    rows = re.findall(r"^\| (.+) \| ([023]) \| (.+) \|$", table, re.MULTILINE)
    assert rows == [(wrong.what, str(wrong.status), wrong.says) for wrong in WRONG]
    assert len(rows) >= 30
