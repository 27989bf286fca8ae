"""Which parameters of a robot are identified."""

from dataclasses import dataclass
from typing import Annotated, Literal, final

import tyro

Names = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME")]
Laws = Annotated[tuple[str, ...], tyro.conf.arg(metavar="[JOINT=]LAW+LAW")]

Balancers = Annotated[tuple[str, ...], tyro.conf.arg(metavar="JOINT=a:M,b:M,...")]


@final
@dataclass(frozen=True)
class Parameters:
    """Which parameters of a robot are identified."""

    armature: Literal["file", "all", "none"] = "file"
    """Joints with a rotor inertia: those that have one in the robot's file, all, or none (torques measured at the links;
    reversals are then not masked)."""
    add: Names = ()
    """Friction laws in addition to viscous and Coulomb friction, such as offset, a constant torque of each joint."""
    without: Names = ()
    """Parameters to leave out, as if they were zero."""
    friction: Laws = ("standard",)
    """Friction laws: standard (viscous and Coulomb), none (torques measured at the links), asymmetric, or a sum such as
    standard+load+stribeck; for one joint: 2=standard+load. auto chooses those that predict held-out stretches best. `idbench
    list` lists them."""
    balancer: Balancers = ()
    """Springs and gas springs between two points, by their geometry from a drawing, such as 2=a:0.2,b:0.8,zero:-1.66 with
    volume:0.58 for gas [m, rad]: F0, Kb and Fg are identified."""
