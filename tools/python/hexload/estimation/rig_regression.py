"""The regression of `hexload commission`: every parameter of rig_model.py from one run, by Gauss-Newton.

Rows are leg forces, filtered as rig_record.py says. A row counts less where a leg is slow, as friction near zero speed is
not known: with the variance

    s^2 (1 + (0.3 (Fc + Fd) / s)^2 exp(-(v / v_slow)^2)),    s the residual's standard deviation where legs move

Legs may differ in their mass: what of that varies with the motion has unknowns of its own, as hinges would take it up, and
under a load hinges do more; what is constant is in the offsets. What pulls the platform home has its own, too, as the legs'
weight does much the same with the other sign. No controller takes either off: what is found counts as an error.

Priors are normal: of gains, hinges, offsets and tilt the declared tolerances. The covariance is that of the estimate
under the scores of one-second blocks (sandwich estimator), so correlated residuals and what the model lacks count, plus
the priors' own part. As there are fewer blocks than unknowns, noise that is spread evenly over all of them and has the
scores' size counts too.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.estimation import rig_hinges, rig_model
from hexload.estimation.rig_model import LEGS, FrictionLaw, Geometry, LegMotion
from hexload.estimation.rig_record import MOTION_HZ, Friction, Record, Seen, Shapes, low_pass, thinned
from hexload.io.log_file import LegLog

Array = NDArray[np.float64]

BLOCK_S = 1.0
PASSES = 4
SCANNING_PASSES = (1, 2)  # before the first nothing is known of the machine, before the second nothing of its hinges
LOADED_PASSES = 4
OPEN_RADII = 10.0  # of the platform: where the centre of a load may be
MORE_PASSES = 2  # from a solution that differs by what is held
MOST_NOISE = 0.9  # share of what a run seems to say that may be taken off as noise
SLOW_M_S = 0.005
UNKNOWN_FRICTION_SHARE = 0.3
STRIBECK_SPEEDS_M_S = (0.003, 0.005, 0.007, 0.01, 0.014, 0.02, 0.03, 0.05)
REVERSAL_SPEEDS_M_S = (0.0005, 0.001, 0.0014, 0.002, 0.0028, 0.004, 0.0057, 0.008)
PRESLIDING_M = (0.0, 5e-6, 1e-5, 2e-5, 4e-5, 8e-5, 1.6e-4, 3.2e-4)
FIRST_LAW = FrictionLaw(0.01, 0.001, 0.0)
LAWS = tuple(  # the scan begins at the best: friction may turn by the speed or by the way
    FrictionLaw(stribeck, *turn)
    for stribeck in (0.005, 0.014, 0.03)
    for turn in ((0.001, 0.0), (0.004, 0.0), (0.001, 4e-5), (0.001, 1.6e-4))
)
FINER = (1.19, 1.09)  # factors between the steps of the scans: Stribeck's part is off by as much as its speed
FINER_GAIN = 0.005  # less of the residual's square is chance: some 1e4 rows of which a quarter are independent
SCANS = 2  # of each number of the law, the others held
GROUPS = {
    "theta": 10,
    "leg_mass": 3,
    "coulomb": 6,
    "stribeck": 6,
    "viscous": 6,
    "growth": 6,
    "offset": 6,
    "delay": 1,
    "tilt": 2,
    "gain": 6,
    "hinges": 36,
    "unlike_legs": 18,
    "stiffness": 6,
}
SLICES = {
    name: slice(start, start + size)
    for (name, size), start in zip(GROUPS.items(), np.cumsum([0, *GROUPS.values()])[:-1], strict=True)
}
UNKNOWNS = sum(GROUPS.values())
FRICTION = ("coulomb", "stribeck", "viscous", "growth")
RIGID = ("theta", "leg_mass", "tilt", "unlike_legs", "stiffness")
UNTOLD = ("unlike_legs", "stiffness")  # of which no controller is told
TILT_STEP_RAD = 1e-4
DIRECTIONS = 8  # that the firmware carries along
PACES = (1.0, 0.4)  # of the run itself: motions on which a load may be identified
TINY = 1e-12
WORST_CONDITION = 1e-13


@dataclass(frozen=True)
class Start:
    """Prior of the unknowns, (UNKNOWNS,) each; a sigma of inf: nothing known, of 0: fixed."""

    value: Array
    sigma: Array


@dataclass(frozen=True)
class Found:
    value: Array  # (UNKNOWNS,), as in SLICES; hinges, of the base and of the platform, less the platform file's
    covariance: Array  # (UNKNOWNS, UNKNOWNS)
    noise_covariance: Array  # (UNKNOWNS, UNKNOWNS), without the priors' part: of unknowns that are as the prior says
    law: FrictionLaw
    residual_n: float  # standard deviation where legs move
    residuals_n: Array  # (rows, 6)
    t_s: Array  # (rows,)
    hinge_rows: tuple[
        Array | None, Array | None
    ]  # (rows, 6, 36) of the rigid part's forces, without and with more noise


@dataclass(frozen=True)
class _Rigid:
    """What platform and legs need at some values of the unknowns."""

    record: Record
    motion: LegMotion
    geometry: Geometry
    gravity_m_s2: Array
    forces: Array  # (n, 6)
    columns: Array  # (n, 6, k), per unit of the groups in RIGID, or of those of them that are not in UNTOLD

    @functools.cached_property
    def rows(self) -> tuple[Array, Array]:
        """Forces and columns as rows."""
        rows = self.record.as_rows(np.concatenate([self.forces[:, :, None], self.columns], axis=2))
        return rows[:, :, 0], rows[:, :, 1:]


@dataclass(frozen=True)
class _LinearFit:
    """What a solution leaves."""

    residual: Array  # (rows, 6)
    matrix: Array  # (rows, 6, UNKNOWNS)
    weight: Array  # (rows, 6), 1 / standard deviation
    noise_n: float
    noise_information: Array  # (UNKNOWNS, UNKNOWNS), of the weighted rows' what the displacements' noise alone makes


def fit(seen: Seen, geometry: Geometry, gravity: float, start: Start, near: Found | None = None) -> Found:
    """`near`: what the same run has given with other groups held; its friction law stays. Raises ValueError."""
    record, noisy, friction = seen.record, seen.noisy, seen.friction
    if near is None:
        value = np.where(np.isfinite(start.value), start.value, 0.0)
        law, hinge_rows = FIRST_LAW, (None, None)  # hinges are of no weight before there is a theta
    else:
        value = np.where(start.sigma > 0, near.value, start.value)
        law, hinge_rows = near.law, near.hinge_rows
    rigid, has_untold = None, any(part[SLICES[name]].any() for name in UNTOLD for part in (start.sigma, start.value))
    for number in range(PASSES if near is None else MORE_PASSES):
        rigid = _rigid(record, geometry, gravity, value, rigid, has_untold)
        if near is None and number in SCANNING_PASSES:
            law = _scan(friction, rigid, value, start, LAWS if number == SCANNING_PASSES[0] else (law,))
        shapes = friction.shapes(law)
        with_more = rigid
        if number > 0 or near is not None:
            with_more = _rigid(noisy, geometry, gravity, value, rigid, has_untold)
        if number == 1 and near is None:
            hinge_rows = tuple(_hinge_rows(some, value, start) for some in (rigid, with_more))
        rows = _linearise(rigid, shapes, value, hinge_rows[0])
        known = near is not None or number >= SCANNING_PASSES[-1]
        of_noise = _linearise(with_more, shapes, value, hinge_rows[1]) if known else rows
        doubles = rows[0] - of_noise[0], of_noise[1] - rows[1]
        change = _change(record, *rows, value, start, doubles)
        value = value + change
    left = _linear_fit(record, *rows, value, change, doubles[1])
    covariances = _sandwich(record, left, start)
    return Found(value, *covariances, law, left.noise_n, left.residual, record.t_s, hinge_rows)


def friction_columns(shapes: Array, rigid: Array) -> Array:
    """(..., 4), in the order of FRICTION, of shapes (..., 3). `rigid`, (...): the legs' forces on the platform."""
    return np.concatenate([shapes, shapes[..., :1] * np.abs(rigid)[..., None]], axis=-1)


def moved(geometry: Geometry, value: Array) -> Geometry:
    """The geometry with the hinges that were found."""
    shift = value[SLICES["hinges"]].reshape(2, LEGS, 3)
    return replace(
        geometry,
        base_hinges_m=geometry.base_hinges_m + shift[0],
        platform_hinges_m=geometry.platform_hinges_m + shift[1],
    )


def _rigid(
    record: Record,
    geometry: Geometry,
    gravity: float,
    value: Array,
    near: _Rigid | None = None,
    has_untold: bool = True,
) -> _Rigid:
    """`near`: of much the same pose at each row. `has_untold`: those groups are asked for, or have a value."""
    tilt = value[SLICES["tilt"]]
    g = rig_model.gravity_vector(gravity, tilt)
    here = moved(geometry, value)
    motion = rig_model.motion_of_legs(
        here, record.displacement, record.speed, record.acceleration, None if near is None else near.motion
    )
    of_body, of_legs = rig_model.body_forces(motion, g), rig_model.leg_mass_forces(motion, here, g)
    theta, leg_mass = value[SLICES["theta"]], value[SLICES["leg_mass"]]
    turned = (rig_model.gravity_vector(gravity, tilt + step) - g for step in TILT_STEP_RAD * np.eye(2))
    of_tilt = [rig_model.weight_forces(motion, here, change / TILT_STEP_RAD, theta, leg_mass) for change in turned]
    forces = of_body @ theta + of_legs @ leg_mass
    columns = np.concatenate([of_body, of_legs, np.stack(of_tilt, axis=2)], axis=2)
    if has_untold:
        of_unlike = rig_model.unlike_leg_forces(motion, here, g)
        of_unlike -= of_unlike.mean(axis=0)  # that is in the offsets
        untold = np.concatenate([of_unlike, rig_model.stiffness_forces(motion, here)], axis=2)
        forces += untold @ np.concatenate([value[SLICES[name]] for name in UNTOLD])
        columns = np.concatenate([columns, untold], axis=2)
    return _Rigid(record, motion, here, g, forces, columns)


def _hinge_columns(rigid: _Rigid, value: Array) -> Array:
    """Of the rigid part's forces, (n, 6, 36)."""
    theta, leg_mass = value[SLICES["theta"]], value[SLICES["leg_mass"]]
    return rig_hinges.force_columns(rigid.motion, rigid.geometry, rigid.gravity_m_s2, theta, leg_mass)


def _hinge_rows(rigid: _Rigid, value: Array, start: Start) -> Array | None:
    """(rows, 6, 36) of the rigid part's forces; None: the hinges are fixed."""
    return rigid.record.as_rows(_hinge_columns(rigid, value)) if (start.sigma[SLICES["hinges"]] > 0).any() else None


def _linearise(rigid: _Rigid, shapes: Shapes, value: Array, hinge_rows: Array | None) -> tuple[Array, Array]:
    """Residual (rows, 6) and matrix (rows, 6, UNKNOWNS) at `value`."""
    record, (forces, columns) = rigid.record, rigid.rows
    model, matrix = _model(forces, columns, _friction_rows(rigid, shapes), value)
    matrix[:, :, SLICES["delay"].start] = -record.force_rate
    if hinge_rows is not None:
        matrix[:, :, SLICES["hinges"]] = _gains(value) * hinge_rows
    return record.force - model + value[SLICES["delay"]] * record.force_rate, matrix


def _friction_rows(rigid: _Rigid, shapes: Shapes) -> Array:
    """(rows, 6, 4), in the order of FRICTION."""
    growing = rigid.record.as_rows(shapes.direction * np.abs(rigid.forces))
    return np.concatenate([shapes.rows, growing[:, :, None]], axis=2)


def _gains(value: Array) -> Array:
    """(6, 1)"""
    return 1.0 + value[SLICES["gain"]][:, None]


def _model(forces: Array, columns: Array, of_friction: Array, value: Array) -> tuple[Array, Array]:
    """What the load cells show, (n, 6), and its derivatives, (n, 6, UNKNOWNS), the delay's and the hinges' left out.
    `forces` and `columns`: of _Rigid; `of_friction`: (n, 6, 4)."""
    coefficients = np.stack([value[SLICES[name]] for name in FRICTION], axis=1)
    model = forces + np.einsum("nlk,lk->nl", of_friction, coefficients)
    gain = _gains(value)
    matrix = np.zeros((*forces.shape, UNKNOWNS))
    of_rigid = [np.arange(UNKNOWNS)[SLICES[name]] for name in RIGID]
    matrix[:, :, np.concatenate(of_rigid)[: columns.shape[2]]] = gain * columns
    for leg in range(LEGS):
        for k, name in enumerate(FRICTION):
            matrix[:, leg, SLICES[name].start + leg] = gain[leg] * of_friction[:, leg, k]
        matrix[:, leg, SLICES["offset"].start + leg] = 1.0
        matrix[:, leg, SLICES["gain"].start + leg] = model[:, leg]
    return gain[:, 0] * model + value[SLICES["offset"]], matrix


def _weights(record: Record, value: Array, noise_n: float) -> Array:
    rubbing = np.abs(value[SLICES["coulomb"]]) + np.maximum(value[SLICES["stribeck"]], 0.0)
    unknown = UNKNOWN_FRICTION_SHARE * rubbing / noise_n
    slow = np.exp(-((record.speeds_at_rows / SLOW_M_S) ** 2))
    return 1.0 / np.sqrt(1.0 + unknown**2 * slow)


def _change(
    record: Record, residual: Array, matrix: Array, value: Array, start: Start, doubles: tuple[Array, Array]
) -> Array:
    """Of the unknowns, (UNKNOWNS,). `doubles`: what noise like the displacements' changes of the model and of the matrix.
    The noise that is in both counts as information that no motion has given, and draws the unknowns towards zero: it is
    taken out of the normal equations."""
    noise_n = _noise(record, residual, value)
    weight = _weights(record, value, noise_n) / noise_n
    free = start.sigma > 0
    prior = _prior_information(start)[free]
    A = (weight[:, :, None] * matrix).reshape(-1, UNKNOWNS)[:, free]
    information = A.T @ A
    scale = np.sqrt(np.diag(information) + prior) + TINY
    normal = (information + np.diag(prior)) / np.outer(scale, scale)
    right = (A.T @ (weight * residual).ravel() + prior * (start.value - value)[free]) / scale
    false = (weight[:, :, None] * doubles[1]).reshape(-1, UNKNOWNS)[:, free] / scale
    of_noise = _bounded_noise(false.T @ false, normal)
    normal -= of_noise
    right += false.T @ (weight * doubles[0]).ravel()
    change = np.zeros(UNKNOWNS)
    change[free] = np.linalg.lstsq(normal, right, rcond=WORST_CONDITION)[0] / scale
    return change


def _linear_fit(
    record: Record, residual: Array, matrix: Array, value: Array, change: Array, double: Array
) -> _LinearFit:
    """`change`: that led from where the rows were made to `value`; `double`: of the matrix."""
    left = residual - matrix @ change
    noise_n = _noise(record, left, value)
    weight = _weights(record, value, noise_n) / noise_n
    false = (weight[:, :, None] * double).reshape(-1, UNKNOWNS)
    return _LinearFit(left, matrix, weight, noise_n, false.T @ false)


def _bounded_noise(of_noise: Array, normal: Array) -> Array:
    """`of_noise`, where it is more than MOST_NOISE of `normal` no more than that."""
    values, vectors = np.linalg.eigh(normal)
    root = vectors * np.sqrt(np.maximum(values, WORST_CONDITION * values.max()))
    inverse = vectors / np.sqrt(np.maximum(values, WORST_CONDITION * values.max()))
    share, ways = np.linalg.eigh(inverse.T @ of_noise @ inverse)
    ways = root @ ways
    return (ways * np.clip(share, 0.0, MOST_NOISE)) @ ways.T


def _prior_information(start: Start) -> Array:
    known = np.isfinite(start.sigma) & (start.sigma > 0)
    return np.where(known, 1.0 / np.where(known, start.sigma, 1.0) ** 2, 0.0)


def _noise(record: Record, residual: Array, value: Array) -> float:
    moving = np.abs(record.speeds_at_rows) > 2.0 * SLOW_M_S
    return float(np.sqrt(np.mean(residual[moving] ** 2))) if moving.any() else float(residual.std())


def _scan(friction: Friction, rigid: _Rigid, value: Array, start: Start, laws: tuple[FrictionLaw, ...]) -> FrictionLaw:
    """The friction law's numbers by the smallest residual of what is linear, from the best of `laws` on; hinges, gains, tilt
    stay."""
    cost = functools.cache(_law_cost(friction, rigid, value, start))
    law = min(laws, key=cost)
    for _ in range(SCANS):
        for name, numbers in (
            ("presliding_m", PRESLIDING_M),
            ("stribeck_speed_m_s", STRIBECK_SPEEDS_M_S),
            ("reversal_speed_m_s", REVERSAL_SPEEDS_M_S),
        ):
            law = min((replace(law, **{name: number}) for number in numbers), key=cost)
    for factor in FINER if len(laws) == 1 else ():
        for name in ("stribeck_speed_m_s", "reversal_speed_m_s", "presliding_m"):
            number = getattr(law, name)
            finer = min((replace(law, **{name: number * k}) for k in (factor, 1.0 / factor)), key=cost)
            law = finer if cost(finer) < (1.0 - FINER_GAIN) * cost(law) else law
    return law


def _law_cost(friction: Friction, rigid: _Rigid, value: Array, start: Start) -> Callable[[FrictionLaw], float]:
    """The square of what is left of the forces, N^2, of a friction law: theta, leg mass, offsets and friction as they then fit
    best."""
    residual, matrix = _linearise(rigid, friction.shapes(FIRST_LAW), value, None)
    weight = _weights(rigid.record, value, _noise(rigid.record, residual, value))
    shape, legs = (LEGS, len(FRICTION)), np.arange(LEGS)
    own = np.array([SLICES[name].start + np.arange(LEGS) for name in FRICTION]).T  # the unknowns of each leg's friction
    is_free = start.sigma[own].ravel() > 0
    others = np.concatenate([np.arange(UNKNOWNS)[SLICES[name]] for name in ("theta", "leg_mass", "offset")])
    others = others[start.sigma[others] > 0]
    basis = np.linalg.qr((weight[:, :, None] * matrix[:, :, others]).reshape(-1, len(others)))[0]
    # By legs, (6, rows, ..), as `weight`, `due` and the columns below.
    basis = basis.reshape(*weight.shape, -1).transpose(1, 0, 2)
    weight = weight.T
    due = weight * (residual + matrix[:, :, own.ravel()] @ np.where(is_free, value[own.ravel()], 0.0)).T
    due -= basis @ np.tensordot(basis, due, ((0, 1), (0, 1)))
    gained = weight * _gains(value)

    def cost(law: FrictionLaw) -> float:
        columns = gained[:, :, None] * _friction_rows(rigid, friction.shapes(law)).transpose(1, 0, 2)
        # A leg's friction is in its own rows alone: normal equations by legs, less what the others explain.
        overlap = (basis.transpose(0, 2, 1) @ columns).transpose(1, 0, 2).reshape(len(others), -1)
        normal = -overlap.T @ overlap
        normal.reshape(*shape, *shape)[legs, :, legs] += columns.transpose(0, 2, 1) @ columns
        right = np.einsum("lnk,ln->lk", columns, due).ravel()
        found = np.zeros(is_free.size)
        found[is_free] = np.linalg.lstsq(normal[np.ix_(is_free, is_free)], right[is_free], rcond=WORST_CONDITION)[0]
        left = due - np.einsum("lnk,lk->ln", columns, found.reshape(shape)) + basis @ (overlap @ found)
        return float(np.sum((left / weight) ** 2))

    return cost


def _sandwich(record: Record, left: _LinearFit, start: Start) -> tuple[Array, Array]:
    free = start.sigma > 0
    prior = _prior_information(start)[free]
    A = (left.weight[:, :, None] * left.matrix)[:, :, free]
    scale = np.sqrt(np.sum(A**2, axis=(0, 1)) + prior) + TINY
    A = A / scale
    information, of_noise = _scores(record, A, left.weight * left.residual)
    normal = information + np.diag(prior / scale**2)
    normal -= _bounded_noise(left.noise_information[np.ix_(free, free)] / np.outer(scale, scale), normal)
    of_priors = np.diag(prior / scale**2)
    inverse = np.linalg.pinv(normal, rcond=WORST_CONDITION, hermitian=True)
    covariances = np.zeros((2, UNKNOWNS, UNKNOWNS))
    even = _dispersion(information, of_noise) * information
    for covariance, meat in zip(covariances, (of_noise + even + of_priors, even), strict=True):
        covariance[np.ix_(free, free)] = (inverse @ meat @ inverse) / np.outer(scale, scale)
    return covariances[0], covariances[1]


def score(seen: Seen, geometry: Geometry, gravity: float, start: Start, found: Found, name: str) -> float:
    """Chi-square, of the size of a group that is held in `found`, of what its columns explain of the residual beside those of
    the groups that `start` frees (score test, Rao 1948): large where a fit with it may find something. What priors hold
    counts too, so it asks too often rather than too rarely."""
    record, value = seen.record, found.value
    rigid = _rigid(record, geometry, gravity, value)
    residual, matrix = _linearise(rigid, seen.friction.shapes(found.law), value, found.hinge_rows[0])
    weight = _weights(record, value, found.residual_n) / found.residual_n
    free, flat = start.sigma > 0, (weight[:, :, None] * matrix).reshape(-1, UNKNOWNS)
    A, asked, prior = flat[:, free], flat[:, SLICES[name]], _prior_information(start)[free]
    scale = np.sqrt(np.sum(A**2, axis=0) + prior) + TINY
    A = A / scale
    normal = A.T @ A + np.diag(prior / scale**2)
    beside = asked - A @ (np.linalg.pinv(normal, rcond=WORST_CONDITION, hermitian=True) @ (A.T @ asked))
    beside = beside / (np.linalg.norm(beside, axis=0) + TINY)
    left = weight * residual
    information, of_noise = _scores(record, beside.reshape(*left.shape, -1), left)
    follows = beside.T @ left.ravel()
    return float(follows @ np.linalg.pinv(information, hermitian=True) @ follows / _dispersion(information, of_noise))


def _scores(record: Record, A: Array, left: Array) -> tuple[Array, Array]:
    """Information of weighted rows A (rows, 6, k), and the covariance of their scores from block to block; both (k, k)."""
    blocks = np.floor((record.t_s - record.t_s[0]) / BLOCK_S).astype(int)
    terms = np.einsum("nlj,nl->nj", A, left)
    scores = np.array([terms[blocks == k].sum(axis=0) for k in range(blocks.max() + 1)])
    scores -= scores.mean(axis=0)
    return np.tensordot(A, A, ((0, 1), (0, 1))), scores.T @ scores * len(scores) / (len(scores) - 1)


def _dispersion(information: Array, of_noise: Array) -> float:
    return float(np.trace(of_noise) / np.trace(information))


def fit_loaded(seen: Seen, geometry: Geometry, gravity: float, found: Found, mass_kg: float) -> Found:
    """What a run with a known mass on the platform adds to `found`, that of the empty run: all its unknowns under their
    whole covariance, beside the load's centre and inertia, of which nothing is known. The friction law stays.

    With z = z0 + L u, L L^T the prior's covariance, rows A = w dz-columns L, and the dispersion q, by which scores vary more
    from block to block than independent rows make them: u = (q E + A^T A)^-1 A^T w r, with the covariance
    H^-1 (scores + q^2 E) H^-1, H = q E + A^T A."""
    record, shapes = seen.record, seen.friction.shapes(found.law)
    prior, root = _with_load(found, geometry, mass_kg)
    free = Start(found.value, np.sqrt(np.diag(found.covariance)))
    theta = SLICES["theta"]
    u, dispersion, hinge_rows, rigid = np.zeros(root.shape[1]), 1.0, None, None
    for number in range(LOADED_PASSES):
        carried = _as_carried(prior + root @ u)
        rigid = _rigid(record, geometry, gravity, carried, rigid)
        if number > 0:  # before, the load is a point
            hinge_rows = _hinge_rows(rigid, carried, free)
        residual, matrix = _linearise(rigid, shapes, carried, hinge_rows)
        matrix = np.concatenate([matrix, matrix[:, :, theta]], axis=2) @ root
        noise_n = _noise(record, residual, carried) if number > 0 else found.residual_n
        weight = _weights(record, carried, noise_n) / noise_n
        A = weight[:, :, None] * matrix
        flat = A.reshape(-1, len(u))
        H = flat.T @ flat + dispersion * np.eye(len(u))
        step = np.linalg.solve(H, flat.T @ (weight * residual).ravel() - dispersion * u)
        u = u + step
        information, of_noise = _scores(record, A, weight * (residual - matrix @ step))
        size = 1.0 + np.sqrt(np.diag(information))
        dispersion = max(1.0, _dispersion(information / np.outer(size, size), of_noise / np.outer(size, size)))
    inverse = np.linalg.inv(information + dispersion * np.eye(len(u)))
    meat = of_noise + dispersion * information + dispersion**2 * np.eye(len(u))
    covariance = (root @ inverse @ meat @ inverse @ root.T)[:UNKNOWNS, :UNKNOWNS]
    return replace(found, value=(prior + root @ u)[:UNKNOWNS], covariance=covariance)


def _with_load(found: Found, geometry: Geometry, mass_kg: float) -> tuple[Array, Array]:
    """Unknowns of the rig and the load, and a root of their covariance."""
    radius_m = np.linalg.norm(geometry.platform_hinges_m, axis=1).mean()
    open_load = OPEN_RADII * mass_kg * np.repeat([0.0, radius_m, radius_m**2], [1, 3, 6])
    root = np.zeros((UNKNOWNS + GROUPS["theta"],) * 2)
    root[:UNKNOWNS, :UNKNOWNS] = _root(found.covariance)
    root[UNKNOWNS:, UNKNOWNS:] = np.diag(open_load)
    return np.concatenate([found.value, [mass_kg], np.zeros(9)]), root


def _as_carried(unknowns: Array) -> Array:
    """What a run with the load shows: platform and load are one body."""
    value = unknowns[:UNKNOWNS].copy()
    value[SLICES["theta"]] += unknowns[UNKNOWNS:]
    return value


def open_directions(
    seen: Seen,
    geometry: Geometry,
    gravity: float,
    found: Found,
    loads: tuple[Array, ...],
    scale: Array,
) -> Array:
    """Ways in which all unknowns may be off together, one standard deviation each, (k, UNKNOWNS), k <= DIRECTIONS.

    Those that matter most for a load: with A the body's columns and S the others', an estimate of the load goes off by
    -(d theta + A^+ S d others). Of the covariance as a product L L^T the largest singular directions are kept of what that is
    of L, for each of `loads` at each of PACES of this run's motion, in units of `scale`, (10,). What the firmware does not
    follow counts as theta, as the last of `loads` sees it at this run's own pace: the mass of the legs, the groups in UNTOLD,
    which are off as found, what wrong hinges do to accelerations, and as the last way all that the others leave."""
    record = thinned(seen.record)
    as_found = np.zeros((UNKNOWNS, len(UNTOLD)))
    for k, name in enumerate(UNTOLD):
        as_found[SLICES[name], k] = found.value[SLICES[name]]
    root = np.column_stack([_root(found.covariance), as_found])
    effects, folded = [], root.copy()
    for pace in PACES:
        slower = replace(record, speed=pace * record.speed, acceleration=pace**2 * record.acceleration)
        law = replace(found.law, presliding_m=0.0)
        shapes = rig_model.friction_shapes(pace * record.friction_speed, law, record.dt_s)
        for load in loads:
            value = found.value.copy()
            value[SLICES["theta"]] += load
            rigid = _rigid(slower, geometry, gravity, value)
            _, matrix = _model(rigid.forces, rigid.columns, friction_columns(shapes, rigid.forces), value)
            matrix[:, :, SLICES["hinges"]] = _gains(value) * _hinge_columns(rigid, value)
            flat = matrix.reshape(-1, UNKNOWNS)
            to_theta = np.linalg.pinv(flat[:, SLICES["theta"]])
            of_others = to_theta @ flat[:, SLICES["theta"].stop :]
            effects.append(np.concatenate([np.eye(10), of_others], axis=1) @ root / scale[:, None])
            if pace == PACES[0] and load is loads[-1]:
                whole = effects[-1]
                for name, columns in (
                    ("leg_mass", matrix[:, :, SLICES["leg_mass"]]),
                    *((name, matrix[:, :, SLICES[name]]) for name in UNTOLD),
                    ("hinges", rig_hinges.inertial_columns(rigid.motion, rigid.geometry, value[SLICES["theta"]])),
                ):
                    folded[SLICES["theta"]] += to_theta @ columns.reshape(len(flat), -1) @ root[SLICES[name]]
    _, size, ways = np.linalg.svd(np.concatenate(effects))
    kept = ways[: min(DIRECTIONS - 1, np.count_nonzero(size > 0))]
    left = np.zeros(UNKNOWNS)
    left[SLICES["theta"]] = scale * np.sqrt(
        np.maximum(np.sum(whole**2, axis=1) - np.sum((whole @ kept.T) ** 2, axis=1), 0.0)
    )
    return np.concatenate([kept @ folded.T, left[None]])


def _root(covariance: Array) -> Array:
    """L of L L^T; small negative eigenvalues are roundings."""
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


@dataclass(frozen=True)
class Explained:
    """A run beside the model of its forces, rows MOTION_STEP_S apart."""

    t_s: Array  # (n,)
    speed_m_s: Array  # (n, 6), of friction
    residual_n: Array  # (n, 6), what the load cells show less the model, below MOTION_HZ
    slow_residual_n: Array  # (n, 6), the same below ROW_HZ: above that it is noise of the accelerations
    friction_n: Array  # (n, 6), the model's friction on the legs
    force_n: Array  # (n, 6), what the legs push the platform with by the model


def explain(
    record: Record,
    log: LegLog,
    geometry: Geometry,
    gravity: float,
    value: Array,
    law: FrictionLaw,
) -> Explained:
    """Of a rig with the unknowns `value`, (UNKNOWNS,). `record`: the log, prepared."""
    shapes = record.below_motion_hz(rig_model.friction_shapes(record.friction_speed, law, record.dt_s))
    rigid = _rigid(record, geometry, gravity, value)
    model, _ = _model(rigid.forces, rigid.columns, friction_columns(shapes, rigid.forces), value)
    force = low_pass(log.force_n, MOTION_HZ, record.dt_s)
    shown = (force + value[SLICES["delay"]] * np.gradient(force, record.dt_s, axis=0))[:: record.step]
    inner = slice(record.rows.start, record.rows.stop)
    residual = shown - model
    return Explained(
        log.t_s[:: record.step][inner],
        record.friction_speed[:: record.step][inner],
        residual[inner],
        record.below_row_hz(residual)[inner],
        ((model - value[SLICES["offset"]]) / (1.0 + value[SLICES["gain"]]) - rigid.forces)[inner],
        rigid.forces[inner],
    )
