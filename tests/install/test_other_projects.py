"""hexload in other projects: installed, as a folder of theirs, and fetched from git; on this machine and for the Cortex-M7."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hexload_dev import target

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])
HERE = Path(__file__).parent
USED = ("CMakeLists.txt", "CMakePresets.json", "firmware", "tools/cmake")  # all that another project needs
VERSION = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text())[1]
TOOLCHAIN = ROOT / "tools" / "cmake" / "toolchain-arm-none-eabi.cmake"
OPTIONS = {"native": (), "cortex-m7": (f"--toolchain={TOOLCHAIN}", "-DHEXLOAD_CORE=cortex-m7")}
BUILDS = {"native": BUILD, "cortex-m7": target.directory("target-cortex-m7")}


def run(*command, folder: Path | None = None, **environment: str) -> str:
    """The output; fails with it when the command does."""
    words = [str(word) for word in command]
    result = subprocess.run(
        words, cwd=folder, env=os.environ | environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert result.returncode == 0, f"{shlex.join(words)}\n{result.stdout}"
    return result.stdout


@pytest.fixture(scope="module")
def clone(tmp_path_factory) -> Path:
    """A repository of the files that another project needs, as they are in this tree: branch main, tagged."""
    folder = tmp_path_factory.mktemp("clone") / "hexload"
    for name in USED:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        copy(ROOT / name, folder / name)
    run("git", "init", "--quiet", "--initial-branch=main", folder)
    run("git", "add", "--all", folder=folder)
    author = ("-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false")
    run("git", *author, "commit", "--quiet", "--message=all", folder=folder)
    run("git", "tag", f"v{VERSION}", folder=folder)
    return folder


@pytest.fixture(scope="module")
def prefixes(tmp_path_factory) -> dict[str, Path]:
    """Installations of the builds, moved to another place."""
    prefixes = {}
    for machine, build in BUILDS.items():
        folder = tmp_path_factory.mktemp(machine)
        run("cmake", "--install", build / "firmware", "--prefix", folder / "first")
        prefixes[machine] = (folder / "first").rename(folder / "second")
    return prefixes


def build_application(folder: Path, machine: str, *definitions: str) -> Path:
    """Configures and builds the project `application`; the folder of its build."""
    python = f"-DPython_EXECUTABLE={sys.executable}"
    options = ("-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", python, *OPTIONS[machine], *definitions)
    run("cmake", "-S", HERE / "application", "-B", folder, "-G", "Ninja", *options)
    run("cmake", "--build", folder)
    return folder


def assert_program_is_for(machine: str, program: Path) -> None:
    """Here it runs, and its status is that of a node that works; for the board it has been linked."""
    if machine == "native":
        run(program)
    else:
        assert "Tag_CPU_arch: v7E-M" in run("arm-none-eabi-readelf", "--arch-specific", program)


@pytest.mark.parametrize("machine", OPTIONS)
def test_an_installed_application_is_found(prefixes, tmp_path, machine):
    # GIVEN an installation that has been moved WHEN a project finds its component app THEN it builds
    place = f"-Dhexload_DIR={prefixes[machine] / 'lib' / 'cmake' / 'hexload'}"
    build = build_application(tmp_path, machine, "-DHEXLOAD_FROM=package", place)
    assert_program_is_for(machine, build / "application")


@pytest.mark.parametrize("machine", OPTIONS)
def test_a_folder_of_another_project_builds_the_firmware_alone_and_without_errors_of_warnings(clone, tmp_path, machine):
    # GIVEN the sources in a project of another's WHEN it adds them THEN it builds
    build = build_application(tmp_path, machine, "-DHEXLOAD_FROM=folder", f"-DHEXLOAD_SOURCE={clone}")
    assert_program_is_for(machine, build / "application")
    # and neither are warnings errors, as they are in this project's presets, nor is anything built for tests or installed
    commands = (build / "compile_commands.json").read_text()
    folders = {Path(entry["file"]).parent for entry in json.loads(commands)}
    ours = {folder.relative_to(clone) for folder in folders if folder.is_relative_to(clone)}
    assert "-Werror" not in commands
    assert "-Werror" in (BUILDS[machine] / "compile_commands.json").read_text()
    assert {folder.parts[:2] for folder in ours} == {("firmware", name) for name in ("src", "bus", "app")}
    run("cmake", "--install", build, "--prefix", tmp_path / "prefix")
    assert not list((tmp_path / "prefix").rglob("*hexload*"))


@pytest.mark.parametrize(("machine", "tag"), [("native", f"v{VERSION}"), ("cortex-m7", "main")])
def test_a_repository_is_fetched(clone, tmp_path, machine, tag):
    # GIVEN a repository with a branch and a tag WHEN a project fetches one of them THEN it builds
    place = (f"-DHEXLOAD_SOURCE=file://{clone}", f"-DHEXLOAD_TAG={tag}")
    build = build_application(tmp_path, machine, "-DHEXLOAD_FROM=git", *place)
    assert_program_is_for(machine, build / "application")


def test_pkg_config_knows_the_flags_of_core_and_application(prefixes, tmp_path):
    # GIVEN an installation that has been moved WHEN programs are compiled with what pkg-config says THEN they run
    folder = str(prefixes["native"] / "lib" / "pkgconfig")
    for package, source in (("hexload", "consumer/example.c"), ("hexload_app", "application/application.c")):
        flags = run("pkg-config", "--cflags", "--libs", package, PKG_CONFIG_PATH=folder).split()
        run("cc", "-std=c11", HERE / source, *flags, "-o", tmp_path / package)
        run(tmp_path / package)
        assert run("pkg-config", "--modversion", package, PKG_CONFIG_PATH=folder).strip() == VERSION
    # and it names the DBC, which is the one of the sources
    dbc = run("pkg-config", "--variable=dbcfile", "hexload_app", PKG_CONFIG_PATH=folder).strip()
    assert Path(dbc).read_bytes() == (ROOT / "firmware" / "bus" / "hexload.dbc").read_bytes()


def test_the_first_step_of_the_guide_to_a_new_port_links(clone, tmp_path):
    # GIVEN step 1 of "A new port" in firmware/README.md: a copy of the blank port, its target renamed, and a preset
    tree = shutil.copytree(clone, tmp_path / "tree")
    port = shutil.copytree(tree / "firmware" / "ports" / "blank", tree / "firmware" / "ports" / "mine")
    listfile = port / "CMakeLists.txt"
    listfile.write_text(listfile.read_text().replace("hexload_blank_port", "hexload_mine"))
    variables = {"HEXLOAD_CORE": "cortex-m7", "HEXLOAD_PORT": "mine"}
    preset = {"name": "mine", "inherits": "target", "cacheVariables": variables}
    (tree / "CMakeUserPresets.json").write_text(json.dumps({"version": 6, "configurePresets": [preset]}))
    # WHEN it is configured and built THEN it links
    run("cmake", "--preset", "mine", f"-DPython_EXECUTABLE={sys.executable}", folder=tree)
    run("cmake", "--build", "build/mine", "--target", "hexload_mine", folder=tree)
    assert_program_is_for("cortex-m7", tree / "build" / "mine" / "firmware" / "ports" / "mine" / "hexload_mine")
