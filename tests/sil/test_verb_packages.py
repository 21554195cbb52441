"""What tools/hexload installs for a verb is all that the verb imports: seen on the sources, as a developer's environment has
everything."""

import ast
import functools
import importlib.metadata
import inspect
import re
import subprocess

import pytest
import typer

from hexload import project
from hexload_dev import cli, lock
from hexload_dev.requirements import canonical, chosen, read_lock, requirements

SOURCES = project.ROOT / "tools" / "python"
SCRIPT = (project.ROOT / "tools" / "hexload").read_text()
GROUPS = re.search(r"^python_groups\(\) \{.*?^\}", SCRIPT, re.M | re.S)[0]
LOCKED = read_lock(lock.LOCK.read_text())
PACKAGES = importlib.metadata.packages_distributions()  # by the modules that they bring
OPTIONS = ["--view", "--screenshot", "--report", "--faults"]  # with which a verb imports more


def module_file(name):
    path = SOURCES / name.replace(".", "/")
    return next((found for found in (path.with_suffix(".py"), path / "__init__.py") if found.is_file()), None)


def names_of(node):
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]


def imports_at_once(body):
    """Of statements that run whenever the body does: not of branches, nor of functions in it."""
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from names_of(node)
        elif isinstance(node, ast.With):
            yield from imports_at_once(node.body)


def imports_somewhere(body):
    for node in ast.walk(ast.Module(body, [])):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from names_of(node)


@functools.cache
def imports_of_module(path):
    return list(imports_at_once(ast.parse(path.read_text()).body))


def foreign(names):
    """Top-level names of other projects' modules that importing these brings in, module by module."""
    found, seen, waiting = set(), set(), list(names)
    while waiting:
        name = waiting.pop()
        path = module_file(name)
        if not name.startswith("hexload"):
            found.add(name.split(".")[0])
        elif path and path not in seen:
            seen.add(path)
            waiting += imports_of_module(path)
            waiting += [name.rpartition(".")[0]] if "." in name else []
    return found


def functions():
    """The body of each verb's function, by the verb."""
    groups = [(group.typer_instance.info.name, group.typer_instance) for group in cli.app.registered_groups]
    for group, commands in (("", cli.app), *groups):
        for command in commands.registered_commands:
            function = command.callback
            body = ast.parse(inspect.getsource(function)).body[0].body
            verb = group or command.name or function.__name__
            yield pytest.param(verb, body, id=f"{verb}-{function.__name__}")


def installed_for(arguments):
    """Packages of the lock, with those that they need."""
    command = f'{GROUPS}\npython_groups "$@"'
    groups = subprocess.run(["bash", "-c", command, "-", *arguments], text=True, capture_output=True, check=True).stdout
    lines = requirements(lock.PROJECTS, ["cli", *groups.split()])
    return {package.name for package in chosen(LOCKED, lines)}


def missing(names, arguments):
    there = installed_for(arguments)
    return {
        name
        for name in foreign([*names, "hexload.cli.app", "hexload_dev.cli"])
        if name in PACKAGES and not there & {canonical(package) for package in PACKAGES[name]}
    }


@pytest.mark.parametrize("verb, body", list(functions()))
def test_a_verb_imports_only_what_is_installed_for_it(verb, body):
    # GIVEN a fresh clone WHEN a verb is given, without options and with those that need more
    # THEN each module that it imports is of a package that tools/hexload has installed for it
    assert missing(imports_at_once(body), [verb]) == set()
    assert missing(imports_somewhere(body), [verb, *OPTIONS]) == set()


def test_a_misspelt_verb_is_refused_before_anything_is_installed_for_it(tmp_path):
    # GIVEN the script alone, beside which nothing is set up WHEN a verb is misspelt
    script = tmp_path / "tools" / "hexload"
    script.parent.mkdir()
    script.write_text(SCRIPT)
    result = subprocess.run(["bash", script, "rplay", "log.csv"], capture_output=True, text=True)
    # THEN it says so, and which is meant, AND has made nothing
    words = "hexload: No such command 'rplay'. Did you mean replay? (see hexload --help)\n"
    assert (result.returncode, result.stderr) == (2, words)
    assert [path.name for path in tmp_path.iterdir()] == ["tools"]


def test_the_script_knows_every_verb():
    known = re.search(r"^verbs=\(\n(.*?)\)", SCRIPT, re.M | re.S)[1].split()
    assert known == sorted(typer.main.get_command(cli.app).commands)
