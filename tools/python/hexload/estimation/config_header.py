"""`hexload export`: the configuration that `replay --rig` gives the firmware, as a C header for a controller."""

import re
from collections.abc import Sequence
from pathlib import Path

from hexload.errors import InputError
from hexload.estimation.firmware_run import load_platform, native_firmware
from hexload.estimation.rig_file import platform_with_rig
from hexload.io.atomic_file import replaced_when_done

KEYWORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while".split()
)
TEXT = """\
// Made by `hexload export` from {rig} and {platform}. Do not edit: commission, and export again.
// Numbers have the bits that `hexload replay --rig` works with.
// Samples are refused beyond {platform}'s
//   stroke: geometry.stroke_m
//   speed: {speed}
//   force: {force}
#ifndef {guard}
#define {guard}

#include <hexload/config.h>

#include <assert.h>

static_assert(sizeof(hexload_real_t) != sizeof(float) || sizeof(hexload_config_t) == {size},
              "made for another version of hexload: export again");

static const hexload_config_t {name} = {initialiser};

#endif
"""


def export(rig: Path, platform_file: Path, out: Path, tick_s: float | None, force: bool) -> str:
    """Writes the header and returns the name of the constant in it, the file's. Raises InputError."""
    name = _name_of(out)
    if out.exists() and not force:
        raise InputError(f"{out}: found it already there, expected a new file, or --force to replace it")
    native = native_firmware()
    platform = platform_with_rig(rig, native, load_platform(native, platform_file))
    try:
        config = native.config_bytes(platform, platform.tick_s if tick_s is None else tick_s)
    except ValueError as error:
        raise InputError(f"{platform_file} with {rig}: {error}") from None
    with replaced_when_done(out) as temporary:
        temporary.write_text(
            header(native.config_initialiser(config), len(config), name, rig, platform_file, platform.actuators)
        )
    return name


def header(
    initialiser: str, size: int, name: str, rig: Path, platform: Path, actuators: Sequence[float | None] = (None,) * 3
) -> str:
    """`actuators`: hexload_native.Platform's."""
    speed_m_s, force_n, _ = actuators
    return TEXT.format(
        speed=_gate("leg_speed_m_s", speed_m_s, "10 m/s"),
        force=_gate("leg_force_n", force_n, "1e6 N"),
        rig=rig.name,
        platform=platform.name,
        guard=f"{name.upper()}_H",
        size=size,
        name=name,
        initialiser=initialiser.rstrip(),
    )


def _gate(key: str, stated: float | None, default: str) -> str:
    """Source: take_actuators() in firmware/platform_file/firmware_config.cpp."""
    if stated is None:
        return f"{default}, the firmware's default, as it has no actuators.{key}; state it for a gate that is your machine's"
    return f"twice actuators.{key} = {stated:g}"


def _name_of(out: Path) -> str:
    if out.suffix != ".h" or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", out.stem, re.ASCII) or out.stem in KEYWORDS:
        raise InputError(
            f"--out: found {out.name}, expected NAME.h, with NAME as C names a constant: it gets the file's name"
        )
    return out.stem
