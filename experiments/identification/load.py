"""From files to logs: those of a fit, with their delays and the band that suits them, and those held out to judge it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.chain_settings import with_cutoff
from idbench.experiments.identification.logs import Logs, delay_method
from idbench.experiments.identification.poses import of_poses
from idbench.experiments.identification.reading import ReadLog, ReadOptions, file_of, late, read, read_as, with_delays
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.simulated_logs import SimulatedLogs
from idbench.experiments.text import of_each
from idbench.identify import LogError, MotionLog
from idbench.identify.judge.band import Band
from idbench.identify.telling import stage

MOST_STARTS = 1000  # Instants of a log that are looked at for the beginning of another


@dataclass(frozen=True, eq=False)
class Loaded:
    """Logs as they were read, and the request with the band that suits them."""

    request: Request
    """What is asked for."""
    read: tuple[ReadLog, ...]
    """The logs."""
    notes: tuple[str, ...]
    """What was read, done and assumed."""
    simulated: SimulatedLogs | None = None
    """How torques are read that are those of a simulation."""

    def logs(self, some: slice = slice(None)) -> tuple[MotionLog, ...]:
        """Return some of the logs, or the pieces of those with gaps."""
        return tuple(log for one in self.read[some] for log in one.logs)

    @property
    def names(self) -> tuple[str, ...]:
        """What to call them."""
        found = []
        for one, name in zip(self.read, _names(self.read), strict=True):
            found += [f"{name}, piece {k + 1}" if len(one.logs) > 1 else name for k in range(len(one.logs))]
        return tuple(found)


def _names(every: Sequence[ReadLog]) -> list[str]:
    """Return names of files, with their folders where they would be alike: every run has a log.parquet."""
    alike = len({one.path.name for one in every}) < len(every)
    return [str(one.path) if alike else one.path.name for one in every]


def load(
    paths: Sequence[Path], options: ReadOptions, request: Request, *, band: bool, more: int = 0, alike: int | None = None
) -> Loaded:
    """Return logs of one fit.

    Parameters
    ----------
    paths : sequence of Path
        Their files, or folders of runs.
    options : ReadOptions
        How they are read.
    request : Request
        What is asked for.
    band : bool
        Whether the band is to suit short logs.
    more : int
        Parameters that are identified beside those of the basis.
    alike : int, optional
        How many logs, from the first on, are of the robot without a payload: these show the delay of all. All by default.
    """
    require_different(paths)
    with stage("reading logs"):
        every = [read(file_of(path), options, request.robot_model) for path in paths]
    return prepared(every, request, sought=delay_method(options.delay), band=band, more=more, alike=alike)


def prepared(
    every: Sequence[ReadLog], request: Request, *, sought: str | None, band: bool, more: int = 0, alike: int | None = None
) -> Loaded:
    """Return logs of one fit that were read, with the band that suits them and, if it is sought, the delay of their torques."""
    _require_other_samples(every)
    of_band, logs = list[str](), [log for one in every for log in one.logs]
    simulated = None
    if any(log.poses for log in logs):
        request = of_poses(request, logs, band=band, sought=sought)
    if band and not logs[0].poses:
        p, least = len(request.robot_model.basis.names) + more, request.processing.operator.cutoff  # type: ignore[attr-defined]
        needed = Band.of(logs, p, least)
        if needed.cutoff != least:
            mask, of_band = request.processing.mask, [needed.words(p, least)]
            request = in_band(request, needed.cutoff)
            if needed.cutoff < least:  # edges of a mask that are as long as a slow log's moves would leave nothing
                request = replace(request, method=(replace(request.processing, mask=mask), request.solver))
    if sought:
        with stage("the delay of the torques"):
            own = with_delays(every[:alike], request, sought)
            every = [*own, *(late(read, own[0].channel) for read in every[len(own) :])]
    if not logs[0].poses and (simulated := SimulatedLogs.of(every, request)):  # at the delays that were found
        every = [simulated.acting(read) for read in every]
    named = zip(every, _names(every), strict=True)
    said = of_each((name, note) for one, name in named for note in one.notes) if len(every) > 1 else every[0].notes
    return Loaded(request, tuple(every), tuple(dict.fromkeys([*said, *of_band])), simulated)


def in_band(request: Request, cutoff: float) -> Request:
    """Return a request with the band up to `cutoff` [Hz]."""
    return replace(request, method=(with_cutoff(request.processing, cutoff), request.solver))


def with_held_out(loaded: Loaded, paths: Sequence[Path], options: ReadOptions, truth: Mapping[str, float] | None) -> Logs:
    """Return logs of a fit with those on which it is judged.

    Where nothing says what the torques of these mean, it is what those of the first log do.
    """
    known = loaded.read[0].channel  # as it was logged; its gain is of its own file
    sought, every = delay_method(options.delay), dict[str, ReadLog]()
    options = replace(options, fallback=replace(known, gain=1.0))
    require_different(paths)
    for given in paths:
        path = file_of(given)
        try:
            one = read_as(loaded.read[0].path, path, options, loaded.request.robot_model)
            every[str(given)] = late(one, known) if sought else one
        except (LogError, ExperimentError) as error:
            words = f"--validate {error}" if str(path) in str(error) else f"--validate {path}: {error}"
            raise ExperimentError(words) from error
    return judged_on(loaded, every, truth, sought)


def judged_on(loaded: Loaded, every: Mapping[str, ReadLog], truth: Mapping[str, float] | None, sought: str | None) -> Logs:
    """Return logs of a fit with held-out logs that were read, by name."""
    said = list[tuple[str, str]]()
    if loaded.simulated:
        every = {name: loaded.simulated.acting(one) for name, one in every.items()}
    for name, one in every.items():
        pieces = [f"of its {len(one.logs)} pieces the longest is judged"] if len(one.logs) > 1 else []
        said += [(one.path.name, note) for note in (*one.notes, *pieces)]
        if one.longest.poses != loaded.logs()[0].poses:
            kinds = ("poses at rest", "motion") if one.longest.poses else ("motion", "poses at rest")
            raise ExperimentError(f"--validate {name} is of {kinds[0]}, what is identified of {kinds[1]}: give another log")
        if any(within(one.longest, log) for log in loaded.logs()):
            raise ExperimentError(f"--validate {name} holds the motion that is identified: give another motion, or none")
    held_out, notes = {name: one.longest for name, one in every.items()}, (*loaded.notes, *of_each(said))
    gains = loaded.read[0].columns.gain
    return Logs(loaded.logs(), loaded.names, held_out, notes, truth, sought, gains)


def require_different(paths: Sequence[Path]) -> None:
    """Raise ExperimentError if a log is given twice."""
    twice = [str(path) for k, path in enumerate(paths) if path.absolute() in [p.absolute() for p in paths[:k]]]
    if twice:
        raise ExperimentError(f"{', '.join(twice)} is given twice: it would count twice")


def _require_other_samples(every: Sequence[ReadLog]) -> None:
    """Raise ExperimentError if two files hold the same samples."""
    for one, other in combinations(every, 2):
        if np.array_equal(one.columns.q, other.columns.q) and np.array_equal(one.columns.tau, other.columns.tau):
            raise ExperimentError(f"{other.path} holds the same samples as {one.path}: they would count twice; leave one out")


def within(one: MotionLog, other: MotionLog) -> bool:
    """Return whether a log is a part of another, or the other of it."""
    short, long = sorted((one, other), key=lambda log: log.samples)
    starts = np.flatnonzero((long.q[: long.samples - short.samples + 1] == short.q[0]).all(axis=1)) if short.n == long.n else ()
    return any(np.array_equal(long.q[k : k + short.samples], short.q) for k in starts[:MOST_STARTS])
