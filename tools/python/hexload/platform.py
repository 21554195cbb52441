"""The machine, from a platform file or its tables, for the firmware and for the formulas."""

from __future__ import annotations

import copy
import json
import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hexload import project
from hexload.errors import InputError
from hexload.io.toml_document import read_toml, to_toml
from hexload.theory import bound

Kind = Literal["momentum", "momentum_effects", "paper"]
Prior = Literal["safe", "printed"]


@dataclass(frozen=True)
class Platform:
    """A platform file's tables, checked by the firmware's own reader: geometry, platform, environment, sensors, load,
    estimator. Keys and units: README, "Platform file"; SI throughout."""

    tables: Mapping[str, Any]
    source: str = "platform"  # names it in errors

    @classmethod
    def of(cls, platform: Platform | Mapping[str, Any] | Path | str) -> Platform:
        """A platform as it is, of a file, or of a dict like a parsed file; its arrays may be numpy's.

        Raises InputError with file or key, what was found and what is expected.
        """
        if isinstance(platform, Platform):
            return platform
        if isinstance(platform, Mapping):
            made = cls(json.loads(json.dumps(platform, default=_plain)))
        else:
            made = cls(_read(Path(platform)), str(platform))
        made.native()
        return made

    def with_estimator(self, kind: Kind | None = None, prior: Prior | None = None) -> Platform:
        """The same machine with another estimator, or another start covariance of the paper's filter."""
        tables = copy.deepcopy(dict(self.tables))
        wanted = {"kind": kind, "prior": prior}
        tables["estimator"] = tables.get("estimator", {}) | {key: word for key, word in wanted.items() if word}
        return Platform(tables, self.source)

    def native(self) -> Any:
        """hexload_native.Platform. Raises InputError."""
        with tempfile.TemporaryDirectory(prefix="hexload-") as folder:
            path = Path(folder) / "platform.toml"
            try:
                path.write_text(to_toml(dict(self.tables)), encoding="utf-8")
                native = project.native_module().load_platform(str(path))
            except ValueError as error:
                raise InputError(str(error).replace(str(path), self.source)) from None
        native.source = self.source
        return native

    def theory(self) -> bound.Platform:
        """For hexload.theory."""
        return bound.platform_of(dict(self.tables))


def _plain(value: object) -> object:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise InputError(f"platform: found {type(value).__name__} as a value, expected numbers, words or lists of them")


def _read(path: Path) -> dict:
    try:
        return read_toml(path)
    except FileNotFoundError:
        raise InputError(f"{path}: found no such file, expected a platform file (.toml)") from None
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: found no valid TOML ({error}), expected a platform file") from None
