"""Times, positions and torques of a log as they are, before anything is made of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import TorqueChannel
from idbench.identify.errors import LogError


@dataclass(frozen=True, eq=False)
class LogColumns:
    """The columns of a log, as they are, in SI units."""

    t: Array
    """Shape (time,) [s]."""
    q: Array
    """Positions [rad], shape (time, joint)."""
    tau: Array
    """Torques [N m], shape (time, joint)."""
    torque: TorqueChannel | None
    """What the file says of its torque."""
    joints: tuple[str, ...] = ()
    """Names of the joints, where the columns have them."""
    qd: Array | None = None
    """Logged velocities [rad/s], shape (time, joint)."""
    qdd: Array | None = None
    """Accelerations of samples that are by themselves [rad/s^2], shape (time, joint): the log has no times, or none count."""
    t_tau: Array | None = None
    """Times of the torques, where they are others than those of the positions [s], shape (time of torques,)."""
    temperature: Array | None = None
    """Shape (time, joint or 1), optional [deg C]."""
    gain: tuple[float, ...] = ()
    """Torque over what the file has, joint by joint: the torques have been multiplied by it."""
    missing: tuple[int, ...] = ()
    """Joints, from 0, whose torques the file does not have; they are 0 here."""
    integrated: bool = False
    """Whether positions are integrals of velocities, from 0: none were logged."""
    said: str = ""
    """Which file says what the columns are, and in which units; empty if that was the log itself."""

    @property
    def conditions(self) -> dict[str, Array]:
        """What else the log says that laws may need."""
        return {} if self.temperature is None else {"temperature": self.temperature}

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.shape[1]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, or their numbers."""
        return self.joints or tuple(f"joint {j + 1}" for j in range(self.n))

    def rows(self, kept: slice | npt.NDArray[np.intp]) -> Self:
        """Return the columns at some of their times; torques that have times of their own stay whole."""
        qd, qdd, warm = (None if x is None else x[kept] for x in (self.qd, self.qdd, self.temperature))
        tau = self.tau[kept] if self.t_tau is None else self.tau
        return replace(self, t=self.t[kept], q=self.q[kept], tau=tau, qd=qd, qdd=qdd, temperature=warm)

    def prefixed(self, joints: Sequence[str]) -> str:
        """Common prefix of the log's names that those of `joints` lack, as in fer_joint1, or else ""."""
        for joint in joints:
            before = next((name.removesuffix(joint) for name in self.joints if name.endswith(joint)), "")
            if before and {before + name for name in joints} == set(self.joints):
                return before
        return ""

    def ordered(self, joints: Sequence[str]) -> Self:
        """Return the columns in the order of `joints`, where they have names, perhaps with the same text before each.

        Raises
        ------
        LogError
            If there are others, or not as many.
        """
        if before := self.prefixed(joints):
            return replace(self, joints=tuple(name.removeprefix(before) for name in self.joints)).ordered(joints)
        if self.joints and set(self.joints) != set(joints):
            missing = ", ".join(joint for joint in joints if joint not in self.joints)
            over = ", ".join(joint for joint in self.joints if joint not in joints)
            wrong = "; ".join(text for text in (missing and f"missing: {missing}", over and f"not the robot's: {over}") if text)
            raise LogError(f"the log names the joints {', '.join(self.joints)}, the robot {', '.join(joints)}: {wrong}")
        if self.q.shape[1] != len(joints):
            own, others = (f"{n} joint{'s' if n > 1 else ''}" for n in (self.n, len(joints)))
            raise LogError(f"the log has positions of {own}, the robot {others}: {', '.join(joints)}")
        if not self.joints:
            return self
        place = [self.joints.index(joint) for joint in joints]
        qd, qdd = (None if x is None else x[:, place] for x in (self.qd, self.qdd))
        warm = self.temperature
        if warm is not None and warm.shape[1] > 1:
            warm = warm[:, place]
        torque = None if self.torque is None else self.torque.ordered(place)
        return replace(
            self,
            q=self.q[:, place],
            tau=self.tau[:, place],
            qd=qd,
            qdd=qdd,
            torque=torque,
            temperature=warm,
            joints=tuple(joints),
            missing=tuple(k for k, j in enumerate(place) if j in self.missing),
        )
