"""Where things lie: the work tree, the build that the verbs use, scenarios and runs."""

import importlib
import os
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
RUNS = BUILD / "runs"
SCENARIOS = ROOT / "host_sim" / "scenarios"
DEFAULT_PRESET = "host"


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


def native_module() -> ModuleType:
    """The extension hexload_native: the firmware's C and the plant's kinematics, called from Python."""
    directory = str(build_directory() / "python")
    if directory not in sys.path:
        sys.path.insert(0, directory)
    importlib.invalidate_caches()
    return importlib.import_module("hexload_native")
