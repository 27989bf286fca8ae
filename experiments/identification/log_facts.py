"""What a log is like, before a robot comes into it: clock, ranges, noise, steps of encoders, how long joints rest."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from idbench.identify import Array, MotionLog, TorqueChannel, encoder_steps
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.resample import Repaired
from idbench.identify.data.velocities import white_noise
from idbench.identify.judge.band import content_end

STILL = 1e-3
"""A joint is at rest while its velocity is below this share of its largest."""


@final
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
        """Its longest piece."""
        return max(self.repaired.logs, key=lambda log: log.samples)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, or their numbers."""
        return self.columns.joints or tuple(f"joint {j + 1}" for j in range(self.columns.n))

    @cached_property
    def velocities(self) -> Array:
        """Differences of the positions, shape (time, joint)."""
        return np.asarray(np.gradient(self.log.q, 1 / self.log.fs, axis=0))

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """What each joint's columns are like."""
        log, steps = self.log, encoder_steps(self.columns.q)
        noises = [white_noise(x) for x in (log.q, log.tau)]
        speed = np.abs(self.velocities)
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
            for j, joint in enumerate(self.joints)
        ]

    def notes(self) -> Iterator[str]:
        """Yield what is worth knowing of the whole log."""
        yield from self.repaired.words(self.joints)
        yield f"torques exceed their noise up to {content_end(self.log):.3g} Hz"
        dead = [row["joint"] for row in self.rows if row["tau"][0] == row["tau"][1]]
        if dead:
            yield f"the torque of {', '.join(dead)} never changes: is it logged?"
        still = [row["joint"] for row in self.rows if row["q"][0] == row["q"][1]]
        if still:
            yield f"{', '.join(still)} never moves"

    def summary(self) -> dict[str, Any]:
        """Return what --json says."""
        clock = self.repaired.clock
        return {
            "fs": self.log.fs,
            "duration": float(self.columns.t[-1] - self.columns.t[0]),
            "rows": len(self.columns.t),
            "clock": clock.word,
            "repeated": clock.repeated,
            "gaps": clock.gaps,
            "joints": self.rows,
            "notes": list(self.notes()),
        }
