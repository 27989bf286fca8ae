"""How far a motion uses its limits, looked at instant by instant."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.kinematics import Limits
from idbench.identify.parameters.base_parameters import columns_at
from idbench.sim.limits.clearance import Clearance, Touch
from idbench.sim.limits.motion_limits import MotionLimits
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories.trajectory import Reference

FS = 1000.0  # Frequency [Hz] at which limits are looked at
BLOCK = 2000  # States whose columns are made together
ROUNDING = 1e-6  # Share by which a limit may be exceeded: coefficients are rounded where they are written


@dataclass(frozen=True, eq=False)
class LimitUse:
    """Shares of limits that a motion uses."""

    shares: dict[str, Array]
    """Of positions, from the middle of the range, velocities, accelerations, jerks, torques, torques of parameters that are
    off, and of torques on average; 1 at the limit, without those that have none, shape (time, joint), or (1, joint)."""
    touch: Touch | None
    """The nearest that shapes come, if nearer than they may."""
    least: float
    """Distance that they must keep [m]."""
    joints: tuple[str, ...]
    """Names."""

    @property
    def largest(self) -> dict[str, Array]:
        """Largest shares, shape (joint,)."""
        return {name: share.max(axis=0) for name, share in self.shares.items()}

    def broken(self) -> Iterator[str]:
        """Yield which limits are broken, by whom and when."""
        for name, share in self.shares.items():
            k, j = np.unravel_index(int(share.argmax()), share.shape)
            if not share[k, j] <= 1 + ROUNDING:  # nor is what is not a number
                when = f" at {k / FS:.3f} s" if len(share) > 1 else ""
                yield f"{name} of {self.joints[j]} is {share[k, j]:.1%} of its limit{when}"
        if self.touch:
            yield f"{self.touch} at {self.touch.instant / FS:.3f} s ({1000 * self.least:.0f} mm are asked for)"


@dataclass(frozen=True, eq=False)
class Inspector:
    """Looks at motions of a robot."""

    robot: Robot
    """The robot."""
    limits: Limits
    """Its limits."""
    asked: MotionLimits
    """How they are to be kept."""
    clearance: Clearance
    """Its distances."""
    basis: Basis
    """Its parameters."""
    X: Array
    """As far as they are known, shape (p,)."""

    def look(self, motion: Reference) -> LimitUse:
        """Use of the limits by a motion that is sampled at FS."""
        jerk = np.gradient(motion.qdd, 1 / FS, axis=0)
        rates = {"velocity": motion.qd, "acceleration": motion.qdd, "jerk": jerk}
        shares = {"position": np.abs(motion.q - self.limits.middle) / self.limits.sizes[0]}
        shares |= {name: np.abs(x) / getattr(self.limits, name) for name, x in rates.items()}
        tau = inverse_dynamics(self.robot, motion.q, motion.qd, motion.qdd) + coulomb_torque(self.robot, motion.qd)
        shares["torque"] = np.abs(tau) / (self.asked.torque_share * self.limits.torque)
        shares["worst-case torque"] = (np.abs(tau) + self.asked.prior_error * self._spread(motion)) / self.limits.torque
        moves = motion.qd.any(axis=1)  # of a motion that is repeated, rest is at the ends alone
        squares = np.mean(tau[moves] ** 2, axis=0, keepdims=True) if moves.any() else 0 * tau[:1]
        shares["rms torque"] = np.sqrt(squares) / self.limits.rms_torque
        limited = {name: share for name, share in shares.items() if share.any()}
        touch = self.clearance.nearest(motion.q, motion.qd, FS)
        return LimitUse(limited, touch, self.asked.clearance, self.robot.joints)

    def _spread(self, motion: Reference) -> Array:
        """Return the torques that all parameters make together if none were opposed, shape (time, joint) [N m]."""
        blocks = [slice(i, i + BLOCK) for i in range(0, len(motion.q), BLOCK)]
        states = np.stack([motion.q, motion.qd, motion.qdd]).swapaxes(-1, -2)
        return np.concatenate(
            [np.einsum("jpt,p->tj", np.abs(columns_at(self.basis, states[..., b])), np.abs(self.X)) for b in blocks]
        )
