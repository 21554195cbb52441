"""The command line: its verbs in the order of the help, and how one ends. Their options and examples are in the files
verbs_*.py, their work in the module of each verb's name."""

import errno
import inspect
import os
import sys
from typing import Annotated

import typer

from hexload.cli.verbs_campaign import campaign, faults
from hexload.cli.verbs_live import view, watch
from hexload.cli.verbs_log import convert, replay
from hexload.cli.verbs_machine import excite, key_new, platform_check, platform_new
from hexload.cli.verbs_rig import commission, export, tare
from hexload.cli.verbs_run import bridge, demo, report, sim
from hexload.errors import InputError, ToolFailed

VERBS = (
    demo, sim, replay, convert, tare, commission, export, excite, view, watch, report, campaign, faults, bridge,
)  # fmt: skip

app = typer.Typer(
    name="hexload",
    help="Identifies the load of a Gough-Stewart platform: simulator, controller firmware, replay and report.\n\n"
    "Start here:  hexload demo",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
for verb in VERBS:
    app.command()(verb)

platform = typer.Typer(
    name="platform", help="Platform files: a new one for your machine, and what is wrong in one.", no_args_is_help=True
)
platform.command("new")(platform_new)
platform.command("check")(platform_check)
app.add_typer(platform)

key = typer.Typer(name="key", help="The key of a controller and of those who command it: new.", no_args_is_help=True)
key.command("new")(key_new)
app.add_typer(key)


def _print_version(wanted: bool) -> None:
    if wanted:
        from hexload import project

        print(f"hexload {project.version()}")
        raise typer.Exit()


@app.callback()
def of_all(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Runs a verb; a refusal ends with one line on stderr and the status of its kind, as does what cannot be printed."""
    # Thousands of products of small matrices: threads of numpy's library would wait for each other at several times the cost.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    status = _run_verb()
    try:
        if sys.stdout is not None:  # as it is when the verb was started with none
            sys.stdout.flush()
    except OSError as error:
        status = status or _output_lost(error)
    sys.exit(status)


def _join_lines(verbs: typer.Typer) -> None:
    """Of help texts: typer would break paragraphs where the source does, and once more at the edge of the terminal."""
    for verb in verbs.registered_commands:
        paragraphs = inspect.cleandoc(verb.callback.__doc__ or "").split("\n\n")
        verb.help = "\n\n".join(paragraph.replace("\n", " ") for paragraph in paragraphs)
    for group in verbs.registered_groups:
        _join_lines(group.typer_instance)


def _run_verb() -> int:
    _join_lines(app)
    try:
        return app(prog_name="hexload", standalone_mode=False) or 0
    except (InputError, ToolFailed) as error:
        if str(error):
            print(f"hexload: {error}", file=sys.stderr)
        return error.exit_code
    except typer.TyperException as error:  # a wrong option or argument
        if error.format_message():  # none of a verb without arguments, which has shown its help
            print(f"hexload: {error.format_message()} (see hexload --help)", file=sys.stderr)
        return 2
    except (typer.Abort, KeyboardInterrupt):
        return 130
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EPIPE, errno.EIO) or error.filename is not None:
            raise
        return _output_lost(error)


def _output_lost(error: OSError) -> int:
    """What is still to be written goes nowhere, else Python would try, and complain, once more at its end."""
    print(f"hexload: standard output cannot be written: {error.strerror}", file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 1
