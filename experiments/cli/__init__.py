"""The command line. Its modules are light: what a command works with is loaded when it is called."""

import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from experiments.interruption import importing


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    with importing():
        from experiments.cli import bench, logs, looking, paper  # noqa: F401  # all register their commands
        from experiments.cli.app import run
    return run(args)


def entry() -> NoReturn:
    """Run the command line and end the process; an interruption after the work is done changes nothing."""
    code = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if "experiments.audience" in sys.modules and sys.modules["experiments.audience"].left_behind():
        sys.stdout.flush()
        os._exit(code)
    sys.exit(code)
