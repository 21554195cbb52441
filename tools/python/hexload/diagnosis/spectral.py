"""Filters, derivatives and cosine transforms of whole records; the time is the first axis."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def low_pass(values: Array, dt_s: float, hz: float, derivatives: int = 0, step: int = 1) -> list[Array]:
    """What is below `hz`, without lag (Butterworth's fourth order, forth and back), and its time derivatives; every `step`-th
    row. The record goes on as if turned about its ends; the first and last tenths of a second feel that."""
    rows = len(values)
    if rows < 2:
        return [values[::step]] + [np.zeros_like(values[::step])] * derivatives
    ramp = np.linspace(0.0, 1.0, rows).reshape(-1, *[1] * (values.ndim - 1))
    slope = (values[-1] - values[0]) / ((rows - 1) * dt_s)
    line = values[0] + (values[-1] - values[0]) * ramp
    odd = np.concatenate([values - line, (line - values)[-2:0:-1]])
    spectrum = np.fft.rfft(odd, axis=0)
    frequency = np.fft.rfftfreq(len(odd), dt_s).reshape(-1, *[1] * (values.ndim - 1))
    spectrum = spectrum / (1.0 + (frequency / hz) ** 8)
    answers = []
    for order in range(derivatives + 1):
        part = np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, len(odd), axis=0)[:rows:step]
        if order < 2:
            part = part + (line[::step] if order == 0 else slope)
        answers.append(part)
    return answers


def cosines(values: Array, count: int) -> Array:
    """The first `count` terms, at most half the rows, of the orthonormal cosine transform (DCT-II)."""
    rows = len(values)
    shuffled = np.concatenate([values[::2], values[1::2][::-1]])
    spectrum = np.fft.rfft(shuffled, axis=0)[:count]
    k = np.arange(len(spectrum)).reshape(-1, *[1] * (values.ndim - 1))
    terms = 2.0 * np.real(spectrum * np.exp(-0.5j * np.pi * k / rows)) * np.sqrt(0.5 / rows)
    terms[0] *= np.sqrt(0.5)
    return terms


def cosine_hz(count: int, rows: int, dt_s: float) -> Array:
    """Frequencies of the terms."""
    return np.arange(count) / (2.0 * rows * dt_s)
