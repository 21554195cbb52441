"""Which legs the channels belong to: forces in all 720 orders and 64 signs, whole legs in the orders of slips of a plug.

The residual of a free load is linear in the forces: with W_ij the whitened rows of force i at leg j, without what a load
explains, and G their products, a permutation p with signs s leaves sum over a, b of s_a s_b G_(a p_a)(b p_b). Another
order of whole legs is another motion, so that only some are tried: two legs exchanged, and counting from another leg or
the other way round. Orders in which the machine is congruent to itself make the same forces of a load that is turned or
mirrored with them; gravity is along the axis of such a symmetry, so nothing in a log can tell them.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.bank import Bank
from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.dynamics import Machine, dynamics_of
from hexload.diagnosis.record import Record
from hexload.estimation.rig_model import Geometry
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]
Order = tuple[int, ...]

SAME = tuple(range(LEGS))
CONGRUENT_M = 1e-3
DISPLACEMENT_SWAPPED = Cause(Defect.SWAPPED, Channel.DISPLACEMENT)


@dataclass(frozen=True)
class Rewired:
    cause: Cause  # one that phrases.rewired() has words for
    legs: Order
    order: Order  # of each channel, the leg that it is of
    signs: tuple[int, ...]
    left: float  # mean square of the whitened rows
    own: float  # the same as the log has it


def best_forces(bank: Bank) -> Rewired | None:
    """The order and signs of the forces that leave least, when they are not those of the log."""
    d = bank.dynamics
    places = np.zeros((*d.smooth.force.shape, LEGS, LEGS))
    for place in range(LEGS):
        places[:, place, :, place] = d.smooth.force
    rows = d.whitened(places.reshape(*d.smooth.force.shape, -1))
    rows = rows - bank.basis @ (bank.basis.T @ rows)
    products = (rows.T @ rows).reshape(LEGS, LEGS, LEGS, LEGS)
    orders = np.array(list(itertools.permutations(range(LEGS))))
    signs = np.array(list(itertools.product((1, -1), repeat=LEGS - 1)))
    signs = np.hstack([np.ones((len(signs), 1), int), signs])
    a, b = np.arange(LEGS)[:, None], np.arange(LEGS)[None, :]
    chosen = products[a, orders[:, :, None], b, orders[:, None, :]]
    left = np.einsum("sa,pab,sb->ps", signs, chosen, signs, optimize=True)
    costs = 1.0 + 0.02 * (orders != np.arange(LEGS)).sum(axis=1)[:, None] + 0.02 * (signs < 0).sum(axis=1)[None, :]
    best = np.unravel_index((left * costs).argmin(), left.shape)
    order, sign = tuple(orders[best[0]].tolist()), signs[best[1]]
    sign = -sign if (sign < 0).sum() > LEGS // 2 else sign
    moved = tuple(leg for leg in range(LEGS) if order[leg] != leg)
    turned = tuple(np.flatnonzero(sign < 0).tolist())
    if not moved and not turned:
        return None
    return Rewired(
        Cause(Defect.SWAPPED if moved else Defect.SIGN, Channel.FORCE),
        moved or turned,
        order,
        tuple(sign.tolist()),
        left[best] / bank.rows,
        bank.left / bank.rows,
    )


def best_legs(record: Record, machine: Machine) -> Rewired | None:
    """The order of whole legs, or of their displacements alone, that leaves least."""
    found, own = [], misfit(record, machine)
    for cause, order in _slips(machine.geometry):
        legs = tuple(leg for leg in range(LEGS) if order[leg] != leg)
        if (left := misfit(_ordered(record, order, cause), machine)) < np.inf:
            found.append(Rewired(cause, legs, order, (1,) * LEGS, left, own))
    return min(found, key=lambda each: each.left, default=None)


def misfit(record: Record, machine: Machine) -> float:
    """Mean square of the whitened rows that a free load leaves; inf: displacements of no pose."""
    try:
        dynamics = dynamics_of(record, machine)
    except ValueError:
        return np.inf
    bank = Bank(dynamics, [np.ones(len(dynamics.smooth.t_s))])
    return bank.left / bank.rows


def _slips(geometry: Geometry) -> Iterator[tuple[Cause, Order]]:
    """Not those that the machine cannot tell."""
    blind = set(indistinguishable(geometry))
    for one, other in itertools.combinations(range(LEGS), 2):
        order = list(SAME)
        order[one], order[other] = other, one
        yield Cause(Defect.LEGS_EXCHANGED), tuple(order)
        yield DISPLACEMENT_SWAPPED, tuple(order)
    for shift in range(LEGS):
        for step in (1, -1):
            order = tuple((shift + step * leg) % LEGS for leg in range(LEGS))
            if order not in blind and order != SAME:
                yield Cause(Defect.LEGS_RENUMBERED if step == 1 else Defect.LEGS_MIRRORED), order


def _ordered(record: Record, order: Order, cause: Cause) -> Record:
    places = list(order)
    moved = replace(record, displacement_m=record.displacement_m[:, places])
    return moved if cause == DISPLACEMENT_SWAPPED else replace(moved, force_n=record.force_n[:, places])


def indistinguishable(geometry: Geometry) -> list[Order]:
    """Countings of the legs, from another leg or the other way round, that leave the machine congruent to itself."""
    lengths = _lengths(geometry, SAME)
    orders = [tuple((shift + step * leg) % LEGS for leg in range(LEGS)) for shift in range(LEGS) for step in (1, -1)]
    return [
        order for order in orders if order != SAME and np.abs(_lengths(geometry, order) - lengths).max() < CONGRUENT_M
    ]


def turned(geometry: Geometry, order: Order) -> Array:
    """(3, 3): Q, a turn about the vertical or a mirror, that puts the hinges of legs `order` nearest those of legs 1 to 6.

    Where the machine is congruent to itself in that order, its log with the channels of legs `order` is that of the motion
    p' = Q p, R' = Q R Q^T and of a body h' = Q h, I' = Q I Q^T: Newton's and Euler's equations know no such Q, and
    gravity is along its axis.
    """
    places = list(order)
    sides = (geometry.base_hinges_m[:, :2], geometry.platform_hinges_m[:, :2])
    u, _, v = np.linalg.svd(sum(side.T @ side[places] for side in sides))
    q = np.eye(3)
    q[:2, :2] = u @ v
    return q


def turned_body(q: Array, theta: Array) -> Array:
    """(10,): m, Q h, Q I Q^T."""
    xx, yy, zz, xy, xz, yz = theta[4:]
    inertia = q @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ q.T
    return np.concatenate(
        [theta[:1], q @ theta[1:4], inertia[np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])]]
    )


def _lengths(geometry: Geometry, order: Order) -> Array:
    """All distances and heights between hinges of a side, and the legs' home lengths: what a turn or mirror keeps."""
    places = list(order)
    parts = [geometry.home_leg_length_m[places]]
    for hinges in (geometry.base_hinges_m[places], geometry.platform_hinges_m[places]):
        parts += [np.linalg.norm(hinges[:, None] - hinges[None], axis=2).ravel(), hinges[:, 2]]
    below, above = geometry.base_hinges_m[places, :2], geometry.platform_hinges_m[places, :2]
    return np.concatenate([*parts, (below @ above.T).ravel()])
