"""The logs of an identification: those of the fit, those held out to judge it, and what was done to them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from idbench.experiments.identification.poses import poses_of
from idbench.experiments.note import Note, noted
from idbench.identify import Array, Basis, Chain, IdentificationError, MotionLog, TorqueChannel, encoder_steps
from idbench.identify.data.jumps import white_noise
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.resample import Repaired
from idbench.identify.judge.band import content_end
from idbench.identify.judge.delay import DelayEstimate, estimate_delay, estimate_joint_delays
from idbench.identify.rows.rows import is_long

STILL = 1e-3  # Share of its largest velocity below which a joint is at rest, and of the busiest one's travel: it trembles


@dataclass(frozen=True, eq=False)
class LogFacts:
    """What a log is like."""

    columns: LogColumns
    """Its columns, in SI units."""

    @cached_property
    def repaired(self) -> Repaired:
        """The log made uniform."""
        return Repaired.of(self.columns, self.columns.torque or TorqueChannel("instantaneous"))

    @cached_property
    def log(self) -> MotionLog:
        """Its longest piece; samples by themselves as they are."""
        if self.columns.qdd is not None:
            return poses_of(self.columns, TorqueChannel("instantaneous"))[0]
        return max(self.repaired.logs, key=lambda log: log.samples)

    @cached_property
    def velocities(self) -> Array:
        """Differences of the positions, or the velocities of samples, shape (time, joint)."""
        if self.log.motion:
            return self.log.motion[0]
        return np.asarray(np.gradient(self.log.q, 1 / self.log.fs, axis=0))

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """What each joint's columns are like."""
        log, steps, speed = self.log, encoder_steps(self.columns.q), np.abs(self.velocities)
        noises = [np.zeros(log.n) if log.poses else white_noise(x) for x in (log.q, log.tau)]
        return [
            {
                "joint": joint,
                "q": [float(log.q[:, j].min()), float(log.q[:, j].max())],
                "qd_max": float(speed[:, j].max()),
                "tau": [float(log.tau[:, j].min()), float(log.tau[:, j].max())],
                "standing": float(np.mean(speed[:, j] <= STILL * speed[:, j].max())) if speed[:, j].any() else 1.0,
                "position_noise": float(noises[0][j]),
                "torque_noise": float(noises[1][j]),
                "encoder_step": None if np.isnan(steps[j]) else float(steps[j]),
            }
            for j, joint in enumerate(self.columns.names)
        ]

    def notes(self) -> Iterator[str]:
        """Yield what is worth knowing of the whole log."""
        if self.columns.qdd is not None:
            yield "samples by themselves: times do not count"
            return
        yield from self.repaired.words(self.columns.names)
        yield f"torques exceed their noise up to {content_end(self.log):.3g} Hz"
        absent = self.columns.missing
        dead = [row["joint"] for j, row in enumerate(self.rows) if row["tau"][0] == row["tau"][1] and j not in absent]
        if absent:
            yield f"there is no torque of {', '.join(self.columns.names[j] for j in absent)}: a fit leaves its rows out"
        if dead:
            yield f"the torque of {', '.join(dead)} never changes: is it logged?"
        if still := [row["joint"] for row in self.rows if row["q"][0] == row["q"][1]]:
            yield f"{', '.join(still)} never moves"

    def summary(self) -> dict[str, Any]:
        """Content of --json."""
        found = {"rows": len(self.columns.t), "joints": self.rows, "notes": list(self.notes())}
        if self.columns.qdd is not None:
            return found
        clock = self.repaired.clock
        return found | {
            "fs": self.log.fs,
            "duration": float(self.columns.t[-1] - self.columns.t[0]),
            "clock": clock.word,
            "repeated": clock.repeated,
            "gaps": clock.gaps,
        }


def resting(log: MotionLog, joints: Sequence[str]) -> list[str]:
    """Return the joints that never move."""
    travel = np.ptp((log.q if log.motion is None else log.motion[0]).reshape(-1, log.n), axis=0)
    return [joint for joint, way in zip(joints, travel, strict=True) if way <= STILL * travel.max()]


DELAYS: Mapping[str, Callable[[Sequence[MotionLog], Basis, Chain], DelayEstimate]] = {
    "estimate": estimate_delay,
    "joints": estimate_joint_delays,
}
"""Words for a delay that the logs are asked for, and who asks them: one of all joints, or one of each."""


def delay_method(delay: str | None) -> str | None:
    """Kind of the delay that is sought, of `DELAYS`, if any."""
    return delay if delay in DELAYS else None


LEAST = 0.05  # Share of a sample by which a delay must move to matter

WITH_LAWS = "delay with laws"  # Mark of the note on a delay that was estimated again, which a later one replaces


def _with_laws(said: object) -> Note:
    return Note(f"torque delay with the laws of friction that were chosen: {said}", about=WITH_LAWS)


@dataclass(frozen=True, eq=False)
class Logs:
    """The logs of one fit."""

    fitted: tuple[MotionLog, ...]
    """The logs, and the pieces of those with gaps."""
    names: tuple[str, ...] = ()
    """What to call them."""
    held_out: Mapping[str, MotionLog] | None = None
    """Logs on which the fit is judged, by name; without any, the last quarter of the longest fitted log."""
    notes: tuple[str, ...] = ()
    """What was read, done and assumed."""
    truth: Mapping[str, float] | None = None
    """The true parameters, where they are known."""
    delay_sought: str | None = None
    """Which delay of the torques was estimated, of `DELAYS`, and may be estimated again with more laws of friction."""
    gains: tuple[float, ...] = ()
    """Torque over what the file of the first has, joint by joint, where it was multiplied by that."""

    def delayed(self, basis: Basis, chain: Chain) -> tuple["Logs", bool]:
        """Return the logs with the delay that explains their torques best with other laws, and whether it moved by a sigma.

        As they are if there is none.
        """
        found, estimated = dict[str, DelayEstimate](), DELAYS[self.delay_sought or "estimate"]
        notes = [note for note in self.notes if noted(note).about != WITH_LAWS]
        for meaning in dict.fromkeys(log.torque.meaning for log in self.fitted):
            try:
                found[meaning] = estimated([log for log in self.fitted if log.torque.meaning == meaning], basis, chain)
            except IdentificationError as error:
                return replace(self, notes=(*notes, _with_laws(error))), False
        said, first = ", ".join(each.words for each in found.values()), next(iter(found.values()))
        each = [(log, found[log.torque.meaning]) for log in self.fitted]
        moved = any(own.differs(log.torque, max(own.doubt, LEAST / log.fs)) for log, own in each)
        fitted, others = tuple(with_delay(log, own) for log, own in each), (self.held_out or {}).items()
        held_out = {name: with_delay(log, found.get(log.torque.meaning, first)) for name, log in others}
        return replace(self, fitted=fitted, held_out=held_out, notes=(*notes, _with_laws(said))), moved

    def without_torque(self, joint: int) -> "Logs":
        """Return the logs without the torque of a joint, from 0, where it never changes; all, if it changes in all."""
        still = any(joint in log.unchanging for log in self.fitted)

        def quiet(log: MotionLog) -> MotionLog:
            return replace(log, missing=(*log.missing, joint)) if joint in log.unchanging or not still else log

        held_out = self.held_out and {name: quiet(log) for name, log in self.held_out.items()}
        return replace(self, fitted=tuple(map(quiet, self.fitted)), held_out=held_out)

    @property
    def longest_name(self) -> str:
        """What to call the longest of them, where it stands among others or by itself."""
        return self.name(self.longest) if len(self.fitted) > 1 else "the log"

    def name(self, k: int) -> str:
        """Name of one of the fitted logs."""
        return self.names[k] if self.names else f"log {k + 1}" if len(self.fitted) > 1 else "the log"

    @property
    def title(self) -> str:
        """What to call them at once."""
        return ", ".join(self.names) or "a log"

    @property
    def longest(self) -> int:
        """The number of the fitted log with the most samples."""
        return max(range(len(self.fitted)), key=lambda k: self.fitted[k].samples)

    @property
    def long(self) -> bool:
        """Whether they are too long for their rows to be kept."""
        return is_long(self.fitted)


def with_delay(log: MotionLog, found: DelayEstimate) -> MotionLog:
    """Return a log whose torques have a delay."""
    return replace(log, torque=found.of(log.torque))
