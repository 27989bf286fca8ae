"""Ideal data, as in section 7.2 of the paper: what filters and differences do, and nothing else."""

from identify.motion_log import MotionLog, TorqueChannel
from sim.errors import ScenarioError
from sim.inverse_dynamics import coulomb_torque, inverse_dynamics
from sim.robot import Robot
from sim.trajectory import Reference


def ideal_log(robot: Robot, reference: Reference) -> MotionLog:
    """Return the log of a robot that follows `reference` exactly, with exact sensors.

    The torque at every instant is MuJoCo's inverse dynamics plus the friction law Fs sign(qd); it is instantaneous.

    Raises
    ------
    ScenarioError
        If the motion is not one of the robot's joints, or leaves their ranges.
    """
    _require_reachable(robot, reference)
    tau = inverse_dynamics(robot, reference.q, reference.qd, reference.qdd) + coulomb_torque(robot, reference.qd)
    return MotionLog(reference.fs, reference.q, tau, TorqueChannel("instantaneous"))


def _require_reachable(robot: Robot, reference: Reference) -> None:
    if reference.q.shape[1] != robot.n:
        raise ScenarioError(f"the trajectory moves {reference.q.shape[1]} joints, robot {robot.name!r} has {robot.n}")
    for name, q, (low, high) in zip(robot.joints, reference.q.T, robot.ranges, strict=True):
        if q.min() < low or q.max() > high:
            raise ScenarioError(
                f"{name} would move from {q.min():.3g} to {q.max():.3g} rad, its range is {low:.3g} to {high:.3g}"
            )
