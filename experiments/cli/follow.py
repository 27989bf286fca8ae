"""Following a log that is being written: what can be said of it so far, again and again."""

import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from experiments.cli.reading import Question, read
from experiments.errors import ExperimentError
from experiments.identification.identified import Identified
from experiments.recording.audience import Audience
from experiments.recording.columns import part
from experiments.recording.live_layer import LiveIdentification
from experiments.recording.motion_layer import Base
from identify import IdentificationError, MotionLog
from identify.data.log_file import CSV

EVERY = 0.25
"""Time between two looks at the file [s]."""

FEW = 20
"""Lines up to which a log that cannot be read has only just begun."""

WEAK = 10.0
"""%sigma up to which a parameter counts as known."""


@dataclass(eq=False)
class Follower:
    """Shows a log as it grows.

    Parameters
    ----------
    path : Path
        The log, CSV.
    question : Question
        How its torque is to be read.
    named : Identified
        Robot and chain.
    audience : Audience, optional
        Who watches.
    """

    path: Path
    question: Question
    named: Identified
    audience: Audience | None = None
    _samples: int = 0
    _base: Base | None = field(default=None, init=False)

    def follow(self, patience: float) -> None:
        """Show the log until it has not grown for `patience` [s], or Ctrl-C; then it counts as complete.

        Raises
        ------
        ExperimentError
            If it is no CSV file, or cannot be read.
        """
        if self.path.suffix != CSV:
            raise ExperimentError(f"--follow {patience:g}: only a CSV log can be read while it is written, not {self.path}")
        sys.stderr.write(f"idbench: following {self.path} until it has not grown for {patience:g} s; Ctrl-C ends it before\n")
        size, since = -1, time.monotonic()
        try:
            while time.monotonic() - since < patience:
                now = self.path.stat().st_size if self.path.is_file() else 0
                if now != size:
                    self._look()
                    size, since = now, time.monotonic()  # what a look takes is not the log's rest
                time.sleep(EVERY)
        except KeyboardInterrupt:
            sys.stderr.write("idbench: following has ended; this is what there is so far\n")

    def _look(self) -> None:
        log = self._so_far()
        if log is None or log.samples <= self._samples:
            return
        base = self._base = self._base or self._begun(log)
        new = slice(self._samples, log.samples)
        qd = np.gradient(log.q[max(0, new.start - 1) :], axis=0)[-(log.samples - new.start) :] * log.fs
        anew = base.live is not None and base.live.grow(log.q[new], log.tau[new])
        base.add(new.start, {"q/measured": log.q[new], "torque/log": log.tau[new]}, {"measured": log.q[new]}, qd)
        self._samples = log.samples
        if anew:
            sys.stderr.write(f"idbench: {self._words(float(log.t[-1]))}\n")

    def _so_far(self) -> MotionLog | None:
        """Return what the complete lines of the file hold; None if they are too few to tell."""
        whole = self.path.read_bytes() if self.path.is_file() else b""
        lines = whole[: whole.rfind(b"\n") + 1]
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
            copy = Path(folder) / self.path.name
            copy.write_bytes(lines)
            try:
                return read(copy, replace(self.question, delay=self._delay), self.named)[0]
            except (ExperimentError, IdentificationError) as error:
                if lines.count(b"\n") <= FEW:
                    return None
                raise ExperimentError(str(error).replace(str(copy), str(self.path))) from error

    @property
    def _delay(self) -> str | None:
        """What is asked for, but for an estimate: that comes at the end."""
        return None if self.question.delay == "estimate" else self.question.delay

    def _begun(self, log: MotionLog) -> Base:
        robot, subject = self.named.subject.robot, self.named.subject
        base = Base(f"following-{self.path.stem}", robot, log.fs, ("measured",), self.audience)
        joints = [part(joint) for joint in robot.joints]
        base.live = LiveIdentification(base.stream, subject, self.named.chain, log.torque, log.fs, joints)
        return base

    def _words(self, now: float) -> str:
        found = self._base.live.found if self._base and self._base.live else None
        if found is None:
            return f"{now:.1f} s"
        estimate = next(iter(found.estimates.values()))
        shares = 100 * estimate.best_sigma / np.maximum(np.abs(estimate.X), 1e-300)
        weakest = int(np.argmax(np.nan_to_num(shares, nan=np.inf)))
        known = np.count_nonzero(shares < WEAK)
        return (
            f"{now:.1f} s: {known} of {len(shares)} parameters known to {WEAK:g} %; "
            f"weakest {estimate.names[weakest]}, sigma {shares[weakest]:.2g} %"
        )
