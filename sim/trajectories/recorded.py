"""A motion out of a file."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import scipy
from pydantic import AfterValidator

from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import Positive, settings
from idbench.sim.trajectories.trajectory import AbstractMotion, AbstractTrajectory, Reference

DEGREE = 5  # Degree of the spline through positions: its acceleration is smooth, too
ORDER = 4  # Order of the low-pass, which is applied forwards and backwards
RESTS = 0.05  # Speed at an end, as a share of the largest of all joints, up to which a joint counts as at rest there
EXAMPLE, EXAMPLES = Path(__file__).parent / "example.csv", 2  # A short motion of the SCARA, and its joints


@dataclass(frozen=True, eq=False)
class RecordedMotion(AbstractMotion):
    """A spline through recorded positions, at rest at the ends at which it hardly moves."""

    t: Array
    """Instants, from 0 [s], shape (time,)."""
    q: Array
    """Positions [rad], shape (time, joint)."""

    @property
    def duration(self) -> float:
        """Time from the first to the last instant, and as long as an instant is apart from the next [s]."""
        return float(self.t[-1] + np.median(np.diff(self.t)))

    def at(self, t: Array, fs: float) -> Reference:
        """Return the motion at the times `t` [s], shape (time,)."""
        inside = (t <= self.t[-1])[:, None]
        q, qd, qdd = (curve(np.minimum(t, self.t[-1])) for curve in self._curves)
        return Reference(fs, q, qd * inside, qdd * inside)

    @cached_property
    def moving(self) -> Array:
        """Speed at the first and the last instant, as a share of the largest of all joints, shape (2, joint)."""
        speed = np.abs(scipy.interpolate.make_interp_spline(self.t, self.q, k=DEGREE).derivative()(self.t))
        return speed[[0, -1]] / max(speed.max(), np.finfo(float).tiny)

    @cached_property
    def _curves(self) -> "tuple[scipy.interpolate.BSpline, ...]":
        still = np.zeros(self.q.shape[1])
        ends: Any = tuple(  # the stubs know conditions by their names alone
            [(1, still), (2, still)] if share.max() < RESTS else [(3, still), (4, still)] for share in self.moving
        )
        spline = scipy.interpolate.make_interp_spline(self.t, self.q, k=DEGREE, bc_type=ends)
        return spline, spline.derivative(1), spline.derivative(2)


def _absolute(file: str) -> str:
    """Return the path of a file from the root: scenarios are kept with runs, which are read from other folders."""
    return file if file == "example" else str(Path(file).absolute())


@settings
class Recorded(AbstractTrajectory):
    """The motion of a CSV file: planned positions that a controller has logged, or measured ones without their noise."""

    file: Annotated[str, AfterValidator(_absolute)] = "example"
    """The file: a line of names, then columns t [s] and q1, q2, ... [rad], in the order of the robot's joints; others do not
    matter. example is a short motion of the SCARA."""
    cutoff: Positive | None = None
    """Low-pass [Hz], without phase, for positions that were measured: their noise would become accelerations."""

    def plan(self, robot: Robot) -> RecordedMotion:
        """Return the motion.

        Raises
        ------
        ScenarioError
            If the file cannot be read, lacks a joint, or does not begin at rest.
        """
        if self.file == "example" and robot.n != EXAMPLES:
            raise ScenarioError(
                f"trajectory.file is the example, which moves {EXAMPLES} joints; robot {robot.name!r} has {robot.n}: name "
                "the CSV file of its motion"
            )
        motion = RecordedMotion(*_read(EXAMPLE if self.file == "example" else Path(self.file), robot.n))
        motion = motion if self.cutoff is None else self._smoothed(motion, self.cutoff)
        if (fast := np.flatnonzero(motion.moving[0] > RESTS)).size:
            raise ScenarioError(
                f"{self.file} begins while {robot.joints[fast[0]]} moves at {100 * motion.moving[0, fast[0]]:.0f} % of the top "
                "speed, and simulated robots start at rest: begin the file earlier"
                + ("" if self.cutoff else ", or give trajectory.cutoff if its positions were measured")
            )
        return motion

    def _smoothed(self, motion: RecordedMotion, cutoff: float) -> RecordedMotion:
        fs = 1 / float(np.median(np.diff(motion.t)))
        if not cutoff < fs / 2:
            raise ScenarioError(f"trajectory.cutoff = {cutoff:g} Hz must be below {fs / 2:g} Hz, half the rate of {self.file}")
        low_pass = scipy.signal.butter(ORDER, cutoff, fs=fs, output="sos")
        least = 6 * len(low_pass) + 4  # what sosfiltfilt reflects at the ends
        if len(motion.t) < least:
            raise ScenarioError(f"{self.file} has {len(motion.t)} instants; with trajectory.cutoff it needs at least {least}")
        even = np.arange(int(motion.t[-1] * fs + 1e-6) + 1) / fs
        q = scipy.interpolate.make_interp_spline(motion.t, motion.q, k=1)(np.minimum(even, motion.t[-1]))
        return RecordedMotion(even, scipy.signal.sosfiltfilt(low_pass, q, axis=0))


def _read(path: Path, n: int) -> tuple[Array, Array]:
    """Return instants, from 0, and positions of the robot's joints; raise ScenarioError if a file does not have them."""
    wanted = ["t", *(f"q{j + 1}" for j in range(n))]
    try:
        lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    except (OSError, ValueError) as error:
        raise ScenarioError(f"cannot read the motion {path}: {getattr(error, 'strerror', None) or 'it is no text'}") from None
    names = [name.strip(" \t'\"#") for name in "".join(lines[:1]).split(",")]
    if missing := [name for name in wanted if name not in names]:
        raise ScenarioError(f"{path} has no column {', '.join(missing)}; its columns are {', '.join(names):.200}")
    try:
        table = np.loadtxt(lines[1:] or ["nan," * len(names)], delimiter=",", usecols=[*map(names.index, wanted)], ndmin=2)
    except ValueError as error:
        raise ScenarioError(f"cannot read the motion {path}: {error}") from None
    if len(table) <= DEGREE:
        raise ScenarioError(f"{path} has too few instants: a motion needs at least {DEGREE + 1}")
    t, q = table[:, 0], table[:, 1:]
    if not np.isfinite(table).all() or not (np.diff(t) > 0).all():
        raise ScenarioError(f"{path} holds instants that do not rise, or numbers that are not finite")
    return t - t[0], q
