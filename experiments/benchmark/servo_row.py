"""A set of servos, as a benchmark identifies it: positions of held-out logs, simulated from their commands alone."""

import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.benchmark.definition import FILE, Definition
from idbench.experiments.benchmark.row import Made
from idbench.experiments.errors import ExperimentError
from idbench.experiments.requests.jobs import ServoRequest
from idbench.experiments.results.writing import finite
from idbench.experiments.servo.identification import Servos, summary_of
from idbench.experiments.servo.job import servos_identified
from idbench.identify import Array
from idbench.identify.servo import ServoFit


def servo_row(folder: Path, definition: Definition, out: Path) -> Made:
    """Return the row of a set, and what writes the files of other tools into a folder: nothing."""
    del out
    if not definition.held_out and len(definition.fit) < 2:
        raise ExperimentError(f"{FILE}: name a second log, or held_out: one alone says nothing of others")
    begin, command = time.perf_counter(), definition.request(folder)
    assert isinstance(command, ServoRequest)
    made = servos_identified(command)
    seconds = time.perf_counter() - begin
    servos = made.servos
    others = made.others
    fits = made.fits
    assert others is not None
    row = {
        "title": definition.title,
        "joints": list(servos.links.joints),
        "model": ", ".join(dict.fromkeys(fit.friction for fit in fits.values())),
        "estimator": "output error",
        "parameters": sum(len(fit.p) for fit in fits.values()),
        "estimate": {joint: summary_of(fit) for joint, fit in fits.items()},
        "seconds": seconds,
        "logs": _logs(others, made.errors["held out"], servos.links.joints),
        "published": [asdict(one) for one in definition.published],
        "notes": [f"{joint}: {why}" for joint, why in made.every.items() if isinstance(why, str)],
        "verdict": None,
        "verdicts": made.verdicts,
        "repeats": {},
        "free_run": _free_runs(others, fits, servos.links.joints),
        "tools": {},
    }
    return row, _nothing


def _nothing(folder: Path) -> None:
    """Write no files: what other tools of servos read differs from tool to tool."""


def _free_runs(servos: Servos, fits: Mapping[str, ServoFit], joints: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the rms of the position error over the range of each joint, of each log, without spikes."""
    found = []
    runs = servos.runs_with(fits)
    simulated = {joint: fit.simulate(runs[joint]) for joint, fit in fits.items()}
    for k in range(len(servos.logs)):
        nrmse = dict.fromkeys(joints, np.nan)
        for joint, every in simulated.items():
            run = runs[joint][k]
            off = (run.q - every[k])[run.read_well]
            span = float(np.ptp(run.q[run.read_well]))
            nrmse[joint] = float(np.sqrt((off**2).mean())) / span if span > 0 else np.nan
        found.append({"nrmse": [finite(x) for x in nrmse.values()]})
    return found


def _logs(servos: Servos, errors: Mapping[str, Array], joints: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return what the row says of each held-out log: the mean absolute error of the position of each joint [rad]."""
    none = np.full(len(servos.logs), np.nan)
    each = np.array([errors.get(joint, none) for joint in joints]).T
    return [
        {"title": servos.name(path), "position_error": [finite(x) for x in own], "samples_seen": 0}
        for path, own in zip(servos.logs, each, strict=True)
    ]
