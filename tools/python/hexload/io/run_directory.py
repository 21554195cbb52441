"""Reader of the run directory that hexload_sim writes: what was run, the truth, the sensors, the estimates."""

import csv
import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.io.log_file import LegLog, read_log
from hexload.io.run_files import FILES
from hexload.theory.bound import THETA_NAMES

POSE = ("x", "y", "z", "roll", "pitch", "yaw")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
REFERENCE = tuple(f"ref_{name}" for name in POSE)
PAPER_PARAMETERS = ("dz", "Ixx", "Iyy", "Izz")

Columns = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Run:
    directory: Path
    scenario_toml: str
    platform_toml: str
    platform: dict  # parsed platform_toml
    meta: dict
    log: LegLog
    truth: Columns  # t, POSE, TWIST, REFERENCE; SI, base axes
    estimates: Columns  # t, PAPER_PARAMETERS or THETA_NAMES, each with s_ (one standard deviation), nis
    verdict: str  # of the last tick

    @property
    def name(self) -> str:
        return self.meta["name"]

    @property
    def is_of_paper(self) -> bool:
        """The estimator is the paper's, of four parameters; else it has all ten."""
        return self.meta["estimator"]["kind"] == "paper"

    @property
    def final_load(self) -> dict:
        return self.meta["loads"][-1]

    def load_parameters(self, t_s: NDArray[np.float64]) -> Columns:
        """True dz, Ixx, Iyy, Izz (about the load's own centre of mass) at each time; steps where the load changes."""
        values = np.array([[load["com_m"][2], *load["inertia_com_kg_m2"][:3]] for load in self.meta["loads"]])
        return dict(zip(PAPER_PARAMETERS, values[self._load_at(t_s)].T))

    def theta(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """The true ten parameters at each time, (n, 10)."""
        return theta_at(self.meta["loads"], t_s)

    def _load_at(self, t_s: NDArray[np.float64]) -> NDArray[np.int64]:
        return _row_of_load(self.meta["loads"], t_s)


def theta_at(loads: list[dict], t_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """The true ten parameters at each time, (n, 10). `loads`: of a run's meta.json."""
    return np.array([load["theta"] for load in loads])[_row_of_load(loads, t_s)]


def _row_of_load(loads: list[dict], t_s: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.maximum(np.searchsorted([load["at_s"] for load in loads], t_s + 1e-9, side="right") - 1, 0)


def read_run(directory: Path) -> Run:
    """Raises InputError when `directory` is not a complete run directory."""
    if not directory.is_dir():
        raise InputError(f"{directory}: found no such folder, expected a run directory written by `hexload sim`")
    for name in FILES:
        if not (directory / name).is_file():
            raise InputError(f"{directory}: found no {name}, expected the files {', '.join(FILES)}")
    platform_toml = (directory / "platform.toml").read_text(encoding="utf-8")
    truth, _ = _read_columns(directory / "truth.csv", ("t", *POSE, *TWIST, *REFERENCE), ())
    meta = _read_meta(directory / "meta.json")
    names = PAPER_PARAMETERS if meta["estimator"]["kind"] == "paper" else THETA_NAMES
    sigmas = tuple(f"s_{name}" for name in names)
    estimates, texts = _read_columns(directory / "estimates.csv", ("t", *names, *sigmas, "nis"), ("verdict",))
    return Run(
        directory=directory,
        scenario_toml=(directory / "scenario.toml").read_text(encoding="utf-8"),
        platform_toml=platform_toml,
        platform=_parse_toml(directory / "platform.toml", platform_toml),
        meta=meta,
        log=read_log(directory / "log.csv"),
        truth=truth,
        estimates=estimates,
        verdict=texts["verdict"][-1],
    )


def _parse_toml(path: Path, text: str) -> dict:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: found no valid TOML ({error}), expected the platform of a run") from None


def _read_meta(path: Path) -> dict:
    expected = (
        "name",
        "description",
        "version",
        "seed",
        "duration_s",
        "tick_s",
        "rows",
        "missing",
        "refused",
        "loads",
        "sensors",
        "estimator",
        "coupling_matrix_home",
        "health_ticks",
    )
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{path}: found no valid JSON ({error}), expected the metadata of a run") from None
    for key in expected:
        if key not in meta:
            raise InputError(f"{path}: found no key {key}, expected {', '.join(expected)}")
    return meta


def _read_columns(path: Path, numbers: tuple[str, ...], texts: tuple[str, ...]) -> tuple[Columns, dict[str, list[str]]]:
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    header = rows[0] if rows else []
    for name in (*numbers, *texts):
        if name not in header:
            raise InputError(f"{path}: line 1: found no column {name}, expected {','.join((*numbers, *texts))}")
    if len(rows) < 3:
        raise InputError(f"{path}: found {max(len(rows) - 1, 0)} rows after the header, expected at least 2")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise InputError(f"{path}: line {number}: found {len(row)} values, expected {len(header)}")
    columns = dict(zip(header, zip(*rows[1:])))
    return {name: _to_floats(path, name, columns[name]) for name in numbers}, {
        name: list(columns[name]) for name in texts
    }


def _to_floats(path: Path, name: str, fields: tuple[str, ...]) -> NDArray[np.float64]:
    try:
        return np.array(fields, dtype=np.float64)
    except ValueError:
        pass
    for number, field in enumerate(fields, start=2):
        try:
            float(field)
        except ValueError:
            raise InputError(f"{path}: line {number}: column {name}: found '{field}', expected a number") from None
    raise AssertionError("numpy refused a column in which every field is a number")
