"""tools/TUTORIAL.md, done as it stands: its files written, its commands run in their order, with less to compute."""

import ctypes
import re
import shlex
import subprocess

import numpy as np
import pytest
import typer

from hexload import project
from hexload.cli.app import app
from hexload.io.log_file import read_log
from hexload_dev import cli  # the developers' verbs

TUTORIAL = (project.ROOT / "tools" / "TUTORIAL.md").read_text(encoding="utf-8")
MASS_KG = 60.0
# The same verbs, shorter: searches of one step, runs of ten and six seconds.
SMALLER = {"excite": ["--starts", "1", "--iterations", "1", "--sines", "4"], "sim": ["--quiet"]}
SECONDS = {"empty": "12", "loaded": "7"}
NOT_HERE = ("doctor",)  # its status is this machine's
IN_A_BROWSER = ("view",)  # tested where there is one


def steps():
    """Files and commands in their order: (name of a file, its text) or (None, a command)."""
    pattern = r"```(?:toml|c) (\S+)\n(.*?)```|^    ((?:tools/hexload|cmake|cc) [^\n]*)$"
    for found in re.finditer(pattern, TUTORIAL, re.DOTALL | re.MULTILINE):
        name, text, command = found.groups()
        yield name, text if name else command


def smaller(words):
    verb, rest = words[0], " ".join(words)
    more = list(SMALLER.get(verb, []))
    if verb in ("excite", "sim"):
        more += ["--duration", SECONDS["empty" if "empty" in rest else "loaded"]]
    return [*words, *more]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder in which everything has been done; what each verb ended with."""
    folder, ends = tmp_path_factory.mktemp("tutorial"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name, text in steps():
            if name:
                (folder / name).write_text(text)
                continue
            words = shlex.split(text)
            if words[0] == "cmake":
                continue
            if words[0] == "cc":
                build = project.build_directory() / "firmware"  # instead of three commands: it is built
                prefix = ["cmake", "--install", str(build), "--prefix", "hexload-c"]
                subprocess.run(prefix, check=True, stdout=subprocess.DEVNULL)
                subprocess.run([*words, "-Wall", "-Wextra", "-Werror"], check=True)
            elif words[1] not in (*NOT_HERE, *IN_A_BROWSER):
                try:
                    app(smaller(words[1:]), prog_name="hexload", standalone_mode=False)
                except typer.Exit as end:
                    ends.append((words[1], end.exit_code))
    return folder, ends


def test_every_verb_of_the_tutorial_ends_well_and_writes_its_files(done):
    # GIVEN the tutorial WHEN it is done THEN no verb has complained, and what it promises is there
    folder, ends = done
    assert [end for end in ends if end[1] != 0] == []
    for name in (
        "mine.toml",
        "mine.html",
        "empty_motion.csv",
        "rig.toml",
        "rig.html",
        "load.html",
        "rig_config.h",
        "load_step.so",
    ):
        assert (folder / name).is_file(), name
    assert cli.doctor  # whose line is a verb's too


def test_the_load_of_the_tutorial_is_found(done):
    # GIVEN the estimates at the end of step 6 WHEN read THEN the mass is the load's, within five of its sigmas
    folder, _ = done
    rows = (folder / "estimates.csv").read_text().splitlines()
    last = dict(zip(rows[0].split(","), rows[-1].split(",")))
    assert abs(float(last["m"]) - MASS_KG) < 5 * float(last["s_m"]) < 0.1 * MASS_KG
    assert last["verdict"] in ("converged", "converging")


def test_the_shared_library_of_the_tutorial_finds_the_same(done):
    # GIVEN the C function of step 8 in a shared library WHEN it is given the log of step 6
    folder, _ = done
    log = read_log(folder / "loaded_run" / "log.csv")
    library = ctypes.CDLL(str(folder / "load_step.so"))
    vector = np.ctypeslib.ndpointer(np.float32, flags="C")
    library.load_step.argtypes = [vector] * 5
    value, sigma = np.zeros(10, np.float32), np.zeros(10, np.float32)
    channels = [np.ascontiguousarray(each, np.float32) for each in (log.displacement_m, log.velocity_m_s, log.force_n)]
    for legs in zip(*channels):
        assert library.load_step(*legs, value, sigma) >= 0
    # THEN its last estimate is the replay's, to the bits of single precision
    rows = (folder / "estimates.csv").read_text().splitlines()
    last = dict(zip(rows[0].split(","), rows[-1].split(",")))
    names = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    np.testing.assert_array_equal(value, np.array([last[name] for name in names], np.float32))


def test_the_tutorial_names_no_option_that_a_verb_does_not_have(done):
    # GIVEN its remaining commands, which are not run WHEN their options are looked for in the help THEN they are there
    for _, text in steps():
        words = shlex.split(text) if text.startswith("tools/hexload") else []
        if words and words[1] in IN_A_BROWSER:
            command = typer.main.get_command(app).commands[words[1]]
            known = {option for parameter in command.params for option in parameter.opts}
            assert {word for word in words if word.startswith("--")} <= known
