"""What only shows results: each view may fail alone, and says so in one line."""

import sys
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

from idbench.experiments.errors import REPORT, ResultsError, is_told, reason, report, trace
from idbench.experiments.results.folder import ResultsFolder
from idbench.identify.blame import is_mistake

if TYPE_CHECKING:
    from collections.abc import Sequence

    from idbench.experiments.recording.stream import Stream

    Streams = Sequence[tuple[str, Stream]]

T = TypeVar("T")


def write_streams(streams: "Streams", folder: ResultsFolder | None) -> None:
    """Write the files of a recording into a results folder, all or none; who watches has seen them anyway.

    Raises
    ------
    ResultsError
        If they cannot be written.
    """
    try:
        if folder is not None:
            with folder.more() as hidden:
                for name, stream in streams:
                    stream.write(hidden / name)
    finally:
        for _, stream in streams:  # when everything is written: a viewer may hang
            stream.close()


class Attempts:
    """Works on results that are complete; one that fails takes nothing away from the others.

    `kept` says what is there whatever fails; `folder` is where the results are, and tracebacks of faults go.
    """

    def __init__(self, kept: str, folder: ResultsFolder | None = None) -> None:
        self._kept = kept
        self._folder = folder
        self._failures = list[str]()
        self._traces = list[str]()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close at the end of the block; if it was interrupted, say what is there all the same."""
        if kind is None:
            self.close()
        elif issubclass(kind, KeyboardInterrupt | SystemExit):
            sys.stderr.write(f"\nidbench: {self._kept}\n")

    def attempt(self, what: str, make: Callable[[], T]) -> T | None:
        """Result of `make`, None if it fails."""
        try:
            return make()
        except BaseException as error:
            if not is_mistake(error):  # Ctrl-C and a termination end the others, too
                raise
            self.failed(what, reason(error), "" if is_told(error) else trace(error), error)
            return None

    def file(self, name: str, make: Callable[[], str | bytes]) -> None:
        """Write what `make` returns as a file beside the results."""
        if (folder := self._folder) is not None:
            self.attempt(name, lambda: folder.add(name, make()))

    def recording(self, make: "Callable[[], Streams]") -> None:
        """Write the recording that `make` returns, beside the results."""
        self.attempt("the recording", lambda: write_streams(make(), self._folder))

    def failed(self, what: str, why: str, traceback: str = "", error: BaseException | None = None) -> None:
        """Note that something failed, and why; of a fault its traceback."""
        if traceback and self._folder is None and error is not None:
            why += f"; its traceback is in {report(error)}"
        elif traceback:
            self._traces.append(f"{what}\n{traceback}")
            why += f"; its traceback is in {self._folder.out / REPORT}" if self._folder else ""
        self._failures.append(why if what in why else f"{what}: {why}")

    def close(self) -> None:
        """Write tracebacks; raise ResultsError that names all that failed, and what is there all the same."""
        if self._traces and self._folder:
            with suppress(ResultsError), self._folder.more() as hidden:
                (hidden / REPORT).write_text("\n".join(self._traces), encoding="utf-8", errors="backslashreplace")
        if self._failures:
            raise ResultsError(f"{'; '.join(self._failures)}; {self._kept}")
