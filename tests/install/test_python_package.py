"""`pip install .` of a clone in an empty environment, as a user would, and the example of tools/python/README.md."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(os.environ["HEXLOAD_SOURCE_DIR"])
DATA = ROOT / "tests" / "data"
SIGMAS = 5.0  # a Gaussian error is larger once in two million times


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The interpreter of an environment that has hexload, what it depends on, and nothing else."""
    folder = tmp_path_factory.mktemp("environment") / "venv"
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    install = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-compile", ROOT]
    result = subprocess.run(install, capture_output=True, text=True, env=clean_environment())
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-4000:]
    return python


def clean_environment():
    """Without the paths by which tests find the clone's own packages and build."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("HEXLOAD_", "PYTHON"))}


def run(python, *arguments, folder=ROOT):
    return subprocess.run([python, *arguments], capture_output=True, text=True, cwd=folder, env=clean_environment())


def test_the_readme_example_identifies_the_recorded_load(environment, tmp_path):
    # GIVEN the example of the README and the truth of the log that it reads
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / "tools" / "python" / "README.md").read_text(), re.DOTALL)
    script = tmp_path / "example.py"
    script.write_text(
        example + "\nimport json\nprint(json.dumps([load.value.tolist(), load.sigma.tolist(), hexload.__file__]))\n"
    )
    truth = json.loads((DATA / "multisine_eccentric.truth.json").read_text())["segments"][-1]["theta"]
    # WHEN it runs in the environment
    result = run(environment, script)
    assert result.returncode == 0, result.stderr
    # THEN all ten parameters are right within their own sigmas, and sample by sample it says the same mass
    value, sigma, home = json.loads(result.stdout.splitlines()[-1])
    assert all(abs(v - t) < SIGMAS * s for v, t, s in zip(value, truth, sigma, strict=True))
    masses = re.findall(r"^mass (\d+\.\d+) ", result.stdout, re.MULTILINE)
    assert masses == [f"{value[0]:.2f}"] * 2
    # and it was the installed package that said so
    assert Path(home).is_relative_to(environment.parents[1])


def test_nothing_but_numpy_comes_with_it(environment):
    # GIVEN the environment WHEN it lists its packages THEN beside those of every new one there is numpy
    listed = json.loads(run(environment, "-m", "pip", "list", "--format", "json").stdout)
    assert {package["name"] for package in listed} - {"pip", "setuptools"} == {"hexload", "numpy"}


def test_the_wheel_has_no_more_than_the_package_inside(environment):
    # GIVEN the environment WHEN the files of the package are listed THEN all are Python's, its module, pages with their scripts and the DBC
    listed = run(environment, "-m", "pip", "show", "--files", "hexload").stdout.partition("Files:\n")[2]
    files = [Path(line.strip()) for line in listed.splitlines()]
    package = [path for path in files if path.parts[0] == "hexload"]
    assert {path.suffix for path in package} == {".py", ".so", ".jinja", ".js", ".dbc", ".typed"}
    assert not [path for path in files if path.parts[0] in ("hexload_dev", "include", "lib")]


def test_a_verb_without_its_extra_says_which_one_it_needs(environment):
    # GIVEN the environment, without the extra cli WHEN the program is called THEN it names the extra
    result = subprocess.run([environment.with_name("hexload")], capture_output=True, text=True, env=clean_environment())
    assert result.returncode == 1
    assert result.stderr == "hexload: found no package typer, expected it: pip install 'hexload[cli]'\n"


def test_what_needs_a_clone_says_so(environment):
    # GIVEN the environment, which has no simulator WHEN a scenario is run THEN that is said, without a traceback
    script = "from hexload.simulation import sim; from hexload import errors\ntry: sim.run_simulation(sim.SimRequest(sim.resolve_scenario('s.toml')))\nexcept errors.ToolFailed as e: print(e)"
    scenario = environment.parent / "s.toml"
    scenario.write_text("")
    result = run(environment, "-c", script, folder=environment.parent)
    assert "hexload_sim_app: found no build in" in result.stdout, result.stderr
