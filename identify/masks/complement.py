"""What another mask leaves out."""

from dataclasses import dataclass
from typing import final

from identify.arrays import Array
from identify.masks.base import AbstractMask


@final
@dataclass(frozen=True)
class Complement(AbstractMask):
    """1 - the weights of another mask: the instants that it leaves out.

    Parameters
    ----------
    mask : AbstractMask
        The other one.
    """

    mask: AbstractMask

    def halo(self, fs: float) -> float:
        """Return that of the other one."""
        return self.mask.halo(fs)

    def weight(self, qd: Array, fs: float) -> Array:
        """Return 1 - its weights."""
        return 1.0 - self.mask.weight(qd, fs)
