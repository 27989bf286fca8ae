"""Ideal data, as in section 7.2 of the paper: what filters and differences do, and nothing else."""

from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import Reference
from idbench.sim.trajectories.trajectory import require_in_range


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
