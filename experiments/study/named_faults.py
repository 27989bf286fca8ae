"""Whether the doctor names the faults that the runs of a study have."""

from collections.abc import Mapping, Sequence

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.study.statistics import NAMED
from idbench.identify import IdentificationError, MotionLog
from idbench.identify.judge.suspect import Suspect
from idbench.sim.scenario.faults import FAULTS, OF_PAIRS, Fault

SAME = {"gravity": {"gravity", "tilt"}}
"""Causes that are right beside that of a fault: a base that is tilted a little has another gravity."""


def named_faults(method: Method, robot_model: RobotModel, log: MotionLog, faults: Sequence[Fault]) -> dict[str, float]:
    """Columns `NAMED` of a run, 1 or 0 each; a fit that is refused names nothing."""
    try:
        causes = fit(Request(robot_model, method=method, models=("explicit",)), Logs((log,))).diagnosis or ()
    except IdentificationError:
        causes = ()
    unknown = not causes or causes[0].suspect.cause == "unknown"
    right = is_named(causes[0].suspect, robot_model.robot.joints, faults) if causes and faults else unknown and not faults
    return dict(zip(NAMED, (float(right), float(not right and not unknown)), strict=True))


def is_named(first: Suspect, joints: Sequence[str], faults: Sequence[Fault]) -> bool:
    """True if the first suspect, or a rival that is named with it, is one of the faults, of the joint that has it."""
    rivals = {(first.cause, first.joint), *first.alternatives}
    return any(_is(cause, None if j is None else joints[j], fault, joints) for fault in faults for cause, j in rivals)


def _is(cause: str, joint: str | None, fault: Fault, joints: Sequence[str]) -> bool:
    flaw = FAULTS[fault.kind]
    near: Mapping[str, set[str]] = SAME
    if cause not in near.get(flaw.cause[0], {flaw.cause[0]}):
        return False
    pair = joints[joints.index(fault.joint) + 1] if fault.kind in OF_PAIRS else fault.joint
    return flaw.whole or not fault.joint or joint in (None, fault.joint, pair)
