"""A bar on a terminal's stderr for logs that take a while."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hexload.io.log_file import Progress

LONG_BYTES = 30_000_000  # some two seconds of work


@contextmanager
def progress_of(log: Path) -> Iterator[Progress | None]:
    """What is to be told the bytes read of `log`; None: it is short, or nobody looks."""
    size = log.stat().st_size if log.is_file() else 0
    if size < LONG_BYTES or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(log.name, total=size)
        yield lambda done: bar.update(task, completed=done)
