"""Headless Chromium over its DevTools protocol: the page as a picture, and what a user would do in it."""

import base64
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from websockets.sync.client import ClientConnection, connect

from hexload.errors import ToolFailed

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SIZE_PX = (1440, 810)
PAGE_PX = (1200, 1760)
LIMIT_S = 60.0  # a busy machine draws slowly
OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # the page is our own; containers run as root
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--no-first-run",
    "--remote-debugging-port=0",
)


# The page is drawn: viser fades its canvas in.
IS_DRAWN = """(() => {
    const canvases = [...document.querySelectorAll('canvas')];
    return canvases.some(c => c.width > 0) && canvases.every(c => getComputedStyle(c).opacity === '1');
})()"""
IS_LOADED = "location.protocol !== 'about:' && document.readyState === 'complete'"  # not the empty page before it
# What tells of the browser's software renderer, over the picture.
CLOSE_NOTES = "document.querySelectorAll('.mantine-Notification-closeButton').forEach(button => button.click())"


class Tab:
    """A page in the browser."""

    def __init__(self, connection: ClientConnection):
        self._connection = connection
        self._last = 0

    def call(self, method: str, **parameters) -> dict:
        self._last += 1
        self._connection.send(json.dumps({"id": self._last, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._connection.recv(timeout=LIMIT_S))
            if answer.get("id") == self._last:
                if "error" in answer:
                    raise ToolFailed(f"chromium: {method}: {answer['error'].get('message')}")
                return answer["result"]

    def evaluate(self, script: str):
        return self.call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def wait_for(self, script: str, limit_s: float = LIMIT_S) -> None:
        """Until the script's value is true. Raises ToolFailed."""
        until = time.monotonic() + limit_s
        while not self.evaluate(script):
            if time.monotonic() > until:
                raise ToolFailed(f"chromium: found no {script} within {limit_s:g} s")
            time.sleep(0.05)

    def wait_for_stillness(self, limit_s: float = LIMIT_S) -> None:
        """Until two pictures in a row are the same. Raises ToolFailed."""
        until, before = time.monotonic() + limit_s, b""
        while (now := self.picture()) != before:
            if time.monotonic() > until:
                raise ToolFailed(f"chromium: the page still changes after {limit_s:g} s")
            before = now
            time.sleep(0.4)

    def picture(self) -> bytes:
        """PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])


def browser() -> str | None:
    return next((path for name in BROWSERS if (path := shutil.which(name))), None)


@contextmanager
def opened(url: str, size_px: tuple[int, int] = SIZE_PX, is_drawn: str = IS_DRAWN) -> Iterator[Tab]:
    """The page in headless Chromium, drawn: `is_drawn` is a script that says so. Raises ToolFailed when there is no browser, or it does not start."""
    program = browser()
    if program is None:
        raise ToolFailed("found no chromium, expected it for pictures: apt-get install chromium")
    with tempfile.TemporaryDirectory(prefix="hexload-browser-", ignore_cleanup_errors=True) as profile:
        log = Path(profile) / "log"
        size = f"--window-size={size_px[0]},{size_px[1]}"
        command = [program, *OPTIONS, size, f"--user-data-dir={profile}", url]
        with log.open("w") as output:
            process = subprocess.Popen(command, stdout=output, stderr=output)
        try:
            with connect(_address_of_tab(log, url), max_size=None) as connection:
                tab = Tab(connection)
                tab.call(
                    "Emulation.setDeviceMetricsOverride",
                    width=size_px[0], height=size_px[1], deviceScaleFactor=1, mobile=False,
                )  # fmt: skip
                tab.wait_for(is_drawn)
                tab.evaluate(CLOSE_NOTES)
                yield tab
        finally:
            process.terminate()
            process.wait()


def write_page_picture(page: Path, picture: Path, size_px: tuple[int, int] = PAGE_PX) -> None:
    """The upper part of a report as PNG, its animated view at the end of the run. Raises ToolFailed."""
    with opened(page.absolute().as_uri(), size_px, IS_LOADED) as tab:
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
        tab.call("Page.reload")
        tab.wait_for(IS_LOADED)
        tab.wait_for_stillness()
        picture.write_bytes(tab.picture())


def _address_of_tab(log: Path, url: str) -> str:
    from urllib.request import urlopen

    until = time.monotonic() + LIMIT_S
    while time.monotonic() < until:
        if said := re.search(r"DevTools listening on ws://([^/\s]+)/", log.read_text(errors="replace")):
            with urlopen(f"http://{said[1]}/json/list") as answer:
                tabs = json.load(answer)
            for tab in tabs:
                if tab["type"] == "page" and tab["url"].startswith(url):
                    return tab["webSocketDebuggerUrl"]
        time.sleep(0.05)
    raise ToolFailed(f"chromium: found no page within {LIMIT_S:g} s: {log.read_text(errors='replace')[-300:]}")
