"""The live page: what it shows of a recorded run is the run, in the browser too, and its buttons reach a controller."""

import io
import os
import socket
import subprocess
import time
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
import viser
from PIL import Image
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from hexload import project
from hexload.io.run_directory import PAPER_PARAMETERS, read_run
from hexload.report.page import write_report
from hexload.theory.bound import THETA_NAMES, rotation_from_rpy
from hexload.view import picture
from hexload.view.body import body_of_estimate, body_of_theta
from hexload.view.live import Live
from hexload.view.page import page_of
from hexload.view.recorded import recording_of_run
from hexload.view.scene import quaternion

SCENARIO = project.SCENARIOS / "multisine.toml"
DURATION_S = 2.0
PATIENCE_S = 60.0
SKIPPED = 77  # SKIP_RETURN_CODE in CMakeLists.txt
PLATFORM_BOX = (0.35, 0.1, 0.7, 0.5)  # of the page, left, top, right, bottom: platform and load
FLOOR_BOX = (0.45, 0.88, 0.6, 0.98)


@pytest.mark.parametrize("silence_s", [0.6, 30.0])
def test_samples_per_second_are_counted_without_the_silence_before_them(monkeypatch, silence_s):
    # GIVEN a listener that hears nothing for a while, then 1 kHz for 1.1 s
    now_s = 100.0
    monkeypatch.setattr("hexload.view.live.time", SimpleNamespace(monotonic=lambda: now_s))
    live = Live("test")
    now_s += silence_s
    for tick in range(1100):
        live.count("samples")
        live.sample(tick, np.zeros(6), np.zeros(6))
        now_s += 1e-3
    # WHEN it is asked for the rate THEN it is that of the samples, to the one at each end
    assert live.rate() == pytest.approx(1000.0, abs=2.0)


@pytest.fixture(scope="module")
def run_directory(tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "multisine"
    options = ["--estimator", "momentum", "--duration", str(DURATION_S), "--quiet"]
    subprocess.run([project.simulator(), SCENARIO, "--out", out, *options], check=True)
    return out


@pytest.fixture(scope="module")
def page(run_directory):
    with closing(page_of(*recording_of_run(run_directory), port=0)) as page:
        yield page


def wait_until(is_so, what):
    until = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < until, f"not within {PATIENCE_S:g} s: {what}"
        time.sleep(0.02)


def go_to(page, moment_s):
    """Until the curves end there."""
    page.player.go_to(moment_s)
    at_end = pytest.approx(moment_s, abs=1e-3)
    wait_until(lambda: (chart := page.chart("hz")) is not None and chart[0][-1] == at_end, "the curves to follow")


def test_the_platform_in_the_scene_stands_where_the_run_has_it(page, run_directory):
    # GIVEN a run WHEN each of some moments is shown
    run = read_run(run_directory)
    home = np.array([0.0, 0.0, page.scene._platform.home_height_m])
    for row in (0, 700, 1400, 2000):
        page.player.go_to(run.truth["t"][row])
        position, rotation = page.scene.pose(page.source.frame().displacement_m)
        # THEN position and attitude are the true ones, but for displacement noise of 20 um (5 sigma, lever below 2)
        truth = [run.truth[name][row] for name in ("x", "y", "z")]
        np.testing.assert_allclose(position - home, truth, atol=5 * 20e-6 * 2)
        rpy = np.array([[run.truth[name][row] for name in ("roll", "pitch", "yaw")]])
        np.testing.assert_allclose(rotation, rotation_from_rpy(rpy)[0], atol=5 * 20e-6 * 2 / 0.4)


def test_the_curve_closes_in_on_the_truth(page):
    # GIVEN a run WHEN it is shown to 0.4 s, and to its end
    gaps, bands = [], []
    for moment_s in (0.4, DURATION_S):
        go_to(page, moment_s)
        _, upper, lower, value, truth, *_ = (column[-1] for column in page.chart("hz"))
        assert truth == pytest.approx(150.0)
        gaps.append(abs(value - truth))
        bands.append(upper - lower)
    # THEN the band has become smaller, and holds the truth
    assert bands[1] < bands[0] / 2
    assert gaps[1] < bands[1] / 2


def test_a_load_change_is_a_line_in_every_curve_and_an_event(page):
    # GIVEN a detected change at 1 s WHEN the run is shown to its end
    recording = page.source
    recording.load_changes_s = (1.0,)
    go_to(page, DURATION_S)
    try:
        # THEN each chart has a line from outside to its upper end there, and the events tell it
        wait_until(lambda: 1.0 in page.chart("m")[0], "the line")
        wait_until(lambda: "another load detected" in page._events.content, "the event")
        for name in THETA_NAMES:
            t, *_, changes, limits = page.chart(name)
            assert changes[t == 1.0].max() == limits.max()
            assert np.delete(changes, np.flatnonzero(t == 1.0)).max() < limits.min()
    finally:
        recording.load_changes_s = ()


def test_the_box_of_a_load_has_its_mass_and_its_tensor():
    # GIVEN a turned homogeneous box of 3 x 2 x 1 m, 12 kg, off O_A, and its theta
    native = project.native_module()
    turn = rotation_from_rpy(np.array([[0.3, -0.2, 0.5]]))[0]
    edges, com = np.array([3.0, 2.0, 1.0]), np.array([0.1, -0.2, 0.3])
    moments = 12.0 / 12.0 * ((edges**2).sum() - edges**2)
    load = native.Load(12.0, com, turn @ np.diag(moments) @ turn.T)
    # WHEN it is described THEN the same box is found, in single precision
    body = body_of_theta(native, load.theta, np.full(10, 1e-3))
    np.testing.assert_allclose(body.com_m, com, rtol=1e-5)
    np.testing.assert_allclose(np.sort(body.box_m), np.sort(edges), rtol=1e-4)
    found = body.box_axes @ np.diag(body.box_m**2) @ body.box_axes.T
    np.testing.assert_allclose(found, turn @ np.diag(edges**2) @ turn.T, atol=1e-3)
    assert np.linalg.norm(quaternion(body.box_axes)) == pytest.approx(1.0)
    # and a load that is the same about x and y, but for noise, has a box along the platform's axes
    nearly = native.Load(12.0, com, np.diag([5.0, 5.1, 13.0]) + 0.05 * (np.eye(3, k=1) + np.eye(3, k=-1)))
    axes = np.abs(body_of_theta(native, nearly.theta, np.full(10, 1e-3)).box_axes)
    np.testing.assert_allclose(axes, np.eye(3), atol=0.01)
    # and of the paper's four parameters the known mass and the height alone are told
    paper = body_of_estimate(native, PAPER_PARAMETERS, np.array([0.3, *moments]), np.full(4, 1e-3), 12.0)
    np.testing.assert_allclose(paper.com_m, [0.0, 0.0, 0.3])
    np.testing.assert_allclose(paper.box_m, edges)


@pytest.mark.parametrize(
    "host, origin, is_let_in",
    [
        (None, "http://{host}", True),
        ("localhost:{port}", "http://localhost:{port}", True),  # and at the end of an ssh tunnel
        (None, None, True),  # a program, not a page
        (None, "https://elsewhere.example", False),
        (None, "http://localhost:1", False),  # another page of this computer
        (None, "null", False),  # a page from a file, or in a frame without rights
        ("elsewhere.example:{port}", "http://elsewhere.example:{port}", False),  # a name that points to 127.0.0.1
    ],
)
def test_no_other_page_of_the_browser_reaches_the_buttons(page, host, origin, is_let_in):
    # GIVEN the live page's server WHEN a page of this origin opens a WebSocket, by this name of the computer
    port = int(page.url.rpartition(":")[2])
    name = (host or "127.0.0.1:{port}").format(port=port)
    origin = origin and origin.format(host=name, port=port)
    status = 101
    with socket.create_connection(("127.0.0.1", port)) as connection:
        options = {"subprotocols": [f"viser-v{viser.__version__}"], "proxy": None}
        try:
            connect(f"ws://{name}", sock=connection, origin=origin, **options).close()
        except InvalidStatus as refused:
            status = refused.response.status_code
    # THEN it is let in when it is the page itself, and refused else
    assert status == (101 if is_let_in else 403)


def crop(png, box):
    image = Image.open(io.BytesIO(png)).convert("RGB")
    size = np.array([*image.size, *image.size])
    return np.asarray(image.crop(tuple((size * box).astype(int))), dtype=int)


@pytest.fixture(scope="module")
def browser():
    """Where there is none the program ends with the status that ctest takes for a skip, as those of CAN without vcan0; with
    CI=true that is a failure."""
    if picture.browser() is None:
        assert os.environ.get("CI", "").lower() in ("", "0", "false"), "CI=true without a browser"
        pytest.exit("found no chromium, expected it for these tests: apt-get install chromium", returncode=SKIPPED)


def test_in_the_browser_the_platform_moves_and_the_floor_stands_still(browser, page, tmp_path):
    # GIVEN the page in headless Chromium
    with picture.opened(page.url, (900, 640)) as tab:
        # WHEN two moments of the run are shown
        pictures = []
        for moment_s in (0.7, 1.4):
            page.player.go_to(moment_s)
            tab.wait_for(f"document.body.innerText.includes('t = {moment_s:.2f} s')")
            tab.wait_for_stillness()
            pictures.append(tab.picture())
            (tmp_path / f"{moment_s}.png").write_bytes(pictures[-1])
    # THEN the middle of the picture, where the platform is, has changed by much, the floor in front of it has not
    before, after = (crop(png, PLATFORM_BOX) for png in pictures)
    assert (np.abs(before - after).max(axis=2) > 60).mean() > 0.02
    before, after = (crop(png, FLOOR_BOX) for png in pictures)
    assert (np.abs(before - after).max(axis=2) > 60).mean() < 0.001
    assert len(np.unique(before)) > 1  # there is a grid


PANELS = "[...document.querySelectorAll('.panel')]"
# A page is laid out first and drawn again in the frame after it.
ARE_DRAWN_IN_THEIR_WIDTH = (
    f"{PANELS}.every(each => each.querySelector('svg').viewBox.baseVal.width === each.clientWidth)"
)


def test_in_the_browser_a_report_draws_every_panel_and_fits_a_narrow_screen(browser, run_directory, tmp_path):
    # GIVEN the report of a run, of ten parameters, NIS, tracking and legs
    page = tmp_path / "report.html"
    write_report([run_directory], page)
    with picture.opened(page.as_uri(), (390, 700), picture.IS_LOADED) as tab:
        # WHEN it is opened on a narrow screen THEN nothing reaches beyond it, and panels stand below each other
        assert tab.evaluate("document.documentElement.scrollWidth") == 390
        assert tab.evaluate(f"new Set({PANELS}.map(each => each.offsetLeft)).size") == 1
        # and every panel has a curve inside its axes, numbers on both, and its time below
        drawn = tab.evaluate(f"{PANELS}.map(each => [each.querySelectorAll('g path').length, each.innerText])")
        assert len(drawn) == 10 + 2 + 12 + 3
        assert all(curves >= 1 and "time, s" in text and "2" in text for curves, text in drawn)
        # and the machine is drawn, in the canvas' own colours
        assert (
            tab.evaluate(
                "new Set(document.querySelector('canvas').getContext('2d').getImageData(0, 0, 300, 250).data).size"
            )
            > 10
        )
        narrow = printed(tab)
        # and whatever time is looked at closer, three numbers or more are below it
        assert min(numbers_of_time(tab, *ends) for ends in ((0.05, 0.45), (0.3, 0.75), (0.1, 0.9), (0.52, 0.6))) >= 3
        # WHEN the screen is wide THEN they stand side by side
        tab.call(
            "Emulation.setDeviceMetricsOverride", width=1200, height=900, deviceScaleFactor=1, mobile=False
        )  # fmt: skip
        tab.wait_for(f"new Set({PANELS}.map(each => each.offsetLeft)).size > 4")
        # and they are printed as from the narrow one
        assert printed(tab) == narrow


def numbers_of_time(tab, begin, end):
    """The fewest of any panel, with the title, after a drag over this part of the axis."""
    tab.evaluate(
        f"""{PANELS}.forEach(each => {{
            const box = each.getBoundingClientRect(), at = share => ({{ clientX: box.left + 52 + share * (box.width - 60), bubbles: true }});
            each.dispatchEvent(new PointerEvent('pointerdown', at({begin})));
            each.dispatchEvent(new PointerEvent('pointerup', at({end})));
        }})"""
    )
    texts = "[...each.querySelectorAll('svg > text[text-anchor=middle]')].filter(text => /\\d/.test(text.textContent)).length"
    found = tab.evaluate(f"{PANELS}.map(each => {texts})")
    tab.evaluate(f"{PANELS}.forEach(each => each.dispatchEvent(new Event('dblclick')))")
    return min(found)


def printed(tab):
    """The panels' measures as they are drawn for paper; they are drawn for the window again afterwards."""
    measures = f"{PANELS}.map(each => each.querySelector('svg').getAttribute('viewBox'))"
    tab.wait_for(ARE_DRAWN_IN_THEIR_WIDTH)
    before = tab.evaluate(measures)
    tab.evaluate("dispatchEvent(new Event('beforeprint'))")
    found = tab.evaluate(measures)
    tab.evaluate("dispatchEvent(new Event('afterprint'))")
    assert tab.evaluate(measures) == before != found
    return found
