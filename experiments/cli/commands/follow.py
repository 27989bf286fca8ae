"""Following a log that is being written: what can be said of it so far, again and again."""

import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.logs import delay_method
from idbench.experiments.identification.reading import read
from idbench.experiments.identification.request import Request
from idbench.experiments.recording.audience import Audience
from idbench.experiments.requests.shared import LogRequest
from idbench.identify import IdentificationError, MotionLog, measured_state
from idbench.identify.arrays import TINY
from idbench.identify.files.log_file import CSV

if TYPE_CHECKING:
    from idbench.experiments.recording.identification_layer import LiveIdentification
    from idbench.experiments.recording.motion_layer import Base

EVERY = 0.25  # Time between two looks at the file [s]
REST = 3.0  # Rest after a look, as a multiple of what it took: the work stays a quarter of a processor's, however long the log
FEW = 20  # Lines up to which a log that cannot be read has only just begun
KNOWN = 10.0  # %sigma up to which a parameter counts as known


@dataclass(eq=False)
class Follower:
    """Shows a log as it grows."""

    path: Path
    """The log, CSV."""
    options: LogRequest
    """How its torque is to be read."""
    request: Request
    """Robot and chain."""
    audience: Audience | None = None
    """Who watches."""
    _samples: int = field(default=0, init=False)
    _live: "LiveIdentification | None" = field(default=None, init=False)
    _base: "Base | None" = field(default=None, init=False)
    _complaint: str = field(default="", init=False)

    def follow(self, patience: float) -> None:
        """Show the log until it has not grown for `patience` [s], or Ctrl-C; then it counts as complete.

        Raises
        ------
        ExperimentError
            If it is no CSV file.
        """
        if self.path.suffix.lower() != CSV:
            raise ExperimentError(f"--follow {patience:g}: only a CSV log can be read while it is written, not {self.path}")
        sys.stderr.write(f"idbench: following {self.path} until it has not grown for {patience:g} s; Ctrl-C ends it before\n")
        size, since = -1, time.monotonic()
        try:
            while True:
                now = self.path.stat().st_size if self.path.is_file() else 0
                rest = min(EVERY, patience / 2)
                if now != size:
                    size, began = now, time.monotonic()
                    self._look()
                    since = time.monotonic()  # what a look takes is not the log's rest
                    rest = max(rest, REST * (since - began))
                elif time.monotonic() - since >= patience:
                    return
                time.sleep(rest)
        except KeyboardInterrupt:
            sys.stderr.write("idbench: following has ended; this is what there is so far\n")

    def complete(self, folder: Path) -> Path:
        """Return the log, or a copy of it in `folder` without a last line that was never finished, which is said."""
        lines, rest = self._read()
        if not rest.strip() or rest.count(b",") == lines.partition(b"\n")[0].count(b","):
            return self.path
        sys.stderr.write(f"idbench: the last line of {self.path} is not complete: left out\n")
        copy = folder / self.path.name
        copy.write_bytes(lines)
        return copy

    def _read(self) -> tuple[bytes, bytes]:
        """Return the complete lines of the file, and what has begun after them."""
        whole = self.path.read_bytes() if self.path.is_file() else b""
        end = whole.rfind(b"\n") + 1
        return whole[:end], whole[end:]

    def _look(self) -> None:
        log = self._so_far()
        if log is None or log.samples <= self._samples:
            return
        live, new = self._begun(log), slice(self._samples, log.samples)
        anew = live.grow(log.q[new], log.tau[new])
        if self._base is not None:
            qd = np.gradient(log.q[max(0, new.start - 2) :], axis=0)[-(log.samples - new.start) :] * log.fs
            signals = {"q/measured": log.q[new], "torque/log": log.tau[new]}
            self._base.add(new.start, signals, {"measured": log.q[new]}, qd)
        self._samples = log.samples
        if anew:
            sys.stderr.write(f"idbench: {_words(live, float(log.t[-1]))}\n")

    def _so_far(self) -> MotionLog | None:
        """Log of the file's complete lines; None if they cannot be read yet, which is said once."""
        lines, _ = self._read()
        with tempfile.TemporaryDirectory(prefix="idbench-") as folder:
            copy = Path(folder) / self.path.name
            copy.write_bytes(lines)
            try:
                stated = self.options.torque_delay
                delay = None if delay_method(stated) else stated  # an estimate comes at the end
                return read(copy, replace(self.options, torque_delay=delay), self.request.robot_model).longest
            except (ExperimentError, IdentificationError) as error:
                complaint = str(error).replace(str(copy), str(self.path))
                if lines.count(b"\n") > FEW and complaint != self._complaint:
                    self._complaint = complaint
                    sys.stderr.write(f"idbench: not yet: {complaint}\n")
                return None

    def _begun(self, log: MotionLog) -> "LiveIdentification":
        """Growing recording, begun with the first look."""
        if self._live is not None:
            return self._live
        from idbench.experiments.recording.identification_layer import LiveIdentification
        from idbench.experiments.recording.motion_layer import Base
        from idbench.experiments.recording.stream import Stream, parts

        robot_model, name = self.request.robot_model, f"following-{self.path.stem}"
        if self.audience:
            qd = measured_state(log, self.request.processing).qd.T
            self._base = Base(name, robot_model.robot, log.fs, ("measured",), qd, self.audience)
        stream = self._base.stream if self._base else Stream(name)
        joints = parts(robot_model.robot.joints)
        self._live = LiveIdentification(stream, robot_model, self.request.method.chain_name, log.torque, log.fs, joints)
        return self._live


def _words(live: "LiveIdentification", now: float) -> str:
    """Line on the parameters after `now` [s]."""
    if live.fit is None:
        return f"{now:.1f} s"
    estimate = next(iter(live.fit.estimates.values()))
    shares = 100 * estimate.standard_errors / np.maximum(np.abs(estimate.X), TINY)
    weakest = int(np.argmax(np.nan_to_num(shares, nan=np.inf)))
    known = np.count_nonzero(shares < KNOWN)
    return (
        f"{now:.1f} s: {known} of {len(shares)} parameters known to {KNOWN:g} %; "
        f"weakest {estimate.names[weakest]}, sigma {shares[weakest]:.2g} %"
    )
