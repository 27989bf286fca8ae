"""The robot's file with the parameters that were identified."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import final

from idbench.experiments.identification.consistent_estimate import consistent_of
from idbench.experiments.identification.fit import Fit
from idbench.identify import Consistent
from idbench.identify.basis.block import FRICTION, named
from idbench.sim.robot.rewrite import compiled, rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters

SIGMAS = 3.0
"""Departures from the estimate beyond this many sigma are messages."""


@final
@dataclass(frozen=True, eq=False)
class WrittenRobot:
    """The physically consistent robot that agrees best with an estimate, as a file."""

    fit: Fit
    """The identification."""
    model: str
    """Name of the model whose estimate is taken."""

    @cached_property
    def consistent(self) -> Consistent:
        """Its standard parameters."""
        return consistent_of(self.fit.robot_model, self.fit.estimates[self.model])

    @cached_property
    def robot(self) -> Robot:
        """The robot of the file."""
        return compiled(self.fit.robot_model.name, self.text())

    @cached_property
    def values(self) -> dict[str, float]:
        """The standard parameters by name; those that were not asked for are zero."""
        found, robot_model = self.consistent, self.fit.robot_model
        without = {named("Ia", j): 0.0 for j in range(robot_model.basis.n)} if robot_model.asked.armature == "none" else {}
        for letters, law in (("Fv", "viscous"), ("Fs", "coulomb")):
            without |= {named(letters, j): 0.0 for j, own in enumerate(robot_model.laws.names) if law not in own}
        return without | robot_model.equal(dict(zip(found.names, map(float, found.standard), strict=True)))

    def text(self, folder: Path | None = None) -> str:
        """Return the file, to stand in a folder; in that of the robot's own file by default."""
        robot_model = self.fit.robot_model
        return rewritten(robot_model.name, self.values, folder, robot_model.mounting)

    def without_friction(self, joints: Collection[int]) -> Robot:
        """Return the robot without the friction of some joints."""
        robot_model = self.fit.robot_model
        of_joints = (p for p in robot_model.grouping.standard.parameters if p.joint in joints and p.kind in FRICTION)
        none = {p.name: 0.0 for p in of_joints}
        return compiled(robot_model.name, rewritten(robot_model.name, self.values | none, None, robot_model.mounting))

    @property
    def warnings(self) -> list[str]:
        """What is wrong about it."""
        found, names = self.consistent, self.fit.robot_model.grouping.names
        messages = []
        if not found.agrees:
            far = [f"{n} by {abs(d):.1f}" for n, d in zip(names, found.departure, strict=True) if abs(d) > SIGMAS]
            messages.append(
                f"the estimate of the {self.model} model is not physically consistent: the nearest consistent parameters are "
                f"{found.distance:.1f} sigma off{', ' + ', '.join(far) + ' sigma' if far else ''}"
            )
        if self.lost:
            messages.append(f"{', '.join(self.lost)} have no place in an MJCF file and are left out")
        return messages

    @property
    def lost(self) -> dict[str, float]:
        """Standard parameters that have no place in the file, and their values."""
        known = standard_parameters(self.fit.robot_model.robot)
        return {name: value for name, value in self.values.items() if name not in known and value}
