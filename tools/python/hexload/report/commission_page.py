"""The page of `hexload commission --report`: what was found of a rig, how well, and what the forces still show beside it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from hexload.estimation import rig_model
from hexload.estimation.rig_model import LEGS
from hexload.estimation.rig_record import ROW_HZ
from hexload.estimation.rig_regression import FRICTION, SLICES, Explained, Found, Start, friction_columns
from hexload.report.charts import ERROR, ESTIMATE, REFERENCE, TRUTH, Chart, Panel, Series, to_html
from hexload.report.page import templates
from hexload.theory.bound import THETA_NAMES, unit_of

Array = NDArray[np.float64]

TEMPLATE = "commission.html.jinja"
SEGMENT_S = 4.0  # of the spectra: a quarter of a hertz
HIGHEST_HZ = 40.0  # the regression's own filter
DOTS = 800  # of a leg's friction
BINS = 24
SLOW_M_S = 0.05  # where friction turns
SPEEDS = 400  # of a drawn friction law
HINGES = tuple(f"{side} {leg + 1} {axis}" for side in ("base", "platform") for leg in range(LEGS) for axis in "xyz")
LEG_MASS = ("inertia, kg m²", "slide, kg m", "tilt, kg m")
STIFFNESS = ("x, N/m", "y, N/m", "z, N/m", "about x, N m/rad", "about y, N m/rad", "about z, N m/rad")
UNLIKE = tuple(f"leg {leg + 1}" for leg in range(LEGS) for _ in LEG_MASS)


@dataclass(frozen=True)
class Kind:
    """How the unknowns of a group are shown."""

    title: str
    unit: str
    factor: float = 1.0
    digits: int = 2
    names: tuple[str, ...] = ()


KINDS = {
    "theta": Kind("platform", "", 1.0, 3, tuple(f"{name}, {unit_of(name)}" for name in THETA_NAMES)),
    "leg_mass": Kind("leg mass", "", 1.0, 4, LEG_MASS),
    "unlike_legs": Kind("leg mass, by which legs differ", "", 1.0, 4, UNLIKE),
    "stiffness": Kind("pull towards home (hoses)", "", 1.0, 1, STIFFNESS),
    "coulomb": Kind("Coulomb friction", "N", 1.0, 1),
    "stribeck": Kind("more at rest (Stribeck)", "N", 1.0, 1),
    "viscous": Kind("viscous friction", "N s/m", 1.0, 1),
    "growth": Kind("dry friction by the leg's force", "%", 100.0, 3),
    "offset": Kind("force offset", "N", 1.0, 2),
    "delay": Kind("force delay", "ms", 1e3, 3, ("forces late by, ms",)),
    "tilt": Kind("tilt of gravity", "deg", 180.0 / np.pi, 4, ("towards x, deg", "towards y, deg")),
    "gain": Kind("force gain, beyond 1", "%", 100.0, 3),
    "hinges": Kind("hinges", "mm", 1e3, 3, HINGES),
}


@dataclass(frozen=True)
class Unknown:
    name: str
    stated: float  # by the platform file
    value: float
    sigma: float
    tolerance: float  # one sigma before the run; inf: nothing was known


@dataclass(frozen=True)
class Group:
    name: str
    kind: Kind
    unknowns: list[Unknown]
    words: str  # identifiability

    @property
    def is_per_leg(self) -> bool:
        return len(self.unknowns) == LEGS and not self.kind.names

    @property
    def tolerance(self) -> float:
        return self.unknowns[0].tolerance

    @property
    def change(self) -> float:
        return float(np.sqrt(np.mean([(each.value - each.stated) ** 2 for each in self.unknowns])))

    @property
    def sigma(self) -> float:
        return float(np.median([each.sigma for each in self.unknowns]))


def render(
    start: Start,
    found: Found,
    words: dict[str, str],
    runs: tuple[Explained, Explained],
    source: dict[str, str | float],
    platform: str,
    noise_n: Callable[[Array], Array],
) -> str:
    """`start`: platform file and tolerances; `runs`: the empty run with these numbers and with those found; `noise_n`: of
    the sensors in a residual, (n, 6) N per root Hz at (n,) Hz."""
    groups = [_group(name, start, found, words[name]) for name in SLICES]
    before, after = runs
    figures = {
        "spectra": residual_spectra(before, after, noise_n),
        "friction": friction_curves(after, found, float(np.abs(after.speed_m_s).max())),
        "slow": friction_curves(after, found, SLOW_M_S),
    }
    return (
        templates()
        .get_template(TEMPLATE)
        .render(
            platform=platform,
            source=source,
            groups=groups,
            by_name={group.name: group for group in groups},
            common_gain_percent=100.0 * float(np.sqrt(found.covariance[SLICES["gain"], SLICES["gain"]].mean())),
            legs=[group for group in groups if group.is_per_leg],
            leg_mass_names=LEG_MASS,
            law=found.law,
            rms=[(_rms(before.slow_residual_n[:, leg]), _rms(after.slow_residual_n[:, leg])) for leg in range(LEGS)],
            rms_of_all=(_rms(before.slow_residual_n), _rms(after.slow_residual_n)),
            slow_hz=ROW_HZ,
            figures={name: to_html(chart, f"{name}-figure") for name, chart in figures.items()},
        )
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _group(name: str, start: Start, found: Found, words: str) -> Group:
    part = SLICES[name]
    kind = KINDS.get(name, Kind(name.replace("_", " "), ""))
    sigma = np.sqrt(np.diag(found.covariance)[part])
    stated = np.where(np.isfinite(start.value[part]), start.value[part], 0.0)
    names = kind.names or tuple(f"leg {number}" for number in range(1, len(sigma) + 1))
    columns = (kind.factor * column for column in (stated, found.value[part], sigma, start.sigma[part]))
    return Group(name, kind, [Unknown(*each) for each in zip(names, *columns, strict=True)], words)


def residual_spectra(before: Explained, after: Explained, noise_n: Callable[[Array], Array]) -> Chart:
    """What the forces show beside the model, by frequency: with the platform file's numbers and with those found."""
    fs_hz = 1.0 / float(np.median(np.diff(after.t_s)))
    spectra = []
    for run, colour, name in ((before, ERROR, "platform file"), (after, ESTIMATE, "commissioned")):
        segment = min(round(SEGMENT_S * fs_hz), len(run.t_s))
        hz, density = welch(run.residual_n, fs_hz, nperseg=segment, detrend=False, axis=0)
        shown = (hz > 0.0) & (hz <= HIGHEST_HZ)
        spectra.append((hz[shown], np.sqrt(density[shown]), colour, name))
    hz = spectra[0][0]
    noise = noise_n(hz)
    heights = np.concatenate([each[1].ravel() for each in spectra] + [noise.ravel()])
    y_range = (0.8 * float(heights.min()), 1.25 * float(heights.max()))
    panels = []
    for leg in range(LEGS):
        curves = [Series(at, density[:, leg], colour, name, width=1.6) for at, density, colour, name in spectra]
        curves.append(Series(hz, noise[:, leg], TRUTH, "sensor noise", dash="5 4", width=1.2))
        title = (
            f"leg {leg + 1}: {_rms(before.slow_residual_n[:, leg]):.1f} N → {_rms(after.slow_residual_n[:, leg]):.1f} N"
        )
        axes = {"x_title": "frequency, Hz", "y_title": "residual, N/√Hz", "x_log": True, "y_log": True}
        panels.append(Panel(title, curves, y_range=y_range, **axes))
    return Chart(panels, columns=3, height=270)


def friction_curves(run: Explained, found: Found, fastest_m_s: float) -> Chart:
    """What is left of the forces, below ROW_HZ, without friction's part of the model, by speed, and that part."""
    measured = run.slow_residual_n / (1.0 + found.value[SLICES["gain"]]) + run.friction_n
    speeds = fastest_m_s * np.linspace(-1.0, 1.0, SPEEDS) ** 3  # close together where friction turns round
    shapes = rig_model.friction_shapes(speeds, rig_model.FrictionLaw(**vars(found.law) | {"presliding_m": 0.0}), 1.0)
    in_view = np.abs(measured[np.abs(run.speed_m_s) <= fastest_m_s])
    reach = 1.15 * float(np.quantile(in_view, 0.999)) if in_view.size else 1.0
    panels = []
    for leg in range(LEGS):
        mean_n = np.full(SPEEDS, np.abs(run.force_n[:, leg]).mean())
        law_n = friction_columns(shapes, mean_n) @ [found.value[SLICES[name]][leg] for name in FRICTION]
        shown = np.flatnonzero(np.abs(run.speed_m_s[:, leg]) <= fastest_m_s)
        speed_mm_s, friction_n = 1e3 * run.speed_m_s[shown, leg], measured[shown, leg]
        every = max(1, len(shown) // DOTS)
        series = (
            Series(speed_mm_s[::every], friction_n[::every], REFERENCE, "measured", kind="dots", size=1.3),
            _means(speed_mm_s, friction_n),
            Series(1e3 * speeds, law_n, ERROR, "model", width=1.8),
        )
        panels.append(Panel(f"leg {leg + 1}: friction, N", series, "leg speed, mm/s", y_range=(-reach, reach)))
    return Chart(panels, columns=3, height=280)


def _means(speed_mm_s: Array, friction_n: Array) -> Series:
    """Over equally many rows each."""
    bins = [each for each in np.array_split(np.argsort(speed_mm_s), BINS) if len(each)]
    means = (np.array([float(values[each].mean()) for each in bins]) for values in (speed_mm_s, friction_n))
    return Series(*means, ESTIMATE, f"means of 1/{BINS} of the rows", kind="dots", size=3.0)
