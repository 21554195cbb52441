"""`hexload platform new`: a platform file from what a data sheet says of a hexapod."""

import codecs
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import typer
from numpy.typing import NDArray

from hexload.cli.kept_inputs import refuse_existing
from hexload.errors import InputError
from hexload.estimation.machine_check import Checked, check
from hexload.io.atomic_file import replaced_when_done
from hexload.io.quantity import Quantity, parse
from hexload.io.toml_document import GUESSED
from hexload.theory.tolerances import DEFAULTS, OPEN

Array = NDArray[np.float64]

LONGEST_M = 20.0  # a bare length beyond it is in millimetres
THICKNESS = 0.2  # of a guessed platform, of its hinges' radius
PAIR_DEG = 60.0  # half angles at which the hinges of neighbouring pairs meet

ASKED = {
    "platform-radius": "radius of the circle of the platform's hinges, e.g. 400mm (or a list: --platform-hinges)",
    "platform-angle": "half the angle between the two hinges of a pair of the platform, deg; or the six angles of its hinges",
    "base-radius": "radius of the circle of the base's hinges, e.g. 600mm (or a list: --base-hinges)",
    "base-angle": "half the angle between the two hinges of a pair of the base, deg; or the six angles of its hinges",
    "leg-length": "length of the legs at home, between hinge centres, e.g. 874mm; or six lengths",
    "stroke": "shortest and longest displacement of a leg from there, e.g. -300, 300 mm; or one number for both ways",
    "mass": "mass of the empty platform, with what of the legs moves with it, kg",
    "displacement-sigma": "noise of a leg's displacement sensor, one standard deviation, e.g. 20um",
    "velocity-sigma": "noise of a leg's velocity sensor, e.g. 1mm/s; none: there are no such sensors",
    "force-sigma": "noise of a leg's force sensor, e.g. 5N",
}
# Kind of the answer, and how many numbers there may be.
OF_ANSWER = {
    "platform-radius": ("length", (1,)),
    "platform-angle": ("angle", (1, 6)),
    "base-radius": ("length", (1,)),
    "base-angle": ("angle", (1, 6)),
    "leg-length": ("length", (1, 6)),
    "stroke": ("length", (1, 2)),
    "mass": ("mass", (1,)),
    "displacement-sigma": ("length", (1,)),
    "velocity-sigma": ("speed", (1,)),
    "force-sigma": ("force", (1,)),
}
# Of which options a key of the file is made.
OPTIONS = {
    "geometry.base_hinges_m": ("base-radius", "base-angle", "base-hinges"),
    "geometry.platform_hinges_m": ("platform-radius", "platform-angle", "platform-hinges", "base-angle"),
    "geometry.home_leg_length_m": ("leg-length", "home-height"),
    "geometry.stroke_m": ("stroke", "leg-range"),
    "platform.mass_kg": ("mass",),
    "platform.com_m": ("com",),
    "platform.inertia_kg_m2": ("inertia", "com", "mass"),
    "environment.gravity_m_s2": ("gravity",),
    "sensors.displacement_sigma_m": ("displacement-sigma",),
    "sensors.velocity_sigma_m_s": ("velocity-sigma",),
    "sensors.force_sigma_n": ("force-sigma",),
    "load.known_mass_kg": ("load",),
    "actuators.leg_speed_m_s": ("leg-speed",),
    "actuators.leg_force_n": ("leg-force",),
    "actuators.speed_sum_m_s": ("speed-sum",),
}
# Of these a guess of the others tells nothing.
GUESSED_BY = {
    "geometry.platform_hinges_m": ("platform-radius", "platform-angle", "platform-hinges"),
    "platform.inertia_kg_m2": ("inertia",),
}
# What stands for what: of each line one suffices.
INSTEAD = {
    "platform-radius": "platform-hinges",
    "platform-angle": "platform-hinges",
    "base-radius": "base-hinges",
    "base-angle": "base-hinges",
    "leg-length": "home-height",
    "stroke": "leg-range",
}
SIZES = ("base-radius", "platform-radius", "base-hinges", "platform-hinges", "leg-length", "home-height", "leg-range")
SIZES_RATIO = 100.0  # of a machine's: beyond, one of them is in another unit
HEADED_UNIT = re.compile(r"(?:^\W*|[\[(/_]|\bin |\bunits?:? )(um|mm|cm|m|in|ft)(?![a-z])")
IN_SI = {"mass": "kg", "force": "N", "acceleration": "m/s2"}  # what is taken of a number without a unit
ACTUATORS = {"leg-speed": "speed", "leg-force": "force", "speed-sum": "speed"}


@dataclass(frozen=True)
class Guess:
    options: tuple[str, ...]
    words: str  # for the terminal, after the options
    mark: str = ""  # in the file, at what they became; none: nothing that may be wrong

    def __str__(self) -> str:
        return f"{', '.join(f'--{option}' for option in self.options)} {self.words}"


@dataclass
class DataSheet:
    """What is known of the machine; SI; base and platform axes."""

    base_m: Array  # (6, 3)
    platform_m: Array  # (6, 3)
    lengths_m: Array  # (6,) at home
    stroke_m: tuple[float, float]
    mass_kg: float
    com_m: list[float]
    inertia_kg_m2: list[float]
    sigmas: dict[str, float | None]
    gravity_m_s2: float
    load_kg: float | None
    actuators: dict[str, float]
    guesses: list[Guess] = field(default_factory=list)


def new(given: Mapping[str, str | None], out: Path, force: bool) -> tuple[list[str], Checked]:
    """Writes `out`. `given`: texts by the options' names. Returns what was guessed, and what the check finds.

    Asks for what is missing on a terminal. Raises InputError, and then nothing is written.
    """
    if out.suffix != ".toml":
        raise InputError(f"--out: found {out}, expected NAME.toml")
    refuse_existing((out,), force)
    _refuse_both(given)
    texts = _completed(given, sys.stdin.isatty())
    sheet = data_sheet_of(texts)
    with replaced_when_done(out) as temporary:
        temporary.write_text(document(sheet), encoding="utf-8")
        try:
            checked = check(temporary, str(out))
        except InputError as error:
            raise InputError(_by_option(str(error), str(out), texts)) from None
    return [str(guess) for guess in sheet.guesses], checked


def _by_option(message: str, file: str, texts: Mapping[str, str]) -> str:
    """A refusal of the file's reader, with the option that the user wrote instead of a line of a file that is not there."""
    match = re.match(re.escape(file) + r"(?::\d+)?: ([\w.]+)", message)
    options = OPTIONS.get(match.group(1), ()) if match else ()
    named = [f"--{option}" for option in options if option in texts]
    return f"{', '.join(named)}: {message[match.end(1) - len(match.group(1)) :]}" if match and named else message


def _refuse_both(given: Mapping[str, str | None]) -> None:
    for name, other in INSTEAD.items():
        if given.get(name) is not None and given.get(other) is not None:
            raise InputError(f"--{name}: found together with --{other}, expected one of them")


def _completed(given: Mapping[str, str | None], can_ask: bool) -> dict[str, str]:
    texts = {name: text for name, text in given.items() if text is not None}
    missing = [name for name in ASKED if name not in texts and INSTEAD.get(name, name) not in texts]
    if missing and not can_ask:
        names = ", ".join(f"--{name}" for name in missing)
        example = ASKED[missing[0]]
        raise InputError(
            f"found no {names}, expected them (--{missing[0]}: {example}); on a terminal they are asked for"
        )
    for name in missing:
        texts[name] = _answer(name)
    return texts


def _answer(name: str) -> str:
    """Asks until there is a number, or what else there may be."""
    while True:
        text = typer.prompt(f"{ASKED[name]}\n  {name}")
        if name == "velocity-sigma" and text.strip().lower() == "none":
            return text
        try:
            kind, counts = OF_ANSWER[name]
            parse(text, kind, name, counts)
            return text
        except InputError as error:
            typer.echo(str(error), err=True)


def data_sheet_of(texts: Mapping[str, str]) -> DataSheet:
    guesses = _bare(texts)
    lengths = _lengths(texts, guesses)
    base, platform = (_hinges(texts, side, lengths, guesses) for side in ("base", "platform"))
    home = _home_lengths(base, platform, lengths)
    mass = parse(texts["mass"], "mass", "--mass").si()[0]
    com = _com(lengths, guesses)
    radius = float(np.linalg.norm(platform, axis=1).mean())
    inertia = _inertia(texts, (mass, np.array(com), radius), guesses)
    return DataSheet(
        base_m=base,
        platform_m=platform,
        lengths_m=home,
        stroke_m=_stroke(lengths, home),
        mass_kg=mass,
        com_m=com,
        inertia_kg_m2=inertia,
        sigmas=_sigmas(texts, guesses),
        gravity_m_s2=_one(texts, "gravity", "acceleration", 9.81),
        load_kg=_one(texts, "load", "mass", None),
        actuators={
            name: _actuator(texts[name], name, kind, guesses) for name, kind in ACTUATORS.items() if name in texts
        },
        guesses=guesses,
    )


LENGTHS = {
    "base-radius": (1,),
    "platform-radius": (1,),
    "base-hinges": (18,),
    "platform-hinges": (18,),
    "leg-length": (1, 6),
    "home-height": (1,),
    "stroke": (1, 2),
    "leg-range": (2,),
    "com": (3,),
}


def _bare(texts: Mapping[str, str]) -> list[Guess]:
    """Numbers without a unit where one alone is usual."""
    kinds = {"mass": "mass", "load": "mass", "force-sigma": "force", "leg-force": "force", "gravity": "acceleration"}
    bare = {
        name: parse(texts[name], kind, f"--{name}").numbers[0]
        for name, kind in kinds.items()
        if name in texts and parse(texts[name], kind, f"--{name}").factor is None
    }
    return [Guess((name,), f"{number:g} without a unit read as {IN_SI[kinds[name]]}") for name, number in bare.items()]


def _lengths(texts: Mapping[str, str], guesses: list[Guess]) -> dict[str, list[float]]:
    """All lengths in m; those without a unit are all in the same one, which the largest of them tells."""
    found: dict[str, Quantity] = {
        name: parse(_text_of(texts[name]) if name.endswith("hinges") else texts[name], "length", f"--{name}", counts)
        for name, counts in LENGTHS.items()
        if name in texts
    }
    bare = {name: max(map(abs, each.numbers)) for name, each in found.items() if each.factor is None}
    largest = max(bare.values(), default=0.0)
    is_mm = largest > LONGEST_M
    if largest:
        unit, other = ("mm", "m") if is_mm else ("m", "mm")
        words = f"without a unit read as {unit}, because the largest number is {largest:g}, hardly {other}"
        guesses.append(Guess(tuple(bare), words, f"the unit, {unit}"))
    lengths = {name: each.si(1e-3 if is_mm else 1.0) for name, each in found.items()}
    _refuse_mixed_units({name: max(map(abs, lengths[name])) for name in SIZES if name in lengths}, bare)
    return lengths


def _refuse_mixed_units(sizes_m: Mapping[str, float], bare: Mapping[str, float]) -> None:
    small, large = min(sizes_m, key=sizes_m.get), max(sizes_m, key=lambda name: (name in bare, sizes_m[name]))
    if not sizes_m[large] > SIZES_RATIO * sizes_m[small]:
        large = max(sizes_m, key=sizes_m.get)
    if sizes_m[large] > SIZES_RATIO * sizes_m[small]:
        found = [
            f"{bare[name]:g} without a unit" if name in bare else f"{sizes_m[name]:g} m" for name in (small, large)
        ]
        raise InputError(
            f"--{small}: found {found[0]} beside --{large} of {found[1]}, expected sizes of one machine: their units are mixed; "
            "write them, as in 400mm, in a file as x [mm], y [mm], z [mm] above the rows"
        )


def _text_of(hinges: str) -> str:
    """The list itself, or that in a file: three numbers a line, lines with words left out but for the unit in them."""
    path = Path(hinges)
    if not hinges.lower().endswith((".csv", ".txt")):
        return hinges
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: found no readable file ({error}), expected a list of hinges") from None
    try:
        text = raw.decode("utf-16" if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")  # its letters can stand in words alone, never in a number
    lines = [line.strip() for line in text.splitlines()]
    is_row = [bool(line) and not line[0].isalpha() and line[0] not in '#"' for line in lines]
    rows = [line for line, is_one in zip(lines, is_row) if is_one]
    units = {unit for line, is_one in zip(lines, is_row) if not is_one for unit in HEADED_UNIT.findall(line)}
    if len(units) > 1:
        raise InputError(f"{path}: found the units {', '.join(sorted(units))} above the rows, expected one of them")
    if all(";" in row and "," in row for row in rows):
        rows = [row.replace(",", ".") for row in rows]  # decimal commas
    return "; ".join(rows) + (units.pop() if units else "")


def _hinges(texts: Mapping[str, str], side: str, lengths: Mapping[str, list[float]], guesses: list[Guess]) -> Array:
    if f"{side}-hinges" in lengths:
        return np.array(lengths[f"{side}-hinges"]).reshape(6, 3)
    angle = parse(texts[f"{side}-angle"], "angle", f"--{side}-angle", (1, 6))
    is_rad = max(map(abs, angle.numbers)) < np.pi / 3.0 and any(angle.numbers)
    if angle.factor is None:
        unit, because = ("rad", ", because as degrees it is next to none") if is_rad else ("deg", "")
        words = f"{angle.numbers[0]:g} without a unit read as {unit}{because}"
        guesses.append(Guess((f"{side}-angle",), words, "the unit, rad" if is_rad else ""))
    angles = np.array(angle.si(1.0 if is_rad else np.pi / 180.0))
    if len(angles) == 1:
        half = float(angles[0])
        if not 0.0 <= half < np.radians(PAIR_DEG):
            raise InputError(
                f"--{side}-angle: found {np.degrees(half):g} deg, expected half the angle between the hinges of a pair, "
                f"from 0 to less than {PAIR_DEG:g} deg"
            )
        # Base pairs around 0, 120, 240 deg, platform pairs 60 deg further; leg 1 from +half of the first base pair.
        ends = np.radians([0, 120, 120, 240, 240, 360]) + half * np.array([1, -1, 1, -1, 1, -1])
        turned = np.radians([60, 60, 180, 180, 300, 300]) + half * np.array([-1, 1, -1, 1, -1, 1])
        angles = ends if side == "base" else turned
    radius = lengths[f"{side}-radius"][0]
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])


def _home_lengths(base: Array, platform: Array, lengths: Mapping[str, list[float]]) -> Array:
    if "home-height" in lengths:
        return np.linalg.norm(platform - base + [0.0, 0.0, lengths["home-height"][0]], axis=1)
    return np.broadcast_to(lengths["leg-length"], (6,)).astype(float)


def _stroke(lengths: Mapping[str, list[float]], home: Array) -> tuple[float, float]:
    if "leg-range" in lengths:
        shortest, longest = lengths["leg-range"]
        return shortest - float(home.min()), longest - float(home.max())
    stroke = lengths["stroke"]
    return (-abs(stroke[0]), abs(stroke[0])) if len(stroke) == 1 else (stroke[0], stroke[1])


def _com(lengths: Mapping[str, list[float]], guesses: list[Guess]) -> list[float]:
    if "com" not in lengths:
        words = "not given, taken as 0, 0, 0: the platform's centre of mass is in the middle of its hinges"
        guesses.append(Guess(("com",), words, "the middle of the hinges"))
    return lengths.get("com", [0.0, 0.0, 0.0])


def _inertia(texts: Mapping[str, str], body: tuple[float, Array, float], guesses: list[Guess]) -> list[float]:
    """About O_A."""
    mass, com, radius = body
    if "inertia" not in texts:
        tilting = mass * radius**2 * (0.25 + THICKNESS**2 / 12.0)
        tensor = np.diag([tilting, tilting, 0.5 * mass * radius**2])
        tensor += mass * (com @ com * np.eye(3) - np.outer(com, com))
        entries = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
        words = "not given, taken as that of a disc of the hinges' radius and a fifth of it thick: "
        words += f"{entries[0]:.3g}, {entries[1]:.3g}, {entries[2]:.3g} kg m2"
        guesses.append(Guess(("inertia",), words, "a disc of the hinges' radius"))
        return [float(each) for each in entries]
    found = parse(texts["inertia"], "inertia", "--inertia", (3, 6))
    gyration = np.sqrt(max(map(abs, found.numbers)) / abs(mass)) if mass else 0.0
    is_mm = found.factor is None and gyration > LONGEST_M * radius
    if found.factor is None:
        because = f", because as kg m2 the mass would be {gyration:.0f} m away" if is_mm else ""
        words = f"without a unit read as {'kg mm2' if is_mm else 'kg m2'}{because}"
        guesses.append(Guess(("inertia",), words, "the unit, kg mm2" if is_mm else ""))
    values = found.si(1e-6 if is_mm else 1.0)
    return [*values, *([0.0] * (6 - len(values)))]


def _sigmas(texts: Mapping[str, str], guesses: list[Guess]) -> dict[str, float | None]:
    displacement = parse(texts["displacement-sigma"], "length", "--displacement-sigma")
    size = abs(displacement.numbers[0])
    unit, factor = ("um", 1e-6) if size >= 0.5 else ("mm", 1e-3) if size >= 1e-3 else ("m", 1.0)
    if displacement.factor is None:
        words = f"{displacement.numbers[0]:g} without a unit read as {unit}, because that is what such sensors have"
        guesses.append(Guess(("displacement-sigma",), words, f"the unit, {unit}"))
    velocity = None
    if texts["velocity-sigma"].strip().lower() != "none":
        found = parse(texts["velocity-sigma"], "speed", "--velocity-sigma")
        is_mm = found.factor is None and abs(found.numbers[0]) >= 0.05
        if found.factor is None:
            unit = "mm/s" if is_mm else "m/s"
            words = f"{found.numbers[0]:g} without a unit read as {unit}, because that is what such sensors have"
            guesses.append(Guess(("velocity-sigma",), words, f"the unit, {unit}"))
        velocity = found.si(1e-3 if is_mm else 1.0)[0]
    return {
        "displacement": displacement.si(factor)[0],
        "velocity": velocity,
        "force": parse(texts["force-sigma"], "force", "--force-sigma").si()[0],
    }


def _actuator(text: str, name: str, kind: str, guesses: list[Guess]) -> float:
    found = parse(text, kind, f"--{name}")
    is_mm = kind == "speed" and found.factor is None and abs(found.numbers[0]) > LONGEST_M
    if kind == "speed" and found.factor is None:
        unit, because = ("mm/s", f", because legs are slower than {LONGEST_M:g} m/s") if is_mm else ("m/s", "")
        words = f"{found.numbers[0]:g} without a unit read as {unit}{because}"
        guesses.append(Guess((name,), words, f"the unit, {unit}" if is_mm else ""))
    return found.si(1e-3 if is_mm else 1.0)[0]


def _one(texts: Mapping[str, str], name: str, kind: str, otherwise: float | None) -> float | None:
    return parse(texts[name], kind, f"--{name}").si()[0] if name in texts else otherwise


def document(sheet: DataSheet) -> str:
    """The platform file, with what each number means."""
    low, high = sheet.stroke_m
    alike = np.ptp(sheet.lengths_m) < 1e-9
    length = _number(sheet.lengths_m[0]) if alike else _row(sheet.lengths_m)
    keys = {"leg-speed": "leg_speed_m_s", "leg-force": "leg_force_n", "speed-sum": "speed_sum_m_s"}
    stated = {key: sheet.actuators.get(name) for name, key in keys.items()}
    actuators = "\n".join(
        f"{key} = {_number(value)}" if value is not None else f"# {key} =" for key, value in stated.items()
    )
    tolerances = "\n".join(f"# {key} = {_number(each)}" for key, each in DEFAULTS.items() if each != OPEN)
    velocity = sheet.sigmas["velocity"]
    text = f"""# A hexapod, by hexload platform new. SI units; hexload platform check says whether it is plausible.

[geometry] # legs 1 to 6 in the order of their channels
base_hinges_m = [ # in base axes: z up, origin anywhere in the middle of the base
{_rows(sheet.base_m)}
]
platform_hinges_m = [ # in platform axes, which are parallel to the base's at home; their origin is what moves
{_rows(sheet.platform_m)}
]
home_leg_length_m = {length} # between hinge centres where the displacements are 0; one number, or six
stroke_m = [{_number(low)}, {_number(high)}] # displacements at which a leg is at its end

[platform] # empty, with what of the legs moves with the upper hinges
mass_kg = {_number(sheet.mass_kg)}
com_m = {_row(sheet.com_m)} # platform axes
inertia_kg_m2 = {_row(sheet.inertia_kg_m2)} # xx, yy, zz, xy, xz, yz about the platform's origin

[environment]
gravity_m_s2 = {_number(sheet.gravity_m_s2)}

[sensors] # white noise of one sample, one standard deviation
displacement_sigma_m = {_number(sheet.sigmas["displacement"])}
{"velocity = false # there are no such sensors" if velocity is None else f"velocity_sigma_m_s = {_number(velocity)}"}
force_sigma_n = {_number(sheet.sigmas["force"])}
# force_bandwidth_hz = 300.0 # of the force channel's second-order low-pass

# [tolerances] # of the data sheets, one standard deviation; these are what is taken where nothing is stated
{tolerances}

{"[load]" if sheet.load_kg is not None else "# [load] # when the load's mass is known"}
{f"known_mass_kg = {_number(sheet.load_kg)}" if sheet.load_kg is not None else "# known_mass_kg ="}

[actuators] # what they can do, for hexload excite: speed without load, force at standstill, six speeds together
{actuators}
"""
    return _marked(text, sheet.guesses)


def _marked(text: str, guesses: list[Guess]) -> str:
    """With each guess at the key that comes of it, where guessed_in_words() of io/toml_document.py finds it."""
    marks: dict[str, list[str]] = {}
    for guess in guesses:
        for key, options in (OPTIONS | GUESSED_BY).items():
            if guess.mark and set(options) & set(guess.options):
                marks.setdefault(key.partition(".")[2], []).append(guess.mark)
    lines = []
    for line in text.splitlines():
        key, _, rest = line.partition(" = ")
        if key in marks and "#" in rest:
            line = line.replace("#", f"# {GUESSED} {', '.join(marks[key])};", 1)
        elif key in marks:
            line += f" # {GUESSED} {', '.join(marks[key])}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def _number(value: float | None) -> str:
    return f"{value:.10g}"


def _row(values: Array | list[float]) -> str:
    return f"[{', '.join(_number(float(value)) for value in values)}]"


def _rows(points: Array) -> str:
    return "\n".join(f"    {_row(np.round(point, 10) + 0.0)}," for point in points)


def print_new(guesses: list[str], out: Path, tell: Callable[[str], None] = print) -> None:
    for guess in guesses:
        tell(f"guessed:   {guess}")
    tell(f"platform:  {out}")
