"""The firmware's estimators on arrays: sample by sample, or over a whole log."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexload import project
from hexload.errors import InputError
from hexload.estimation import load_summary
from hexload.estimation.arrays import leg_log, one_sample
from hexload.estimation.firmware_run import run_firmware
from hexload.estimation.input_check import refuse_implausible
from hexload.estimation.leg_mass import ACCELERATION_S
from hexload.estimation.tare import MachineTare
from hexload.io.log_file import LegLog
from hexload.platform import Kind, Platform, Prior

Array = NDArray[np.float64]
PlatformLike = Platform | Mapping[str, Any] | Path | str


@dataclass(frozen=True)
class Estimate:
    """What the firmware says after one sample."""

    t_s: float  # since the first sample
    names: tuple[str, ...]  # of the n parameters; units: hexload.unit_of(name)
    value: Array  # (n,), SI, about O_A in platform axes; of the paper's filter about the load's centre of mass
    sigma: Array  # (n,), one standard deviation, the tare's included
    own_sigma: Array  # (n,), the filter's part of it: what its noise model alone would say
    nis: float  # normalised innovation squared; its mean is the number of measurements where model and noise fit
    verdict: str  # the worst of the parameters': converged, converging, not_excited, misfit, inconsistent
    parameter_verdict: tuple[str, ...]  # of the load's parameters
    health: tuple[str, ...]  # remarks of this sample, as in hexload/types.h
    input_fault: str  # what is wrong with the channels, with leg and what to do; empty: nothing

    def __getitem__(self, name: str) -> float:
        """The value of a parameter."""
        return float(self.value[self.names.index(name)])


class Estimator:
    """One of the firmware's estimators, its own C code, sample by sample.

    platform    a platform file, its tables as a dict, or a Platform
    kind        momentum (all ten parameters, any motion), momentum_effects (and bias and friction of the legs, tilt of
                the base), paper (dz, Ixx, Iyy, Izz at known mass); None: the platform's own
    prior       start covariance of the paper's filter, safe or printed; None: the platform's own
    sampling_s  period of the samples, s; None: the platform's own
    tare        what hexload.tare() found of the empty platform

    Raises InputError with key, what was found and what is expected.
    Source: firmware/EQUATIONS.md; the momentum filter is this project's, the paper's filter is of its section 3.
    """

    def __init__(
        self,
        platform: PlatformLike,
        kind: Kind | None = None,
        *,
        prior: Prior | None = None,
        sampling_s: float | None = None,
        tare: MachineTare | None = None,
    ):
        chosen = Platform.of(platform).with_estimator(kind, prior)
        self._tare = tare
        # samples that the firmware has taken, of which the legs' accelerations are made
        self._before: list[tuple[float, Array, Array, Array]] = []
        self._tick = 0
        machine = chosen.native()
        self._sampling_s = machine.tick_s if sampling_s is None else sampling_s
        self._most_before = math.ceil(ACCELERATION_S / self._sampling_s)
        self._has_velocity = machine.has_velocity
        try:
            self._native = project.native_module().Estimator(
                machine, self._sampling_s, None if tare is None else tare.offset
            )
        except ValueError as error:
            raise InputError(str(error)) from None
        self.names: tuple[str, ...] = tuple(self._native.names)
        self._health_names = tuple(self._native.health_names)

    def step(self, dl: ArrayLike, vl: ArrayLike | None, f: ArrayLike, *, tick: int | None = None) -> Estimate | None:
        """Takes a sample and returns the estimate after it.

        dl    (6,) leg displacements from home, m, positive = extended
        vl    (6,) leg velocities, m/s; None of a platform that has no velocity sensors
        f     (6,) leg forces, N, positive pushes the platform away from the base
        tick  number of the sample, greater than the one before; None: the next. A jump is a gap.

        Returns None when the firmware refuses the sample, which leaves its state as it was; last_refusal says why.
        Values are rounded to float32, as the controller's samples are. Raises InputError on a wrong shape.
        """
        if vl is None and self._has_velocity:
            raise InputError("vl: found None, expected leg velocities, or a platform with [sensors] velocity = false")
        legs = tuple(part.astype(np.float32).astype(float) for part in one_sample(dl, vl, f))
        now = self._tick if tick is None else tick
        if now < self._tick:
            raise InputError(f"tick: found {now}, expected {self._tick} or more")
        self._tick = now + 1
        timed = (now * self._sampling_s, *legs)
        answer = self._native.step(now, *self._without_leg_mass(timed))
        if answer is None:
            return None
        self._before = [*self._before, timed][-self._most_before :]
        value, sigma, own_sigma, nis, verdict, verdicts, bits = answer
        health = tuple(name for bit, name in enumerate(self._health_names) if bits >> bit & 1)
        return Estimate(
            now * self._sampling_s,
            self.names,
            value,
            sigma,
            own_sigma,
            nis,
            verdict,
            tuple(verdicts),
            health,
            self._native.input_fault,
        )

    def _without_leg_mass(self, timed: tuple[float, Array, Array, Array]) -> tuple[Array, ...]:
        """Displacements, velocities and forces, (6,) each, of a sample that begins with its time."""
        legs = timed[1:]
        if self._tare is None or self._tare.leg_mass is None:
            return legs
        if self._has_velocity and np.isnan(legs[1]).any():
            return legs  # the firmware refuses it
        log = LegLog(*(np.array(column) for column in zip(*self._before, timed)))
        return (*legs[:2], self._tare.taken_off(log).force_n[-1])

    @property
    def covariance(self) -> Array | None:
        """(n, n) after the last sample, without the tare's. None: the paper's filter, which does not publish it."""
        matrix = self._native.covariance
        return matrix if matrix.size else None

    @property
    def load_changes_s(self) -> list[float]:
        """Times since the first sample at which a change of the load was detected."""
        return self._native.load_changes_s

    @property
    def refused(self) -> int:
        """Samples that the firmware refused."""
        return self._native.refused

    @property
    def last_refusal(self) -> str:
        """The firmware's word for the last refusal."""
        return self._native.last_refusal


@dataclass(frozen=True)
class Body:
    """The load as a body: m kg; centre of mass cx, cy, cz m; tensor about it Ixx .. Iyz kg m^2; platform axes."""

    names: tuple[str, ...]
    value: Array  # (10,), nan where it is not known yet
    sigma: Array  # (10,)
    is_consistent: bool  # some body can have these parameters
    nearest: Array  # (10,) of the nearest body that can exist

    def __getitem__(self, name: str) -> float:
        return float(self.value[self.names.index(name)])


@dataclass(frozen=True)
class Replay:
    """An estimator's answers to a log; refused samples have no row."""

    t_s: Array  # (k,)
    names: tuple[str, ...]
    value: Array  # (k, n), as Estimate.value
    sigma: Array  # (k, n)
    own_sigma: Array  # (k, n), as Estimate.own_sigma
    nis: Array  # (k,)
    verdict: tuple[str, ...]  # (k,)
    parameter_verdict: dict[str, str]  # in words, at the end
    covariance: Array | None  # (n, n) at the end, without the tare's; None: the paper's filter
    body: Body | None  # at the end; None: the paper's filter
    load_changes_s: list[float]  # when a change of the load was detected
    health_counts: dict[str, int]  # ticks with each remark
    input_faults: list[tuple[float, str]]  # since when which channels contradict each other, in words
    refused: int  # samples
    first_refusal: str


@dataclass(frozen=True)
class Identification:
    """The load at the end of a log."""

    names: tuple[str, ...]
    value: Array  # (n,)
    sigma: Array  # (n,)
    own_sigma: Array  # (n,), as Estimate.own_sigma
    verdict: str
    words: dict[str, str]  # each parameter's verdict with its reason
    body: Body | None
    load_changes_s: list[float]

    def __getitem__(self, name: str) -> float:
        """The value of a parameter, e.g. load["m"]."""
        return float(self.value[self.names.index(name)])

    def __str__(self) -> str:
        """A line for each parameter: value, sigma, unit, the filter's own part of sigma, verdict."""
        rows = zip(self.names, self.value, self.sigma, self.own_sigma)
        lines = [
            f"{name:4} {value:10.4f} +- {sigma:.4f} {unit_of(name)} (own {own:.4f})  {self.words.get(name, '')}".rstrip()
            for name, value, sigma, own in rows
        ]
        return "\n".join(lines)


def replay(
    t: ArrayLike,
    dl: ArrayLike,
    vl: ArrayLike | None,
    f: ArrayLike,
    platform: PlatformLike,
    kind: Kind | None = None,
    *,
    prior: Prior | None = None,
    tare: MachineTare | None = None,
    unchecked: bool = False,
) -> Replay:
    """Runs the firmware's own C code over a log in memory.

    t           (n,) s, strictly increasing, multiples of the sampling period; rows may be missing
    dl, vl, f   (n, 6) as of Estimator.step(): m, m/s, N; vl None: no velocity sensors, whatever the platform says; nan
                where one is missing: one of six dl or f is bridged, a row with more gaps is a missing one
    platform, kind, prior, tare   as of Estimator
    unchecked   go on where units, signs or order contradict each other

    Raises InputError: wrong shapes, values that are infinite, channels that contradict each other, a platform that lacks
    what the estimator needs, or a log of which every sample is refused. 20,000 rows take about a second. Source: as of Estimator.
    """
    samples = leg_log(t, dl, vl, f)
    chosen = Platform.of(platform).with_estimator(kind, prior)
    native, machine = project.native_module(), chosen.native()
    if not unchecked:
        refuse_implausible(
            native, samples, machine, machine.known_mass_kg if machine.estimator_kind == "paper" else None
        )
    legs, offset = (samples, None) if tare is None else (tare.taken_off(samples), tare.offset)
    try:
        result = run_firmware(native, machine, legs, Path(os.devnull), tare=offset)
    except ValueError as error:
        raise InputError(str(error)) from None
    words = {
        name: load_summary.in_words(name, verdict, result["confounded"].get(name))
        for name, verdict in zip(result["names"], result["parameter_verdict"])
    }
    return Replay(
        t_s=result["t"],
        names=tuple(result["names"]),
        value=result["value"],
        sigma=result["sigma"],
        own_sigma=result["own_sigma"],
        nis=result["nis"],
        verdict=tuple(result["verdict"]),
        parameter_verdict=words,
        covariance=result.get("covariance"),
        body=_body(result.get("body")),
        load_changes_s=load_summary.load_changes_s(result),
        health_counts=dict(result["health_counts"]),
        input_faults=list(result["input_faults"]),
        refused=result["refused"],
        first_refusal=result["first_refusal"],
    )


def identify(
    t: ArrayLike,
    dl: ArrayLike,
    vl: ArrayLike | None,
    f: ArrayLike,
    platform: PlatformLike,
    kind: Kind | None = None,
    *,
    prior: Prior | None = None,
    tare: MachineTare | None = None,
    unchecked: bool = False,
) -> Identification:
    """The load at the end of a log in memory: replay() and its last row. Arguments, errors and source as of replay()."""
    run = replay(t, dl, vl, f, platform, kind, prior=prior, tare=tare, unchecked=unchecked)
    return Identification(
        names=run.names,
        value=run.value[-1],
        sigma=run.sigma[-1],
        own_sigma=run.own_sigma[-1],
        verdict=run.verdict[-1],
        words=run.parameter_verdict,
        body=run.body,
        load_changes_s=run.load_changes_s,
    )


def unit_of(name: str) -> str:
    """Of a parameter of any estimator, e.g. "hz": kg m."""
    return load_summary.unit_of_parameter(name)


def _body(body: dict | None) -> Body | None:
    if body is None:
        return None
    return Body(tuple(body["names"]), body["value"], body["sigma"], body["is_consistent"], body["nearest"])
