"""The robot's file with the parameters that were identified."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from idbench.experiments.identification.consistent_estimate import consistent_of
from idbench.experiments.identification.fit import Fit
from idbench.identify import Array, Consistent, IdentificationError
from idbench.identify.basis.block import FRICTION, named
from idbench.sim.robot.rewrite import compiled, rewritten
from idbench.sim.robot.robot import Robot

LITTLE = 0.1  # Differences of torques of less than so many per cent are not named
FAR = 2.0  # Times the file's mass, or share of it, beyond which a link is named: CAD is off by a third at most


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
    def values(self) -> dict[str, float]:
        """The standard parameters by name; those that were not asked for are zero."""
        found, robot_model = self.consistent, self.fit.robot_model
        return robot_model.equal(dict(zip(found.names, map(float, found.standard), strict=True)))

    @cached_property
    def sigma(self) -> dict[str, float]:
        """Standard errors of the parameters that the log shows by themselves, in no sum with others."""
        estimate = self.fit.estimates[self.model]
        places = estimate.problem.basis.places.items()  # of those that are tied, too
        return {p.name: float(estimate.standard_errors[k]) for p, k in places if p.name in self.values}

    def source(self, name: str) -> str:
        """Whether a value is of the log, a share of a sum that the log shows, stated, or of the file."""
        names, K = self.consistent.names, self.fit.robot_model.grouping.K
        if name in self.sigma:
            return "log"
        if name in names:
            return "sum" if K[:, names.index(name)].any() else "file"
        return "stated" if name in self.values else "file"

    @property
    def strayed(self) -> list[str]:
        """Links whose mass is far from the file's; none where no robot is consistent, which is said when it is written."""
        try:
            found = self.consistent
        except (IdentificationError, np.linalg.LinAlgError):
            return []
        joints = {named("M", j): joint for j, joint in enumerate(self.fit.robot_model.robot.joints)}
        own = self.fit.robot_model.filed == found.given  # without bodies whose size is assumed
        masses = zip(found.names, found.standard, found.given * own, strict=True)
        far = [(joints[x], m, of) for x, m, of in masses if x in joints and of > 0 and not of / FAR <= m <= FAR * of]
        return [f"the link of {joint} has {mass:.3g} kg, {filed:.3g} in the robot's file" for joint, mass, filed in far]

    def text(self, folder: Path | None = None) -> str:
        """Return the file, to stand in a folder; in that of the robot's own file by default."""
        robot_model = self.fit.robot_model
        return rewritten(robot_model.name, self.values, folder, robot_model.mounting)

    def robot(self, joints: Collection[int]) -> Robot:
        """Return the robot of the file, without the friction of some joints."""
        robot_model = self.fit.robot_model
        of_joints = (p for p in robot_model.grouping.standard.parameters if p.joint in joints and p.kind in FRICTION)
        none = {p.name: 0.0 for p in of_joints}
        return compiled(robot_model.name, rewritten(robot_model.name, self.values | none, None, robot_model.mounting))

    @property
    def warnings(self) -> list[str]:
        """What is wrong about it."""
        messages = []
        if not self.consistent.agrees:
            joints = self.fit.robot_model.robot.joints
            off = 100 * self._share(self.consistent.base, self.fit.estimates[self.model].X)
            far = ", ".join(f"{joint} {x:.2g} %" for joint, x in zip(joints, off, strict=True) if x > LITTLE)
            messages.append(
                f"the estimate of the {self.model} model is not physically consistent; torques of the nearest robot that is "
                f"differ by {far or f'less than {LITTLE:g} %'} of the log's"
            )
        if self.lost:
            smooth = {p.name for p in self.fit.basis.parameters if p.is_random_effect}
            others = [name for name in self.lost if name not in smooth]
            names = ", ".join([*others, *(["smooth functions of friction"] if smooth & self.lost.keys() else [])])
            messages.append(f"{names} have no place in the file and are left out")
        return messages

    def share_of(self, names: Collection[str]) -> Array:
        """Return the rms torque that standard parameters make, over that of the log, shape (joint,)."""
        found = self.consistent
        own = np.array([x if name in names else 0.0 for name, x in zip(found.names, found.standard, strict=True)])
        return self._share(self.fit.robot_model.grouping.base(own))

    def _share(self, base: Array, without: Array | float = 0.0) -> Array:
        """Return the rms torque of base values, beside that of an estimate X, over that of the log, shape (joint,)."""
        places, problem = self.fit.robot_model.grouping.basis.places, self.fit.problem
        X = np.array([base[places[p]] for p in problem.basis.parameters]) - without
        R = problem.factors.R
        squares = [np.sum(x**2, axis=-1) for x in (R[..., :-1] @ X, R[..., -1])]
        return np.sqrt(np.divide(squares[0], squares[1], out=np.zeros_like(squares[0]), where=squares[1] > 0))

    @property
    def lost(self) -> dict[str, float]:
        """Standard parameters that have no place in the file, and their values."""
        filed = self.fit.robot_model.given
        return {name: value for name, value in self.values.items() if name not in filed and value}
