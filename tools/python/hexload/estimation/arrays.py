"""Leg samples as arrays: what is given is checked and named before the firmware sees it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload.errors import InputError
from hexload.io.log_file import LegLog
from hexload.theory.kinematics import LEGS


def leg_log(t: ArrayLike, dl: ArrayLike, vl: ArrayLike | None, f: ArrayLike) -> LegLog:
    """t (n,) in s, strictly increasing, n >= 2; dl, vl, f (n, 6) in m, m/s, N, nan where one is missing; vl None, or nan
    throughout: no velocity sensors. Raises InputError."""
    t_s = np.ascontiguousarray(t, float)
    if t_s.ndim != 1 or len(t_s) < 2:
        raise InputError(f"t: found shape {t_s.shape}, expected (n,) with at least 2 rows")
    shape = (len(t_s), LEGS)
    displacement, force = _with_gaps("dl", dl, shape), _with_gaps("f", f, shape)
    velocity = np.full(shape, np.nan) if vl is None else _with_gaps("vl", vl, shape)
    late = np.flatnonzero(~(np.diff(t_s) > 0.0))
    if late.size or not np.isfinite(t_s).all():
        row = int(late[0]) + 1 if late.size else 0
        raise InputError(f"t: row {row}: found {t_s[row]:.9g}, expected finite times, each later than the one before")
    return LegLog(t_s, displacement, velocity, force)


def one_sample(dl: ArrayLike, vl: ArrayLike | None, f: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """(6,) each, in m, m/s, N; vl None: no velocity sensors. Not a number is left to the firmware, which refuses it.
    Raises InputError."""
    vl = np.full(LEGS, np.nan) if vl is None else vl
    return tuple(_shaped(name, values, (LEGS,)) for name, values in (("dl", dl), ("vl", vl), ("f", f)))


def _with_gaps(name: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = _shaped(name, values, shape)
    _finite(name, np.where(np.isnan(array), 0.0, array), shape)
    return array


def _finite(name: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = _shaped(name, values, shape)
    wrong = np.argwhere(~np.isfinite(array))
    if wrong.size:
        row, leg = wrong[0]
        raise InputError(f"{name}: row {row}, leg {leg + 1}: found {array[row, leg]}, expected a finite number")
    return array


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, float)
    if array.shape != shape:
        raise InputError(f"{name}: found shape {array.shape}, expected {shape}")
    return array
