"""A load as a body to be drawn: where its centre of mass is, how sure that is, and the box that has its inertia."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from hexload.io.run_directory import PAPER_PARAMETERS
from hexload.theory.bound import THETA_NAMES

Array = NDArray[np.float64]
ROUGHEST = 2.0  # radii of the platform: a centre or a box that is farther or larger tells nothing
SAME_MOMENT = 0.02  # of the sum of the three: closer ones count as the same


@dataclass(frozen=True)
class Body:
    """In platform axes. `box_m` is None where no box has these moments of inertia."""

    mass_kg: float
    com_m: Array  # (3,)
    com_sigma_m: Array  # (3,), along the platform's axes
    box_m: Array | None  # (3,) edges of the homogeneous box with this mass and tensor
    box_axes: Array  # (3, 3), its edges' directions in columns


def body_of_theta(native: ModuleType, theta: Array, sigma: Array) -> Body | None:
    """By the firmware's own hexload_body_describe(), with the parameters' errors taken as independent: only the sigmas
    are on the bus. None: there is no centre of mass to tell."""
    found = native.describe_body(theta, np.diag(sigma**2))
    if not found["has_com"]:
        return None
    entries = found["inertia_kg_m2"] if found["has_inertia"] else np.full(6, np.nan)
    return _body(found["mass_kg"], found["com_m"], found["com_sigma_m"], entries)


def body_of_estimate(
    native: ModuleType, names: tuple[str, ...], value: Array, sigma: Array, known_mass_kg: float | None
) -> Body | None:
    if names[:4] == PAPER_PARAMETERS:
        if not known_mass_kg:
            return None
        com, spread = (np.array([0.0, 0.0, numbers[0]]) for numbers in (value, sigma))
        return _body(known_mass_kg, com, spread, np.array([*value[1:4], 0.0, 0.0, 0.0]))
    count = len(THETA_NAMES)
    return body_of_theta(native, value[:count], sigma[:count])


def _principal(tensor: Array) -> tuple[Array, Array]:
    """Moments and axes, right-handed. Of moments that are nearly the same, whose axes noise would choose, the axes are
    those next to the platform's."""
    moments, axes = np.linalg.eigh(tensor)
    begins = [0, *(np.flatnonzero(np.diff(moments) > SAME_MOMENT * moments.sum()) + 1), len(moments)]
    for first, end in zip(begins, begins[1:]):
        shares = axes[:, first:end] @ axes[:, first:end].T  # what of the platform's axes lies in these directions
        nearest = np.sort(np.argsort(-np.diag(shares), kind="stable")[: end - first])
        left, _, right = np.linalg.svd(shares[:, nearest], full_matrices=False)
        axes[:, first:end] = left @ right
    return moments, axes * np.sign(np.linalg.det(axes))


def _body(mass_kg: float, com: Array, com_sigma: Array, entries: Array) -> Body:
    xx, yy, zz, xy, xz, yz = entries
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass_kg <= 0.0 or not np.isfinite(tensor).all():
        return Body(mass_kg, np.asarray(com), np.asarray(com_sigma), None, np.eye(3))
    moments, axes = _principal(tensor)
    # I1 = m (b^2 + c^2) / 12 and so on, solved for the edges.
    squares = 6.0 / mass_kg * (moments.sum() - 2.0 * moments)
    box = np.sqrt(squares) if (squares > 0.0).all() else None
    return Body(mass_kg, np.asarray(com), np.asarray(com_sigma), box, axes)
