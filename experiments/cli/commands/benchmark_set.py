"""One set of a benchmark, as a worker makes it: read, fitted, judged, saved."""

import threading
import time
from collections.abc import Sequence
from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.benchmark.definition import FILE, Definition, read_definition
from experiments.benchmark.files import files_of, kept_row, made_of_files, require_files
from experiments.benchmark.for_tools import what_tools_read, write_for_tools
from experiments.benchmark.row import row_of
from experiments.benchmark.set_fit import SetFit
from experiments.benchmark.tools import Predicted, predictions
from experiments.cli.app import parsed
from experiments.cli.commands.identify import fit_of, loaded_logs
from experiments.cli.commands.requests import read_options, request_of
from experiments.cli.options.identify import Identify
from experiments.errors import ExperimentError, ResultsError
from experiments.faults import reason
from experiments.identification.fit import Fit
from experiments.identification.held_out import HeldOut
from experiments.identification.logs import Logs
from experiments.identification.reading import file_of, read_as
from experiments.identification.request import Request
from experiments.results.folder import ResultsFolder
from experiments.results.summaries import write_summary
from identify import MotionLog
from identify.judge.validation import split

IN_FOLDER = threading.Lock()
"""Held while this process is in the folder of a set: options name files there, and other threads have sets of their own."""


def set_row(folder: Path, out: Path, force: bool) -> dict[str, Any]:
    """Return the row of a set: that of earlier results if it is of the same definition, files and version.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If there is none.
    """
    definition = read_definition(folder)
    require_files(folder, definition)
    if out == folder:
        raise ExperimentError(f"the results of {folder} would go into the set itself: choose another --out")
    made_of = made_of_files(folder, definition, out)
    if not force and (kept := kept_row(out, made_of)) is not None:
        return kept
    results = ResultsFolder(out, "benchmark-set", f"idbench benchmark {folder.name}", force, files_of(folder, definition))
    with results.held():
        with IN_FOLDER, chdir(folder):
            made = _fitted(folder, definition)

        def predicted(held_out: Sequence[HeldOut]) -> list[Predicted]:
            return predictions(out, len(held_out))

        row = {"set": folder.name, **row_of(made, predicted), "made_of": made_of, "tools_read": what_tools_read(made)}
        try:
            with results.complete() as hidden:
                write_for_tools(made, hidden)
                write_summary(hidden / "summary.json", row)
        except (ResultsError, OSError) as error:  # a full disk: the row is printed all the same
            row["unsaved"] = reason(error)
    return row


def _fitted(folder: Path, definition: Definition) -> SetFit:
    begin = time.perf_counter()
    held_out = ["--validate", *definition.held_out] if definition.held_out else []
    command = parsed(["identify", *definition.fit, *definition.words, *held_out])
    if not isinstance(command, Identify) or command.log != tuple(map(Path, definition.fit)):
        raise ExperimentError(f"{FILE}: options = {definition.options!r:.60} must be options of `idbench identify`, no logs")
    fit = fit_of(*_held_out(*loaded_logs(command, request_of(command, {}), {})))
    seconds = time.perf_counter() - begin
    return SetFit(definition, fit, lambda: _repeated(folder, command, fit, definition), seconds)


def _held_out(request: Request, logs: Logs) -> tuple[Request, Logs]:
    """Return logs of which some are held out: where none are named, the last quarter of the longest."""
    if logs.held_out:
        return request, logs
    k = logs.longest
    rest, end = split(logs.fitted[k])
    fitted = (*logs.fitted[:k], rest, *logs.fitted[k + 1 :])
    return request, replace(logs, fitted=fitted, held_out={f"the last quarter of {logs.name(k)}": end})


def _repeated(folder: Path, command: Identify, fit: Fit, definition: Definition) -> dict[str, MotionLog]:
    """Return the logs that are fitted one by one, with the delay of the fit."""
    if len(definition.every_repeat) < 2:
        return {}
    torque, first = fit.logs.fitted[0].torque, file_of(folder / definition.fit[0])
    options = replace(read_options(command), delay=str(torque.delay), fallback=replace(torque, gain=1.0))
    return {name: read_as(first, file_of(folder / name), options, fit.request).longest for name in definition.every_repeat}
