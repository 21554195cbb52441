"""`hexload spy`: lcm-spy decodes our channels, on a virtual screen; what it showed is kept as a picture."""

import os
import subprocess
import sys
import time

import lcm
import numpy as np
import pytest
from PIL import Image, ImageGrab

from hexload import project
from lcm_listener import PATIENCE_S, private_url
from loop import PATIENT, SLOW_MACHINE

PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"
TYPES = sorted((project.ROOT / "lcm_types").glob("*.lcm"))
SCREEN = (1600, 1000)
# Where each window goes: left, top, width, height. lcm-spy opens new ones at the upper left, away from the list of channels.
LIST = (800, 0, 800, 600)
SHOWN = {
    "HEXLOAD_ESTIMATE": (0, 0, 790, 490),
    "HEXLOAD_HEALTH": (0, 500, 790, 490),
    "HEXLOAD_LEG_SAMPLE": (800, 610, 395, 380),
    "HEXLOAD_PLATFORM_STATE": (1205, 610, 390, 380),
}
SELF_TEST = "LCM_SELF_TEST"  # the channel on which LCM's own programs say that they have begun
ROW_PX, HEADER_PX = 16, 18
CHANGED_PX = 20  # a few digits


@pytest.fixture
def display(start, monkeypatch, tmp_path, artefacts):
    """A virtual screen; what it shows at the end is kept."""
    number_file = tmp_path / "display"
    with number_file.open("wb") as file:
        screen = "x".join(map(str, SCREEN)) + "x24"
        words = ["Xvfb", "-displayfd", "1", "-screen", "0", screen, "-nolisten", "tcp"]
        server = subprocess.Popen(words, stdout=file, stderr=subprocess.DEVNULL)
    wait_until("no virtual screen", lambda: number_file.read_text().endswith("\n") or server.poll() is not None)
    assert server.poll() is None, "no virtual screen"
    monkeypatch.setenv("DISPLAY", f":{number_file.read_text().strip()}")
    yield
    picture().save(artefacts / "lcm_spy.png")
    server.terminate()
    server.wait()


def wait_until(complaint, is_so, *arguments):
    until = time.monotonic() + PATIENCE_S
    while not is_so(*arguments):
        assert time.monotonic() < until, complaint
        time.sleep(0.1)


def xdotool(*words) -> list[str]:
    result = subprocess.run(["xdotool", *map(str, words)], capture_output=True, text=True)
    return result.stdout.split()


def window(title, patience_s=PATIENCE_S):
    """The window with this title, once it is there; None when it does not come."""
    until = time.monotonic() + patience_s
    while not (found := xdotool("search", "--onlyvisible", "--name", f"^{title}$")):
        if time.monotonic() > until:
            return None
        time.sleep(0.1)
    return found[-1]


def place(identifier, box):
    left, top, width, height = box
    xdotool("windowmove", identifier, left, top, "windowsize", identifier, width, height)


def lists(main, count):
    """Whether the list of channels has that many rows: a row is white, below it the window is grey.

    The program may lay its window out once more after it has shown it, on a slow machine after place().
    """
    place(main, LIST)
    x, y = LIST[0] + 700, LIST[1] + HEADER_PX + ROW_PX * count - ROW_PX // 2
    return picture(x, y, 1, 1).getpixel((0, 0)) == (255, 255, 255)


def hears(main, sender):
    """It subscribes after it has shown its window: what is sent before that has no row."""
    sender.publish(SELF_TEST, b"a row for lcm-spy")
    return lists(main, 1)


def opened(title, row):
    """A double click on a row of the list; to be tried again when the machine was too slow to see one in two clicks."""
    x, y = LIST[0] + 60, LIST[1] + HEADER_PX + ROW_PX * row + ROW_PX // 2
    xdotool("mousemove", x, y, "click", "--repeat", 2, "--delay", 50, 1)
    return window(title, patience_s=3)


def picture(left=0, top=0, width=SCREEN[0], height=SCREEN[1]) -> Image.Image:
    box = (left, top, left + width, top + height)
    return ImageGrab.grab(bbox=box, xdisplay=os.environ["DISPLAY"]).convert("RGB")


def values(box):
    """The right half of a viewer, where the values are."""
    left, top, width, height = box
    return np.asarray(picture(left + width // 2, top, width // 2, height).convert("L"), dtype=int)


def has_changed(box, before):
    return (values(box) != before).sum() >= CHANGED_PX


def test_lcm_spy_decodes_every_type_and_shows_live_values(display, start, ecu, simulator, tmp_path):
    # GIVEN lcm-spy as the user starts it, when it hears
    url = private_url()
    spy = start(sys.executable, "-m", "hexload_dev", "spy", "--url", url)
    spy.wait_for(f"^Found {len(TYPES)} LCM types$")
    main = window("LCM Spy")
    assert main is not None
    sender = lcm.LCM(url)
    wait_until("lcm-spy hears nothing", hears, main, sender)
    # WHEN a run by the clock is on LCM: samples, truth and the controller's answers
    start(ecu, "--feed", f"lcm:{url}", "--platform", PLATFORM, *SLOW_MACHINE).wait_for("ready on LCM")
    options = ["--duration", "3600", "--real-time", "--feed", f"lcm:{url}", "--publish", f"lcm:{url}", *PATIENT]
    start(simulator, project.SCENARIOS / "paper.toml", "--out", tmp_path / "run", *options)
    # the list is in the order of the names: LCM's own comes last
    # no CAN bus, another process estimates, the load stays, and nobody commands the plant
    silent = ("bus_statistics_t", "innovation_t", "load_change_t", "plant_command_t")
    channels = sorted(f"HEXLOAD_{path.stem.removesuffix('_t').upper()}" for path in TYPES if path.stem not in silent)
    rows = [*channels, SELF_TEST]
    wait_until(f"lcm-spy does not list {rows}", lists, main, len(rows))
    # and channels are opened by a double click
    for channel, box in SHOWN.items():
        wait_until(f"no window {channel}", opened, channel, rows.index(channel))
        place(window(channel), box)
    # THEN each shows values that live
    first = {channel: values(box) for channel, box in SHOWN.items()}
    for channel, box in SHOWN.items():
        wait_until(f"no live values in {channel}", has_changed, box, first[channel])


def test_without_a_screen_the_remedy_is_named(start, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    program = start(sys.executable, "-m", "hexload_dev", "spy")
    assert program.wait() == 1
    program.wait_for("^hexload: DISPLAY: found no X display, expected one .* xvfb-run -a tools/hexload spy$")
