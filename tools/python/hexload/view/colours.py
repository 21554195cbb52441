"""Colours that eyes without red or green tell apart: Okabe and Ito's for what is named, viridis for numbers."""

import numpy as np

Rgb = tuple[int, int, int]

ESTIMATE: Rgb = (0, 114, 178)
TRUTH: Rgb = (213, 94, 0)
CHANGE: Rgb = (204, 121, 167)
INK: Rgb = (36, 41, 47)
MACHINE: Rgb = (150, 158, 168)
FLOOR: Rgb = (225, 228, 232)

VIRIDIS = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], dtype=float)


def of_number(value: float, low: float, high: float) -> Rgb:
    """Viridis from `low` to `high`; grey for what is no number."""
    if not np.isfinite(value):
        return MACHINE
    share = np.clip((value - low) / (high - low) if high > low else 0.5, 0.0, 1.0) * (len(VIRIDIS) - 1)
    red, green, blue = (int(round(np.interp(share, range(len(VIRIDIS)), channel))) for channel in VIRIDIS.T)
    return red, green, blue


def css(colour: Rgb, alpha: float = 1.0) -> str:
    return f"rgba({colour[0]}, {colour[1]}, {colour[2]}, {alpha:g})"


def gradient_css() -> str:
    return f"linear-gradient(to right, {', '.join(css(tuple(map(int, stop))) for stop in VIRIDIS)})"
