"""`hexload view`, and the option --view of demo, sim and replay."""

import os
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from hexload import project
from hexload.errors import InputError
from hexload.estimation.replay import replay_log
from hexload.io.atomic_file import replaced_when_done
from hexload.io.key_file import read_key
from hexload.platform import Platform
from hexload.view.controls import add_controls, add_plant_controls
from hexload.view.frame import Source
from hexload.view.listening import listened_to
from hexload.view.page import PORT, Page, page_of
from hexload.view.recorded import Recording, recording_of_replay, recording_of_run

GUESSED_MASS_KG = 100.0  # where the platform file names none


def recording_of(
    path: Path, platform: Path | None, estimator: str | None, rig: Path | None
) -> tuple[Platform, Recording]:
    """A run directory, or a log that is replayed first."""
    project.ensure_built("hexload_native")
    if path.is_dir():
        if platform is not None or estimator is not None or rig is not None:
            raise InputError(f"{path}: found a run directory with --platform, --estimator or --rig, expected it alone")
        return recording_of_run(path)
    if platform is None:
        raise InputError(f"{path}: found a log and no --platform, expected the platform file that goes with it")
    result = replay_log(path, platform, estimator, None, Path(os.devnull), rig=rig)
    return Platform.of(platform), recording_of_replay(path.name, result)


def show(platform: Platform, source: Source, port: int = PORT) -> None:
    """Until Ctrl-C."""
    with closing(page_of(platform, source, port)) as page:
        tell(page)
        page.wait()


def show_run(directory: Path) -> None:
    """A run directory, played."""
    show(*recording_of(directory, None, None, None))


def show_replay(platform_file: Path, log: Path, result: dict) -> None:
    """`result`: of replay_log()."""
    show(Platform.of(platform_file), recording_of_replay(log.name, result))


def show_picture(platform: Platform, recording: Recording, picture: Path, at_s: float | None) -> None:
    """Writes the page as PNG, at a moment of the recording."""
    from hexload.view.picture import opened

    with replaced_when_done(picture) as file, closing(page_of(platform, recording, 0)) as page:
        page.player.go_to(recording.duration_s if at_s is None else at_s)
        with opened(page.url) as tab:
            tab.wait_for_stillness()
            file.write_bytes(tab.picture())
    print(f"picture: {picture}")


def tell(page: Page) -> None:
    print(f"view:    {page.url}   (Ctrl-C ends)", flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(page.url)


@contextmanager
def live_page(
    platform_file: Path,
    bus: str | None,
    profile: str | None,
    url: str | None,
    port: int = PORT,
    key_file: Path | None = None,
) -> Iterator[Page]:
    """A page that listens on a bus, on LCM, or on both: then the samples are the bus', the truth LCM's. `key_file`: of the
    controller on the bus."""
    project.ensure_built("hexload_native")
    platform = Platform.of(platform_file)
    key = None if key_file is None else read_key(key_file)
    with (
        listened_to(bus, profile, url, platform.native().tick_s, key) as live,
        closing(page_of(platform, live, port)) as page,
    ):
        mass_kg = platform.native().known_mass_kg or GUESSED_MASS_KG
        add_controls(page, live, mass_kg)
        if live.plant is not None:
            add_plant_controls(page, live.plant, mass_kg)
        yield page


def show_live(
    platform_file: Path, bus: str | None, profile: str | None, url: str | None, port: int, key_file: Path | None
) -> None:
    with live_page(platform_file, bus, profile, url, port, key_file) as page:
        tell(page)
        page.wait()


def show_simulation(
    platform_file: Path,
    bus: str | None,
    profile: str | None,
    url: str,
    key_file: Path | None,
    run: Callable[[], Path],
) -> None:
    """Live while it runs; then its recording, with a time slider. `run`: the simulation, returns the run directory."""
    with live_page(platform_file, bus, profile, url, key_file=key_file) as page:
        tell(page)
        wait_for_browser(page)
        directory = run()
        print(directory, flush=True)
        page.play(recording_of(directory, None, None, None)[1])
        page.wait()


def wait_for_browser(page: Page, limit_s: float = 30.0) -> None:
    """A run is not over before anybody looks."""
    until = time.monotonic() + limit_s
    while not page.server.get_clients() and time.monotonic() < until:
        time.sleep(0.1)
