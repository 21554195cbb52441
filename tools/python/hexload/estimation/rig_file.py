"""rig.toml: what `hexload commission` has found of one machine. One set of names, SI units as suffixes.

[rig]       what replaces geometry and body of the platform file, and what the firmware takes off (hexload/rig.h)
[sigma]     one standard deviation of each
[source]    the runs, the friction law's residual
[[direction]]  ways in which all of it may be off together, one standard deviation each, for the sigmas of a load
[geometry], [platform], [environment]   of the platform file that it belongs to
"""

from pathlib import Path
from types import ModuleType

import numpy as np

from hexload.errors import InputError
from hexload.io.toml_document import Table, to_toml
from hexload.theory.bound import LEGS, TENSOR

KEYS = (
    "base_hinges_m",
    "platform_hinges_m",
    "mass_kg",
    "com_m",
    "inertia_kg_m2",
    "gravity_m_s2",
    "leg_inertia_kg_m2",
    "leg_slide_kg_m",
    "leg_tilt_kg_m",
    "coulomb_n",
    "stribeck_n",
    "growth_n_n",
    "viscous_n_s_m",
    "stribeck_speed_m_s",
    "reversal_speed_m_s",
    "presliding_m",
    "force_offset_n",
    "force_gain",
    "force_delay_s",
    "velocity_delay_s",
)
MACHINE_KEYS = {
    "geometry": ("base_hinges_m", "platform_hinges_m", "home_leg_length_m"),
    "platform": ("mass_kg", "com_m", "inertia_kg_m2"),
    "environment": ("gravity_m_s2",),
}


def machine_of(platform) -> Table:
    """The numbers of the platform file that a rig file or a tare file depends on, as in the file."""
    values = {key: getattr(platform, key) for keys in MACHINE_KEYS.values() for key in keys}
    values["inertia_kg_m2"] = values["inertia_kg_m2"][TENSOR]
    return {section: {key: np.asarray(values[key]).tolist() for key in keys} for section, keys in MACHINE_KEYS.items()}


def of_model(platform) -> Table:
    """KEYS of a machine that is its platform file's: nothing to take off. Where a rig file by hand starts."""
    machine = machine_of(platform)
    legs = dict.fromkeys(
        ("coulomb_n", "stribeck_n", "growth_n_n", "viscous_n_s_m", "force_offset_n", "force_gain"), np.zeros(LEGS)
    )
    none = dict.fromkeys(KEYS, 0.0)
    hinges = {key: machine["geometry"][key] for key in ("base_hinges_m", "platform_hinges_m")}
    gravity = {"gravity_m_s2": np.array([0.0, 0.0, -platform.gravity_m_s2])}
    return (
        none | hinges | machine["platform"] | gravity | legs | {"stribeck_speed_m_s": 0.01, "reversal_speed_m_s": 0.001}
    )


def document(rig: Table, sigma: Table, source: Table, directions: list[Table], platform) -> str:
    """The file's text; `rig` has KEYS."""
    numbers = {key: np.asarray(rig[key]).tolist() for key in KEYS}
    heading = [
        "# Made by hexload commission. SI units; f shown = (1 + force_gain) (f on the platform + friction) + force_offset_n,",
        "# friction = (coulomb_n + stribeck_n exp(-(v / stribeck_speed_m_s)^2) + growth_n_n |f on the platform|) s",
        "# + viscous_n_s_m v, s to tanh(v / reversal_speed_m_s) over presliding_m of motion.",
    ]
    return "\n".join(
        [
            *heading,
            to_toml(
                {"rig": numbers, "sigma": sigma, "source": source, **machine_of(platform), "direction": directions}
            ),
        ]
    )


def platform_with_rig(path: Path, native: ModuleType, platform):
    """The platform as the rig file says that it is. Raises InputError: no rig file, or that of another machine."""
    try:
        return native.with_rig(platform, str(path))
    except ValueError as error:  # names the file itself
        raise InputError(str(error)) from None
