"""The borders between the rooms of the code: who may include whom, and that a controller has no plant in it."""

import os
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])

CORE = "firmware/src"
PUBLIC = "firmware/include"
FRONT = ("algebra", "configuration", "body", "front_end")


def core(*rooms: str) -> set[str]:
    return {PUBLIC, *(f"{CORE}/{room}" for room in rooms)}


APP = {PUBLIC, "firmware/bus", "firmware/app"}
PLANT = {"host_sim/include", "firmware/platform_file"}
RUN = APP | PLANT | {"host_sim/links", "firmware/transport", "lcm_types"}

# Folder -> the folders, besides itself, from which its files may include, in data-flow order. A file belongs to the
# longest name that it is in.
BORDERS = {
    PUBLIC: set(),
    f"{CORE}/algebra": core(),
    f"{CORE}/configuration": core(*FRONT[:1]),
    f"{CORE}/body": core(*FRONT[:2]),
    f"{CORE}/front_end": core(*FRONT[:3]),
    f"{CORE}/paper": core(*FRONT),
    f"{CORE}/rig": core(*FRONT),
    f"{CORE}/momentum": core(*FRONT, "rig"),
    f"{CORE}/actuator_effects": core(*FRONT, "momentum"),
    CORE: core(*FRONT, "rig", "paper", "momentum", "actuator_effects"),
    "firmware/bus": {PUBLIC},
    "firmware/app": {PUBLIC, "firmware/bus"},
    "firmware/ports/blank": APP,
    "firmware/ports/mbedtls": {PUBLIC},
    "firmware/ports/boot": APP | {"firmware/ports/mbedtls"},
    "firmware/ports/mps2_an500": APP | {"firmware/ports/boot"},
    "firmware/ports/zynqmp_r5": APP | {"firmware/ports/boot"},
    "lcm_types": set(),
    "firmware/platform_file": {PUBLIC},
    "firmware/transport": APP | {"lcm_types", "firmware/ports/mbedtls"},
    "firmware/ports/linux": APP | {"lcm_types", "firmware/platform_file", "firmware/transport"},
    "host_sim/include": PLANT,
    "host_sim/src": PLANT,
    "host_sim/links": RUN,
    "host_sim/apps": RUN,
}
OWNERS = ("firmware", "host_sim", "lcm_types")

# Where the compiler looks, besides the folder of the including file.
INCLUDE_PATHS = ("firmware", "firmware/src", PUBLIC, "host_sim", "host_sim/include", "lcm_types/include")
OURS = re.compile(r"hexload\w*/|options\.h$")
GENERATED = {"hexload_dbc.h": "firmware/bus"}

COMMENT = re.compile(r"//.*")
FUNCTION = re.compile(r"^[A-Za-z_][\w \*]*?\b(\w+)\(([^;{}()]*)\) \{", re.MULTILINE)  # its name and its parameters

CONTROLLERS = ("hexload_ecu", "hexload_ecu_separate")
PLANT_ARCHIVES = (
    "host_sim/libhexload_sim.a",
    "host_sim/links/libhexload_links.a",
    "host_sim/links/libhexload_bus_links.a",
)
STRONG = set("TDBRSC")
PLANT_NAMESPACE = "7hexload3sim"  # hexload::sim, mangled


def room_of(path: str) -> str | None:
    rooms = [room for room in BORDERS if path == room or path.startswith(room + "/")]
    return max(rooms, key=len, default=None)


def sources() -> list[str]:
    return sorted(
        path.relative_to(ROOT).as_posix()
        for owner in OWNERS
        for path in (ROOT / owner).rglob("*")
        if path.suffix in (".c", ".h", ".cpp", ".hpp", ".S")
    )


def target_of(source: str, written: str, is_quoted: bool) -> str | None:
    """The file of the project, or the folder of a generated one, that an include means; None: another library's."""
    name = written.rpartition("/")[2]
    if name in GENERATED:
        return GENERATED[name]
    lcm_type = name.removesuffix(".hpp")
    if name != lcm_type and (ROOT / "lcm_types" / f"{lcm_type}.lcm").exists():
        return "lcm_types"
    own_folder = [Path(source).parent.as_posix()] if is_quoted else []
    for folder in (*own_folder, *INCLUDE_PATHS):
        for suffix in ("", ".in"):
            if (ROOT / folder / f"{written}{suffix}").is_file():
                return os.path.normpath(f"{folder}/{written}")
    assert not is_quoted and not OURS.match(written), f"{source}: found no file for #include of {written}"
    return None


@cache
def includes_of(source: str) -> list[str]:
    if not (ROOT / source).is_file():
        return []  # generated
    found = re.findall(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]', (ROOT / source).read_text(), re.MULTILINE)
    targets = [target_of(source, written, mark == '"') for mark, written in found]
    return [target for target in targets if target is not None]


def crossings() -> list[str]:
    found = []
    for source in sources():
        room = room_of(source)
        for target in includes_of(source):
            other = room_of(target)
            if other not in {room, *BORDERS[room]}:
                found.append(f"{source} includes {target}: {room} may not look into {other}")
    return found


def reached_from(source: str) -> set[str]:
    """All that an include of the file brings with it."""
    reached, waiting = set(), [source]
    while waiting:
        new = set(includes_of(waiting.pop())) - reached
        reached |= new
        waiting += new
    return reached


def symbols(path: Path, *options: str) -> dict[str, str]:
    """Mangled name -> nm's letter of what a library or program defines itself."""
    command = ["nm", "--defined-only", "--format=posix", *options, path]
    listing = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    lines = (line.split() for line in listing.splitlines())
    return {line[0]: line[1] for line in lines if len(line) > 1}


def plant_symbols() -> set[str]:
    """Functions and objects of plant and links; not what templates and inline functions leave wherever they are used."""
    found = (symbols(BUILD / archive, "--extern-only") for archive in PLANT_ARCHIVES)
    return {name for table in found for name, letter in table.items() if letter in STRONG}


def test_every_source_has_a_room():
    # GIVEN all C and C++ of firmware, simulator and messages WHEN each is looked up in the borders THEN it is in a room
    lost = [source for source in sources() if room_of(source) is None]
    assert not lost, f"tests/static/test_borders.py names no room for {lost}"


def test_includes_stay_inside_their_borders():
    # GIVEN all their includes WHEN each is held against the borders THEN none crosses one
    found = crossings()
    assert not found, "\n".join(found)


def test_no_function_of_the_firmware_takes_more_than_six_parameters():
    # GIVEN all functions that the firmware's C defines WHEN their parameters are counted THEN none has more than six
    found = []
    for path in sorted(ROOT.glob("firmware/**/*.[ch]")):
        for name, parameters in FUNCTION.findall(COMMENT.sub("", path.read_text())):
            found += [f"{path.relative_to(ROOT)}: {name}"] if parameters.count(",") > 5 else []
    assert not found, "\n".join(found)


def test_the_plant_shares_nothing_with_the_firmware():
    # GIVEN the plant WHEN its includes are followed to their ends THEN no header of the firmware is among them, nor does
    # the platform file bring one along, whose firmware_config.hpp has the firmware's types
    plant = [source for source in sources() if room_of(source) in ("host_sim/include", "host_sim/src")]
    found = [
        f"{source} reaches {target}"
        for source in plant
        for target in reached_from(source)
        if room_of(target) not in PLANT | {"host_sim/src"}
    ]
    assert plant and not found, "\n".join(found)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_controller_has_no_plant_in_it(controller):
    # GIVEN the libraries of plant and links, which the simulator has in it
    plant = plant_symbols()
    assert len(plant & symbols(BUILD / "host_sim" / "hexload_sim").keys()) > 100
    # WHEN the controller's symbols are read
    own = symbols(BUILD / "firmware" / "ports" / "linux" / controller).keys()
    # THEN it has the estimator, and of the plant nothing, not even what is inline
    assert "hexload_tick" in own
    assert not [name for name in own if name in plant or PLANT_NAMESPACE in name]
