"""How noise of the torques reaches the rows of a system, and from there the parameters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from identify.arrays import Array
from identify.kernel import Kernel


@dataclass(frozen=True, eq=False)
class Carrier:
    """The rows of one log as a linear function of its torques: row i of kind a at sample k_i is

        y_i = outside[a, i] sum_l h[l - k_i] inside[a, l] sum_j B[a, j, l] (T tau_j)[l]

    with T the prefilter and the alignment, inside and outside the weights before and after the operator, h its kernel.

    Parameters
    ----------
    B : mapping of (int, int) to Array, shape (..., time)
        (row kind, joint) -> what a model multiplies the torque of the joint by.
    inside : Array, shape (..., row kind, time)
        Weights of the samples.
    outside : Array, shape (..., row kind, count)
        Weights of the rows, zero for void ones.
    kernel : Kernel
        h, at the rows of a grid.
    transposed : callable
        T transposed, along the last axis.
    reach : int
        How many samples T looks to either side.
    """

    B: Mapping[tuple[int, int], Array]
    inside: Array
    outside: Array
    kernel: Kernel
    transposed: Callable[[Array], Array]
    reach: int

    @property
    def rows(self) -> int:
        """Number of rows, void ones included."""
        return self.outside.shape[-2] * self.outside.shape[-1]

    def variance(self) -> Array:
        """Return the variance that white noise of variance 1 on every torque gives each row, shape (..., rows).

        Exact where weights and B are the same over what a row looks at, as they nearly are: T then acts on the kernel.
        """
        seen = self.kernel.through(self.transposed, self.reach)
        squares = np.zeros(self.inside.shape)
        for (row, _), B in self.B.items():
            squares[..., row, :] += (self.inside[..., row, :] * B) ** 2
        variance = self.outside**2 * seen.squared().apply(squares)
        return np.swapaxes(variance, -1, -2).reshape(*variance.shape[:-2], -1)

    def pull(self, G: Array) -> dict[int, Array]:
        """Return, for each joint, the sums of `G` over the rows as functions of its torque, shape (..., p, time).

        Parameters
        ----------
        G : Array, shape (..., rows, p)
            Weights of the rows in p sums.
        """
        kinds, count = self.outside.shape[-2:]
        weights = np.moveaxis(G.reshape(*G.shape[:-2], count, kinds, G.shape[-1]), -3, -1) * self.outside[..., None, :]
        samples = self.kernel.transposed(weights, self.inside.shape[-1]) * self.inside[..., None, :]
        joints: dict[int, Array] = {}
        for (row, joint), B in self.B.items():
            reached = samples[..., row, :, :] * B[..., None, :]
            joints[joint] = joints[joint] + reached if joint in joints else reached
        return {joint: self.transposed(reached) for joint, reached in joints.items()}
