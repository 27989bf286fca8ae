"""The entry point of the command line: everything slow to load is loaded here, guarded."""

import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from experiments.interruption import importing


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    with importing():
        from experiments.commands import run
    return run(args)


def entry() -> NoReturn:
    """Run the command line and end the process; an interruption after the work is done changes nothing."""
    code = main()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if "experiments.audience" in sys.modules and sys.modules["experiments.audience"].left_behind():
        sys.stdout.flush()
        os._exit(code)
    sys.exit(code)
