"""How far a motion uses its limits, looked at instant by instant."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from idbench.identify.arrays import Array
from idbench.sim.limits.clearance import Touch

FS = 1000.0  # Frequency [Hz] at which limits are looked at
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
