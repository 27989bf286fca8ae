"""What a simulation gives: the log that a robot would give, and the truth behind it."""

from collections.abc import Sequence
from dataclasses import dataclass

from idbench.identify.data.motion_log import MotionLog
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference


@dataclass(frozen=True, eq=False)
class Run:
    """Simulations of one scenario that advanced together; the leading axis of all arrays is the simulation.

    Parameters
    ----------
    scenario : Scenario
        What was simulated.
    seeds : tuple of int
        Seed of every simulation.
    robots : sequence of Robot
        The true robot of every simulation.
    reference : Reference
        The planned motion.
    log : MotionLog
        What the robot logged; shape (nsim, time, joint).
    q, qd : Array, shape (nsim, time, joint)
        True positions [rad] and velocities [rad/s] at the instants of the log.
    tau : Array, shape (nsim, time, joint)
        True mean torque of the motors between an instant of the log and the next, ripple included [N m].
    command : Array, shape (nsim, time, joint)
        Torque that the controller asked for [N m].
    failures : dict of int to str
        Why simulations failed, by their number; from then on their arrays hold nothing of use.
    """

    scenario: Scenario
    seeds: tuple[int, ...]
    robots: Sequence[Robot]
    reference: Reference
    log: MotionLog
    q: Array
    qd: Array
    tau: Array
    command: Array
    failures: dict[int, str]

    @property
    def truth(self) -> dict[str, float]:
        """The true standard parameters of the first robot, with the friction of the scenario, by name.

        `BaseParameters.values` groups them.

        Examples
        --------
        >>> from idbench.sim import load_scenario, run
        >>> run(load_scenario("ideal")).truth["Fs1"]
        0.5
        """
        robot, friction = self.robots[0], self.scenario.friction
        return standard_parameters(robot) | (friction.truth(robot) if friction else {})

    def alone(self, i: int = 0) -> MotionLog:
        """Return the log of simulation `i` by itself."""
        return self.log.run((i,))
