"""The factor that all force sensors have in common, which a run of the empty platform does not tell from its weight.

Sensors that show (1 + g) f show a platform of 1 + g times the mass, the first moments and the inertia, and so does a
platform that is denser than drawn. Errors of a drawing in some of the ten numbers do not agree with one factor, nor do
legs with mass, whose rods the platform carries at its hinges: how much of them there is would be open, too. Where one
factor is all that the run finds, and it is further from 1 than the platform's mass and the sensors are declared to be,
either is a surprise, and the common gain is as open as that.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hexload.estimation.commissioning_run import DOUBT
from hexload.estimation.rig_model import LEGS
from hexload.estimation.rig_regression import SLICES, UNKNOWNS, Found
from hexload.theory.tolerances import GRANTED_SIGMAS

Array = NDArray[np.float64]

WEIGHED = (
    "theta",
    "leg_mass",
    "unlike_legs",
    "stiffness",
    "coulomb",
    "stribeck",
    "viscous",
)  # groups that forces are proportional to
NOISELESS = 1e-10  # of the largest variance: roundings
MEAN = np.zeros(UNKNOWNS)  # of the gains
MEAN[SLICES["gain"]] = 1.0 / LEGS


def common_factor(stated: Array, found: Array, covariance: Array) -> float | None:
    """g of found = (1 + g) stated by generalised least squares, theta of the platform, (10,), with the covariance of what
    is found, (10, 10). None: it is no factor, or none that stands out of the noise."""
    scale = np.sqrt(np.diag(covariance))
    column, change = stated / scale, (found - stated) / scale
    weight = np.linalg.pinv(covariance / np.outer(scale, scale), rcond=NOISELESS, hermitian=True)
    information = column @ weight @ column
    factor = float(column @ weight @ change / information)
    left = change - factor * column
    is_alike = left @ weight @ left < chi2.ppf(1.0 - DOUBT, len(found) - 1)
    return factor if is_alike and factor**2 * information > GRANTED_SIGMAS**2 else None


def tangent_at(factor: float, found: Found) -> Found:
    """What a run of the empty platform says near sensors that show 1 + factor times what they are taken to. There the model
    of rig_model.py has the same forces, exactly, with other numbers, on a curve that the covariance of `found` has as a
    straight line. The gains' mean is as likely as before."""
    scale = np.ones(UNKNOWNS)
    for name in WEIGHED:
        scale[SLICES[name]] = 1.0 / (1.0 + factor)
    scale[SLICES["gain"]] = 1.0 + factor
    value, covariance = scale * found.value, found.covariance * np.outer(scale, scale)
    value[SLICES["gain"]] += factor
    return replace(found, value=value - factor * _follow(covariance), covariance=covariance)


def with_common_gain(covariance: Array, open_gain: float) -> Array:
    """(UNKNOWNS, UNKNOWNS). An empty run tells nothing of the gains' mean, so that it is as open as that; what follows it,
    follows."""
    follow = _follow(covariance)
    return covariance + (open_gain**2 - MEAN @ covariance @ MEAN) * np.outer(follow, follow)


def _follow(covariance: Array) -> Array:
    """What the unknowns change by with the gains' mean, (UNKNOWNS,); none where that is fixed."""
    variance = MEAN @ covariance @ MEAN
    return covariance @ MEAN / variance if variance > 0.0 else np.zeros(UNKNOWNS)
