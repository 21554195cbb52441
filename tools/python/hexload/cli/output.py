"""What a verb prints: its summary, with --json its figures for programs, with --quiet nothing. Errors are always told.
And its exit status, where what it has written is there and not to be believed."""

import io
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

IMPLAUSIBLE = 3  # of replay: the estimates; of platform: the file


@contextmanager
def said(as_json: bool, quiet: bool) -> Iterator[None]:
    """While a verb works: its summary goes nowhere with --json and --quiet, with the latter its progress neither."""
    if quiet:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    elif as_json:
        with redirect_stdout(io.StringIO()):
            yield
    else:
        yield


@contextmanager
def told(as_json: bool, quiet: bool) -> Iterator[dict]:
    """said(), and then, with --json, what the verb has put into the dict."""
    figures: dict = {}
    with said(as_json, quiet):
        yield figures
    if as_json:
        print_json(figures)


def print_json(figures: object) -> None:
    """One object, indented; SI units; null for what is no number."""
    print(json.dumps(plain(figures), indent=2, ensure_ascii=False))


def plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
