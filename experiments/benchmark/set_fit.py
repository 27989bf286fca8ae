"""A set of torques and positions that is fitted: its files are read once."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from idbench.experiments.benchmark.definition import Definition
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.job import fit_of, read_logs, read_options, request_of
from idbench.experiments.identification.load import Loaded, with_held_out
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.reading import ReadLog, file_of, late, read_as
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.identify import MotionLog
from idbench.identify.judge.excitation import seen
from idbench.identify.judge.validation import split


@final
@dataclass(frozen=True, eq=False)
class SetFit:
    """A set that is fitted."""

    definition: Definition
    """What it is."""
    asked: IdentifyRequest
    """How it is identified."""
    fit: Fit
    """Its fit."""
    read: dict[str, ReadLog]
    """Its logs as they were read, by the names of the definition: those of the fit, and held-out ones."""
    seconds: float
    """How long reading and fitting took."""

    @classmethod
    def of(cls, folder: Path, definition: Definition, asked: IdentifyRequest) -> "SetFit":
        """Return the fit of a set in a folder."""
        begin = time.perf_counter()
        loaded = read_logs(asked, request_of(asked))
        logs = with_held_out(loaded, asked.validate, read_options(asked), None)
        if definition.held_out:
            held_out = (logs.held_out or {}).values()
            logs = replace(logs, held_out=dict(zip(definition.held_out, held_out, strict=True)))
        fit = fit_of(loaded.request, logs if logs.held_out else _without_end(logs))
        names = (*definition.fit, *definition.held_out)
        read = dict(zip(names, (*loaded.read, *logs.read_held_out), strict=True))
        seconds = time.perf_counter() - begin
        return cls(definition, asked, fit, read | _others(folder, definition, asked, loaded, names), seconds)

    @property
    def repeated(self) -> dict[str, MotionLog]:
        """The logs that are fitted one by one, with the delay of the fit."""
        names, channel = self.definition.every_repeat, self.fit.logs.fitted[0].torque
        return {name: late(self.read[name], channel).longest for name in names} if len(names) > 1 else {}

    @property
    def seen(self) -> dict[str, int]:
        """How many samples of each held-out file are in fitted ones, too, before any were resampled."""
        fitted = [self.read[name].columns for name in self.definition.fit]
        return {name: seen(self.read[name].columns, fitted) for name in self.definition.held_out}


def _others(
    folder: Path, definition: Definition, asked: IdentifyRequest, loaded: Loaded, names: tuple[str, ...]
) -> dict[str, ReadLog]:
    """Return logs that are only fitted one by one, read as the first of the fit was."""
    first = loaded.read[0]
    options = replace(read_options(asked), delay=None, fallback=replace(first.channel, gain=1.0))
    return {
        name: read_as(first.path, file_of(folder / name), options, loaded.request.robot_model)
        for name in definition.every_repeat
        if name not in names
    }


def _without_end(logs: Logs) -> Logs:
    """Return logs of which the last quarter of the longest is held out."""
    k = logs.longest
    rest, end = split(logs.fitted[k])
    fitted = (*logs.fitted[:k], rest, *logs.fitted[k + 1 :])
    return replace(logs, fitted=fitted, held_out={f"the last quarter of {logs.name(k)}": end})
