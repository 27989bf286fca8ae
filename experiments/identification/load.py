"""From files to logs: those of a fit, with their delays and the band that suits them, and those held out to judge it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil
from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.chain_settings import with_cutoff
from idbench.experiments.identification.logs import Logs, delay_method
from idbench.experiments.identification.poses import of_poses
from idbench.experiments.identification.reading import ReadLog, file_of, late, read, read_as, with_delays
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.shared import LogRequest
from idbench.experiments.text import of_each
from idbench.identify import Array, CentralDifference, ExplicitModel, IdentificationError, LogError, MotionLog, instants
from idbench.identify.judge.band import Band
from idbench.identify.rows.rows import is_long
from idbench.identify.signals.filters import REACH, shift
from idbench.identify.telling import stage
from idbench.sim.robot.time_steps import acting_late, apparent_rotor_inertia, integrator_name, torque_of_steps

EVIDENT, HALF = 0.1, 0.5
"""Shares of what the file's own parameters leave of the torques that they leave without the integrator's part, in a quarter and
in half of the joints that have one, if a log is of a simulation of the file, with none where they leave more: of 17 simulations
of robots of others the shares are 0.04 and 0.27 at most; of three by another integrator than the file's above 100."""


DERIVATIVES = 4  # Of the positions, that the torques of a step take


@dataclass(frozen=True, eq=False)
class SimulatedLogs:
    """How torques of a simulation of a robot's file are read."""

    robot_model: RobotModel
    """The robot."""
    inertia: Array
    """By how much its rotors seem larger, shape (joint,) [kg m^2, kg]."""

    @classmethod
    def of(cls, every: Sequence[ReadLog], request: Request) -> "SimulatedLogs | None":
        """Reading of a simulation's torques, if stated or evident; None otherwise."""
        robot_model, inertia = request.robot_model, apparent_rotor_inertia(request.robot_model.robot)
        found = cls(robot_model, inertia)
        if any(read.simulated for read in every):
            if Path(robot_model.name).suffix not in ("", ".xml"):
                raise ExperimentError(
                    f"--simulated: the integrator, its step and kv are those of an MJCF file, which {robot_model.name} is not: "
                    "give the file that was simulated"
                )
            return found
        logs = [log for read in every for log in read.logs]
        still = not inertia.any() or robot_model.robot.weightless or is_long(logs) or logs[0].poses
        return None if still or not found._evident(logs, request) else found

    def acting(self, read: ReadLog) -> ReadLog:
        """Return a log with the torques that acted, and a note."""
        logs = tuple(map(self._acting, read.logs))
        channel = logs[0].torque if read.channel.delay == 0 else read.channel
        return replace(read, logs=logs, channel=channel, notes=(*read.notes, self._words(read)))

    def _acting(self, log: MotionLog) -> MotionLog:
        """Return the torques of the motion through the positions; what is taken out is that of the instant of each torque."""
        s, motion = CentralDifference(), [np.ascontiguousarray(log.q.T)]
        for _ in range(DERIVATIVES):
            motion.append(s.derivative(motion[-1], log.fs))
        extra = torque_of_steps(self.robot_model.robot, [x.T for x in motion])
        extra = shift(np.ascontiguousarray(extra.T), log.torque.delay * log.fs).T
        edge = ceil((DERIVATIVES * s.halo(log.fs) + abs(log.torque.delay)) * log.fs) + REACH
        instantaneous = log.torque.delay == 0 and not log.torque.lags
        torque = replace(log.torque, delay=log.torque.delay + acting_late(self.robot_model.robot))
        torque = replace(torque, meaning="instantaneous", period=None) if instantaneous else torque
        return replace(log, tau=log.tau - extra / np.asarray(log.torque.gain), torque=torque).part(edge, log.samples - edge)

    def _evident(self, logs: Sequence[MotionLog], request: Request) -> bool:
        """True if the file's parameters explain the torques so much better."""
        try:
            before, after = (self._left(each, request) for each in (logs, [self._acting(log) for log in logs]))
        except IdentificationError:  # of a log that cannot be identified, the fit says why
            return False
        share = np.divide(after, before, out=np.ones(len(after)), where=(before > 0) & (self.inertia != 0))[self.inertia != 0]
        return bool(np.quantile(share, 0.25) <= EVIDENT and np.median(share) <= HALF and share.max() <= 1)

    def _left(self, logs: Sequence[MotionLog], request: Request) -> Array:
        """Norm of the residual torque of the file's parameters, shape (joint,)."""
        plain, chain = self.robot_model.plain, request.processing
        filed = np.array(list(plain.truth(self.robot_model.robot).values()))
        each = (instants(chain.signals(log), plain.basis, ExplicitModel(), chain, filed).in_rows(chain) for log in logs)
        return np.asarray(np.linalg.norm(np.concatenate([rows.reshape(-1, plain.basis.n) for rows in each]), axis=0))

    def _words(self, read: ReadLog) -> str:
        robot = self.robot_model.robot
        stated = "as stated" if read.simulated else "since its parameters explain the torques ten times better so"
        sizes = list(dict.fromkeys(f"{x:.3g}" for x in self.inertia))
        each = sizes if len(sizes) == 1 else [f"{x:.3g}" for x in self.inertia]
        unit = "kg m^2" if not robot.slides.any() else "kg m^2, kg"
        seeming = (
            f"takes what damps joints at the end of a step, as if rotors were larger by {' '.join(each)} {unit}; that"
            if self.inertia.any()
            else "takes nothing at the end of a step; what half a step makes of velocities"
        )
        if late := acting_late(robot):
            return (
                f"a log of MuJoCo's simulation of the robot's file, {stated}: by RK4 with a step of "
                f"{robot.model.opt.timestep:g} s actuators act on joints as these move within it, as if rotors were larger by "
                f"{' '.join(each)} {unit}; that is taken out, and torques act {1e3 * late:g} ms later than logged"
            )
        instants = "" if read.channel.delay else ", and torques are those at the instants of the positions"
        return (
            f"a log of MuJoCo's simulation of the robot's file, {stated}: {integrator_name(robot)} with a step of "
            f"{robot.model.opt.timestep:g} s {seeming} is taken out{instants}"
        )


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
    paths: Sequence[Path], options: LogRequest, request: Request, *, band: bool, more: int = 0, alike: int | None = None
) -> Loaded:
    """Return logs of one fit, from files or folders of runs; `band` says whether the band is to suit short logs.

    `more` parameters are identified beside those of the basis; the first `alike` logs, all by default, are of the robot without
    a payload: these show the delay of all.
    """
    require_different(paths)
    with stage("reading logs"):
        every = [read(file_of(path), options, request.robot_model) for path in paths]
    return prepared(every, request, sought=delay_method(options.torque_delay), band=band, more=more, alike=alike)


def prepared(
    every: Sequence[ReadLog], request: Request, *, sought: str | None, band: bool, more: int = 0, alike: int | None = None
) -> Loaded:
    """Return logs of one fit that were read, with the band that suits them and, if it is sought, the delay of their torques."""
    _require_other_samples(every)
    of_band, logs, simulated = list[str](), [log for one in every for log in one.logs], None
    if any(log.poses for log in logs):
        request = of_poses(request, logs, band=band, sought=sought)
    if band and not logs[0].poses:
        p, least = len(request.robot_model.basis.names) + more, request.processing.operator.cutoff  # type: ignore[attr-defined]
        needed = Band.of(logs, p, least)
        if needed.cutoff != least:
            before = request.method.chain
            of_band = [needed.words(p, least)]
            request = in_band(request, needed.cutoff)
            if needed.cutoff < least:  # edges of a mask that are as long as a slow log's moves would leave nothing
                request = request.with_chain(replace(request.method.chain, mask=before.mask))
    if sought:
        with stage("the delay of the torques"):
            own = with_delays(every[:alike], request, sought)
            every = [*own, *(late(read, own[0].channel) for read in every[len(own) :])]
    if not logs[0].poses and (simulated := SimulatedLogs.of(every, request)):  # at the delays that were found
        every = [simulated.acting(read) for read in every]
    named = zip(every, _names(every), strict=True)
    said = of_each((name, note) for one, name in named for note in one.notes).values() if len(every) > 1 else every[0].notes
    return Loaded(request, tuple(every), tuple(dict.fromkeys([*said, *of_band])), simulated)


def in_band(request: Request, cutoff: float) -> Request:
    """Return a request with the band up to `cutoff` [Hz]."""
    return request.with_chain(with_cutoff(request.method.chain, cutoff))


def with_held_out(loaded: Loaded, asked: IdentifyRequest, truth: Mapping[str, float] | None) -> Logs:
    """Return logs of a fit with those on which it is judged.

    Where nothing says what the torques of these mean, it is what those of the first log do.
    """
    known = loaded.read[0].channel  # as it was logged; its gain is of its own file
    sought, every = delay_method(asked.torque_delay), dict[str, ReadLog]()
    require_different(asked.validate)
    for given in asked.validate:
        path = file_of(given)
        try:
            one = read_as(loaded.read[0].path, path, asked, loaded.request.robot_model, replace(known, gain=1.0))
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
    held_out, notes = {name: one.longest for name, one in every.items()}, (*loaded.notes, *of_each(said).values())
    gains = loaded.read[0].columns.gain
    return Logs(loaded.logs(), loaded.names, held_out, notes, truth, sought, gains)


def require_different(paths: Sequence[Path]) -> None:
    """Raise ExperimentError if a log is given twice."""
    if twice := [str(path) for k, path in enumerate(paths) if path.absolute() in [p.absolute() for p in paths[:k]]]:
        raise ExperimentError(f"{', '.join(twice)} is given twice: it would count twice")


def _require_other_samples(every: Sequence[ReadLog]) -> None:
    """Raise ExperimentError if two files hold the same samples."""
    for one, other in combinations(every, 2):
        if np.array_equal(one.columns.q, other.columns.q) and np.array_equal(one.columns.tau, other.columns.tau):
            raise ExperimentError(f"{other.path} holds the same samples as {one.path}: they would count twice; leave one out")


def within(one: MotionLog, other: MotionLog) -> bool:
    """True if a log is a part of another, or the other of it."""
    short, long = sorted((one, other), key=lambda log: log.samples)
    starts = np.flatnonzero((long.q[: long.samples - short.samples + 1] == short.q[0]).all(axis=1)) if short.n == long.n else ()
    return any(np.array_equal(long.q[k : k + short.samples], short.q) for k in starts[:MOST_STARTS])
