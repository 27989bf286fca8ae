"""The command line. Its modules are light: what a command works with is loaded when it is called."""

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from idbench.experiments.cli.interruption import importing


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    with importing():
        from idbench.experiments.cli.app import run
        from idbench.experiments.cli.options import jobs, tools  # noqa: F401  # in the order of the help: all commands register
    return run(args)


def entry() -> NoReturn:
    """Run the command line and end the process; an interruption after the work is done changes nothing."""
    try:
        code = main()
    except SystemExit as ended:  # of the parser, for help and wrong words
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, AttributeError, ValueError):  # closed, or its reader has gone
            stream.flush()
    os._exit(code)  # everything is written; native threads of libraries, and viewers that hang, have no say any more
