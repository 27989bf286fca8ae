"""Which parameters of a robot are identified."""

from dataclasses import dataclass
from typing import Annotated, Literal, final

import tyro

Names = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME")]
Laws = Annotated[tuple[str, ...], tyro.conf.arg(metavar="[JOINT=]LAW+LAW")]


@final
@dataclass(frozen=True)
class Parameters:
    """Which parameters of a robot are asked for."""

    armature: Literal["file", "all", "none"] = "file"
    """Which joints have the inertia of a rotor: those to which the robot's file gives one, all, or none, as where torques are
    measured at the links: reversals are not masked then."""
    add: Names = ()
    """Laws of friction beside viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Names = ()
    """Parameters to leave out, as if they were zero."""
    friction: Laws = ("standard",)
    """Laws of friction: standard (viscous and Coulomb), none (torques measured at the links), asymmetric, or a sum such as
    standard+load+stribeck; of one joint: 2=standard+load. auto: those that predict motion best that was not fitted. `idbench
    list` has them all."""
