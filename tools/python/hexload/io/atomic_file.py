"""Files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from hexload.errors import InputError


@contextmanager
def replaced_when_done(path: Path) -> Iterator[Path]:
    """Yields a temporary name beside `path`; when the block ends well, and the disk has what was written, renames it to
    `path`, else removes it. What is no file, such as /dev/null or a pipe, is written to as it is: a file in its place would be another thing."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: cannot be written, found no folder {path.parent}, expected an existing one")
    if path.is_dir():
        raise InputError(f"{path}: cannot be written, found a folder, expected a file name")
    if path.exists() and not path.is_file():
        yield path
        return
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        _sync(temporary)  # a power cut after the renaming would leave an empty file where the old one was
        temporary.replace(path)
        _sync(path.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written, {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def replaced_or_none(path: Path | None) -> AbstractContextManager[Path | None]:
    """The same of a file that is not always wanted."""
    return nullcontext() if path is None else replaced_when_done(path)
