"""Ideal data, as in section 7.2 of the paper: what filters and differences do, and nothing else."""

from identify.motion_log import MotionLog, TorqueChannel
from sim.inverse_dynamics import coulomb_torque, inverse_dynamics
from sim.robot import Robot
from sim.trajectory import Reference


def ideal_log(robot: Robot, reference: Reference) -> MotionLog:
    """Return the log of a robot that follows `reference` exactly, with exact sensors.

    The torque at every instant is MuJoCo's inverse dynamics plus the friction law Fs sign(qd); it is instantaneous.
    """
    tau = inverse_dynamics(robot, reference.q, reference.qd, reference.qdd) + coulomb_torque(robot, reference.qd)
    return MotionLog(reference.fs, reference.q, tau, TorqueChannel("instantaneous"))
