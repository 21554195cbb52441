"""Kinematics of the legs: their vectors, the Jacobian, and the pose that their lengths have.

Base hinges, and places of O_A, count from one origin, whichever it is; arrays carry the tick as their first axis.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEGS = 6
NEWTON_STEPS_MAX = 15
CONVERGED_M = 1e-9


def leg_vectors(base_hinges_m: Array, platform_hinges_m: Array, place_m: Array, rotation: Array) -> Array:
    """From lower to upper hinge, (n, 6, 3), base axes, of O_A at `place_m`, (n, 3), and R, (n, 3, 3)."""
    return place_m[:, None] + np.einsum("nij,lj->nli", rotation, platform_hinges_m) - base_hinges_m


def jacobian_of(base_hinges_m: Array, place_m: Array, vectors_m: Array) -> Array:
    """Leg speeds per twist of the platform in base axes, (n, 6, 6), rows [e, R a x e]. `vectors_m`: of leg_vectors()."""
    e = vectors_m / np.linalg.norm(vectors_m, axis=2, keepdims=True)
    return np.concatenate([e, np.cross(vectors_m + base_hinges_m - place_m[:, None], e)], axis=2)


def poses(
    base_hinges_m: Array, platform_hinges_m: Array, lengths_m: Array, place_m: Array, rotation: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Place of O_A, (n, 3), and R, (n, 3, 3), of leg lengths, (n, 6), by Newton's method from a start near them, all rows at
    once; and whether a row has got there, (n,): not where its legs fit no pose."""
    for _ in range(NEWTON_STEPS_MAX):
        vectors = leg_vectors(base_hinges_m, platform_hinges_m, place_m, rotation)
        excess = np.linalg.norm(vectors, axis=2) - lengths_m
        fits = (np.abs(excess) < CONVERGED_M).all(axis=1)
        is_lost = ~np.isfinite(excess).all(axis=1)
        if (fits | is_lost).all():
            break
        step = np.linalg.solve(jacobian_of(base_hinges_m, place_m, vectors), excess[:, :, None])[:, :, 0]
        place_m = place_m - step[:, :3]
        rotation = rotation_of_vector(-step[:, 3:]) @ rotation
    return place_m, rotation, fits


def rotation_of_vector(vector_rad: Array) -> Array:
    """Rodrigues' formula: (n, 3, 3) of rotation vectors (n, 3)."""
    angle = np.linalg.norm(vector_rad, axis=1)[:, None, None]
    cross = cross_matrix(vector_rad)
    sine, versine = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.eye(3) + sine * cross + versine * cross @ cross


def vector_of_rotation(rotation: Array) -> Array:
    """Axis times angle of R, (n, 3, 3) to (n, 3), of less than half a turn."""
    sine = 0.5 * (rotation - np.swapaxes(rotation, 1, 2))[:, [2, 0, 1], [1, 2, 0]]  # times the axis
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    return sine * np.where(size > 0.0, angle / np.where(size > 0.0, size, 1.0), 1.0)[:, None]


def cross_matrix(vector: Array) -> Array:
    """[a]x with [a]x b = a x b, (..., 3, 3)."""
    matrix = np.zeros((*vector.shape[:-1], 3, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -vector[..., 2], vector[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = vector[..., 2], -vector[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -vector[..., 1], vector[..., 0]
    return matrix
