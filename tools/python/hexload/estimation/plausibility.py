"""What a log's channels say of each other before any estimator has them: units, signs, order, time.

Sums alone are kept, so a log may come in parts, of any length. No few values decide: what is stray is left out, the stroke is
held against quantiles, the weight against medians. Compared are, over blocks of 32 rows, the change of each
displacement with the way of each velocity; displacements with the machine's stroke; the legs' vertical force at the home
pose with the weight that they carry, and its changes with the vertical acceleration. What contradicts itself beyond any
doubt is told with the column map that would mend it; nothing is converted. What is left the firmware's own check finds.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.stray import strays_of, without
from hexload.io.log_file import LEGS, LegLog

Array = NDArray[np.float64]

BLOCK_ROWS = 32  # 20 um of displacement are then 1 mm/s, so slow motion can be compared
FEWEST_BLOCKS = 30
SHORTEST_S, LONGEST_S = 0.95e-4, 5.05e-3  # sampling periods of the firmware
CLEAR, UNCLEAR = 0.95, 0.7  # correlation of what belongs together, and of what does not
FALLING = 0.8  # correlation, less its sign, of the legs' force with acceleration: the home pose stands for all
LIFTING = 0.2  # of the legs' acceleration the platform's along the vertical: less is what tilting does to second order
SAME = 0.05  # a factor of a unit is met within that
NEARLY_ALL = (0.001, 0.999)  # quantiles of a part's displacements
OUTSIDE = 0.1  # of the stroke's span, beyond which legs cannot be
LENGTHS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "um": 1e-6}
TIMES = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9, "s": 1e3}  # the last: milliseconds in its heading only
HALF_CARRIED = 0.5  # of the empty platform's weight: less no standing platform leaves on its legs
MOST_CARRIED = 100.0
KNOWN_WITHIN = 0.1  # of the weight, when the load's mass is known
LIKE_OTHERS = 5.0  # times more or less than the median of all legs a leg may carry
LEFT_ACROSS = 0.7  # of what the legs push across the weight, at most, when a leg's unit is mended


@dataclass(frozen=True)
class Doubt:
    words: str
    options: tuple[str, ...]  # of hexload replay, that mend it; empty: no option does

    @property
    def mend(self) -> str:
        return " ".join(self.options)


@dataclass(frozen=True)
class MachineAtHome:
    """What the check knows of the platform."""

    stroke_m: tuple[float, float]
    home_leg_length_m: Array  # (6,)
    twist_of_speeds: Array  # (6, 6): at home, of speeds and of angular ones
    wrench_of_forces: Array  # (6, 6): at home, its moments in metres of the platform hinges' radius
    weight_n: float  # of the empty platform
    expected_n: float | None  # with its load, when that is known


def machine_of(platform, load_kg: float | None) -> MachineAtHome:
    """Of hexload_native.Platform. `load_kg`: what it carries; None: not known."""
    hinges = np.asarray(platform.platform_hinges_m)
    legs = hinges + [0.0, 0.0, platform.home_height_m] - np.asarray(platform.base_hinges_m)
    e = legs / np.linalg.norm(legs, axis=1)[:, None]
    jacobian = np.hstack([e, np.cross(hinges, e)])
    radius_m = np.sqrt(np.mean(np.sum(hinges[:, :2] ** 2, axis=1)))
    weight_n = platform.mass_kg * platform.gravity_m_s2
    expected_n = None if load_kg is None else weight_n + load_kg * platform.gravity_m_s2
    low, high = np.asarray(platform.stroke_m, float).ravel()[:2]
    home_m = np.asarray(platform.home_leg_length_m, float)
    wrench_of_forces = (jacobian / np.repeat([1.0, radius_m], 3)).T
    return MachineAtHome(
        (float(low), float(high)), home_m, np.linalg.inv(jacobian), wrench_of_forces, weight_n, expected_n
    )


def mm(unit: str, channel: str = "dl") -> str:
    return f"--columns '{channel} = {{ unit = \"{unit}\" }}'"


def negated(channel: str) -> str:
    return f"--columns '{channel} = {{ sign = -1 }}'"


class Plausibility:
    """Of one log, part by part. Without a machine: what displacements, velocities and time alone say."""

    def __init__(self, machine: MachineAtHome | None, sampling_s: float):
        self._machine = machine
        self._sampling_s = sampling_s
        self._blocks = 0
        self._changes_ways = np.zeros((6, 6))  # sums of products of the blocks
        self._changes2, self._ways2 = np.zeros(6), np.zeros(6)
        self._lowest, self._highest = np.full(6, np.inf), np.full(6, -np.inf)
        self._force_n, self._rows = 0.0, 0  # the sum of the parts' medians, each as often as it has rows
        self._forces = np.zeros((5, 6))  # of blocks: sums of F, the next F, F^2, the next F^2, F times the next
        self._force_blocks = 0
        self._acceleration = np.zeros(5)  # sums: count, a, F, a^2, a F
        self._force2 = self._legs_acceleration2 = 0.0
        self._has_velocity = True

    def add(self, part: LegLog) -> None:
        self._has_velocity = part.has_velocity
        part = without(part, strays_of(part))
        known = ~np.isnan(part.displacement_m).all(axis=0)
        low, high = np.nanquantile(part.displacement_m[:, known], NEARLY_ALL, axis=0)
        self._lowest[known] = np.minimum(self._lowest[known], low)
        self._highest[known] = np.maximum(self._highest[known], high)
        upward_n = part.force_n @ (np.ones(6) if self._machine is None else self._machine.wrench_of_forces[2])
        whole = ~np.isnan(upward_n)
        if whole.any():
            self._force_n += float(np.median(upward_n[whole])) * int(whole.sum())
        self._rows += int(whole.sum())
        self._add_blocks(part, upward_n)

    def _add_blocks(self, part: LegLog, upward_n: Array) -> None:
        count = (len(part.t_s) - 1) // BLOCK_ROWS
        if count == 0:
            return
        ends = BLOCK_ROWS * np.arange(count + 1)
        spans_s = np.diff(part.t_s[ends])
        changes = np.diff(part.displacement_m[ends], axis=0)
        ways = changes
        if part.has_velocity:
            steps = 0.5 * (part.velocity_m_s[1:] + part.velocity_m_s[:-1]) * np.diff(part.t_s)[:, None]
            ways = np.add.reduceat(steps[: ends[-1]], ends[:-1], axis=0)
        is_whole = spans_s < 1.5 * BLOCK_ROWS * self._sampling_s
        is_whole &= np.isfinite(changes + ways).all(axis=1)
        self._changes_ways += changes[is_whole].T @ ways[is_whole]
        self._changes2 += np.sum(changes[is_whole] ** 2, axis=0)
        self._ways2 += np.sum(ways[is_whole] ** 2, axis=0)
        self._blocks += int(is_whole.sum())
        if self._machine is None:
            return
        forces = np.add.reduceat(upward_n[: ends[-1]], ends[:-1]) / BLOCK_ROWS
        self._add_accelerations(changes / spans_s[:, None], forces, part.t_s[ends], is_whole)
        self._add_forces(np.add.reduceat(part.force_n[: ends[-1]], ends[:-1], axis=0) / BLOCK_ROWS)

    def _add_forces(self, means_n: Array) -> None:
        now, then = means_n[:-1], means_n[1:]
        is_whole = np.isfinite(now + then).all(axis=1)
        now, then = now[is_whole], then[is_whole]
        self._forces += [sums.sum(axis=0) for sums in (now, then, now**2, then**2, now * then)]
        self._force_blocks += len(now)

    def _add_accelerations(self, speeds_m_s: Array, forces: Array, ends_s: Array, is_whole: NDArray[np.bool_]) -> None:
        """Of a block and the next: speeds of their middles, the force over both."""
        between_s = 0.5 * (ends_s[2:] - ends_s[:-2])
        both = is_whole[1:] & is_whole[:-1] & np.isfinite(forces[1:] + forces[:-1])
        of_legs = (np.diff(speeds_m_s, axis=0) / between_s[:, None])[both]
        a = of_legs @ self._machine.twist_of_speeds[2]
        force = 0.5 * (forces[1:] + forces[:-1])[both]
        self._acceleration += [len(a), a.sum(), force.sum(), (a**2).sum(), (a * force).sum()]
        self._force2 += float((force**2).sum())
        self._legs_acceleration2 += float((of_legs**2).mean(axis=1).sum())

    def doubt(self) -> Doubt | None:
        """The first that there is; None: nothing contradicts itself so far."""
        time = self._of_time()
        if self._machine is None:  # not for an estimator: slow rows will do
            return (time if time and time.options else None) or self._of_order() or self._of_speed()
        return (
            time
            or self._of_stroke(self._machine)
            or self._of_order()
            or self._of_speed()
            or self._of_weight(self._machine)
            or self._of_one_force(self._machine)
            or self._of_sign()
        )

    def _of_time(self) -> Doubt | None:
        period_s = self._sampling_s
        if SHORTEST_S <= period_s <= LONGEST_S:
            return None
        apart = f"rows are {period_s:g} s apart, a controller's ticks 0.0001 to 0.005 s"
        for unit, factor in TIMES.items():
            if SHORTEST_S <= period_s * factor <= LONGEST_S:
                return Doubt(f"time looks like {unit}: {apart}", (mm(unit, "t"),))
        if period_s < SHORTEST_S:
            return Doubt(f"time is too dense: {apart}", ("--resample 0.001",))
        return Doubt(f"too few rows: {apart}; what lies between them no option makes: record faster", ())

    def _of_stroke(self, machine: MachineAtHome) -> Doubt | None:
        low, high = machine.stroke_m
        if self._fits(machine, 1.0, 0.0):
            return None
        lowest, highest = self._lowest.min(), self._highest.max()
        found = f"displacements are {lowest:.4g} to {highest:.4g} m, the stroke is {low:g} to {high:g} m"
        home = machine.home_leg_length_m
        gains = self._gains()
        if gains is None and self._correlation() is not None:
            return Doubt(
                f"displacements are no displacements: {found}, and they do not change as the velocities say", ()
            )
        for unit, factor in {"m": 1.0, **LENGTHS}.items():
            if gains is not None and unit != "m" and not _all_near(gains, 1.0) and not _all_near(gains, 1.0 / factor):
                continue
            both = gains is not None and unit != "m" and _all_near(gains, 1.0)
            options = (mm(unit), *((mm(f"{unit}/s", "vl"),) if both else ()))
            if unit != "m" and self._fits(machine, factor, 0.0):
                who = "displacements and velocities look" if both else "displacements look"
                return Doubt(f"{who} like {unit}{f' and {unit}/s' if both else ''}: {found}", options)
            for offset, what in ((-home, "absolute leg lengths"), (np.full(6, low), "lengths from the shortest leg")):
                if self._fits(machine, factor, offset):
                    in_unit = "" if unit == "m" else f" in {unit}"
                    moved = _moved(unit, offset)
                    return Doubt(f"displacements look like {what}{in_unit}: {found}", (*moved, *options[1:]))
        return None

    def _fits(self, machine: MachineAtHome, factor: float, offset: float | Array) -> bool:
        low, high = machine.stroke_m
        slack = OUTSIDE * (high - low)
        lowest, highest = factor * self._lowest + offset, factor * self._highest + offset
        return bool((lowest >= low - slack).all() and (highest <= high + slack).all())

    def _correlation(self) -> Array | None:
        """(6, 6) of displacements (rows) with velocities; None: too little motion, or no velocities."""
        if not self._has_velocity or self._blocks < FEWEST_BLOCKS or not self._changes2.all() or not self._ways2.all():
            return None
        return self._changes_ways / np.sqrt(self._changes2[:, None] * self._ways2)

    def _gains(self) -> Array | None:
        """(6,) of displacements' derivatives against velocities; nan where that is not clear. None: of no leg."""
        correlation = self._correlation()
        if correlation is None:
            return None
        own = np.diag(correlation)
        gains = np.where(np.abs(own) > CLEAR, np.diag(self._changes_ways) / self._ways2, np.nan)
        return None if np.isnan(gains).all() else gains

    def _of_order(self) -> Doubt | None:
        correlation = self._correlation()
        if correlation is None:
            return None
        best = np.abs(correlation).argmax(axis=1)
        own, others = np.abs(np.diag(correlation)), np.abs(correlation).max(axis=1)
        moved = np.flatnonzero((own < UNCLEAR) & (others > CLEAR))
        if moved.size < 2 or sorted(best[moved]) != list(moved):
            return None
        legs = (
            " and ".join(str(leg + 1) for leg in moved) if moved.size == 2 else ", ".join(str(leg + 1) for leg in moved)
        )
        pairs = ", ".join(f"dl{leg + 1} with vl{best[leg] + 1}" for leg in moved)
        options = tuple(f"--columns 'vl{leg + 1} = \"vl{best[leg] + 1}\"'" for leg in moved)
        words = f"legs {legs} look swapped: {pairs} belong together (if it is the displacements, swap dl instead of vl)"
        return Doubt(words, options)

    def _of_speed(self) -> Doubt | None:
        if self._has_velocity and self._blocks >= FEWEST_BLOCKS and not self._ways2.any() and self._changes2.all():
            return Doubt(
                "velocities are 0 throughout, and the legs move: there are no velocities", ("--columns 'vl = false'",)
            )
        gains = self._gains()
        if gains is None:
            return None
        for unit, factor in LENGTHS.items():
            for channel, gain, name in (("dl", 1.0 / factor, unit), ("vl", factor, f"{unit}/s")):
                legs = np.flatnonzero(_near(gains, gain) | _near(gains, -gain))
                if legs.size:
                    return self._of_unit(channel, name, legs, gain)
        legs = np.flatnonzero(_near(gains, -1.0))
        if not legs.size:
            return None
        words = f"velocities{_of_legs(legs)} have the opposite sign of the displacements' change"
        if legs.size < 6:
            others = " ".join(negated(f"dl{leg + 1}") for leg in legs)
            return Doubt(
                f"{words} (if it is the displacements: {others})", tuple(negated(f"vl{leg + 1}") for leg in legs)
            )
        return Doubt(words, (negated("dl" if self._is_falling() else "vl"),))

    def _of_unit(self, channel: str, unit: str, legs: NDArray[np.intp], gain: float) -> Doubt:
        name = {"dl": "displacements", "vl": "velocities"}[channel]
        words = (
            f"{name}{_of_legs(legs)} look like {unit}: displacements change {gain:g} times as fast as velocities say"
        )
        options = (mm(unit, channel),) if legs.size == 6 else tuple(mm(unit, f"{channel}{leg + 1}") for leg in legs)
        return Doubt(words, options)

    def _of_weight(self, machine: MachineAtHome) -> Doubt | None:
        if self._rows < FEWEST_BLOCKS * BLOCK_ROWS:
            return None
        mean_n, weight_n = self._force_n / self._rows, machine.weight_n
        carried = mean_n / weight_n
        found = f"the legs carry {mean_n:.4g} N, the empty platform weighs {weight_n:.4g} N"
        if carried <= -HALF_CARRIED:
            return Doubt(f"forces have the opposite sign: {found}", (negated("f"),))
        if abs(carried) < HALF_CARRIED:
            sign = ", sign = -1" if carried < 0 else ""
            unit = "kN" if 0.7 <= abs(1e3 * carried) <= MOST_CARRIED else "kgf" if 10 * abs(carried) > 0.9 else None
            if unit is not None:
                opposite = ", with the opposite sign" if sign else ""
                also = " (or daN, or lbf)" if unit == "kgf" else ""
                option = f"--columns 'f = {{ unit = \"{unit}\"{sign} }}'"
                return Doubt(f"forces look like {unit}{also}{opposite}: {found}", (option,))
            return Doubt(
                f"forces are no weight of this platform: {found}; check their unit, and mass_kg of the platform file",
                (),
            )
        if carried > MOST_CARRIED:
            return Doubt(f"forces look like mN: {found}", (mm("mN", "f"),))
        return _of_known_weight(mean_n, machine.expected_n)

    def _of_one_force(self, machine: MachineAtHome) -> Doubt | None:
        """Of legs that carry next to nothing, and a thousand times as much fits: as others, and to a standing platform's balance
        across the weight. A dead sensor's noise does not: a load's force is much the same 32 rows later."""
        if self._force_blocks < FEWEST_BLOCKS:
            return None
        now, then, now2, then2, both = self._forces / self._force_blocks
        rms_n = np.sqrt(now2)
        share = 1e3 * rms_n / np.median(rms_n)
        spread = np.sqrt(np.fmax(now2 - now**2, 0.0) * np.fmax(then2 - then**2, 0.0))
        legs = np.flatnonzero(
            (share > 1.0 / LIKE_OTHERS)
            & (share < LIKE_OTHERS)
            & (both - now * then > UNCLEAR * spread)
            & (spread > 0.0)
        )
        factors = np.where(np.isin(np.arange(6), legs), 1e3, 1.0)
        across, mended = (machine.wrench_of_forces[[0, 1, 5]] @ (f * now) for f in (1.0, factors))
        if not legs.size or np.linalg.norm(mended) > LEFT_ACROSS * np.linalg.norm(across):
            return None
        words = f"forces{_of_legs(legs)} look like kN: they are {np.median(rms_n) / rms_n[legs].max():.0f} times smaller than others"
        return Doubt(words, tuple(mm("kN", f"f{leg + 1}") for leg in legs))

    def _of_sign(self) -> Doubt | None:
        if not self._is_falling():
            return None
        options = (negated("dl"), *((negated("vl"),) if self._has_velocity else ()))
        words = "legs look positive when they retract: the platform is pushed up while it accelerates downwards"
        return Doubt(words, options)

    def _is_falling(self) -> bool:
        """By the displacements: less force on the legs while the platform accelerates upwards."""
        count, a, force, a2, a_force = self._acceleration
        if count < FEWEST_BLOCKS or a2 < LIFTING**2 * self._legs_acceleration2:
            return False
        covariance = a_force / count - a * force / count**2
        variance = (a2 / count - (a / count) ** 2) * (self._force2 / count - (force / count) ** 2)
        return variance > 0.0 and covariance < -FALLING * np.sqrt(variance) and self._force_n > 0.0


def _of_known_weight(mean_n: float, expected_n: float | None) -> Doubt | None:
    if expected_n is None:
        return None
    for unit, factor in (("lbf", 4.4482216), ("kgf", 9.80665), ("daN", 10.0)):
        if abs(factor * mean_n / expected_n - 1.0) < KNOWN_WITHIN:
            found = f"the legs carry {mean_n:.4g} N, platform and load weigh {expected_n:.4g} N"
            return Doubt(f"forces look like {unit}: {found}", (mm(unit, "f"),))
    return None


def _moved(unit: str, offset_m: Array) -> tuple[str, ...]:
    """Options: of all legs where one offset is that of all."""
    of_unit = "" if unit == "m" else f' unit = "{unit}",'
    channels = ["dl"] if np.ptp(offset_m) == 0.0 else [f"dl{leg}" for leg in LEGS]
    return tuple(f"--columns '{channel} = {{{of_unit} offset = {m:g} }}'" for channel, m in zip(channels, offset_m))


def _near(gains: Array, gain: float) -> NDArray[np.bool_]:
    return np.abs(gains / gain - 1.0) < SAME


def _all_near(gains: Array, gain: float) -> bool:
    return bool(_near(gains[~np.isnan(gains)], gain).all())


def _of_legs(legs: NDArray[np.intp]) -> str:
    return "" if legs.size == len(LEGS) else f" of leg{'s' * (legs.size > 1)} {', '.join(str(leg + 1) for leg in legs)}"
