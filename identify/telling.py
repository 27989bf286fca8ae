"""How far a long work is, told to whoever listens: nobody, unless a caller says so."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache

from threadpoolctl import ThreadpoolController

Listener = Callable[[str], None]
"""Receives what is being worked at, from the outermost to the innermost: "power model, IV: round 3 of 15"."""

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)
_within: ContextVar[tuple[str, ...]] = ContextVar("within", default=())
_controller = cache(ThreadpoolController)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Let `listener` hear the progress of the block, in this thread."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


@contextmanager
def stage(what: str) -> Iterator[None]:
    """Tell what the block works at; stages may stand in each other."""
    token = _within.set((*_within.get(), what))
    try:
        if (listener := _listener.get()) is not None:
            listener(": ".join(_within.get()))
        yield
    finally:
        _within.reset(token)


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep BLAS to one thread, whatever it is set to: results are then the same on every machine, too."""
    with _controller().limit(limits=1):
        yield
