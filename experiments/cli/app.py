"""Running a command: its words, its errors, its end."""

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.metadata import version

from idbench.experiments.cli.command import COMMANDS
from idbench.experiments.cli.interruption import INTERRUPTED, Notice, TerminatedError, importing, noticing, terminating
from idbench.experiments.errors import ExperimentError, RequirementError, is_told, reason, report, visible

DESCRIPTION = "A MuJoCo testbench for the dynamic identification of robots."

LEAST_MEMORY = 1.5  # Address space [GB] below which libraries fail while they are loaded

OVERVIEW = """\
idbench: identify the dynamics of robots, on simulated data whose truth is known, and on logs of real ones

  idbench table1                  the paper's comparison of three models; half a minute
  idbench run ripple              simulate a scenario, identify it, record it
  idbench view                    look at the latest results
  idbench identify LOG.csv        identify a log; --robot names the arm
  idbench robot panda             what can be identified of an arm
  idbench excite panda            design an exciting trajectory
  idbench study encoder           ask a question of many simulated robots
  idbench new scenario mine       begin a scenario, a study or a plug-in of your own
  idbench list, idbench --help    what can be combined, all commands"""
"""What `idbench` alone prints."""

ENVIRONMENT = {
    "MUJOCO_GL": "disable",  # nothing is drawn by MuJoCo, and what would draw takes a tenth of a second to load
    "OPENBLAS_NUM_THREADS": "1",  # matrices are small here: threads of BLAS wait for each other longer than they work
    "MKL_NUM_THREADS": "1",
}
"""Read when MuJoCo and NumPy are loaded, unless the user says otherwise."""

for name, value in ENVIRONMENT.items():
    os.environ.setdefault(name, value)


def run(args: Sequence[str] | None = None) -> int:
    """Run a command; return its exit code: 0, 1 for a fault of idbench, 2 for wrong input, 130 when interrupted."""
    words = sys.argv[1:] if args is None else list(args)
    notice = Notice()
    try:
        _require_memory()
        with terminating(), noticing() as notice:
            if words == ["--version"]:
                _print(f"idbench {version('idbench')}")
            elif not words:
                _print(OVERVIEW)
            else:
                with importing():
                    from idbench.experiments.cli.parser import parsed

                    command = parsed(words, COMMANDS, DESCRIPTION)
                if command is not None:
                    _do(command)
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except Exception as error:
        if is_told(error):
            return _complain(reason(error), 1 if isinstance(error, RequirementError) else 2)
        if notice.pressed:
            return _complain("interrupted", INTERRUPTED)
        return _complain(f"{reason(error)}; its traceback is in {report(error)}", 1)
    return 0


def _require_memory() -> None:
    """Raise ExperimentError if so little memory is allowed that libraries fail, or hang, while they are loaded."""
    with suppress(ImportError):  # not on Windows
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY and 1e-9 * limit < LEAST_MEMORY:
            raise ExperimentError(
                f"this process may have {1e-9 * limit:.2g} GB of address space (ulimit -v), idbench needs {LEAST_MEMORY:g} "
                "GB: raise it, as in ulimit -v unlimited"
            )


def _do(command: Callable[[], None]) -> None:
    """Run a command, which ends by returning or by an error."""
    try:
        command()
    except (Exception, KeyboardInterrupt, TerminatedError):
        raise
    except BaseException as ended:
        raise ExperimentError(
            f"what was called ended the process ({type(ended).__name__}: {ended}) before the command was done: a plug-in must "
            "return, or raise an error; what is printed above is complete, and nothing else"
        ) from ended


def _print(text: str) -> None:
    from idbench.experiments.results.page import Page

    page = Page()
    page.print(text)
    page.close()


def _complain(what: str, code: int) -> int:
    """Say what is wrong in one line."""
    sys.stderr.write(f"idbench: {visible(' '.join(what.split()))}\n")
    return code
