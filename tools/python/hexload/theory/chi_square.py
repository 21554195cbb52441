"""Quantiles of the chi-square distribution, by bisection of its regularised incomplete gamma function."""

import math

_RELATIVE = 1e-14


def quantile(probability: float, degrees: float) -> float:
    """The x that a chi-square variable of so many degrees of freedom does not exceed with this probability, in (0, 1)."""
    if not 0.0 < probability < 1.0 or degrees <= 0.0:
        raise ValueError(
            f"found probability {probability:g} of {degrees:g} degrees, expected (0, 1) and a positive number"
        )
    low, high = 0.0, degrees
    while cumulative(high, degrees) < probability:
        low, high = high, 2.0 * high
    while high - low > _RELATIVE * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if cumulative(middle, degrees) < probability else (low, middle)
    return 0.5 * (low + high)


def cumulative(x: float, degrees: float) -> float:
    """Probability that the variable does not exceed x >= 0: P(degrees / 2, x / 2)."""
    a, z = 0.5 * degrees, 0.5 * x
    if z == 0.0:
        return 0.0
    factor = math.exp(a * math.log(z) - z - math.lgamma(a))
    return factor * _series(a, z) if z < a + 1.0 else 1.0 - factor * _continued_fraction(a, z)


def _series(a: float, z: float) -> float:
    """sum over n of z^n / (a (a + 1) ... (a + n)), Abramowitz and Stegun 6.5.29."""
    term = total = 1.0 / a
    n = 0
    while term > _RELATIVE * total:
        n += 1
        term *= z / (a + n)
        total += term
    return total


def _continued_fraction(a: float, z: float) -> float:
    """Of the upper function, Abramowitz and Stegun 6.5.31 in its even form, by Lentz's method."""
    b = z + 1.0 - a
    c, d = math.inf, 1.0 / b
    value, change, n = d, 0.0, 0
    while abs(change - 1.0) > _RELATIVE:
        n += 1
        numerator = -n * (n - a)
        b += 2.0
        d = 1.0 / (numerator * d + b)
        c = b + numerator / c
        change = c * d
        value *= change
    return value
