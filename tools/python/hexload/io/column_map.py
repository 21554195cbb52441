"""What a user says of a log's columns: which is which channel, in which unit, with which sign.

TOML. Keys are channels, t, dl1..dl6, vl1..vl6, f1..f6 and, for absolute leg lengths, l1..l6; without the number they are
of all six legs. A value is the column's name, `{leg}` standing for 1..6, or a table of what differs:

    t = "Time [ms]"
    dl = "Actuator {leg} position [mm]"
    f = { column = "Load cell {leg}", unit = "kN", sign = -1 }
    f3 = { sign = 1 }
    vl = false                              # what there is are no velocities: leave them out

Of a cylinder that measures the pressures of its chambers, the force is area times pressure of the one less those of the other:

    f = { column = "p cap {leg} [bar]", area_m2 = 3.1e-3, rod_column = "p rod {leg} [bar]", rod_area_m2 = 2.1e-3 }
"""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from hexload.errors import InputError
from hexload.io.toml_document import read_toml

LEGS = range(1, 7)
AREA = "an area in m2, above 0"
GROUPS = ("dl", "vl", "f", "l")
SI = {"t": "s", "dl": "m", "l": "m", "vl": "m/s", "f": "N"}
UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 0.0254},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "um/s": 1e-6, "in/s": 0.0254},
    "N": {"N": 1.0, "kN": 1e3, "daN": 10.0, "MN": 1e6, "mN": 1e-3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "mbar": 100.0, "psi": 6894.757293168},
}


def kind_of(channel: str) -> str:
    """t, dl, vl, f or l."""
    return channel.rstrip("123456")


@dataclass(frozen=True)
class Said:
    """What is said of one channel; None: nothing."""

    column: str | None = None
    unit: str | None = None
    sign: float | None = None
    offset: float | None = None  # SI, added last
    area_m2: float | None = None  # of a chamber, whose pressure the column has
    rod_column: str | None = None  # of the chamber that pulls
    rod_area_m2: float | None = None

    def before(self, other: "Said") -> "Said":
        """This, and of what it does not say the other."""
        return replace(other, **{f.name: value for f in fields(self) if (value := getattr(self, f.name)) is not None})


def si_of(channel: str, said: Said = Said()) -> str:
    """The unit of its column."""
    return SI[kind_of(channel)] if said.area_m2 is None else "Pa"


def factor_of(si: str, unit: str) -> float | None:
    """None: no unit of that kind."""
    return UNITS[si].get(unit)


@dataclass(frozen=True)
class ColumnMap:
    channels: dict[str, Said] = field(default_factory=dict)
    without_velocity: bool = False

    def of(self, channel: str) -> Said:
        return self.channels.get(channel, Said())

    @property
    def is_empty(self) -> bool:
        return not self.channels and not self.without_velocity


def read_column_map(given: Sequence[str]) -> ColumnMap:
    """Of files, or of lines of such a file in their place; the later ones count. Raises InputError."""
    channels: dict[str, Said] = {}
    without_velocity = False
    for text in given:
        where, table = _table_of(text)
        for key, value in sorted(table.items(), key=lambda item: item[0][-1].isdigit()):  # a leg's own word counts
            if key == "vl" and value is False:
                without_velocity = True
                continue
            said = _said(f"{where}: {key}", value)
            for leg in LEGS if key in GROUPS else (None,):
                channel = key if leg is None else f"{key}{leg}"
                _check_channel(where, key, channel, said)
                whole = _of_leg(said, leg).before(channels.get(channel, Said()))
                _check_unit(where, key, channel, whole)
                channels[channel] = whole
    return ColumnMap(channels, without_velocity)


def _table_of(text: str) -> tuple[str, dict]:
    path = Path(text)
    is_line = "=" in text and not path.is_file()
    try:
        return ("--columns", tomllib.loads(text)) if is_line else (text, read_toml(path))
    except FileNotFoundError:
        raise InputError(f"{text}: found no such file, expected a column map (.toml), or a line of one") from None
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f'--columns {text}: found no valid TOML ({error}), expected dl = "NAME [UNIT]"') from None


def _of_leg(said: Said, leg: int | None) -> Said:
    """With the leg's number in the columns' names."""
    if leg is None:
        return said
    names = {"column": said.column, "rod_column": said.rod_column}
    return replace(said, **{key: name and name.replace("{leg}", str(leg)) for key, name in names.items()})


def _said(where: str, value: object) -> Said:
    if isinstance(value, str):
        return Said(column=value.strip())
    if not isinstance(value, dict) or not set(value) <= {f.name for f in fields(Said)}:
        raise InputError(
            f"{where}: found {value!r}, expected a column's name, or column, unit, sign, offset in {{ }}; of pressures also "
            "area_m2, rod_column, rod_area_m2"
        )
    for key in ("column", "unit", "rod_column"):
        if not isinstance(value.get(key, ""), str):
            raise InputError(f"{where}: {key}: found {value[key]!r}, expected a word in quotes")
    if value.get("sign", 1) not in (1, -1):
        raise InputError(f"{where}: sign: found {value['sign']!r}, expected 1 or -1")
    for key, expected in (("offset", "a number in SI units"), ("area_m2", AREA), ("rod_area_m2", AREA)):
        number = value.get(key, 1.0)
        if isinstance(number, bool) or not isinstance(number, (int, float)) or (expected == AREA and not number > 0.0):
            raise InputError(f"{where}: {key}: found {number!r}, expected {expected}")
    return Said(**value)


def _check_channel(where: str, key: str, channel: str, said: Said) -> None:
    if channel != "t" and not (kind_of(channel) in GROUPS and channel[len(kind_of(channel)) :] in map(str, LEGS)):
        raise InputError(
            f"{where}: {key}: found no such channel, expected t, dl1..dl6, vl1..vl6, f1..f6, l1..l6, dl, vl, f, l"
        )
    for name in (said.column, said.rod_column):
        if key in GROUPS and name is not None and "{leg}" not in name:
            raise InputError(f"{where}: {key}: found '{name}' for six legs, expected {{leg}} in it, for their number")


def _check_unit(where: str, key: str, channel: str, said: Said) -> None:
    if said.unit is not None and said.unit != "clock" and factor_of(si_of(channel, said), said.unit) is None:
        raise InputError(
            f"{where}: {key}: found the unit '{said.unit}', expected {units_in_words(si_of(channel, said))}"
        )
    if said.area_m2 is not None and kind_of(channel) != "f":
        raise InputError(f"{where}: {key}: found an area, expected it of a force alone: f, f1..f6")
    chambers = (said.area_m2 is None, said.rod_column is None, said.rod_area_m2 is None)
    if chambers not in ((True, True, True), (False, True, True), (False, False, False)):
        raise InputError(f"{where}: {key}: found part of two chambers, expected area_m2, rod_column and rod_area_m2")


def units_in_words(si: str) -> str:
    return ", ".join(unit for unit in UNITS[si] if unit.isascii())
