"""Logs of MuJoCo's own simulation of a robot's file: what its integrator makes of the torques."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.reading import ReadLog
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import Array, CentralDifference, ExplicitModel, IdentificationError, MotionLog, instants
from idbench.identify.rows.rows import is_long
from idbench.identify.signals.filters import REACH, shift
from idbench.sim.robot.time_steps import apparent_rotor_inertia, integrator_name, torque_of_steps

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
        """Return how the torques of logs are read, if that is stated or evident; None if they are no simulation's."""
        robot_model, stated = request.robot_model, any(read.simulated for read in every)
        inertia = apparent_rotor_inertia(robot_model.robot)
        found = cls(robot_model, inertia)
        if stated:
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
        tau, edge = (
            log.tau - extra / np.asarray(log.torque.gain),
            ceil((DERIVATIVES * s.halo(log.fs) + abs(log.torque.delay)) * log.fs) + REACH,
        )
        instantaneous = log.torque.delay == 0 and not log.torque.lags
        torque = replace(log.torque, meaning="instantaneous", period=None) if instantaneous else log.torque
        return replace(log, tau=tau, torque=torque).part(edge, log.samples - edge)

    def _evident(self, logs: Sequence[MotionLog], request: Request) -> bool:
        """Return whether the file's parameters explain the torques so much better."""
        try:
            before, after = (self._left(each, request) for each in (logs, [self._acting(log) for log in logs]))
        except IdentificationError:  # of a log that cannot be identified, the fit says why
            return False
        share = np.divide(after, before, out=np.ones(len(after)), where=(before > 0) & (self.inertia != 0))[self.inertia != 0]
        return bool(np.quantile(share, 0.25) <= EVIDENT and np.median(share) <= HALF and share.max() <= 1)

    def _left(self, logs: Sequence[MotionLog], request: Request) -> Array:
        """Return what the file's parameters leave of the torques, shape (joint,)."""
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
        instants = "" if read.channel.delay else ", and torques are those at the instants of the positions"
        return (
            f"a log of MuJoCo's simulation of the robot's file, {stated}: {integrator_name(robot)} with a step of "
            f"{robot.model.opt.timestep:g} s {seeming} is taken out{instants}"
        )
