"""The page: one server on this computer alone, one source at a time, drawn 30 times a second whatever comes in."""

import contextlib
import io
import logging
import threading
import time

import viser

from hexload import project
from hexload.errors import ToolFailed
from hexload.platform import Platform
from hexload.view import words
from hexload.view.curves import CurvePanel
from hexload.view.frame import Source
from hexload.view.recorded import Recording
from hexload.view.same_origin import same_origin_only
from hexload.view.scene import Scene

HOST = "127.0.0.1"  # nobody else may press the buttons
PORT = 8080
PERIOD_S = 1.0 / 30.0
WORDS_PERIOD_S = 0.2  # curves and texts
SPEEDS = ("0.1", "0.25", "1", "4")


class Page:
    """Shows `source` until `close`. Buttons that command a live source are added by `controls`."""

    def __init__(self, platform: Platform, source: Source, port: int = PORT):
        logging.getLogger("websockets").setLevel(logging.CRITICAL)  # a browser that hangs up is no news
        with contextlib.redirect_stdout(io.StringIO()), same_origin_only():  # without its banner
            self.server = viser.ViserServer(HOST, port, label="hexload", verbose=False)
        self.url = f"http://{HOST}:{self.server.get_port()}"
        self.source = source
        self._drawn: tuple | None = None
        self._ended = threading.Event()
        self._lock = threading.Lock()  # source and its parts of the page change together
        native = project.native_module()
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(340)
        gui.set_panel_label(f"hexload: {source.title}")
        self.scene = Scene(self.server, native, platform.native(), source.force_range_n)
        self._player: _Player | None = None
        self._curves: CurvePanel | None = None
        self._status = gui.add_html("")
        self.controls_folder = gui.add_folder("Controls", visible=False)
        self._player_folder = gui.add_folder("Time", visible=False)
        with gui.add_folder("Events"):
            self._events = gui.add_html("")
        with gui.add_folder("Health"):
            self._health = gui.add_html("")
        with gui.add_folder("Legend"):
            colour = gui.add_dropdown("Legs show", ("force", "stroke margin"))
            self._legend = gui.add_html("")
        colour.on_update(lambda _: setattr(self.scene, "leg_colour", colour.value))
        self.play(source)
        self._drawer = threading.Thread(target=self._draw_on, daemon=True)
        self._drawer.start()

    def play(self, source: Source) -> None:
        """From now on this source is shown."""
        with self._lock:
            self.source = source
            self.server.gui.set_panel_label(f"hexload: {source.title}")
            if isinstance(source, Recording):
                self._player_folder.visible, self.controls_folder.visible = True, False
                with self._player_folder:
                    self._player = _Player(self.server, source)
            self._draw(with_words=True)

    @property
    def player(self) -> "_Player | None":
        return self._player

    def chart(self, name: str):
        """What the chart of this parameter shows: t, upper, lower, value, truth, load changes. None: no estimate yet."""
        with self._lock:
            return None if self._curves is None else self._curves.data(name)

    def _draw_on(self) -> None:
        last_words = before = time.monotonic()
        while not self._ended.wait(max(0.0, before + PERIOD_S - time.monotonic())):
            now = time.monotonic()
            with self._lock:
                if self._player is not None and self.server.get_clients():  # it plays for somebody
                    self._player.advance(now - before)
                with_words = now - last_words >= WORDS_PERIOD_S
                self._draw(with_words)
            last_words = now if with_words else last_words
            before = now

    def _draw(self, with_words: bool) -> None:
        frame = self.source.frame()
        if frame.force_n is not None:
            self.scene.widen(frame.force_n)
        drawn = (id(self.source), frame.t_s, self.scene.legend())
        with self.server.atomic():
            if drawn != self._drawn:  # what stands still costs the browser nothing
                self.scene.show(frame)
                self._drawn = drawn
            if not with_words:
                return
            _set(self._status, words.status(frame))
            _set(self._events, words.events(self.source.events()))
            _set(self._health, words.health(self.source.health()))
            _set(self._legend, words.legend(*self.scene.legend(), frame.truth is not None))
            curves = self.source.curves()
            if curves is None:
                return
            if self._curves is None or self._curves.names != curves.names:
                if self._curves is not None:
                    self._curves.remove()
                self._curves = CurvePanel(self.server, curves.names)
            self._curves.show(curves)

    def wait(self) -> None:
        """Until Ctrl-C, which is how a look at a page ends."""
        with contextlib.suppress(KeyboardInterrupt):
            self._drawer.join()

    def close(self) -> None:
        self._ended.set()
        self._drawer.join()
        del self.scene  # has objects of the native module, which is gone before the server's buttons are
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()


class _Player:
    """Slider, play and speed of a recording."""

    def __init__(self, server: viser.ViserServer, recording: Recording):
        self._recording = recording
        self.is_playing = True
        gui = server.gui
        self._slider = gui.add_slider("t, s", 0.0, recording.duration_s, 0.001, 0.0)
        self._button = gui.add_button("Pause")
        self._speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1")
        self._button.on_click(lambda _: self._toggle())
        self._slider.on_update(lambda event: None if event.client is None else self.go_to(self._slider.value))

    def _toggle(self) -> None:
        if not self.is_playing and self._recording.t_s >= self._recording.duration_s:
            self._recording.t_s = 0.0
        self._set_playing(not self.is_playing)

    def _set_playing(self, playing: bool) -> None:
        self.is_playing = playing
        self._button.label = "Pause" if playing else "Play"

    def go_to(self, t_s: float) -> None:
        """Stops there."""
        self._set_playing(False)
        self._recording.t_s = min(max(t_s, 0.0), self._recording.duration_s)

    def advance(self, elapsed_s: float) -> None:
        recording = self._recording
        if self.is_playing:
            recording.t_s = min(recording.t_s + elapsed_s * float(self._speed.value), recording.duration_s)
            if recording.t_s >= recording.duration_s:
                self._set_playing(False)
        if abs(self._slider.value - recording.t_s) > 5e-4:
            self._slider.value = round(recording.t_s, 3)


def _set(html: viser.GuiHtmlHandle, content: str) -> None:
    if html.content != content:
        html.content = content


def page_of(platform: Platform, source: Source, port: int = PORT) -> Page:
    """Raises ToolFailed when the port cannot be opened."""
    try:
        return Page(platform, source, port)
    except OSError as error:
        raise ToolFailed(f"{HOST}:{port}: found no way to open it ({error}), expected a free port: --port") from None
