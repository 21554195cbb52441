"""`hexload export`: the header gives a controller the bits that `replay --rig` gives the firmware."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from forked_command import hexload
from hexload import project
from hexload.errors import InputError
from hexload.estimation import rig_file
from hexload.estimation.config_header import export, header
from hexload.estimation.firmware_run import load_platform, native_firmware

PLATFORM = project.SCENARIOS / "platforms" / "rig.toml"
TICK_S = 1e-3
INCLUDES = ("-I", project.ROOT / "firmware" / "include")
STRICT = (
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wmissing-field-initializers",
    "-Werror",
)
COMPILERS = {"C11": ("cc", "-std=c11"), "C++20": ("c++", "-x", "c++", "-std=c++20")}
DUMP = """
#include "{name}.h"
#include <stdio.h>
int main(void) {{
    return fwrite(&{name}, sizeof {name}, 1, stdout) == 1 ? 0 : 1;
}}
"""


def in_memory(header_file: Path, compiler: tuple[str, ...]) -> bytes:
    """The constant of a header as a compiler lays it down."""
    name = header_file.stem
    source, program = header_file.with_name(f"dump_{name}.c"), header_file.with_name(f"dump_{name}")
    source.write_text(DUMP.format(name=name))
    subprocess.run([*compiler, *STRICT, *INCLUDES, source, "-o", program], check=True)
    return subprocess.run([program], check=True, capture_output=True).stdout


LEG_CONSTANTS = ("force_offset_n", "force_gain", "coulomb_n", "stribeck_n", "growth_n_n", "viscous_n_s_m")


@pytest.fixture
def rig(tmp_path) -> Path:
    """A rig file with a number in every key and seven open directions."""
    native = native_firmware()
    platform, random = load_platform(native, PLATFORM), np.random.default_rng(3)

    def drawn(value) -> np.ndarray:
        return np.asarray(value) + random.uniform(1e-5, 1e-3, np.shape(value))

    direction = {
        **{key: drawn(np.zeros(6)).tolist() for key in LEG_CONSTANTS},
        "gravity_m_s2": drawn([0.0, 0.0]).tolist(),
        "platform": drawn(np.zeros(10)).tolist(),
        **{key: drawn(np.zeros((6, 3))).tolist() for key in ("base_hinges_m", "platform_hinges_m")},
    }
    values = {key: drawn(value) for key, value in rig_file.of_model(platform).items()}
    path = tmp_path / "rig.toml"
    path.write_text(rig_file.document(values, {}, {}, [direction] * 7, platform))
    return path


def config_of(rig: Path) -> bytes:
    native = native_firmware()
    return native.config_bytes(rig_file.platform_with_rig(rig, native, load_platform(native, PLATFORM)), TICK_S)


@pytest.mark.parametrize("language", COMPILERS)
def test_a_compiled_header_has_the_bits_of_the_configuration(rig, language, tmp_path):
    # GIVEN a rig file WHEN it is exported and compiled without a warning
    out = tmp_path / "rig_config.h"
    assert export(rig, PLATFORM, out, TICK_S, force=False) == "rig_config"
    # THEN the constant is, byte for byte, the configuration of replay --rig
    assert in_memory(out, COMPILERS[language]) == config_of(rig)


def test_what_no_sample_may_be_beyond_is_of_the_actuators_where_they_are_stated(rig, tmp_path):
    # GIVEN a platform file that says what its legs can do WHEN it is exported THEN the gates are twice that
    stated, out = tmp_path / "stated.toml", tmp_path / "rig_config.h"
    stated.write_text(PLATFORM.read_text() + "\n[actuators]\nleg_speed_m_s = 1.25\nleg_force_n = 6e3\n")
    export(rig, stated, out, TICK_S, force=True)
    text = out.read_text()
    assert ".velocity_range_m_s = HEXLOAD_REAL(2.5), // m/s" in text
    assert ".force_range_n = HEXLOAD_REAL(12000.0), // N" in text
    # AND the header says where they come from, AND that they are wide open where nothing is stated
    assert "//   speed: twice actuators.leg_speed_m_s = 1.25\n//   force: twice actuators.leg_force_n = 6000" in text
    export(rig, PLATFORM, out, TICK_S, force=True)
    assert "//   force: 1e6 N, the firmware's default, as it has no actuators.leg_force_n" in out.read_text()
    assert ".force_range_n = HEXLOAD_REAL(1000000.0), // N" in out.read_text()


def test_the_figures_of_an_export_are_json(rig, tmp_path):
    # GIVEN --json WHEN a rig is exported THEN standard output is JSON alone, and standard error empty
    out = tmp_path / "rig_config.h"
    result = hexload("export", rig, "--platform", PLATFORM, "--out", out, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    assert json.loads(result.stdout) == {"file": str(out), "constant": "rig_config"}


def test_no_field_of_the_configuration_is_left_out(rig, tmp_path):
    # GIVEN a configuration in which all words differ, kind and count of directions apart
    config = np.frombuffer(config_of(rig), np.uint32)
    words = np.arange(1.0, len(config) + 1.0, dtype=np.float32).view(np.uint32)
    words[0] = config[0]
    (count,) = np.flatnonzero(config == 7)  # no float is that small
    words[count] = 8
    # WHEN its header is compiled THEN every word is there again
    native = native_firmware()
    out = tmp_path / "all.h"
    out.write_text(header(native.config_initialiser(words.tobytes()), words.nbytes, "all", rig, PLATFORM))
    np.testing.assert_array_equal(np.frombuffer(in_memory(out, COMPILERS["C11"]), np.uint32), words)


def test_what_cannot_be_exported_is_refused_and_nothing_is_overwritten(rig, tmp_path):
    # GIVEN a header that is there, and wishes that cannot be met
    out = tmp_path / "rig_config.h"
    export(rig, PLATFORM, out, TICK_S, force=False)
    before = out.read_text()
    other = tmp_path / "other.toml"
    other.write_text(PLATFORM.read_text().replace("mass_kg = 100.0", "mass_kg = 120.0"))
    broken = tmp_path / "broken.toml"
    broken.write_text(rig.read_text().replace("force_delay_s = ", "force_delay_s = 1"))
    cases = {
        "found it already there, expected a new file, or --force": (rig, PLATFORM, out, TICK_S, False),
        "expected NAME.h": (rig, PLATFORM, tmp_path / "3.h", TICK_S, True),
        "found int.h": (rig, PLATFORM, tmp_path / "int.h", TICK_S, True),
        "platform.mass_kg: found 100, expected 120 as in the platform file": (rig, other, out, TICK_S, True),
        "rig.force_delay_s is out of range": (broken, PLATFORM, out, TICK_S, True),
        "tick_s is out of range": (rig, PLATFORM, out, 1.0, True),
        "found no such file": (tmp_path / "none.toml", PLATFORM, out, TICK_S, True),
    }
    for words, arguments in cases.items():
        # WHEN they are tried THEN the cause is named, and the header stays
        with pytest.raises(InputError, match=words):
            export(*arguments)
        assert out.read_text() == before
    # AND --force replaces it
    export(rig, PLATFORM, out, 2e-3, force=True)
    assert out.read_text() != before


def test_a_header_compiles_for_a_controller_into_constants_alone(rig, tmp_path):
    # GIVEN an exported header WHEN a controller's compiler takes it THEN the object has constants and no data or code
    out = tmp_path / "rig_config.h"
    export(rig, PLATFORM, out, TICK_S, force=False)
    source = tmp_path / "controller.c"
    source.write_text('#include "rig_config.h"\nconst hexload_config_t* config(void);\n'
                      "const hexload_config_t* config(void) {\n    return &rig_config;\n}\n")  # fmt: skip
    subprocess.run(["arm-none-eabi-gcc", "-mcpu=cortex-m7", "-std=c11", "-O2", *STRICT, *INCLUDES, "-c", source,
                    "-o", tmp_path / "controller.o"], check=True)  # fmt: skip
    sizes = subprocess.run(
        ["arm-none-eabi-size", tmp_path / "controller.o"], check=True, capture_output=True, text=True
    )
    text, data, bss = map(int, sizes.stdout.splitlines()[1].split()[:3])
    assert data == bss == 0 and 0 < text - len(config_of(rig)) < 64
