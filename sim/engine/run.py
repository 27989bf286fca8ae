"""What a simulation gives: the log that a robot would give, and the truth behind it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.faults import require_joints, with_faults
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference
from idbench.sim.trajectories.trajectory import require_in_range

FAULTS = 11  # Stream of random numbers of what faults have


@dataclass(frozen=True, eq=False)
class Run:
    """Simulations of one scenario that advanced together; the leading axis of all arrays is the simulation."""

    scenario: Scenario
    """What was simulated."""
    seeds: tuple[int, ...]
    """Seed of every simulation."""
    robots: Sequence[Robot]
    """The true robot of every simulation."""
    reference: Reference
    """The planned motion."""
    log: MotionLog
    """What the robot logged; shape (nsim, time, joint)."""
    q: Array
    """True positions at the instants of the log [rad], shape (nsim, time, joint)."""
    qd: Array
    """True velocities at the instants of the log [rad/s], shape (nsim, time, joint)."""
    tau: Array
    """True mean torque of the motors between an instant of the log and the next, ripple included [N m], shape (nsim, time,
    joint)."""
    command: Array
    """Torque that the controller asked for [N m], shape (nsim, time, joint)."""
    failures: dict[int, str]
    """Why simulations failed, by their number; from then on their arrays hold nothing of use."""

    @property
    def truth(self) -> dict[str, float]:
        """The true standard parameters of the first robot, with friction and cogging of the scenario, by name.

        `BaseParameters.values` groups them.

        Examples
        --------
        >>> from idbench.sim import load_scenario, run
        >>> run(load_scenario("ideal")).truth["Fs1"]
        0.5
        """
        robot, friction = self.robots[0], self.scenario.friction
        return standard_parameters(robot) | friction.truth(robot) | self.scenario.ripple.truth(robot)

    def alone(self, i: int = 0) -> MotionLog:
        """Return the log of simulation `i` by itself."""
        return self.log.run((i,))


def faulty(run: Run) -> Run:
    """The run with the faults of its scenario in the log; the truth stays."""
    if not run.scenario.fault:
        return run
    logs = list[MotionLog]()
    for i, seed in enumerate(run.seeds):
        if i in run.failures:
            logs.append(run.alone(i))
            continue
        true = run.q[i], run.qd[i], np.gradient(run.qd[i], 1 / run.log.fs, axis=0)
        rng = np.random.default_rng([seed, FAULTS])
        logs.append(with_faults(run.robots[i], run.alone(i), true, run.scenario.faults, rng))
    q, tau = np.stack([log.q for log in logs]), np.stack([log.tau for log in logs])
    fs = next((log.fs for i, log in enumerate(logs) if i not in run.failures), run.log.fs)
    return replace(run, log=replace(run.log, fs=fs, q=q, tau=tau))


def ideal_log(robot: Robot, reference: Reference) -> MotionLog:
    """Return the log of a robot that follows `reference` exactly, with exact sensors.

    The torque at every instant is MuJoCo's inverse dynamics plus the friction law Fs sign(qd); it is instantaneous.

    Raises
    ------
    ScenarioError
        If the motion is not one of the robot's joints, or leaves their ranges.
    """
    require_in_range(robot, reference.q)
    tau = inverse_dynamics(robot, reference.q, reference.qd, reference.qdd) + coulomb_torque(robot, reference.qd)
    return MotionLog(reference.fs, reference.q, tau, TorqueChannel("instantaneous"))


def ideal_run(scenario: Scenario, seeds: Sequence[int], motions: Sequence[Reference]) -> Run:
    """Return the logs of robots that follow their motions exactly, as `simulate` returns those of closed loops.

    A motion whose torques are beyond what the robot's actuators have is one that failed.
    """
    robot = scenario.real_robot
    require_joints(robot, scenario.fault)
    logs = [ideal_log(robot, motion) for motion in motions]
    q = np.stack([log.q for log in logs])
    qd = np.stack([motion.qd for motion in motions])
    tau = np.stack([log.tau for log in logs])
    failures = dict[int, str]()
    for i, j in np.argwhere(np.abs(tau).max(axis=1) > robot.torque_limits).tolist():
        most = np.abs(tau[i, :, j]).max()
        failures.setdefault(i, f"the torque of {robot.joints[j]} would be {most:.3g} N m, beyond its limit")
    log = MotionLog(scenario.fs, q, tau, TorqueChannel("instantaneous"))
    return faulty(Run(scenario, tuple(seeds), [robot] * len(logs), motions[0], log, q, qd, tau, tau, failures))
