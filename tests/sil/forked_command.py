"""The command line in a copy of this process, which has imported it already: starting Python takes longer than most verbs.

Its streams are files, its environment and its exit status its own. What a start itself has to show, a test starts."""

import contextlib
import functools
import io
import os
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable

ENVIRONMENT = {"COLUMNS": "200", "TERM": "dumb", "NO_COLOR": "1"}


@functools.cache
def _imported() -> Callable[[], None]:
    """main(), and with it what it imports when it first runs."""
    from hexload.estimation import replay  # noqa: F401
    from hexload_dev.cli import main

    before, sys.argv = sys.argv, ["hexload", "replay", "--help"]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main()
    sys.argv = before
    return main


def hexload(*arguments: object, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess:
    main = _imported()
    words = ["hexload", *map(str, arguments)]
    with tempfile.TemporaryFile("w+") as stdout, tempfile.TemporaryFile("w+") as stderr:
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            status = 1
            try:
                os.dup2(stdout.fileno(), 1)
                os.dup2(stderr.fileno(), 2)
                sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)
                os.environ.update(ENVIRONMENT | (environment or {}))
                sys.argv = words
                main()
            except SystemExit as end:
                status = end.code if isinstance(end.code, int) else int(end.code is not None)
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(status)  # none of the test's own ends
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        stdout.seek(0)
        stderr.seek(0)
        return subprocess.CompletedProcess(words, status, stdout.read(), stderr.read())
