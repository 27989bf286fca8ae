"""Ending cleanly: Ctrl-C and termination at any instant."""

import os
import signal
import sys
from _thread import interrupt_main
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from threading import Timer, main_thread
from types import FrameType
from typing import Any

INTERRUPTED = 130  # Exit code after Ctrl-C: 128 + SIGINT
AGAIN = 0.01  # Time [s] after which an interruption that was lost is repeated


def importing() -> AbstractContextManager[None]:
    """Make Ctrl-C leave at once and quietly while modules are loaded: some turn an interruption into an ImportError."""
    return _handling(_leave, "SIGINT")


def terminating() -> AbstractContextManager[None]:
    """Make termination (SIGTERM, SIGHUP) unwind like an error, so that nothing half-written stays behind."""
    return _handling(_unwind, "SIGTERM", "SIGHUP")


@contextmanager
def _handling(handler: Callable[[int, FrameType | None], None], *names: str) -> Iterator[None]:
    """Handle signals, those that this system has, until the end of the block."""
    before = {number: signal.signal(number, handler) for name in names if (number := getattr(signal, name, None))}
    try:
        yield
    finally:
        for number, handled in before.items():
            signal.signal(number, handled)


class TerminatedError(SystemExit):
    """The process received a signal to end; a class of our own, so that no plug-in is blamed for it."""


class Notice:
    """Whether Ctrl-C was pressed."""

    pressed: bool = False


@contextmanager
def noticing() -> Iterator[Notice]:
    """Yield whether Ctrl-C was pressed: what is loaded late turns an interruption into errors of its own."""
    notice = Notice()

    def interrupt(number: int, frame: FrameType | None) -> None:
        notice.pressed = True
        signal.default_int_handler(number, frame)

    hook = sys.unraisablehook

    def lost(error: Any) -> None:
        # Python ignores what is raised while an object goes, as locks of imports do: the interruption comes again after that.
        if notice.pressed and error.exc_type is KeyboardInterrupt:
            Timer(AGAIN, _interrupt).start()
        else:
            hook(error)

    with _handling(interrupt, "SIGINT"):
        sys.unraisablehook = lost
        try:
            yield notice
        finally:
            sys.unraisablehook = hook


def _interrupt() -> None:
    """Interrupt the main thread, which may be waiting."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main_thread().ident or 0, signal.SIGINT)
    else:  # on Windows
        interrupt_main()


def _leave(number: int, frame: FrameType | None) -> None:
    del number, frame
    os.write(2, b"idbench: interrupted\n")
    os._exit(INTERRUPTED)


def _unwind(number: int, frame: FrameType | None) -> None:
    del frame
    raise TerminatedError(128 + number)
