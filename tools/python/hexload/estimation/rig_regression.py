"""The regression of `hexload commission`: every parameter of rig_model.py from one run, by Gauss-Newton.

Rows are leg forces. Displacements, forces and every column pass the same zero-phase low-pass filters, so that none of
them lags; the motion is the displacements', as a regression on a velocity sensor would see its noise on both sides.
Speeds in the friction terms pass fewer of them: a filter hides when a leg turns round.

A row counts less where a leg is slow, as friction near zero speed is not known: with the variance

    s^2 (1 + (0.3 (Fc + Fd) / s)^2 exp(-(v / v_slow)^2)),    s the residual's standard deviation where legs move

Priors are normal: of gains, hinges, offsets and tilt the declared tolerances. The covariance is that of the estimate
under the scores of one-second blocks (sandwich estimator), so correlated residuals and what the model lacks count, plus
the priors' own part. As there are fewer blocks than unknowns, noise that is spread evenly over all of them and has the
scores' size counts too.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.signal import butter, sosfiltfilt

from hexload.estimation import rig_hinges, rig_model
from hexload.estimation.rig_model import LEGS, FrictionLaw, Geometry, LegMotion

Array = NDArray[np.float64]

MOTION_HZ = 40.0
ROW_HZ = 15.0
SPEED_HZ = 25.0
MOTION_STEP_S = 0.008  # at which the motion is worked out, and the columns filtered
ROW_STEP_S = 0.016
EDGE_S = 0.3  # there the filters still feel the ends of the record
BLOCK_S = 1.0
PASSES = 4
SCANNING_PASSES = (1, 2)  # before the first nothing is known of the machine, before the second nothing of its hinges
LOADED_PASSES = 4
OPEN_RADII = 10.0  # of the platform: where the centre of a load may be
MORE_PASSES = 2  # from a solution that differs by what is held
NOISE_SEED = 1
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
}
SLICES = {
    name: slice(start, start + size)
    for (name, size), start in zip(GROUPS.items(), np.cumsum([0, *GROUPS.values()])[:-1], strict=True)
}
UNKNOWNS = sum(GROUPS.values())
FRICTION = ("coulomb", "stribeck", "viscous", "growth")
TILT_STEP_RAD = 1e-4
DIRECTIONS = 8  # that the firmware carries along
PACES = (1.0, 0.4)  # of the run itself: motions on which a load may be identified
THIN = 20  # one row of so many is enough for that
TINY = 1e-12
WORST_CONDITION = 1e-13


@dataclass(frozen=True)
class Start:
    """Prior of the unknowns, (88,) each; a sigma of inf: nothing known, of 0: fixed."""

    value: Array
    sigma: Array


@dataclass(frozen=True)
class Found:
    value: Array  # (88,), as in SLICES; hinges as [base_hinges_m, platform_hinges_m] less those of the platform file
    covariance: Array  # (88, 88)
    noise_covariance: Array  # (88, 88), without the part that the priors leave: of unknowns that are as the prior says
    law: FrictionLaw
    residual_n: float  # standard deviation where legs move
    residuals_n: Array  # (rows, 6)
    t_s: Array  # (rows,)
    hinge_rows: tuple[
        Array | None, Array | None
    ]  # (rows, 6, 36) of the rigid part's forces, without and with more noise


@dataclass(frozen=True)
class _Record:
    """What does not depend on the unknowns."""

    displacement: Array  # (n, 6), filtered, MOTION_STEP_S apart
    speed: Array
    acceleration: Array
    force: Array  # (rows, 6), filtered as rows
    force_rate: Array
    friction_speed: Array  # (N, 6), at the log's own period
    dt_s: float  # the log's own period
    step: int  # of the log's periods in a MOTION_STEP_S
    rows: slice  # of n
    row_filter: Array
    motion_filter: Array
    speeds_at_rows: Array
    t_s: Array


@dataclass(frozen=True)
class _Left:
    """What a solution leaves."""

    residual: Array  # (rows, 6)
    matrix: Array  # (rows, 6, 88)
    weight: Array  # (rows, 6), 1 / standard deviation
    noise_n: float
    false: Array  # (88, 88), of the weighted rows' information what the displacements' noise alone makes


def fit(
    log_t_s: Array,
    displacement_m: Array,
    force_n: Array,
    geometry: Geometry,
    gravity: float,
    start: Start,
    near: Found | None = None,
) -> Found:
    """`displacement_m`, `force_n`: (n, 6), without gaps. `near`: what the same run has given with other groups held; its
    friction law stays. Raises ValueError."""
    record = _prepare(log_t_s, displacement_m, force_n)
    if near is None:
        value = np.where(np.isfinite(start.value), start.value, 0.0)
        law, hinge_rows = FIRST_LAW, (None, None)  # hinges are of no weight before there is a theta
    else:
        value = np.where(start.sigma > 0, near.value, start.value)
        law, hinge_rows = near.law, near.hinge_rows
    shapes = _friction_rows(record, law)
    noisy = _with_noise(record, _prepare(log_t_s, _noise_like(displacement_m), force_n))
    for number in range(PASSES if near is None else MORE_PASSES):
        if number == 1 and near is None:
            hinge_rows = tuple(_hinge_rows(seen, geometry, gravity, value, start) for seen in (record, noisy))
        if number in SCANNING_PASSES and near is None:
            law = _scan(record, geometry, gravity, value, start, LAWS if number == 1 else (law,))
            shapes = _friction_rows(record, law)
        rows = _linearise(record, geometry, gravity, value, shapes, hinge_rows[0])
        known = near is not None or number >= SCANNING_PASSES[-1]
        of_noise = _linearise(noisy, geometry, gravity, value, shapes, hinge_rows[1]) if known else rows
        value, left = _solve(record, *rows, value, start, (rows[0] - of_noise[0], of_noise[1] - rows[1]))
    covariances = _sandwich(record, left, start)
    return Found(value, *covariances, law, left.noise_n, left.residual, record.t_s, hinge_rows)


def _prepare(t_s: Array, displacement_m: Array, force_n: Array) -> _Record:
    dt_s = float(np.median(np.diff(t_s)))
    step = max(1, round(MOTION_STEP_S / dt_s))
    motion_filter = butter(4, MOTION_HZ, fs=1.0 / dt_s, output="sos")
    row_filter = butter(4, ROW_HZ, fs=1.0 / (step * dt_s), output="sos")
    speed_filter = butter(4, SPEED_HZ, fs=1.0 / dt_s, output="sos")
    displacement = sosfiltfilt(motion_filter, displacement_m, axis=0)
    speed = np.gradient(displacement, dt_s, axis=0)
    acceleration = np.gradient(speed, dt_s, axis=0)
    force = sosfiltfilt(motion_filter, force_n, axis=0)
    force_rate = np.gradient(force, dt_s, axis=0)
    friction_speed = np.gradient(sosfiltfilt(speed_filter, displacement_m, axis=0), dt_s, axis=0)
    coarse_s = step * dt_s
    edge, stride = round(EDGE_S / coarse_s), max(1, round(ROW_STEP_S / coarse_s))
    rows = slice(edge, -edge, stride)
    return _Record(
        displacement[::step],
        speed[::step],
        acceleration[::step],
        sosfiltfilt(row_filter, force[::step], axis=0)[rows],
        sosfiltfilt(row_filter, force_rate[::step], axis=0)[rows],
        friction_speed,
        dt_s,
        step,
        rows,
        row_filter,
        motion_filter,
        friction_speed[::step][rows],
        t_s[::step][rows],
    )


def _noise_like(displacement_m: Array) -> Array:
    """White noise as large as the displacements', which third differences show: a motion does not pass them."""
    sigma_m = np.sqrt(np.mean(np.diff(displacement_m, 3, axis=0) ** 2, axis=0) / 20.0)
    return sigma_m * np.random.default_rng(NOISE_SEED).standard_normal(displacement_m.shape)


def _with_noise(record: _Record, noise: _Record) -> _Record:
    """As if the displacements had as much noise again."""
    return replace(
        record,
        displacement=record.displacement + noise.displacement,
        speed=record.speed + noise.speed,
        acceleration=record.acceleration + noise.acceleration,
    )


def _as_rows(record: _Record, columns: Array) -> Array:
    return sosfiltfilt(record.row_filter, columns, axis=0)[record.rows]


def _friction_rows(record: _Record, law: FrictionLaw) -> Array:
    """(n, 6, 3) at the motion's period."""
    shapes = rig_model.friction_shapes(record.friction_speed, law, record.dt_s)
    return sosfiltfilt(record.motion_filter, shapes, axis=0)[:: record.step]


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


def _motion(record: _Record, geometry: Geometry, near: LegMotion | None = None) -> LegMotion:
    return rig_model.motion_of_legs(geometry, record.displacement, record.speed, record.acceleration, near)


def _rigid(motion: LegMotion, geometry: Geometry, gravity: Array, value: Array) -> Array:
    return rig_model.rigid_forces(motion, geometry, gravity, value[SLICES["theta"]], value[SLICES["leg_mass"]])


def _hinge_rows(record: _Record, geometry: Geometry, gravity: float, value: Array, start: Start) -> Array | None:
    """(rows, 6, 36) of the rigid part's forces; None: the hinges are fixed."""
    if not (start.sigma[SLICES["hinges"]] > 0).any():
        return None
    return _as_rows(record, _hinge_columns(record, geometry, gravity, value))


def _hinge_columns(record: _Record, geometry: Geometry, gravity: float, value: Array) -> Array:
    """Of the rigid part's forces, (n, 6, 36)."""
    g = rig_model.gravity_vector(gravity, value[SLICES["tilt"]])
    here = moved(geometry, value)
    motion = _motion(record, here)
    return rig_hinges.force_columns(motion, here, g, value[SLICES["theta"]], value[SLICES["leg_mass"]])


def _linearise(
    record: _Record, geometry: Geometry, gravity: float, value: Array, shapes: Array, hinge_rows: Array | None
) -> tuple[Array, Array]:
    """Residual (rows, 6) and matrix (rows, 6, 88) at `value`."""
    model, columns = _columns(record, geometry, gravity, value, shapes)
    is_used = columns.any(axis=0)  # a leg's own unknowns are in its own forces alone
    matrix = np.zeros((len(record.force), *is_used.shape))
    matrix[:, is_used] = _as_rows(record, columns[:, is_used])
    matrix[:, :, SLICES["delay"].start] = -record.force_rate
    if hinge_rows is not None:
        matrix[:, :, SLICES["hinges"]] = _gains(value) * hinge_rows
    return record.force - _as_rows(record, model) + value[SLICES["delay"]] * record.force_rate, matrix


def _gains(value: Array) -> Array:
    """(6, 1)"""
    return 1.0 + value[SLICES["gain"]][:, None]


def _columns(record: _Record, geometry: Geometry, gravity: float, value: Array, shapes: Array) -> tuple[Array, Array]:
    """What the load cells show, (n, 6), and its derivatives, (n, 6, 88), the delay's and the hinges' left out."""
    tilt = value[SLICES["tilt"]]
    g = rig_model.gravity_vector(gravity, tilt)
    here = moved(geometry, value)
    motion = _motion(record, here)
    of_body, of_legs = rig_model.body_forces(motion, g), rig_model.leg_mass_forces(motion, here, g)
    theta, leg_mass = value[SLICES["theta"]], value[SLICES["leg_mass"]]
    rigid = of_body @ theta + of_legs @ leg_mass
    coefficients = np.stack([value[SLICES[name]] for name in FRICTION], axis=1)
    of_friction = friction_columns(shapes, rigid)
    model = rigid + np.einsum("nlk,lk->nl", of_friction, coefficients)
    gain = _gains(value)
    matrix = np.zeros((*rigid.shape, UNKNOWNS))
    matrix[:, :, SLICES["theta"]] = gain * of_body
    matrix[:, :, SLICES["leg_mass"]] = gain * of_legs
    _put_friction(matrix, of_friction, gain[:, 0])
    for leg in range(LEGS):
        matrix[:, leg, SLICES["offset"].start + leg] = 1.0
        matrix[:, leg, SLICES["gain"].start + leg] = model[:, leg]
    for k in range(2):
        turned = rig_model.gravity_vector(gravity, tilt + TILT_STEP_RAD * np.eye(2)[k])
        tilted = rig_model.rigid_forces(motion, here, turned, theta, leg_mass)
        matrix[:, :, SLICES["tilt"].start + k] = gain[:, 0] * (tilted - rigid) / TILT_STEP_RAD
    return gain[:, 0] * model + value[SLICES["offset"]], matrix


def _weights(record: _Record, value: Array, noise_n: float) -> Array:
    rubbing = np.abs(value[SLICES["coulomb"]]) + np.maximum(value[SLICES["stribeck"]], 0.0)
    unknown = UNKNOWN_FRICTION_SHARE * rubbing / noise_n
    slow = np.exp(-((record.speeds_at_rows / SLOW_M_S) ** 2))
    return 1.0 / np.sqrt(1.0 + unknown**2 * slow)


def _solve(
    record: _Record, residual: Array, matrix: Array, value: Array, start: Start, doubles: tuple[Array, Array]
) -> tuple[Array, _Left]:
    """`doubles`: what noise like the displacements' changes of the model and of the matrix. The noise that is in both counts
    as information that no motion has given, and draws the unknowns towards zero: it is taken out of the normal equations."""
    noise_n = _noise(record, residual, value)
    weight = _weights(record, value, noise_n) / noise_n
    free = start.sigma > 0
    prior = _prior_information(start)[free]
    A = (weight[:, :, None] * matrix).reshape(-1, UNKNOWNS)[:, free]
    scale = np.sqrt(np.sum(A**2, axis=0) + prior) + TINY
    normal = (A / scale).T @ (A / scale) + np.diag(prior / scale**2)
    right = (A / scale).T @ (weight * residual).ravel() + prior / scale * (start.value - value)[free]
    false = (weight[:, :, None] * doubles[1]).reshape(-1, UNKNOWNS)[:, free] / scale
    of_noise = _less_than(false.T @ false, normal)
    normal -= of_noise
    right += false.T @ (weight * doubles[0]).ravel()
    change = np.zeros(UNKNOWNS)
    change[free] = np.linalg.lstsq(normal, right, rcond=WORST_CONDITION)[0] / scale
    left = residual - matrix @ change
    noise_n = _noise(record, left, value + change)
    weight = _weights(record, value + change, noise_n) / noise_n
    false = (weight[:, :, None] * doubles[1]).reshape(-1, UNKNOWNS)
    return value + change, _Left(left, matrix, weight, noise_n, false.T @ false)


def _less_than(of_noise: Array, normal: Array) -> Array:
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


def _noise(record: _Record, residual: Array, value: Array) -> float:
    moving = np.abs(record.speeds_at_rows) > 2.0 * SLOW_M_S
    return float(np.sqrt(np.mean(residual[moving] ** 2))) if moving.any() else float(residual.std())


def _scan(
    record: _Record, geometry: Geometry, gravity: float, value: Array, start: Start, laws: tuple[FrictionLaw, ...]
) -> FrictionLaw:
    """The friction law's numbers by the smallest residual of what is linear, from the best of `laws` on; hinges, gains, tilt
    stay."""
    residual, matrix = _linearise(record, geometry, gravity, value, _friction_rows(record, FIRST_LAW), None)
    g = rig_model.gravity_vector(gravity, value[SLICES["tilt"]])
    rigid = _rigid(_motion(record, moved(geometry, value)), moved(geometry, value), g, value)
    weight = _weights(record, value, _noise(record, residual, value))
    shape = (LEGS, len(FRICTION))
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

    @functools.cache
    def cost(law: FrictionLaw) -> float:
        columns = friction_columns(_friction_rows(record, law), rigid)
        columns = gained[:, :, None] * _as_rows(record, columns).transpose(1, 0, 2)
        # A leg's friction is in its own rows alone: normal equations by legs, less what the others explain.
        overlap = (basis.transpose(0, 2, 1) @ columns).transpose(1, 0, 2).reshape(len(others), -1)
        normal = block_diag(*(columns.transpose(0, 2, 1) @ columns)) - overlap.T @ overlap
        right = np.einsum("lnk,ln->lk", columns, due).ravel()
        found = np.zeros(is_free.size)
        found[is_free] = np.linalg.lstsq(normal[np.ix_(is_free, is_free)], right[is_free], rcond=WORST_CONDITION)[0]
        left = due - np.einsum("lnk,lk->ln", columns, found.reshape(shape)) + basis @ (overlap @ found)
        return float(np.sum((left / weight) ** 2))

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


def _put_friction(matrix: Array, columns: Array, gain: Array) -> None:
    for leg in range(LEGS):
        for k, name in enumerate(FRICTION):
            matrix[:, leg, SLICES[name].start + leg] = gain[leg] * columns[:, leg, k]


def _sandwich(record: _Record, left: _Left, start: Start) -> tuple[Array, Array]:
    free = start.sigma > 0
    prior = _prior_information(start)[free]
    A = (left.weight[:, :, None] * left.matrix)[:, :, free]
    scale = np.sqrt(np.sum(A**2, axis=(0, 1)) + prior) + TINY
    A = A / scale
    information, of_noise = _scores(record, A, left.weight * left.residual)
    normal = information + np.diag(prior / scale**2)
    normal -= _less_than(left.false[np.ix_(free, free)] / np.outer(scale, scale), normal)
    of_priors = np.diag(prior / scale**2)
    inverse = np.linalg.pinv(normal, rcond=WORST_CONDITION, hermitian=True)
    covariances = np.zeros((2, UNKNOWNS, UNKNOWNS))
    even = _dispersion(information, of_noise) * information
    for covariance, meat in zip(covariances, (of_noise + even + of_priors, even), strict=True):
        covariance[np.ix_(free, free)] = (inverse @ meat @ inverse) / np.outer(scale, scale)
    return covariances[0], covariances[1]


def _scores(record: _Record, A: Array, left: Array) -> tuple[Array, Array]:
    """Information of weighted rows A (rows, 6, k), and the covariance of their scores from block to block; both (k, k)."""
    blocks = np.floor((record.t_s - record.t_s[0]) / BLOCK_S).astype(int)
    terms = np.einsum("nlj,nl->nj", A, left)
    scores = np.array([terms[blocks == k].sum(axis=0) for k in range(blocks.max() + 1)])
    scores -= scores.mean(axis=0)
    return np.tensordot(A, A, ((0, 1), (0, 1))), scores.T @ scores * len(scores) / (len(scores) - 1)


def _dispersion(information: Array, of_noise: Array) -> float:
    return float(np.trace(of_noise) / np.trace(information))


def fit_loaded(
    log_t_s: Array,
    displacement_m: Array,
    force_n: Array,
    geometry: Geometry,
    gravity: float,
    found: Found,
    mass_kg: float,
) -> Found:
    """What a run with a known mass on the platform adds to `found`, that of the empty run: all its unknowns under their
    whole covariance, beside the load's centre and inertia, of which nothing is known. The friction law stays.

    With z = z0 + L u, L L^T the prior's covariance, rows A = w dz-columns L, and the dispersion q, by which scores vary more
    from block to block than independent rows make them: u = (q E + A^T A)^-1 A^T w r, with the covariance
    H^-1 (scores + q^2 E) H^-1, H = q E + A^T A."""
    record = _prepare(log_t_s, displacement_m, force_n)
    shapes = _friction_rows(record, found.law)
    prior, root = _with_load(found, geometry, mass_kg)
    free = Start(found.value, np.sqrt(np.diag(found.covariance)))
    theta = SLICES["theta"]
    u, dispersion, hinge_rows = np.zeros(root.shape[1]), 1.0, None
    for number in range(LOADED_PASSES):
        carried = _as_carried(prior + root @ u)
        if number > 0:  # before, the load is a point
            hinge_rows = _hinge_rows(record, geometry, gravity, carried, free)
        residual, matrix = _linearise(record, geometry, gravity, carried, shapes, hinge_rows)
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
    log_t_s: Array,
    displacement_m: Array,
    force_n: Array,
    geometry: Geometry,
    gravity: float,
    found: Found,
    loads: tuple[Array, ...],
    scale: Array,
) -> Array:
    """Ways in which all unknowns may be off together, one standard deviation each, (k, 88), k <= DIRECTIONS.

    Those that matter most for a load: with A the body's columns and S the others', an estimate of the load goes off by
    -(d theta + A^+ S d others). Of the covariance as a product L L^T the largest singular directions are kept of what that is
    of L, for each of `loads` at each of PACES of this run's motion, in units of `scale`, (10,). What the firmware does not
    follow counts as theta, as the last of `loads` sees it at this run's own pace: the mass of the legs, what wrong hinges do
    to accelerations, and as the last way all that the others leave."""
    record = _thinned(_prepare(log_t_s, displacement_m, force_n))
    root = _root(found.covariance)
    effects, folded = [], root.copy()
    for pace in PACES:
        slower = replace(record, speed=pace * record.speed, acceleration=pace**2 * record.acceleration)
        law = replace(found.law, presliding_m=0.0)
        shapes = rig_model.friction_shapes(pace * record.friction_speed, law, record.dt_s)
        for load in loads:
            value = found.value.copy()
            value[SLICES["theta"]] += load
            _, matrix = _columns(slower, geometry, gravity, value, shapes)
            matrix[:, :, SLICES["hinges"]] = _gains(value) * _hinge_columns(slower, geometry, gravity, value)
            flat = matrix.reshape(-1, UNKNOWNS)
            to_theta = np.linalg.pinv(flat[:, SLICES["theta"]])
            of_others = to_theta @ flat[:, SLICES["theta"].stop :]
            effects.append(np.concatenate([np.eye(10), of_others], axis=1) @ root / scale[:, None])
            if pace == PACES[0] and load is loads[-1]:
                whole, here = effects[-1], moved(geometry, value)
                for name, columns in (
                    ("leg_mass", matrix[:, :, SLICES["leg_mass"]]),
                    ("hinges", rig_hinges.inertial_columns(_motion(record, here), here, value[SLICES["theta"]])),
                ):
                    folded[SLICES["theta"]] += to_theta @ columns.reshape(len(flat), -1) @ root[SLICES[name]]
    _, size, ways = np.linalg.svd(np.concatenate(effects))
    kept = ways[: min(DIRECTIONS - 1, np.count_nonzero(size > 0))]
    left = np.zeros(UNKNOWNS)
    left[SLICES["theta"]] = scale * np.sqrt(
        np.maximum(np.sum(whole**2, axis=1) - np.sum((whole @ kept.T) ** 2, axis=1), 0.0)
    )
    return np.concatenate([kept @ folded.T, left[None]])


def _thinned(record: _Record) -> _Record:
    rows = slice(record.rows.start, record.rows.stop, THIN)
    parts = (record.displacement, record.speed, record.acceleration)
    displacement, speed, acceleration = (part[rows] for part in parts)
    friction_speed = record.friction_speed[:: record.step][rows]
    return replace(
        record, displacement=displacement, speed=speed, acceleration=acceleration, friction_speed=friction_speed, step=1
    )


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
    log_t_s: Array,
    displacement_m: Array,
    force_n: Array,
    geometry: Geometry,
    gravity: float,
    value: Array,
    law: FrictionLaw,
) -> Explained:
    """Of a rig with the unknowns `value`, (88,)."""
    record = _prepare(log_t_s, displacement_m, force_n)
    shapes = _friction_rows(record, law)
    model, _ = _columns(record, geometry, gravity, value, shapes)
    smooth = value.copy()
    for name in FRICTION:
        smooth[SLICES[name]] = 0.0
    without, _ = _columns(record, geometry, gravity, smooth, shapes)
    force = sosfiltfilt(record.motion_filter, force_n, axis=0)
    shown = (force + value[SLICES["delay"]] * np.gradient(force, record.dt_s, axis=0))[:: record.step]
    inner = slice(record.rows.start, record.rows.stop)
    residual = shown - model
    return Explained(
        log_t_s[:: record.step][inner],
        record.friction_speed[:: record.step][inner],
        residual[inner],
        sosfiltfilt(record.row_filter, residual, axis=0)[inner],
        ((model - without) / (1.0 + value[SLICES["gain"]]))[inner],
        ((without - value[SLICES["offset"]]) / (1.0 + value[SLICES["gain"]]))[inner],
    )
