"""Which causes explain what a free load leaves of the leg forces: forward selection by likelihood.

The load's ten parameters are fitted with every cause, so that what the load can explain is nobody's fault. Of a family of
k columns that takes the sum of squares of m whitened rows from S0 to S1 the score is m ln(S0 / S1) - k ln m (Schwarz,
Annals of Statistics 6(2), 1978): the noise level is the residual's own, and more columns must be worth it. Its
significance is a Wald test whose covariance is that of the scores of the terms (White, Econometrica 48(4), 1980), summed
over the legs: terms of a stationary residual are uncorrelated whatever its spectrum, so that autocorrelation counts. Columns
that live in few terms fit these, and leave too little of them: the covariance of a residual that is alike in all terms is
added, which at most doubles it where terms are many.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.causes import Family
from hexload.diagnosis.dynamics import TEN, Dynamics
from hexload.diagnosis.finding import SIGMAS
from hexload.theory import chi_square
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

INDEPENDENT = 1e-4  # of a column's length that must be left beside the others
DEPENDENT = 1e-6  # of the largest eigenvalue of columns beside each other


@dataclass(frozen=True)
class Candidate:
    family: Family
    score: float
    left: float  # sum of squares with it


@dataclass(frozen=True)
class Selected:
    family: Family
    score: float
    size: Array  # (k,)
    sigmas: float  # of all its columns together; SIGMAS is as rare as of one
    rms_n: float  # of what it adds to the leg forces, beyond what the load does
    shift: Array  # (10,), by which the load's parameters change without it
    share: float  # of the residual's sum of squares


class Bank:
    """The regression as it stands: load, chosen causes, and the residual."""

    def __init__(self, dynamics: Dynamics, segments: Sequence[Array]):
        """`segments`: weights (n,) of the stretches with a load of their own."""
        self.dynamics = dynamics
        loads = [dynamics.of_body * segment[:, None, None] for segment in segments]
        self.base = dynamics.whitened(np.concatenate(loads, axis=2))
        self.segments = np.stack(segments, axis=1)
        self.load_rows = loads
        self.forces = dynamics.whitened(dynamics.smooth.force[:, :, None])[:, 0]
        self.basis = np.linalg.qr(_scaled(self.base))[0]
        self.residual = self._without(self.forces[:, None])[:, 0]
        self.chosen: list[tuple[Family, Array]] = []
        self.families: list[Family] = []
        self.columns: list[Array] = []

    @property
    def rows(self) -> int:
        return len(self.forces)

    @property
    def left(self) -> float:
        return float(self.residual @ self.residual)

    def theta(self) -> Array:
        """Platform and load at each row, (n, 10)."""
        return self.segments @ self.coefficients()[0].reshape(-1, TEN)

    def coefficients(self) -> tuple[Array, Array]:
        """Of the loads, and of the chosen causes."""
        matrix = np.concatenate([self.base, *(columns for _, columns in self.chosen)], axis=1)
        scale = np.linalg.norm(matrix, axis=0) + 1e-300
        value = np.linalg.lstsq(matrix / scale, self.forces, rcond=1e-10)[0] / scale
        return value[: self.base.shape[1]], value[self.base.shape[1] :]

    def offer(self, families: Sequence[Family]) -> None:
        families = [family for family in families if np.isfinite(family.columns).all()]
        if not families:
            return
        whitened = self.dynamics.whitened(np.concatenate([family.columns for family in families], axis=2))
        ends = np.cumsum([family.columns.shape[2] for family in families])
        for family, columns in zip(families, np.split(whitened, ends[:-1], axis=1), strict=True):
            self.families.append(family)
            self.columns.append(columns)

    def ranked(self) -> list[Candidate]:
        """All that are offered, the best first."""
        if not self.families:
            return []
        ends = np.cumsum([columns.shape[1] for columns in self.columns])[:-1]
        beside, is_told = self._beside(np.concatenate(self.columns, axis=1))
        parts = zip(self.families, np.split(beside, ends, axis=1), np.split(is_told, ends), strict=True)
        return sorted((self._judged(*part) for part in parts), key=lambda candidate: -candidate.score)

    def score(self, family: Family) -> float:
        """Of one that is not offered."""
        return self._candidate(family, self.dynamics.whitened(family.columns)).score

    def score_of(self, left: float, parameters: int) -> float:
        return float(self.rows * np.log(self.left / max(left, 1e-300)) - parameters * np.log(self.rows))

    def _candidate(self, family: Family, columns: Array) -> Candidate:
        return self._judged(family, *self._beside(columns))

    def _beside(self, columns: Array) -> tuple[Array, Array]:
        """What load and chosen causes leave of columns, (rows, k) of length 1, and of which it is more than rounding,
        (k,)."""
        beside = self._without(columns)
        length = np.linalg.norm(beside, axis=0)
        return beside / (length + 1e-300), length > INDEPENDENT * np.linalg.norm(columns, axis=0)

    def _judged(self, family: Family, beside: Array, is_told: Array) -> Candidate:
        if not is_told.any():
            return Candidate(family, -np.inf, self.left)
        beside = beside[:, is_told]
        values, vectors = _independent(beside)
        parts = (vectors.T @ (beside.T @ self.residual)) / np.sqrt(values)
        left = self.left - float(parts @ parts)
        return Candidate(family, self.score_of(left, len(values)), left)

    def _without(self, columns: Array) -> Array:
        return columns - self.basis @ (self.basis.T @ columns)

    def choose(self, family: Family) -> Selected:
        """Takes a family into the regression, and says what it is worth."""
        columns = next((c for f, c in zip(self.families, self.columns) if f is family), None)
        if columns is None:
            columns = self.dynamics.whitened(family.columns)
        candidate = self._candidate(family, columns)
        before, left = self._load(), self.left
        told = self._told(columns)
        columns = columns @ told
        self.chosen.append((family, columns))
        new = np.linalg.qr(_scaled(self._without(columns)))[0]
        self.basis = np.concatenate([self.basis, new], axis=1)
        self.residual = self.residual - new @ (new.T @ self.residual)
        sizes = self.coefficients()[1][-columns.shape[1] :]
        size = told @ sizes
        return Selected(
            family,
            candidate.score,
            size,
            self._significance(columns, sizes),
            self._rms(family, size),
            before - self._load(),
            1.0 - self.left / left,
        )

    def _told(self, columns: Array) -> Array:
        """(k, c) combinations of a family's columns that load and chosen causes do not explain as well, as all hinges that
        are moved alike: the size of such a one is any."""
        length = np.linalg.norm(columns, axis=0) + 1e-300
        return _independent(self._without(columns) / length)[1] / length[:, None]

    def _load(self) -> Array:
        """The last one, (10,)."""
        return self.coefficients()[0].reshape(-1, TEN)[-1]

    def _significance(self, columns: Array, size: Array) -> float:
        others = self.basis[:, : self.basis.shape[1] - columns.shape[1]]
        beside = columns - others @ (others.T @ columns)
        scale = np.linalg.norm(beside, axis=0) + 1e-300
        beside = beside / scale
        gram = beside.T @ beside
        inverse = np.linalg.pinv(gram, rcond=DEPENDENT, hermitian=True)
        scores = (beside * self.residual[:, None]).reshape(-1, LEGS, len(size)).sum(axis=1)
        covariance = inverse @ (scores.T @ scores) @ inverse + np.mean(self.residual**2) * inverse
        scaled = size * scale
        wald = float(scaled @ np.linalg.pinv(covariance, rcond=1e-9, hermitian=True) @ scaled)
        degrees = len(_independent(beside)[0])
        return SIGMAS * float(np.sqrt(max(wald, 0.0) / _beyond_chance(degrees)))

    def _rms(self, family: Family, size: Array) -> float:
        fade = self.dynamics.smooth.fade[:, None, None]
        loads = (np.concatenate(self.load_rows, axis=2) * fade).reshape(-1, self.base.shape[1])
        part = ((family.columns @ size)[:, :, None] * fade).ravel()
        scale = np.linalg.norm(loads, axis=0) + 1e-300
        beside = part - loads @ (np.linalg.lstsq(loads / scale, part, rcond=1e-9)[0] / scale)
        legs = sorted(set(family.legs)) or list(range(LEGS))
        return float(np.sqrt(np.mean(beside.reshape(-1, LEGS)[:, legs] ** 2)))


@functools.cache
def _beyond_chance(degrees: int) -> float:
    """The chi-square that is as rare as a normal number of SIGMAS."""
    return chi_square.quantile(1.0 - math.erfc(SIGMAS / math.sqrt(2.0)), degrees)


def _independent(columns: Array) -> tuple[Array, Array]:
    """Squares (c,) of the lengths of the combinations (k, c) that are more than rounding beside the longest."""
    values, vectors = np.linalg.eigh(columns.T @ columns)
    good = values > DEPENDENT * values[-1]
    return values[good], vectors[:, good]


def _scaled(columns: Array) -> Array:
    return columns / (np.linalg.norm(columns, axis=0) + 1e-300)
