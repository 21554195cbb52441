"""What a verb writes never takes the place of what the same call reads, nor of another of its outputs."""

from collections.abc import Iterable
from pathlib import Path

from hexload.errors import InputError


def keep(read: Iterable[Path | None], written: Iterable[Path | None]) -> None:
    """Before anything is read or written. Raises InputError with the path; None: not given."""
    taken = {path.resolve(): "a file that this call reads" for path in read if path is not None}
    for path in written:
        if path is None:
            continue
        if (what := taken.get(path.resolve())) is not None:
            raise InputError(f"{path}: found {what}, expected another name to write")
        taken[path.resolve()] = "another file that this call writes"
