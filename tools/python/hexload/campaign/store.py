"""The folder of a campaign: one file per finished case, written whole or not at all, so that a campaign can go on."""

import dataclasses
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from hexload.campaign.cases import Case
from hexload.errors import InputError
from hexload.io.atomic_file import replaced_when_done

SETTINGS = "campaign.json"
PART = re.compile(r"\..+\.\d+\.part")  # of hexload.io.atomic_file, left by a process that was killed


class AnyCase(Protocol):
    """A frozen dataclass of what defines a case."""

    @property
    def name(self) -> str:
        """Of its file; no two cases of a campaign share it."""


class AnySettings(Protocol):
    """A frozen dataclass."""

    def cases(self) -> Sequence[AnyCase]: ...


@dataclass(frozen=True)
class Settings:
    classes: tuple[str, ...]
    runs: int
    seed: int
    duration_s: float
    tick_s: float = 1e-3

    def cases(self) -> list[Case]:
        seeds = range(self.seed, self.seed + self.runs)
        return [Case(name, seed, self.duration_s, self.tick_s) for name in self.classes for seed in seeds]


class Store:
    def __init__(self, folder: Path):
        self.folder = folder
        self._results = folder / "cases"

    def open(self, settings: AnySettings, code: str, restart: bool) -> list[str]:
        """Makes the folder one of this campaign; returns what there is to say of what it held.

        Raises InputError when the results of another version of the code are in it, unless they are to be done again; and
        then when other files stand among them.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f"{self.folder}: found a file, expected a folder for the campaign, or none yet")
        if self.folder.is_dir() and any(self.folder.iterdir()) and not (self.folder / SETTINGS).is_file():
            raise InputError(
                f"{self.folder}: found other files and no {SETTINGS}, expected a campaign's folder, or none yet"
            )
        remarks = self._compare(settings, code, restart) if (self.folder / SETTINGS).is_file() else []
        self._results.mkdir(parents=True, exist_ok=True)
        if restart:
            names = {f"{case.name}.json" for case in settings.cases()}
            delete(own_files(self._results, lambda path: path.name in names or _is_result(path)))
        _write_json(self.folder / SETTINGS, {"code": code, **asdict(settings)})
        return remarks

    def _compare(self, settings: AnySettings, code: str, restart: bool) -> list[str]:
        path = self.folder / SETTINGS
        try:
            before = json.loads(path.read_text())
            found = {name: before[name] for name in ("code", *asdict(settings))}
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path}: found no settings of a campaign, expected those that hexload campaign writes"
            ) from None
        if found["code"] != code and not restart:
            raise InputError(
                f"{path}: found results of code {found['code']}, expected {code}, the version that runs now: "
                "take another --out, or do all cases again with --restart"
            )
        changes = [
            f"{name} was {found[name]}, is {value}"
            for name, value in json.loads(json.dumps(asdict(settings))).items()
            if found[name] != value
        ]
        return [f"the campaign in {self.folder} has changed: {'; '.join(changes)}"] if changes else []

    def split(self, cases: Sequence[AnyCase], code: str) -> tuple[dict[AnyCase, dict], list[str]]:
        """The cases that are done, and remarks on results that cannot be used and are done again."""
        done, remarks = {}, []
        for case in cases:
            path = self._path(case)
            if not path.is_file():
                continue
            fault = None
            try:
                result = json.loads(path.read_text())
                if result["code"] != code or result["case"] != asdict(case):
                    fault = f"it is of code {result['code']} and {result['case']}"
            except (ValueError, KeyError, TypeError):
                fault = "it is not whole"
            if fault is None:
                done[case] = result
            else:
                remarks.append(f"{path}: done again, as {fault}")
        return done, remarks

    def write(self, case: AnyCase, result: dict) -> None:
        _write_json(self._path(case), result)

    def _path(self, case: AnyCase) -> Path:
        return self._results / f"{case.name}.json"


def own_files(folder: Path, is_own: Callable[[Path], bool]) -> list[Path]:
    """The files of a folder in a campaign's, all of which must be its own. Raises InputError for what is not."""
    if folder.is_symlink():
        raise InputError(f"{folder}: found a link, expected the campaign's own folder: nothing outside it is deleted")
    paths = sorted(folder.iterdir()) if folder.is_dir() else []
    for path in paths:
        if path.is_symlink() or not path.is_file() or not is_own(path):
            raise InputError(
                f"{path}: found what this campaign has not written, expected its own files alone: nothing is deleted; "
                "move it away, or take another --out"
            )
    return paths


def delete(paths: list[Path]) -> None:
    for path in paths:
        path.unlink()


def _is_result(path: Path) -> bool:
    """Whether it is a case's, or what an interrupted writing of one has left."""
    if PART.fullmatch(path.name):
        return True
    try:
        return path.suffix == ".json" and {"code", "case"} <= json.loads(path.read_text()).keys()
    except (ValueError, AttributeError):
        return False


def plain(value: object) -> object:
    """For JSON: dataclasses as their fields, arrays as lists, what is not finite as null."""
    if dataclasses.is_dataclass(value):
        return plain({field.name: getattr(value, field.name) for field in dataclasses.fields(value)})
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(entry) for entry in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value


def _write_json(path: Path, content: dict) -> None:
    with replaced_when_done(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
