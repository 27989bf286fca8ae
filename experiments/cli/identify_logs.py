"""The logs of an identification: those of the fit, and those on which it is judged."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from experiments.cli.logs import Identify
from experiments.cli.reading import Question, ReadLog, file_of, read, with_delays
from experiments.errors import ExperimentError
from experiments.identification.chain_settings import chain_of, with_cutoff
from experiments.identification.defaults import CHAIN
from experiments.identification.identified import Identified
from experiments.identification.validated import Validated
from identify import ESTIMATORS, LogError, MotionLog
from identify.judge.band import Band
from identify.signals.masks import NoMask

MOST_STARTS = 1000
"""Instants of a log that are looked at for the beginning of another."""


@dataclass(frozen=True, eq=False)
class FitLogs:
    """The logs of one fit.

    Parameters
    ----------
    read : tuple of ReadLog
        As they were read.
    named : Identified
        Robot, chain with its band, estimator.
    notes : tuple of str
        What was chosen.
    """

    read: tuple[ReadLog, ...]
    named: Identified
    notes: tuple[str, ...] = ()

    @property
    def logs(self) -> tuple[MotionLog, ...]:
        """The logs, and the pieces of those with gaps."""
        return tuple(log for read in self.read for log in read.logs)

    @property
    def names(self) -> tuple[str, ...]:
        """What to call them."""
        found = []
        for one in self.read:
            several = len(one.logs) > 1
            found += [f"{one.path.name}, piece {k + 1}" if several else one.path.name for k in range(len(one.logs))]
        return tuple(found)


def question_of(asked: Identify) -> Question:
    """Return what is asked of every log beside its columns."""
    return Question(asked.torque, asked.torque_delay, asked.unwrap, columns=asked.reading)


def with_chain(asked: Identify, named: Identified) -> Identified:
    """Return the identification with the chain that options and files say."""
    if asked.chain_file is not None and asked.cutoff is not None:
        raise ExperimentError("--cutoff and --chain-file both say the band: give one")
    if asked.chain_file is not None:
        name, chain = chain_of(asked.chain_file)
        return replace(named, chain=name, method=(chain, ESTIMATORS.create(named.estimator)))
    if named.subject.asked.armature == "none" and asked.chain == CHAIN:
        # Behind the gears next to no friction is left that turns with the velocity: nothing to mask.
        named = replace(named, method=(replace(named.processing, mask=NoMask()), named.solver))
    return named if asked.cutoff is None else _with_cutoff(named, asked.cutoff)


def fit_logs(asked: Identify, named: Identified) -> FitLogs:
    """Return the logs of the fit, their delays estimated if that is asked for, and the band that suits them."""
    question, notes = question_of(asked), list[str]()
    every = [read(file_of(path), question, named) for path in asked.log]
    if asked.cutoff is None and asked.chain_file is None and asked.chain == CHAIN:
        p, least = len(named.basis.names), named.processing.operator.cutoff  # type: ignore[attr-defined]  # of this chain
        band = Band.of([log for one in every for log in one.logs], p, least)
        if band.cutoff > least:
            named, notes = _with_cutoff(named, band.cutoff), [band.words(p, least)]
    if asked.torque_delay == "estimate":
        every = with_delays(every, named)
    return FitLogs(tuple(every), named, tuple(notes))


def judged_on(asked: Identify, found: Identified, fit: FitLogs) -> tuple[list[Validated], list[str]]:
    """Return the identification, to be judged on each of the other logs, and what was done to these; on its end without any.

    Where nothing says what their torque means, it is that of the first log.
    """
    if not asked.validate:
        return [Validated(found)], []
    known = fit.read[0].channel  # as it was logged; its gain is of its own file
    delay = str(known.delay) if asked.torque_delay else None
    judged, notes = list[Validated](), list[str]()
    for given in asked.validate:
        path = file_of(given)
        fallback = replace(known, gain=1.0)
        question = Question(asked.torque, delay, asked.unwrap, fallback, asked.reading)
        try:
            one = read(path, question, found)
        except (LogError, ExperimentError) as error:
            words = f"--validate {error}" if str(path) in str(error) else f"--validate {path}: {error}"
            raise ExperimentError(words) from error
        second = one.longest
        pieces = [f"of its {len(one.logs)} pieces the longest is judged"] if len(one.logs) > 1 else []
        notes += [f"{path.name}: {note}" for note in (*one.notes, *pieces)]
        if any(_within(second, log) for log in fit.logs):
            raise ExperimentError(
                f"--validate {path} holds the motion that is identified: give one that it has not seen, or none"
            )
        judged.append(Validated(found, second, str(given)))
    return judged, notes


def _with_cutoff(named: Identified, cutoff: float) -> Identified:
    return replace(named, method=(with_cutoff(named.processing, cutoff), named.solver))


def _within(one: MotionLog, other: MotionLog) -> bool:
    """Return whether a log is a part of another, or the other of it."""
    short, long = sorted((one, other), key=lambda log: log.samples)
    starts = np.flatnonzero((long.q[: long.samples - short.samples + 1] == short.q[0]).all(axis=1)) if short.n == long.n else ()
    return any(np.array_equal(long.q[k : k + short.samples], short.q) for k in starts[:MOST_STARTS])


def titles(paths: Sequence[object]) -> str:
    """Return what to call several logs at once."""
    return ", ".join(map(str, paths))
