"""Numbers with units as people write them: `400mm`, `15 deg`, `0.57, 1.17 m`."""

import re
from dataclasses import dataclass

from hexload.errors import InputError

SQUARE = str.maketrans({"²": "2", "^": None, " ": None, "*": None, "·": None, "µ": "u", "μ": "u", "°": "d"})
UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048},
    "angle": {"deg": 0.017453292519943295, "d": 0.017453292519943295, "rad": 1.0},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": 0.45359237},
    "inertia": {"kgm2": 1.0, "kgcm2": 1e-4, "kgmm2": 1e-6, "gmm2": 1e-9},
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605},
    "speed": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "um/s": 1e-6, "in/s": 0.0254},
    "acceleration": {"m/s2": 1.0},
}
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Quantity:
    """Numbers of one kind. `factor`: to SI; None: no unit was written."""

    numbers: tuple[float, ...]
    factor: float | None

    def si(self, factor: float = 1.0) -> list[float]:
        """`factor`: of the unit where none was written."""
        return [number * (self.factor or factor) for number in self.numbers]


def parse(text: str, kind: str, name: str, counts: tuple[int, ...] = (1,)) -> Quantity:
    """`counts`: how many numbers there may be, with commas, semicolons or spaces between; the unit stands after the
    last, or after each. Raises InputError with `name`."""
    items = [item for item in re.split(r"\s*[,;]\s*|\s+(?=[-+.\d])", text.strip()) if item]
    numbers, units = [], set()
    for item in items:
        match = NUMBER.match(item)
        if match is None:
            raise _refused(text, kind, name, counts)
        numbers.append(float(match.group()))
        units |= {item[match.end() :].translate(SQUARE)} - {""}
    if len(numbers) not in counts or len(units) > 1 or not units <= set(UNITS[kind]):
        raise _refused(text, kind, name, counts)
    return Quantity(tuple(numbers), UNITS[kind][units.pop()] if units else None)


def _refused(text: str, kind: str, name: str, counts: tuple[int, ...]) -> InputError:
    how_many = "a number" if counts == (1,) else f"{' or '.join(map(str, counts))} numbers"
    units = ", ".join(unit for unit in UNITS[kind] if unit != "d")
    return InputError(f"{name}: found {text!r}, expected {how_many}, with one of the units {units}, or without")
