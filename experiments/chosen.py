"""The robot and its parameters, as the command line asks for them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, final

import tyro

from sim.robot import FILES

Words = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME")]


@final
@dataclass(frozen=True)
class Parameters:
    """Which parameters of a robot are asked for."""

    armature: Literal["file", "all"] = "file"
    """Which joints have the inertia of a rotor: those to which the robot's file gives one, or all."""
    add: Words = ()
    """Laws of friction beside viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Words = ()
    """Parameters to leave out, as if they were zero."""


Asked = Annotated[Parameters, tyro.conf.OmitArgPrefixes]


def absolute(robot: str) -> str:
    """Return the name of a robot, or the path of its file from the root: results are read from other folders too."""
    return str(Path(robot).absolute()) if Path(robot).suffix in FILES else robot
