"""The robot, as the command line asks for it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, final

import tyro

from experiments.subject import CLOSED_FORM, Armature, Subject
from sim.robot import FILES

Words = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME")]


@final
@dataclass(frozen=True)
class Parameters:
    """Which parameters of a robot are asked for."""

    armature: Armature = "file"
    """Which joints have the inertia of a rotor: those to which the robot's file gives one, or all."""
    add: Words = ()
    """Laws of friction beside viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Words = ()
    """Parameters to leave out, as if they were zero."""

    def of(self, robot: str | None) -> Subject:
        """Return the robot of this name or file; that of the paper by default."""
        return Subject(CLOSED_FORM if robot is None else absolute(robot), self.armature, self.add, self.without)


def absolute(robot: str) -> str:
    """Return the name of a robot, or the path of its file from the root: results are read from other folders too."""
    return str(Path(robot).absolute()) if Path(robot).suffix in FILES else robot


Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]
