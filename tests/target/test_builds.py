"""Cross-compiling for every core, with the project's warnings as errors."""

import subprocess

import pytest

from hexload_dev import mps2, target

LIBRARIES = ("target-cortex-m4f", "target-cortex-r5f")


@pytest.mark.parametrize("preset", [*target.CORTEX_M7.values(), *LIBRARIES])
def test_preset_builds_core_bus_and_application_for_its_processor(preset):
    # GIVEN a preset of CMakePresets.json WHEN it is built
    target.build_preset(preset)
    # THEN its libraries are there, for a processor with a floating-point unit and arguments in its registers
    libraries = [target.library(preset), *target.node_libraries(preset)]
    attributes = subprocess.run(
        ["arm-none-eabi-readelf", "--arch-specific", *libraries], capture_output=True, text=True, check=True
    ).stdout
    assert "Tag_FP_arch: " in attributes
    assert attributes.count("Tag_ABI_VFP_args: VFP registers") == attributes.count("Attribute Section: aeabi")


@pytest.mark.parametrize("preset", target.CORTEX_M7.values())
def test_programs_of_the_board_are_there(preset):
    assert mps2.program(preset).exists()
    for program in ("replay", "momentum", "momentum_effects", "body", "node", "rivals", "ticks"):
        assert (target.directory(preset) / "tests" / "target" / "programs" / program).exists()
