"""What else an engineer might use on the same log: regressions on the equations of motion of leg_regression."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.io.log_file import LegLog
from hexload.theory.bound import Platform
from hexload.theory.leg_regression import inner, regression

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Answer:
    theta: Array  # (10,)
    covariance: Array  # (10, 10), by the method's own textbook formula
    history: Array | None = None  # (n, 10), of methods that go along with the time
    nis: Array | None = None  # (n,), of filters


def baselines(log: LegLog, platform: Platform, prior_sigma: Array, force_sigma_n: float) -> dict[str, Answer]:
    """The answers by name of the method. RLS starts from the momentum filter's own prior."""
    raw = regression(log, platform, "none").rows()
    smooth = regression(log, platform, "zero_phase")
    instruments = regression(log, platform, "zero_phase", speeds="displacement")
    rows = inner(log.t_s)
    matrix, force = smooth.matrix[rows].reshape(-1, 10), smooth.force_n[rows].ravel()
    causal = regression(log, platform, "causal")
    return {
        "ls_raw": least_squares(*raw),
        "ls_zero_phase": least_squares(matrix, force),
        "rls": recursive_least_squares(causal.matrix, causal.force_n, prior_sigma, force_sigma_n),
        "tls": total_least_squares(matrix, force),
        "iv": instrumental_variables(matrix, force, instruments.matrix[rows].reshape(-1, 10)),
    }


def least_squares(matrix: Array, values: Array) -> Answer:
    """min |A theta - b|. Columns are scaled to length 1 first: kg and kg m^2 differ."""
    length = np.linalg.norm(matrix, axis=0)
    q, r = np.linalg.qr(matrix / length)
    inverse = np.linalg.inv(r) / length[:, None]
    theta = inverse @ (q.T @ values)
    return Answer(theta, _residual_variance(matrix, values, theta) * inverse @ inverse.T)


def recursive_least_squares(matrix: Array, values: Array, prior_sigma: Array, sigma: float) -> Answer:
    """Least squares tick by tick, without forgetting, from theta = 0 with the given sigmas; A is (n, k, 10)."""
    theta = np.zeros(len(prior_sigma))
    covariance = np.diag(prior_sigma**2)
    noise = sigma**2 * np.eye(matrix.shape[1])
    history = np.empty((len(values), len(theta)))
    for tick, (a, b) in enumerate(zip(matrix, values, strict=True)):
        cross = a @ covariance
        gain = np.linalg.solve(cross @ a.T + noise, cross).T
        theta = theta + gain @ (b - a @ theta)
        covariance = covariance - gain @ cross
        covariance = 0.5 * (covariance + covariance.T)
        history[tick] = theta
    return Answer(theta, covariance, history)


def total_least_squares(matrix: Array, values: Array) -> Answer:
    """Errors in A and b alike, once all columns are scaled to length 1.

    G. H. Golub, C. F. van Loan, SIAM J. Numerical Analysis 17(6), 1980.
    """
    length = np.append(np.linalg.norm(matrix, axis=0), np.linalg.norm(values))
    _, singular, axes = np.linalg.svd(np.column_stack([matrix, values]) / length, full_matrices=False)
    scaled = -axes[-1, :-1] / axes[-1, -1]
    variance = singular[-1] ** 2 / len(values)
    normal = (matrix / length[:-1]).T @ (matrix / length[:-1])
    covariance = variance * (1.0 + scaled @ scaled) * np.linalg.inv(normal)
    to_theta = length[-1] / length[:-1]
    return Answer(scaled * to_theta, covariance * np.outer(to_theta, to_theta))


def instrumental_variables(matrix: Array, values: Array, instruments: Array) -> Answer:
    """theta = (Z^T A)^-1 Z^T b, free of bias when the noise in Z is not that in A."""
    length = np.linalg.norm(instruments, axis=0)
    z, a = instruments / length, matrix / length
    inverse = np.linalg.inv(z.T @ a) / length[:, None]
    theta = inverse @ (z.T @ values)
    return Answer(theta, _residual_variance(matrix, values, theta) * inverse @ (z.T @ z) @ inverse.T)


def _residual_variance(matrix: Array, values: Array, theta: Array) -> float:
    residual = values - matrix @ theta
    return float(residual @ residual) / (len(values) - len(theta))
