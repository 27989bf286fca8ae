"""Whether the doctor names the faults that the runs of a study have."""

from collections.abc import Sequence

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.study.statistics import NAMED
from idbench.identify import IdentificationError, MotionLog
from idbench.identify.judge.suspect import Suspect
from idbench.sim.scenario.faults import FAULTS, OF_PAIRS, Fault


def named_faults(method: Method, robot_model: RobotModel, log: MotionLog, faults: Sequence[Fault]) -> dict[str, float]:
    """Columns `NAMED` of a run, 1 or 0 each; a fit that is refused names nothing."""
    try:
        causes = fit(Request(robot_model, method=method, models=("explicit",)), Logs((log,))).diagnosis or ()
    except IdentificationError:
        causes = ()
    unknown = not causes or causes[0].suspect.cause == "unknown"
    right = is_named(causes[0].suspect, robot_model.robot.joints, faults) if causes and faults else unknown and not faults
    return dict(zip(NAMED, map(float, (right, not right and not unknown)), strict=True))


def is_named(first: Suspect, joints: Sequence[str], faults: Sequence[Fault]) -> bool:
    """True if the first suspect, or a rival that is named with it, is one of the faults, of the joint that has it.

    The first is a mistake of the same thing, too; rivals have a cause and a joint alone. A cause of all joints is none of one.
    """
    for fault in faults:
        flaw, names = FAULTS[fault.kind], {fault.joint}
        if fault.kind in OF_PAIRS:
            names.add(joints[(joints.index(fault.joint) + 1) % len(joints)])
        # A base that is tilted a little has another gravity.
        causes = {flaw.cause[0], " of the ".join(flaw.cause), *(("tilt",) if flaw.cause[0] == "gravity" else ())}
        of_same = first.of == flaw.cause[1]
        for cause, j in ((first.cause, first.joint),) * of_same + first.alternatives:
            if cause in causes and (flaw.whole or not fault.joint or (j is not None and joints[j] in names)):
                return True
    return False
