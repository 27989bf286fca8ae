"""The entry point of the command line: everything slow to load is loaded here, guarded."""

from collections.abc import Sequence

from experiments.interruption import importing


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code: 0, 2 for wrong input, 130 when interrupted."""
    with importing():
        from experiments.commands import run
    return run(args)
