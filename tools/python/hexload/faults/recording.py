"""A clean run of the simulator as arrays: what sensors showed, what they would have shown without noise, how the platform
moved, what it carried. Faults turn one recording into another.

A fault of the world leaves the motion as it is, as a stiff servo would, and changes the forces that the motion takes: a
wrench W that acts on the platform beside the legs changes the leg forces by -J^-T W.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.rig_model import LegMotion
from hexload.io.log_file import CHANNEL_KEYS, COLUMNS, LegLog
from hexload.io.toml_document import Table, to_toml
from hexload.theory import bound
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

TICK_S = 1e-3


@dataclass(frozen=True)
class LoadStep:
    at_s: float
    theta: Array  # (10,), the load's from then on


@dataclass(frozen=True)
class Recording:
    log: LegLog  # what the estimator is given
    clean: LegLog  # the same without noise of sensors
    motion: LegMotion  # true; the platform's own axes
    position_m: Array  # (n, 3) of O_A from home, base axes
    loads: tuple[LoadStep, ...]  # true
    own_theta: Array  # (10,), the empty platform's, true
    gravity_m_s2: Array  # (3,), true, base axes
    platform: Table  # what is stated to the estimator of the machine
    changes_s: tuple[tuple[float, float], ...]  # from when to when the load changes
    order: tuple[int, ...] = tuple(range(LEGS))  # whose channels the log has at legs 1 to 6, from 0

    @property
    def t_s(self) -> Array:
        """When the arrays of the truth were; the log may tell other times."""
        return self.clean.t_s

    @property
    def theta(self) -> Array:
        """(10,) of the load at the end."""
        return self.loads[-1].theta

    def total_theta(self) -> Array:
        """(n, 10) of platform and load at each tick."""
        rows = np.zeros((len(self.t_s), 10))
        for load in self.loads:
            rows[self.t_s >= load.at_s - 1e-9] = load.theta
        return rows + self.own_theta


def write_files(recording: Recording, folder: Path, name: str = "log.csv") -> tuple[Path, Path]:
    """Log and platform file as a user has them."""
    log, platform = folder / name, folder / "platform.toml"
    rows = np.column_stack([recording.log.t_s, *channels_of(recording.log)])
    shown = [k for k, name in enumerate(COLUMNS) if recording.log.has_velocity or not name.startswith("vl")]
    header = ",".join(COLUMNS[k] for k in shown)
    np.savetxt(log, rows[:, shown], fmt="%.9g", delimiter=",", header=header, comments="")
    platform.write_text(to_toml(recording.platform))
    return log, platform


def in_channel(recording: Recording, channel: str) -> Array:
    """A copy of what the sensors of a channel show, (n, 6)."""
    return getattr(recording.log, CHANNEL_KEYS[channel]).copy()


def with_channel(recording: Recording, channel: str, values: Array) -> Recording:
    return replace(recording, log=replace(recording.log, **{CHANNEL_KEYS[channel]: values}))


def without_velocity(recording: Recording) -> Recording:
    """As of a machine that has no velocity sensors."""
    return with_channel(recording, "velocity", np.full_like(recording.log.velocity_m_s, np.nan))


def with_log(recording: Recording, t_s: Array, channels: Sequence[Array]) -> Recording:
    """All that the estimator is given, anew: displacement, velocity, force."""
    return replace(recording, log=LegLog(t_s, *channels))


def with_order(recording: Recording, order: Sequence[int]) -> Recording:
    """All channels of other legs: of leg order[i] at leg i."""
    channels = [part[:, list(order)] for part in channels_of(recording.log)]
    counted = tuple(recording.order[leg] for leg in order)
    return replace(with_log(recording, recording.log.t_s, channels), order=counted)


def channels_of(log: LegLog) -> tuple[Array, Array, Array]:
    return log.displacement_m, log.velocity_m_s, log.force_n


def noise_of(recording: Recording, channel: str) -> Array:
    return in_channel(recording, channel) - getattr(recording.clean, CHANNEL_KEYS[channel])


def with_leg_forces(recording: Recording, force_n: Array) -> Recording:
    """The legs (or what rubs on their force sensors) push so much more, (n, 6)."""
    return replace(
        recording,
        log=replace(recording.log, force_n=recording.log.force_n + force_n),
        clean=replace(recording.clean, force_n=recording.clean.force_n + force_n),
    )


def with_wrench(recording: Recording, wrench: Array) -> Recording:
    """What acts on the platform beside its legs and gravity: [F, moment about O_A] in platform axes, (n, 6)."""
    jacobian = recording.motion.jacobian
    return with_leg_forces(recording, -np.linalg.solve(np.swapaxes(jacobian, 1, 2), wrench[:, :, None])[:, :, 0])


def point_acceleration(motion: LegMotion, point_m: Array) -> Array:
    """(n, 3) of a point (3,) or points (n, 3) fixed to the platform, in platform axes."""
    w, alpha = motion.twist[:, 3:], motion.acceleration[:, 3:]
    point = np.broadcast_to(point_m, w.shape)
    return motion.acceleration[:, :3] + np.cross(alpha, point) + np.cross(w, np.cross(w, point))


def wrench_at(force_n: Array, point_m: Array) -> Array:
    """Of a force (n, 3) at a point of the platform, (3,) or (n, 3)."""
    return np.concatenate([force_n, np.cross(np.broadcast_to(point_m, force_n.shape), force_n)], axis=1)


def motion_of_truth(machine: bound.Platform, truth: bound.Trajectory) -> LegMotion:
    """Accelerations are the differences of the true twist over two ticks."""
    to_platform = np.swapaxes(truth.rotation, 1, 2)
    arms = np.einsum("nij,lj->nli", truth.rotation, machine.platform_hinges_m)
    legs = truth.p_m[:, None] + arms - machine.base_hinges_m + [0.0, 0.0, machine.home_height_m]
    lengths = np.linalg.norm(legs, axis=2)
    e = np.einsum("nij,nlj->nli", to_platform, legs / lengths[:, :, None])
    jacobian = np.concatenate([e, np.cross(machine.platform_hinges_m, e)], axis=2)
    v, w = truth.velocity_m_s, truth.angular_velocity_rad_s

    def turned(vectors: Array) -> Array:
        return np.einsum("nij,nj->ni", to_platform, vectors)

    rates = [turned(np.gradient(part, TICK_S, axis=0)) for part in (v, w)]
    twist, acceleration = np.hstack([turned(v), turned(w)]), np.hstack(rates)
    place_m = truth.p_m + [0.0, 0.0, machine.home_height_m]
    return LegMotion(lengths, e, place_m, to_platform, twist, acceleration, jacobian, np.linalg.inv(jacobian))


def read_recording(path: Path, platform: Table) -> Recording:
    """What write_recording wrote."""
    with np.load(path) as kept:
        t_s, shown, true, body = (kept[name] for name in ("t_s", "shown", "true", "body"))
        loads = tuple(LoadStep(float(at_s), theta) for at_s, theta in zip(kept["load_at_s"], kept["load_theta"]))
    rotation = bound.rotation_from_rpy(body[:, 3:6])
    truth = bound.Trajectory(body[:, :3], rotation, body[:, 6:9], body[:, 9:])
    changes = tuple((load.at_s, load.at_s) for load in loads[1:])
    logs = (LegLog(t_s, *np.split(columns, 3, axis=1)) for columns in (shown, true))
    machine = bound.platform_of(platform)
    gravity = np.array([0.0, 0.0, -machine.gravity_m_s2])
    motion = motion_of_truth(machine, truth)
    return Recording(*logs, motion, truth.p_m, loads, machine.theta, gravity, platform, changes)


def write_recording(path: Path, run: Path, loads: Sequence[Table], log: LegLog) -> None:
    """Of a run directory; `log`: its log.csv, `loads`: those of its meta.json. Appears at `path` as it is."""
    truth = np.loadtxt(run / "truth.csv", delimiter=",", skiprows=1)
    with path.open("wb") as file:
        np.savez(
            file,
            t_s=log.t_s,
            shown=np.hstack(channels_of(log)),
            true=truth[:, 19:37],
            body=truth[:, 1:13],
            load_at_s=[load["at_s"] for load in loads],
            load_theta=[load["theta"] for load in loads],
        )
