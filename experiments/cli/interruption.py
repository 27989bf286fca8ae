"""Ending cleanly: Ctrl-C and termination at any instant."""

import os
import signal
import sys
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer, main_thread
from types import FrameType
from typing import Any

INTERRUPTED = 130  # Exit code after Ctrl-C: 128 + SIGINT
AGAIN = 0.01  # Time [s] after which an interruption that was lost is repeated


@contextmanager
def importing() -> Iterator[None]:
    """Make Ctrl-C leave at once and quietly while modules are loaded: some turn an interruption into an ImportError."""
    before = signal.signal(signal.SIGINT, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def terminating() -> Iterator[None]:
    """Make termination (SIGTERM, SIGHUP) unwind like an error, so that nothing half-written stays behind."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.signal(number, _unwind) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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

    before, hook = signal.signal(signal.SIGINT, interrupt), sys.unraisablehook

    def lost(error: Any) -> None:
        # Python ignores what is raised while an object goes, as locks of imports do: the interruption comes again after that.
        if notice.pressed and error.exc_type is KeyboardInterrupt:
            Timer(AGAIN, _interrupt).start()
        else:
            hook(error)

    sys.unraisablehook = lost
    try:
        yield notice
    finally:
        sys.unraisablehook = hook
        signal.signal(signal.SIGINT, before)


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
