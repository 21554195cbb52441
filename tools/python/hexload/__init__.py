"""Identifies the load of a Gough-Stewart platform: the firmware's estimators on numpy arrays.

    import hexload
    log = hexload.read_log("log.csv")                       # or any arrays t (n,), dl, vl, f (n, 6), SI
    load = hexload.identify(log.t_s, log.displacement_m, log.velocity_m_s, log.force_n, "platform.toml")
    print(load["m"], load.body["cz"], load.verdict)

Estimator takes samples one by one; replay and identify take a log; tare finds what the empty platform is beyond its
file; diagnose names what in a log contradicts itself or the model; excite finds a motion that identifies a load; crlb bounds what any estimator can find. Parameters are
theta = [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz] about O_A in platform axes, h = m c; SI units throughout.
Refused input raises InputError, which names file, line or key, what was found and what is expected.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexload.diagnosis.arrays import diagnose
    from hexload.diagnosis.diagnose import Diagnosis
    from hexload.diagnosis.finding import Finding
    from hexload.errors import InputError
    from hexload.estimation.estimator import (
        Body,
        Estimate,
        Estimator,
        Identification,
        Replay,
        identify,
        replay,
        unit_of,
    )
    from hexload.estimation.motion import Excitation, crlb, excite
    from hexload.estimation.tare import tare
    from hexload.io.log_file import read_log
    from hexload.platform import Platform
    from hexload.theory.bound import THETA_NAMES, Trajectory

# Imported when first used: tools that need one of them do not wait for the others.
_HOME = {
    "diagnose": "diagnosis.arrays",
    "Diagnosis": "diagnosis.diagnose",
    "Finding": "diagnosis.finding",
    "InputError": "errors",
    "Body": "estimation.estimator",
    "Estimate": "estimation.estimator",
    "Estimator": "estimation.estimator",
    "Identification": "estimation.estimator",
    "Replay": "estimation.estimator",
    "identify": "estimation.estimator",
    "replay": "estimation.estimator",
    "unit_of": "estimation.estimator",
    "Excitation": "estimation.motion",
    "crlb": "estimation.motion",
    "excite": "estimation.motion",
    "tare": "estimation.tare",
    "read_log": "io.log_file",
    "Platform": "platform",
    "THETA_NAMES": "theory.bound",
    "Trajectory": "theory.bound",
}

__all__ = [
    "THETA_NAMES",
    "Body",
    "Diagnosis",
    "Estimate",
    "Estimator",
    "Excitation",
    "Finding",
    "Identification",
    "InputError",
    "Platform",
    "Replay",
    "Trajectory",
    "crlb",
    "diagnose",
    "excite",
    "identify",
    "read_log",
    "replay",
    "tare",
    "unit_of",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'hexload' has no attribute '{name}'")
    return getattr(importlib.import_module(f"hexload.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
