"""The report: one page that needs no network, says what the run says, and is never half written."""

import re
import subprocess
import sys

import pytest

from hexload.errors import InputError
from hexload.io.run_directory import read_run
from hexload.io.run_files import FILES
from hexload.report.page import write_report
from synthetic_run import write_run


@pytest.fixture(scope="module")
def run_directory(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("runs") / "synthetic")


@pytest.fixture(scope="module")
def page(run_directory, tmp_path_factory):
    out = tmp_path_factory.mktemp("page") / "report.html"
    write_report([run_directory], out)
    return out.read_text()


def text_of(page):
    """The words of the page, without scripts, styles and tags."""
    bare = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", bare))


def test_the_page_loads_nothing_from_a_network(page):
    # WHEN the tags that can load something are collected THEN none of them names an address
    markup = re.sub(r"<script\b[^>]*>.*?</script>", "<script></script>", page, flags=re.DOTALL)
    assert re.findall(r"<(?:script|img|iframe|link|source|object|embed)\b[^>]*\b(?:src|href|data)\s*=", page) == []
    assert "@import" not in markup and "url(" not in markup
    # and the page itself forbids its browser to load anything
    assert "Content-Security-Policy\" content=\"default-src 'none';" in page


def test_the_page_has_every_section_and_figure(page):
    for heading in (
        "Table 3: truth, paper, this run, bound",
        "Estimates against the truth",
        "Where the paper's claim does not hold, and why",
        "Consistency of the filter",
        "Tracking",
        "Leg signals",
        "Coupling matrix (19) at home",
        "Configuration",
    ):
        assert f">{heading}</h2>" in page
    for figure in ("estimates", "nis", "tracking", "legs", "coupling"):
        assert f'id="run-1-{figure}-figure"' in page


def test_each_identifier_of_the_page_is_unique(page):
    identifiers = re.findall(r'<[a-z0-9]+\b[^>]*\bid="([^"]+)"', page)
    assert len(identifiers) == len(set(identifiers))


def test_the_page_quotes_the_papers_table_and_this_runs_numbers(page):
    text = text_of(page)
    for printed in ("0.2978", "0.73", "25.94", "3.76", "24.75", "1.00", "28.20", "12.80"):
        assert printed in text
    assert "25.25" in text  # the run's last Ixx


def test_the_page_says_where_the_claim_fails_with_this_runs_numbers(page):
    text = text_of(page)
    assert "The trajectory commands no tilt at all" in text
    assert "roll 0.0081° and pitch 0.0081° rms" in text  # 2e-4 rad / sqrt(2)
    assert "the ratio is 1.57" in text
    assert "7.9 sigmas" in text  # 25 / sqrt(10)


def test_the_page_warns_of_a_run_that_the_filter_calls_inconsistent(tmp_path, page):
    # GIVEN a run at whose end the filter does not trust itself
    run = write_run(tmp_path / "run", rows=200, last_verdict="inconsistent")
    # WHEN its page is written THEN the summary says not to use the values; a run in order has no such words
    write_report([run], tmp_path / "page.html")
    warning = "its values are not to be used"
    assert warning in text_of((tmp_path / "page.html").read_text())
    assert warning not in text_of(page)


def test_the_page_names_the_health_bits_that_were_set(page):
    text = text_of(page)
    assert "not_excited in 12 ticks. 0 samples were missing, 0 refused." in text
    assert "leg_out_of_range" not in text


def test_the_page_shows_the_platform_file_as_text(page):
    assert "home_leg_length_m = 0.8741" in page


def test_markup_in_a_description_is_shown_not_executed(tmp_path):
    # GIVEN a run whose description has a script
    run = write_run(tmp_path / "run", rows=200, description="<script>alert(1)</script>")
    # WHEN the page is written THEN the description is escaped
    write_report([run], tmp_path / "page.html")
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in (tmp_path / "page.html").read_text()


def test_several_runs_share_one_page_with_a_comparison(tmp_path, run_directory):
    # GIVEN two runs
    other = write_run(tmp_path / "other", rows=200, seed=2, name="other")
    # WHEN one page is written of both
    write_report([run_directory, other], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    # THEN it compares them, has the figures of both, and the library once
    assert "2 runs side by side" in page
    assert 'id="run-1-nis-figure"' in page and 'id="run-2-nis-figure"' in page
    assert page.count("Draws every chart of the page") == 1


def test_a_run_with_the_same_bytes_gives_the_same_page(tmp_path):
    # GIVEN the same run written twice
    pages = []
    for name in ("a", "b"):
        write_report([write_run(tmp_path / name, rows=200)], tmp_path / f"{name}.html")
        pages.append((tmp_path / f"{name}.html").read_text())
    # THEN the pages are equal
    assert pages[0] == pages[1]


@pytest.mark.parametrize("missing", FILES)
def test_a_run_directory_without_one_of_its_files_is_refused(tmp_path, missing):
    # GIVEN a run directory that lost a file
    run = write_run(tmp_path / "run", rows=200)
    (run / missing).unlink()
    # WHEN it is read THEN the message names the file
    with pytest.raises(InputError, match=re.escape(f"{run}: found no {missing}, expected the files")):
        read_run(run)


def test_a_table_without_a_column_is_refused(tmp_path):
    run = write_run(tmp_path / "run", rows=200)
    path = run / "estimates.csv"
    path.write_text(path.read_text().replace("s_Iyy", "sigma", 1))
    with pytest.raises(InputError, match=re.escape(f"{path}: line 1: found no column s_Iyy, expected t,dz,")):
        read_run(run)


def test_a_table_with_a_word_for_a_number_is_refused_with_line_and_column(tmp_path):
    run = write_run(tmp_path / "run", rows=200)
    path = run / "truth.csv"
    lines = path.read_text().splitlines()
    lines[4] = lines[4].replace(lines[4].split(",")[1], "left", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=re.escape(f"{path}: line 5: column x: found 'left', expected a number")):
        read_run(run)


def test_a_table_with_a_short_row_is_refused_with_its_line(tmp_path):
    run = write_run(tmp_path / "run", rows=200)
    path = run / "truth.csv"
    lines = path.read_text().splitlines()
    lines[9] = "0.008,1"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=re.escape(f"{path}: line 10: found 2 values, expected 37")):
        read_run(run)


def test_broken_metadata_is_refused(tmp_path):
    run = write_run(tmp_path / "run", rows=200)
    (run / "meta.json").write_text("{")
    with pytest.raises(InputError, match=re.escape(f"{run}/meta.json: found no valid JSON (")):
        read_run(run)


def test_metadata_without_a_key_is_refused(tmp_path):
    run = write_run(tmp_path / "run", rows=200)
    (run / "meta.json").write_text('{"name": "x"}')
    with pytest.raises(InputError, match=re.escape(f"{run}/meta.json: found no key description, expected name,")):
        read_run(run)


def test_a_refused_run_leaves_an_older_page_as_it_was(tmp_path):
    # GIVEN a page of an earlier run, and a run directory that is not complete
    out = tmp_path / "page.html"
    out.write_text("earlier")
    run = write_run(tmp_path / "run", rows=200)
    (run / "truth.csv").unlink()
    # WHEN the verb is run THEN it ends with status 2, one line, and nothing is written
    result = subprocess.run(
        [sys.executable, "-m", "hexload_dev", "report", run, "--out", out], capture_output=True, text=True
    )
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1 and "found no truth.csv" in result.stderr
    assert out.read_text() == "earlier"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.html", "run"]


def test_a_page_in_a_folder_that_does_not_exist_is_refused(tmp_path, run_directory):
    with pytest.raises(InputError, match="found no folder .*nowhere, expected an existing one"):
        write_report([run_directory], tmp_path / "nowhere" / "page.html")
