"""The small animated view of a run: machine and loads at some hundred moments, as data that motion.js draws on a canvas."""

import json
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.estimation.load_summary import SYMBOLS, unit_of_parameter
from hexload.report.charts import encode
from hexload.view import colours
from hexload.view.body import ROUGHEST, Body, body_of_estimate, body_of_theta
from hexload.view.frame import SIGMAS
from hexload.view.recorded import Recording

Array = NDArray[np.float64]

FRAMES = 300
FRAMES_OF_MANY = 200  # of a page with many runs
FRAME_S = 0.04
LONGEST_S = 20.0  # that the whole run is shown in


def to_html(platform: Any, recording: Recording, identifier: str, frames: int = FRAMES) -> str:
    """`platform`: hexload_native.Platform; `frames`: at most. Nothing where no pose can be told."""
    data = _data(platform, recording, frames)
    if data is None:
        return ""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<div class="motion" id="{escape(identifier)}"><canvas></canvas><p class="controls"><button type="button"></button>'
        f'<input type="range" min="0" step="1" aria-label="time"><output></output></p>{_scale(*data["force"]["kept"])}'
        f'<script type="application/json">{text}</script></div>'
    )


def _scale(low_n: float, high_n: float) -> str:
    """What the legs' colours mean."""
    bar = f'<i style="background: {colours.gradient_css()}"></i>'
    low, high = (f"{force_n:.0f}".replace("-", "−") for force_n in (low_n, high_n))
    return f'<p class="scale">force of the legs, N (positive pushes): <span>{low}</span>{bar}<span>{high}</span></p>'


def _data(platform: Any, recording: Recording, frames: int) -> dict | None:
    module = project.native_module()
    radius = float(np.linalg.norm(platform.platform_hinges_m[:, :2], axis=1).max())
    count = int(np.clip(recording.duration_s / FRAME_S, 2, frames))
    times = np.linspace(0.0, recording.duration_s, count)
    pose, force = np.full((count, 6), np.nan), np.full((count, 6), np.nan)
    estimated, true = np.full((count, 12), np.nan), np.full((count, 12), np.nan)
    words = []
    for row, t_s in enumerate(times):
        recording.t_s = float(t_s)
        frame = recording.frame()
        if frame.displacement_m is not None:
            pose[row], force[row] = _pose(module, platform, frame.displacement_m), frame.force_n
        if frame.truth is not None:
            true[row] = _shape(body_of_theta(module, frame.truth.theta, np.zeros(10)), radius)
        if frame.estimate is not None:
            numbers = (frame.estimate.names, frame.estimate.value, frame.estimate.sigma)
            estimated[row] = _shape(body_of_estimate(module, *numbers, platform.known_mass_kg), radius)
        words.append(_words(frame.estimate))
    if not np.isfinite(pose).all(axis=1).any():
        return None
    low, high = recording.force_range_n
    return {
        "base": np.round(platform.base_hinges_m, 5).tolist(),
        "platform": np.round(platform.platform_hinges_m, 5).tolist(),
        "home": round(float(platform.home_height_m), 5),
        "duration": recording.duration_s,
        "frames": count,
        "speed": max(1.0, recording.duration_s / LONGEST_S),
        "changes": list(recording.load_changes_s),
        "pose": _coded(pose),
        "force": {"v": encode(force.ravel(), (low, max(high, low + 1.0))), "kept": [low, max(high, low + 1.0)]},
        "estimated": _coded(estimated),
        "true": _coded(true),
        "words": words,
    }


def _pose(module: Any, platform: Any, displacement_m: Array) -> Array:
    """x, y, z, roll, pitch, yaw from home."""
    if not np.isfinite(displacement_m).all():
        return np.full(6, np.nan)
    try:
        position, r = module.forward_kinematics(platform, displacement_m)
    except ValueError:
        return np.full(6, np.nan)
    roll, pitch, yaw = np.arctan2(r[2, 1], r[2, 2]), -np.arcsin(np.clip(r[2, 0], -1, 1)), np.arctan2(r[1, 0], r[0, 0])
    return np.array([*position, roll, pitch, yaw])


def _shape(body: Body | None, radius: float) -> Array:
    """Centre of mass and the half edges of the box of equal mass and inertia, in platform axes; NaN where there is none."""
    found = np.full(12, np.nan)
    if body is None or body.mass_kg <= 0.0 or np.abs(body.com_m).max() > ROUGHEST * radius:
        return found
    found[:3] = body.com_m
    if body.box_m is not None and body.box_m.max() < ROUGHEST * radius:
        found[3:] = (0.5 * body.box_axes * body.box_m).T.ravel()
    return found


def _words(estimate: Any) -> str:
    if estimate is None:
        return ""
    name, value, sigma = estimate.names[0], estimate.value[0], SIGMAS * estimate.sigma[0]
    digits = 4 if name == "dz" else 2
    verdict = estimate.verdict.replace("_", " ")
    size = f"{value:.{digits}f} ± {sigma:.{digits}f} {unit_of_parameter(name)} (3σ)"
    return f"{SYMBOLS.get(name, name)} = {size}, {verdict}"


def _coded(values: Array) -> dict:
    """None of them known: an empty text."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return {"v": "", "kept": [0.0, 1.0]}
    low, high = float(finite.min()), float(finite.max())
    kept = (low, high if high > low else low + 1.0)
    return {"v": encode(values.ravel(), kept), "kept": list(kept)}
