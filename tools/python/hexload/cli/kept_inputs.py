"""What a verb writes never takes the place of what the same call reads, nor, without --force, of what took long to get."""

from collections.abc import Iterable
from pathlib import Path

from hexload.errors import InputError


def keep(read: Iterable[Path | None], written: Iterable[Path | None]) -> None:
    """Before anything is read or written. Raises InputError with the path; None: not given."""
    inputs = {path.resolve() for path in read if path is not None}
    for path in written:
        if path is not None and path.resolve() in inputs:
            raise InputError(f"{path}: found a file that this call reads, expected another name to write")


def refuse_existing(written: Iterable[Path | None], force: bool) -> None:
    """Before anything is read or written. Raises InputError with the path; what is no file, as a pipe, is none that is lost."""
    for path in written:
        if path is not None and path.is_file() and not force:
            raise InputError(f"{path}: found it already there, expected a new file, or --force to replace it")
