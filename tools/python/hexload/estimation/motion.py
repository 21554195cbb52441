"""Motions that identify a load, and the bound on what they can tell, for a platform as users give it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload.errors import InputError
from hexload.estimation.estimator import PlatformLike
from hexload.platform import Platform
from hexload.theory import bound
from hexload.theory.bound import THETA_NAMES, Sigmas, Trajectory

if TYPE_CHECKING:
    from hexload.theory.excitation import Limits

Array = NDArray[np.float64]

PRIOR_SCALES = 10.0  # nothing is known beforehand: a sigma of ten times each parameter's scale
ROW_S = 1e-3


@dataclass(frozen=True)
class Excitation:
    """A motion of O_A from rest at home to rest at home."""

    t_s: Array  # (n,)
    pose: Array  # (n, 6): x, y, z in m from home; roll, pitch, yaw in rad
    relative_bound: Array  # (10,): Cramer-Rao bound after the motion, as shares of the parameters' scales


def excite(
    platform: PlatformLike,
    theta: ArrayLike,
    limits: Limits,
    *,
    duration_s: float = 10.0,
    sines: int = 8,
    frequency_max_hz: float = 2.5,
    seed: int = 1,
    starts: int = 4,
    iterations: int = 100,
) -> Excitation:
    """The motion within the limits whose worst relative bound on the ten parameters is smallest.

    platform          a platform file, its tables as a dict, or a Platform
    theta             (10,) parameters of the expected load, in the order of THETA_NAMES, SI, with a mass
    limits            hexload.theory.excitation.Limits: stroke, m; leg speed and their sum, m/s; leg force with this
                      load, N; tilt, rad; condition of the Jacobian at most, distance to singularity at least, 0 or more
    duration_s        run-in and run-out included, 1 to 120
    sines             frequencies in each of the six coordinates, up to frequency_max_hz
    seed, starts, iterations   random starts of the search, and steps of the best at most

    The same seed gives the same motion. Raises InputError. Needs scipy: pip install "hexload[excite]".
    Source: the first lines of hexload.theory.excitation.
    """
    from hexload.theory.excitation import Basis, Problem, fitted, optimise, relative_bound, trajectory_of

    load = _theta(theta)
    scale = bound.scale_of(load)
    if scale is None or not (scale > 0.0).all():
        raise InputError(
            "theta: found a load without mass, centre of mass or inertia, expected one to compare errors with"
        )
    if not 1.0 <= duration_s <= 120.0 or not 1.0 / duration_s < frequency_max_hz:
        raise InputError(
            f"duration_s: found {duration_s:g} with frequency_max_hz {frequency_max_hz:g}, expected 1 to 120 s and a "
            "frequency of more than 1 / duration_s"
        )
    described = Platform.of(platform)
    native = described.native()
    problem = Problem(
        platform=described.theory(),
        home_leg_length_m=np.asarray(native.home_leg_length_m),
        length_m=float(np.linalg.norm(native.platform_hinges_m, axis=1).mean()),
        limits=limits,
        sigmas=Sigmas(native.velocity_sigma_m_s, native.force_sigma_n),
        theta=load,
        heaviest_theta=load,
        scale=scale,
        prior_sigma=PRIOR_SCALES * scale,
        duration_s=duration_s,
        frequencies_hz=np.geomspace(max(0.2, 1.0 / duration_s), frequency_max_hz, sines),
    )
    coefficients = fitted(problem, optimise(problem, seed, starts, iterations, lambda _: None), ROW_S)
    basis = Basis(problem, ROW_S)
    motion = basis.motion(coefficients)
    return Excitation(basis.t_s, motion[:, :6], relative_bound(problem, trajectory_of(motion)))


def crlb(
    platform: PlatformLike,
    motion: Trajectory,
    theta: ArrayLike,
    *,
    prior_sigma: ArrayLike | None = None,
    parameters: Literal["ten", "paper"] = "ten",
    dt_s: float = 1e-3,
) -> Array:
    """Posterior Cramer-Rao bound: no unbiased estimator has a smaller standard deviation, on average over runs.

    platform     a platform file, its tables as a dict, or a Platform; its [sensors] are the noise
    motion       true motion of O_A, one row per tick of dt_s: hexload.Trajectory(p (n, 3) m, R (n, 3, 3), v (n, 3) m/s,
                 w (n, 3) rad/s), base axes
    theta        (10,) true load, in the order of THETA_NAMES, SI
    prior_sigma  (10,), or (4,) of the paper's parameters: what is known before; None: ten times each parameter's scale
    parameters   "ten", or "paper" for (dz, Ixx, Iyy, Izz) at known mass

    Returns (n, 10) or (n, 4), SI, after each tick; 10,000 ticks take about a second. Raises InputError.
    Source: P. Tichavsky, C. Muravchik, A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998.
    """
    load = _theta(theta)
    described = Platform.of(platform)
    native = described.native()
    if prior_sigma is None:
        scale = bound.scale_of(load)
        if parameters != "ten" or scale is None:
            raise InputError(
                "prior_sigma: found none, expected it for the paper's parameters and for an empty platform"
            )
        prior_sigma = PRIOR_SCALES * scale
    sigmas = Sigmas(native.velocity_sigma_m_s, native.force_sigma_n)
    try:
        return bound.crlb(described.theory(), motion, load, sigmas, prior_sigma, parameters, dt_s)
    except ValueError as error:
        raise InputError(str(error)) from None


def _theta(theta: ArrayLike) -> Array:
    load = np.asarray(theta, float)
    if load.shape != (len(THETA_NAMES),) or not np.isfinite(load).all():
        raise InputError(f"theta: found shape {load.shape}, expected ({len(THETA_NAMES)},) finite numbers")
    return load
