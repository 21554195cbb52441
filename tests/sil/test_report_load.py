"""The page of an estimate of all ten parameters, of a run and of a replayed log: numbers and words of the terminal."""

import base64
import html
import json
import re
import subprocess

import pytest

from hexload import project
from hexload.campaign.one_case import scale_of
from hexload.cli.replay import print_summary
from hexload.errors import InputError
from hexload.estimation import load_summary
from hexload.estimation.replay import replay_log
from hexload.io.run_directory import read_run
from hexload.report.page import write_report

DATA = project.ROOT / "tests" / "data"
UNKNOWN = DATA / "unknown_load.toml"
SCENARIO = f"""\
name = "rubbing"
platform = "{UNKNOWN}"

[simulation]
duration_s = 3.0
seed = 5

[[load]]
at_s = 0.0
mass_kg = 250.0
com_m = [0.02, 0.01, 0.2]
inertia_com_kg_m2 = [12.0, 13.0, 10.0, 0.5, 0.3, 0.2]

[[load]]
at_s = 1.5
mass_kg = 400.0
com_m = [0.06, -0.04, 0.3]
inertia_com_kg_m2 = [25.0, 30.0, 20.0, 1.0, -2.0, 0.5]

[trajectory]
kind = "multisine"

[hydraulics]
coulomb_friction_n = 80.0
viscous_friction_n_s_m = 200.0

[sensors]
force_bias_n = [40.0, -25.0, 60.0, -70.0, 15.0, 30.0]
"""


def rows_of(page: str) -> list[list[str]]:
    """The cells of every row of every table, as text."""
    rows = re.findall(r"<tr\b.*?</tr>", re.sub(r"<script\b.*?</script>", "", page, flags=re.DOTALL), flags=re.DOTALL)
    cells = [re.findall(r"<t[dh]\b[^>]*>(.*?)</t[dh]>", row, flags=re.DOTALL) for row in rows]
    return [[html.unescape(re.sub(r"<[^>]+>", " ", cell)).strip() for cell in row] for row in cells]


def words_of(page: str) -> str:
    bare = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", bare)))


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The directories of a run by each momentum filter."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "scenario.toml").write_text(SCENARIO)
    for kind in ("momentum_effects", "momentum"):
        options = ["--out", folder / kind, "--estimator", kind, "--quiet"]
        subprocess.run([project.simulator(), folder / "scenario.toml", *options], check=True)
    return folder


@pytest.fixture(scope="module")
def page(runs):
    write_report([runs / "momentum_effects"], runs / "page.html")
    return (runs / "page.html").read_text()


@pytest.fixture(scope="module")
def early(tmp_path_factory):
    """A replay of the start of a log, when some parameters are not known, and its page."""
    folder = tmp_path_factory.mktemp("early")
    whole = DATA / "paper_noisy.csv.gz"
    lines = subprocess.run(["gzip", "-dc", whole], capture_output=True, text=True, check=True).stdout.splitlines()
    (folder / "early.csv").write_text("\n".join(lines[:552]) + "\n")
    out, report = folder / "estimates.csv", folder / "page.html"
    result = replay_log(folder / "early.csv", UNKNOWN, "momentum_effects", None, out, report=report)
    return result, report.read_text()


def test_the_page_of_a_run_has_truth_estimate_error_and_verdict(runs, page):
    # GIVEN a run of all ten parameters WHEN its page is written THEN each row of the table has the run's own numbers
    run = read_run(runs / "momentum_effects")
    rows = {row[0]: row[1:] for row in rows_of(page) if len(row) == 8}
    theta = run.theta(run.estimates["t"])[-1]
    for k, name in enumerate(("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")):
        unit = "kg" if name == "m" else "kg m" if name[0] == "h" else "kg m²"
        truth, value, sigma, own, percent, sigmas, verdict = rows[f"{name}, {unit}"]
        last = run.estimates[name][-1]
        assert float(truth) == pytest.approx(theta[k], abs=1e-4)
        digits = len(sigma.partition(".")[2])  # two digits of sigma, and no more of the value
        assert 9.5 <= float(sigma) * 10**digits < 99.5 or digits == 4
        half = 0.5 * 10.0**-digits + 1e-4
        assert (float(value), float(sigma)) == pytest.approx((last, run.estimates[f"s_{name}"][-1]), abs=half)
        assert 0.0 < float(own) <= float(sigma) + half
        assert float(percent) == pytest.approx(100 * abs(last - theta[k]) / scale_of(theta)[k], abs=1e-3)
        assert float(sigmas) == pytest.approx((last - theta[k]) / run.estimates[f"s_{name}"][-1], abs=0.06)
        assert verdict in ("converged", "converging")
    # AND when the new load was detected is told
    assert "It has detected another load at 1.50" in words_of(page)


def test_the_page_of_a_run_has_the_body_and_the_machines_effects_beside_the_truth(page):
    # GIVEN the same page WHEN its other tables are read THEN centre of mass and central tensor are those of the
    # scenario, and the estimates are within the four sigmas beside them
    rows = [row for row in rows_of(page) if len(row) == 4]
    body = {row[0]: [float(cell) for cell in row[1:]] for row in rows if re.match(r"c[xyz], m|I.., kg", row[0])}
    assert body["cz, m"][0] == 0.3 and body["Ixz, kg m²"][0] == -2.0
    assert len(body) == 9
    for truth, value, sigma in body.values():
        assert abs(value - truth) < 4 * sigma
    # AND so are biases and friction, leg by leg
    machine = [row for row in rows_of(page) if len(row) == 8 and row[1] in ("true", "identified", "sigma")]
    assert [row[0] for row in machine if row[0]] == ["force bias, N", "Coulomb friction, N", "viscous friction, N s/m"]
    assert machine[0][2:] == ["40", "-25", "60", "-70", "15", "30"]
    for true, identified, sigma in zip(*(machine[start::3] for start in range(3)), strict=True):
        for leg in range(2, 8):
            assert abs(float(identified[leg]) - float(true[leg])) < 5 * float(sigma[leg])


def test_the_page_is_whole_and_loads_nothing(page):
    # GIVEN the page WHEN read THEN all sections and figures are there, identifiers are unique, no tag has an address
    for heading in ("Ten parameters", "The load as a body", "Force bias and friction", "Estimates against the truth",
                    "Consistency of the filter", "Tracking", "Leg signals", "Configuration"):  # fmt: skip
        assert f">{heading}</h2>" in page
    for figure in ("estimates", "nis", "tracking", "legs", "coupling"):
        assert f'id="run-1-{figure}-figure"' in page
    identifiers = re.findall(r'<[a-z0-9]+\b[^>]*\bid="([^"]+)"', page)
    assert len(identifiers) == len(set(identifiers))
    assert set(re.findall(r'href="#([^"]+)"', page)) <= set(identifiers)
    assert re.findall(r"<(?:script|img|iframe|link|source|object|embed)\b[^>]*\b(?:src|href|data)\s*=", page) == []


def test_the_load_change_is_marked_in_every_curve_over_time(runs, page):
    # GIVEN a run whose load changes WHEN the panels of its page are read
    (detected_s,) = read_run(runs / "momentum_effects").meta["load_changes_detected_s"]
    charts = re.findall(r'<script type="application/json">(\[.*?)</script>', page, flags=re.DOTALL)
    panels = [panel for chart in charts for panel in json.loads(chart)]
    # THEN each of ten parameters, twice, two of NIS, twelve of tracking and three of legs has the mark
    assert [panel["marks"][0][0] for panel in panels] == [pytest.approx(detected_s)] * (20 + 2 + 12 + 3)
    # and each says what is across
    assert {panel["xt"] for panel in panels} == {"time, s"}


def test_the_page_has_an_animated_view_and_is_small(page):
    # GIVEN the page WHEN its view of the run is read
    (data,) = re.findall(r'<script type="application/json">(\{"base.*?)</script>', page, flags=re.DOTALL)
    view = json.loads(data)
    # THEN it has a pose in each of its frames and its words of the mass, in some kB; and the page is below 2 MB
    assert len(base64.b64decode(view["pose"]["v"])) == 2 * 6 * view["frames"]
    assert re.match(r"m = (399|400)\.\d+ ± 0\.\d+ kg \(3σ\), ", view["words"][-1]) and len(data) < 60_000
    assert len(page.encode()) < 2e6


def test_the_page_of_a_replay_says_what_the_terminal_says(early, tmp_path, capsys, monkeypatch):
    # GIVEN the replay of a log's start, when no body can have what is estimated and friction hides some of it
    result, page = early
    assert not result["body"]["is_consistent"] and result["confounded"]
    # WHEN terminal and page are read
    monkeypatch.setenv("COLUMNS", "200")
    print_summary(result, tmp_path / "estimates.csv")
    terminal, words = capsys.readouterr().out, words_of(page)
    # THEN each verdict stands in both in the same words, with its reason once
    assert any(terminal.count(words) == 1 for _, words in load_summary.reasons(load_summary.parameters(result)))
    for parameter in load_summary.parameters(result):
        assert parameter.words in terminal and parameter.words in words
        assert words.count(parameter.words) == 1 or parameter.words == parameter.verdict
        assert f"{parameter.value:z.{parameter.digits}f}" in terminal
    assert "not excited: friction and load cannot be separated" in words
    # AND what is said of the body, with the nearest consistent parameters
    assert load_summary.consistent_in_words(result["body"]) in terminal
    assert load_summary.consistent_in_words(result["body"]) in words
    rows = {row[0]: row[1:] for row in rows_of(page) if len(row) == 4}
    for number in load_summary.body_numbers(result["body"]):
        expected = [f"{value:z.{number.digits}f}" for value in (number.value, number.sigma, number.nearest)]
        assert rows[f"{number.name}, {number.unit}"] in (expected, [*expected[:2], "converged"])
        assert expected[2] in words and expected[2] in terminal


def test_a_page_without_truth_has_no_place_for_it(early):
    _, page = early
    for words in ("true value", "Tracking", "Configuration", "Furthest off"):
        assert words not in words_of(page)


def test_runs_of_several_filters_share_a_page(runs, tmp_path):
    # GIVEN runs with and without the machine's effects WHEN one page is written of both
    write_report([runs / "momentum_effects", runs / "momentum"], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    # THEN they are compared, and the one that knows of no friction is far off
    assert "2 runs side by side" in page
    first, second = (row for row in rows_of(page) if len(row) == 15 and row[0] == "rubbing")
    assert max(float(cell) for cell in first[3:13]) < 1.0 < max(float(cell) for cell in second[3:13])
    for row, kind in ((first, "momentum_effects"), (second, "momentum")):
        assert (row[1], row[-1]) == (kind, read_run(runs / kind).verdict.replace("_", " "))
    assert 'id="run-1-estimates-figure"' in page and 'id="run-2-estimates-figure"' in page


def test_a_replay_by_the_papers_filter_has_a_page_of_its_four_parameters(tmp_path):
    # GIVEN the paper's filter, which has no ten parameters and no body WHEN a replay writes its page
    log, machine, report = DATA / "paper_noisy.csv.gz", DATA / "paper_load.toml", tmp_path / "page.html"
    result = replay_log(log, machine, "paper", None, tmp_path / "estimates.csv", report=report)
    page = report.read_text()
    # THEN it has the four with the replay's last numbers, and no place for what is not known
    rows = {row[0]: row[1:] for row in rows_of(page) if len(row) == 5}
    assert [name.split(",")[0] for name in rows][1:5] == ["Δz", "Ixx", "Iyy", "Izz"]
    assert float(rows["Ixx, kg m²"][0]) == pytest.approx(result["value"][-1][1], abs=0.01)
    assert 'id="run-1-estimates-figure"' in page and "The load as a body" not in words_of(page)


def test_one_file_for_two_answers_is_refused(tmp_path):
    same = tmp_path / "same"
    with pytest.raises(InputError, match="found the same file for --bodies and --report, expected two"):
        replay_log(DATA / "paper_noisy.csv.gz", UNKNOWN, None, None, tmp_path / "e.csv", bodies=same, report=same)
    assert list(tmp_path.iterdir()) == []
