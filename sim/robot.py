"""A robot: a compiled MuJoCo model of one serial arm and what the bench asks of it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import mujoco
import numpy as np

import models
from sim.errors import BenchError, RobotError
from sim.motors import Array, Motors


@dataclass(frozen=True, eq=False)
class Robot:
    """An arm whose every joint is a hinge or a slide.

    Parameters
    ----------
    name : str
        Name of the robot.
    model : mujoco.MjModel
        The compiled model.
    """

    name: str
    model: mujoco.MjModel

    def __post_init__(self) -> None:
        simple = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        other = [self.model.joint(j).name for j in range(self.model.njnt) if self.model.jnt_type[j] not in simple]
        if other:
            raise RobotError(f"robot {self.name!r}: only hinge and slide joints can be simulated, not {', '.join(other)}")
        if not self.model.njnt:
            raise RobotError(f"robot {self.name!r} has no joints")

    @classmethod
    def load(cls, name: str, *edits: Callable[[mujoco.MjSpec], None]) -> Self:
        """Return the robot that ships as `name`, or that of an MJCF file, changed by `edits` before it is compiled.

        Raises
        ------
        RobotError
            If there is no such robot or file, or MuJoCo cannot compile it.
        """
        try:
            path = Path(name) if name.endswith(".xml") else models.path(name)
            spec = mujoco.MjSpec.from_file(str(path))
            for edit in edits:
                edit(spec)
            model = spec.compile()
        except KeyError as error:
            raise RobotError(f"{error.args[0]}, or give the path of an MJCF file (.xml)") from None
        except BenchError:
            raise
        except ValueError as error:
            raise RobotError(f"MuJoCo cannot load {name!r}: {' '.join(str(error).split())}") from error
        return cls(path.stem, model)

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.model.njnt)

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(self.model.joint(j).name for j in range(self.n))

    @cached_property
    def motors(self) -> Motors:
        """The DC motors of the joints; RobotError if a joint has none."""
        return Motors.of(self.model)

    @property
    def ranges(self) -> Array:
        """Lowest and highest position of every joint [rad], shape (joint, 2), infinite where the model has no limits."""
        unlimited = np.tile([-np.inf, np.inf], (self.n, 1))
        return np.where(self.model.jnt_limited[:, None].astype(bool), self.model.jnt_range, unlimited)

    @property
    def torque_limits(self) -> Array:
        """Largest torque of every joint's actuator [N m], shape (joint,), infinite where the model has no limits.

        From the range of forces, and from that of controls where the control is a force, as in `motor`.
        """
        limits, model = np.full(self.n, np.inf), self.model
        for a in range(model.nu):
            joint, gear = model.actuator_trnid[a, 0], abs(model.actuator_gear[a, 0])
            if model.actuator_forcelimited[a]:
                limits[joint] = min(limits[joint], gear * model.actuator_forcerange[a].max())
            is_force = model.actuator_biastype[a] == int(mujoco.mjtBias.mjBIAS_NONE)
            if model.actuator_ctrllimited[a] and is_force:
                limits[joint] = min(limits[joint], gear * model.actuator_gainprm[a, 0] * model.actuator_ctrlrange[a].max())
        return limits
