"""What a fit lacks, in words, and what to try."""

from collections.abc import Iterator, Mapping, Sequence

from idbench.experiments.identification.friction_laws import said
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.text import probability
from idbench.identify.judge.lack_of_fit import WRONG, Lack

TRY: Mapping[str, str] = {
    "velocity": "--friction auto, or {joint}=standard+stribeck",
    "position": "{joint}=standard+cogging with --friction, a spring in the robot's file, a --balancer, or a straighter encoder",
    "load": "--friction auto, or {joint}=standard+load",
    "time": "a log of a warm robot, a shorter one, or {joint}=standard+temperature with the temperature in the log",
}
"""What to try, by what the residual torque depends on."""


def lacking(found: Sequence[Lack]) -> tuple[Lack, ...]:
    """Return what is beyond doubt, of every joint what is surest."""
    first: dict[int, Lack] = {}
    for lack in found:
        if lack.p < WRONG:
            first.setdefault(lack.joint, lack)
    return tuple(first.values())


def words_of_lack(found: Sequence[Lack], robot_model: RobotModel) -> str:
    """Return what the test says, in a line."""
    if not found:
        return "lack of fit: not tested, the rows are too few or do not allow it"
    if not (wrong := lacking(found)):
        return f"lack of fit: none over velocity, position, load and time (p {probability(found[0].p)})"
    joints = robot_model.robot.joints
    each = (
        f"{joints[x.joint]} over its {x.over} ({x.size:.2g} {robot_model.units(x.joint)[0]} rms, p {probability(x.p)})"
        for x in wrong
    )
    return f"lack of fit: {'; '.join(each)}"


def advice_on_lack(found: Sequence[Lack], joints: Sequence[str]) -> Iterator[str]:
    """Yield what to try, joint by joint of the same cause."""
    wrong = lacking(found)
    for over in dict.fromkeys(lack.over for lack in wrong):
        names = ", ".join(joints[lack.joint] for lack in wrong if lack.over == over)
        first = next(lack.joint for lack in wrong if lack.over == over)
        yield (
            f"the residual torque of {names} depends on {over}, which no parameter explains; "
            f"try {TRY[over].format(joint=said(first, joints))}"
        )
