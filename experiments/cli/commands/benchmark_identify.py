"""A set of torques and positions, as a benchmark identifies it."""

import time
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from idbench.experiments.benchmark.definition import FILE, IN_FOLDER, Definition
from idbench.experiments.benchmark.row import row_of
from idbench.experiments.benchmark.set_fit import SetFit
from idbench.experiments.benchmark.tools import predictions, what_tools_read, write_for_tools
from idbench.experiments.cli.app import parsed
from idbench.experiments.cli.commands.identify import fit_of, loaded_logs
from idbench.experiments.cli.commands.requests import read_options, request_of
from idbench.experiments.cli.options.identify import Identify
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.reading import ReadLog, file_of, read_as
from idbench.experiments.identification.request import Request
from idbench.identify import MotionLog
from idbench.identify.judge.excitation import seen
from idbench.identify.judge.validation import split


def identified(folder: Path, definition: Definition, out: Path) -> tuple[dict[str, Any], Callable[[Path], None]]:
    """Return the row of a set, and what writes the files of other tools into a folder."""
    with IN_FOLDER, chdir(folder):
        made = _fitted(folder, definition)
    row = row_of(made, predictions(out))
    return {**row, "tools_read": what_tools_read(made)}, partial(write_for_tools, made)


def _fitted(folder: Path, definition: Definition) -> SetFit:
    begin = time.perf_counter()
    held_out = ["--validate", *definition.held_out] if definition.held_out else []
    command = parsed(["identify", *definition.fit, *definition.words, *held_out])
    if not isinstance(command, Identify) or command.log != tuple(map(Path, definition.fit)):
        raise ExperimentError(f"{FILE}: options = {definition.options!r:.60} must be options of `idbench identify`, no logs")
    fit = fit_of(*_held_out(*loaded_logs(command, request_of(command, {}), {})))
    seconds = time.perf_counter() - begin
    again = _Again(folder, command, fit, definition)
    return SetFit(definition, fit, again.repeated, again.seen, seconds)


def _held_out(request: Request, logs: Logs) -> tuple[Request, Logs]:
    """Return logs of which some are held out: where none are named, the last quarter of the longest."""
    if logs.held_out:
        return request, logs
    k = logs.longest
    rest, end = split(logs.fitted[k])
    fitted = (*logs.fitted[:k], rest, *logs.fitted[k + 1 :])
    return request, replace(logs, fitted=fitted, held_out={f"the last quarter of {logs.name(k)}": end})


@dataclass(frozen=True)
class _Again:
    """Reads the files of a set again, as its fit did."""

    folder: Path
    command: Identify
    fit: Fit
    definition: Definition

    def repeated(self) -> dict[str, MotionLog]:
        """Return the logs that are fitted one by one, with the delay of the fit."""
        names = self.definition.every_repeat
        return {name: self._read(name).longest for name in names} if len(names) > 1 else {}

    def seen(self) -> dict[str, int]:
        """Return how many samples of each held-out file are in fitted ones, too."""
        if not self.definition.held_out:
            return {}
        fitted = [self._read(name).columns for name in self.definition.fit]
        return {name: seen(self._read(name).columns, fitted) for name in self.definition.held_out}

    def _read(self, name: str) -> ReadLog:
        torque, first = self.fit.logs.fitted[0].torque, file_of(self.folder / self.definition.fit[0])
        options = replace(read_options(self.command), delay=str(torque.delay), fallback=replace(torque, gain=1.0))
        return read_as(first, file_of(self.folder / name), options, self.fit.request)
