"""Logs of a Python session, as jobs read them."""

from dataclasses import replace
from pathlib import Path

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.reading import ReadLog
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import LogError, MotionLog
from idbench.identify.data.log_columns import LogColumns


def given_log(name: str, log: MotionLog, robot_model: RobotModel) -> ReadLog:
    """Return a log of Python as one that was read, its joints in the order of the robot."""
    joints = robot_model.robot.joints
    columns = LogColumns(log.t, log.q, log.tau, log.torque, log.joints)
    try:
        _ = columns.ordered(joints)
    except LogError as error:
        raise ExperimentError(f"{name}: {error}") from error
    names = tuple(joint.removeprefix(columns.prefixed(joints)) for joint in log.joints)
    if names and names != joints:
        place = [names.index(joint) for joint in joints]
        torque = log.torque.ordered(place)
        conditions = {key: x[..., place] if x.shape[-1] > 1 else x for key, x in log.conditions.items()}
        motion = log.motion and (log.motion[0][..., place], log.motion[1][..., place])
        missing = tuple(k for k, j in enumerate(place) if j in log.missing)
        log = replace(
            log,
            q=log.q[..., place],
            tau=log.tau[..., place],
            torque=torque,
            conditions=conditions,
            joints=joints,
            motion=motion,
            missing=missing,
        )
    columns = LogColumns(log.t, log.q, log.tau, log.torque, joints)
    return ReadLog(Path(name), (replace(log, joints=()),), columns, log.torque)
