"""Where things lie: the work tree, the build that the verbs use, scenarios and runs."""

import functools
import hashlib
import importlib
import importlib.util
import os
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from hexload.errors import ToolFailed

ROOT = Path(__file__).resolve().parents[3]
BUILD = ROOT / "build"
RUNS = Path(
    os.environ.get("HEXLOAD_RUNS") or BUILD / "runs"
)  # in the virtual machine elsewhere: there build/ is not kept
SCENARIOS = ROOT / "host_sim" / "scenarios"
DEFAULT_PRESET = "host"
# CMake targets behind the verbs.
PROGRAMS = ("hexload_sim_app", "hexload_ecu", "hexload_bridge", "hexload_native", "hexload_lcm_python")


def version() -> str:
    """Of the clone, or of the installed package."""
    described = ROOT / "pyproject.toml"
    if described.is_file():
        return tomllib.loads(described.read_text(encoding="utf-8"))["project"]["version"]
    from importlib import metadata  # takes a quarter of the time in which a small program starts

    return metadata.version("hexload")


def preset_directory(preset: str) -> Path:
    return BUILD / preset


def chosen_build() -> Path | None:
    """The build that ctest has chosen for the tests that it runs; such a build is used as it is."""
    directory = os.environ.get("HEXLOAD_BUILD_DIR")
    return Path(directory) if directory else None


def build_directory() -> Path:
    return chosen_build() or preset_directory(DEFAULT_PRESET)


def simulator() -> Path:
    return build_directory() / "host_sim" / "hexload_sim"


def controller() -> Path:
    return build_directory() / "firmware" / "ports" / "linux" / "hexload_ecu"


@functools.cache
def code_version() -> str:
    """Digest of what decides the numbers of a campaign: modules, programs, scenarios and platforms."""
    modules = Path(__file__).parent.rglob("*.py")
    inputs = SCENARIOS.rglob("*.toml")
    digest = hashlib.sha256()
    for path in (*sorted(modules), *sorted(inputs), Path(native_module().__file__), simulator()):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _take_as_built(*targets: str) -> None:
    """Without the developers' package nothing is built. The native module alone is inside an installed package."""
    if set(targets) - {"hexload_native"} and not build_directory().is_dir():
        raise ToolFailed(
            f"{', '.join(targets)}: found no build in {build_directory()}, expected one: this needs a clone and its "
            "tools/hexload, or HEXLOAD_BUILD_DIR with the folder of a build"
        )


_builder: Callable[..., None] = _take_as_built


def build_with(builder: Callable[..., None]) -> None:
    """From now on ensure_built() calls `builder` with the CMake targets."""
    global _builder
    _builder = builder


def ensure_built(*targets: str) -> None:
    """Called before anything of a build is used; `targets`: CMake's names."""
    _builder(*targets)


def native_module() -> ModuleType:
    """The extension hexload_native, the firmware's C and the plant's kinematics: inside an installed package, else of
    the clone's build."""
    inside = f"{__package__}.hexload_native"
    if importlib.util.find_spec(inside) is not None:
        return importlib.import_module(inside)
    return _built_module("hexload_native")


def bus_contract() -> Path:
    """hexload.dbc, of the clone or inside an installed package."""
    installed = Path(__file__).parent / "io" / "hexload.dbc"
    return installed if installed.is_file() else ROOT / "firmware" / "bus" / "hexload.dbc"


def message_type(name: str) -> type:
    """An LCM type of lcm_types, e.g. leg_sample_t."""
    return getattr(_built_module(f"hexload_lcm.{name}"), name)


def _built_module(name: str) -> ModuleType:
    directory = str(build_directory() / "python")
    if directory not in sys.path:
        sys.path.insert(0, directory)
    importlib.invalidate_caches()
    return importlib.import_module(name)
