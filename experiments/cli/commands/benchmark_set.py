"""One set of a benchmark, as a worker makes it: read, fitted, judged, saved."""

import threading
import time
from collections.abc import Sequence
from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from experiments.benchmark.definition import FILE, Definition, read_definition
from experiments.benchmark.files import files_of, kept_row, made_of_files, require_files
from experiments.benchmark.row import SetFit, row_of
from experiments.benchmark.tools import Predicted, predictions, prepared
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
from identify.rows.long_logs import manageable
from sim.robot.tree import standard_parameters
from sim.robot.write_urdf import urdf_text

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

        row = {"set": folder.name, **row_of(made, predicted), "made_of": made_of, "tools_read": _for_tools(made)}
        try:
            with results.complete() as hidden:
                _write_for_tools(made, hidden)
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


def _for_tools(made: SetFit) -> dict[str, Any]:
    """Return what other tools need to know beside logs and URDF."""
    fit = made.fit
    return {
        "robot": "robot.urdf",
        "joints": list(fit.robot_model.robot.joints),
        "gravity": [float(x) for x in fit.robot_model.tree.gravity],
        "fit": [f"fit{k + 1}.npz" for k in range(len(fit.logs.fitted))],
        "held_out": [f"held_out{k + 1}.npz" for k in range(len(fit.logs.held_out or {}))],
        "couplings": [list(map(float, coupling.weights)) for coupling in fit.robot_model.tree.couplings],
        "rotors": fit.robot_model.asked.armature != "none",
        "cutoff": getattr(fit.processing.operator, "cutoff", None),
    }


def _write_for_tools(made: SetFit, folder: Path) -> None:
    """Write logs, with torques at the instants when they act, and the robot."""
    fit = made.fit
    named = {f"fit{k + 1}.npz": log for k, log in enumerate(fit.logs.fitted)}
    judged = [manageable([log])[0] for log in (fit.logs.held_out or {}).values()]
    named |= {f"held_out{k + 1}.npz": log for k, log in enumerate(judged)}
    for name, log in named.items():
        with (folder / name).open("wb") as file:
            np.savez(file, **prepared(log))  # type: ignore[arg-type]
    robot_model = fit.robot_model
    text = urdf_text(
        robot_model.name, robot_model.robot, robot_model.tree, standard_parameters(robot_model.robot), robot_model.mounting
    )
    (folder / "robot.urdf").write_text(_without_shapes(text), encoding="utf-8")


def _without_shapes(urdf: str) -> str:
    """Return a URDF without meshes: they are elsewhere, and some tools refuse a robot whose meshes are missing."""
    root = ElementTree.fromstring(urdf)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    return ElementTree.tostring(root, encoding="unicode") + "\n"
