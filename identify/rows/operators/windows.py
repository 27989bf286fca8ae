"""Integrals over windows."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import SettingError, require_positive, require_whole
from idbench.identify.models import Equations
from idbench.identify.rows.operators.low_pass import SEEN, AbstractLowPass, AbstractOperator
from idbench.identify.rows.row_map import Grid, Kernel, RowMap, Window


@dataclass(frozen=True)
class Samples(AbstractLowPass):
    """No filter: every sample is a row, with all the noise that derivatives make."""

    def step(self, fs: float) -> int:
        """Return 1."""
        return 1

    def halo(self, fs: float) -> float:
        """Return 0."""
        return 0.0

    def window(self, fs: float, grid: Grid) -> Window:
        """Return the samples themselves."""
        return Kernel(self.response(fs), 0, grid)

    def response(self, fs: float) -> Array:
        """Return a single one."""
        return np.ones(1)


class AbstractWeakForm(AbstractOperator):
    """Rows that are integrals over a stretch of time, s e integrated by parts, so that no velocity is differentiated.

    A stretch that touches a masked instant is left out whole, and one weight holds for the rest, the mean over it: weights
    inside a stretch would have to be differentiated too.
    """

    @abstractmethod
    def kernels(self, fs: float) -> tuple[Array, Array]:
        """Weights, of equal length, of B tau and c, and of e, which integrate s e without differentiating it."""

    @final
    def halo(self, fs: float) -> float:
        """Return half the length of a stretch."""
        return len(self.response(fs)) / 2 / fs

    @final
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return the integrals, weighted; a row is void if its stretch touches a masked instant, or at most `SEEN` is left."""
        kernels = self.kernels(equations.signals.fs)
        length = len(kernels[0])
        before = (length - 1) // 2
        integral, derivative = (Kernel(kernel, before, grid) for kernel in kernels)
        touched = Kernel(np.ones(length), before, grid).apply((weight == 0).astype(np.float64))
        mean = Kernel(np.full(length, 1 / length), before, grid).apply(weight)
        outside = mean * ((touched == 0) & (mean**2 > SEEN))
        ones, by_parts = np.ones_like(weight), derivative if equations.differentiates else None
        return RowMap(equations.signals, equations.B, grid, integral, by_parts, ones, outside, kernels[0])

    @final
    def response(self, fs: float) -> Array:
        """Return the weights of B tau."""
        return self.kernels(fs)[0]


@dataclass(frozen=True)
class Windows(AbstractWeakForm):
    """Integrals over windows [ta, tb]: power becomes the energy model (Eq. 11, 20), implicit its integral form."""

    length: float = 0.1
    """Tb - ta [s]; the paper's n_d / fs."""
    spacing: float | None = None
    """Time from one ta to the next [s]; by default the length. If windows overlap, estimator OLS-selected selects the most
    informative ones."""

    def __post_init__(self) -> None:
        require_positive(length=self.length)
        if self.spacing is not None:
            require_positive(spacing=self.spacing)

    def step(self, fs: float) -> int:
        """Return the samples from window to window."""
        return self.samples(fs) if self.spacing is None else max(1, round(self.spacing * fs))

    def samples(self, fs: float) -> int:
        """Return the samples of a window, at least 2."""
        samples = round(self.length * fs)
        if samples < 2:
            raise SettingError(
                f"windows of {self.length:g} s hold {samples} samples at fs = {fs:g} Hz, fewer than 2: use longer"
            )
        return samples

    def kernels(self, fs: float) -> tuple[Array, Array]:
        """Return Simpson's rule, and the difference of the window's ends."""
        intervals = self.samples(fs)
        ends = np.zeros(intervals + 1)
        ends[0], ends[-1] = -1.0, 1.0
        return _simpson(intervals) / fs, ends


def _simpson(intervals: int) -> Array:
    """Return the weights of Simpson's rule over unit intervals; an odd number of them ends with the 3/8 rule."""
    weights = np.zeros(intervals + 1)
    paired = intervals - 3 * (intervals % 2)
    weights[0:paired:2] += 1 / 3
    weights[1:paired:2] += 4 / 3
    weights[2 : paired + 1 : 2] += 1 / 3
    if intervals % 2:
        weights[-4:] += np.array([3, 9, 9, 3]) / 8
    return weights


@dataclass(frozen=True)
class ModulatingFunctions(AbstractWeakForm):
    """Products with phi(t) = (1 - (t/H)^2)^degree over |t| < H, of unit area: the weak form, beyond the paper.

    After M. Shinbrot, "On the analysis of linear and nonlinear systems", Trans. ASME 79 (1957) 547-552.
    """

    support: float = 0.4
    """2 H [s], where a function is not zero."""
    spacing: float = 0.1
    """Time [s] between consecutive functions."""
    degree: int = 6
    """Smoothness: phi and its first degree - 1 derivatives vanish at both ends, which makes plain sums accurate."""

    def __post_init__(self) -> None:
        require_positive(support=self.support, spacing=self.spacing)
        require_whole(2, degree=self.degree)  # of degree 1 they have a kink at their ends

    def step(self, fs: float) -> int:
        """Return the samples between functions, at least 1."""
        return max(1, round(self.spacing * fs))

    def kernels(self, fs: float) -> tuple[Array, Array]:
        """Return phi, and -d phi/dt from the integration by parts."""
        half = self.support * fs / 2
        if half < self.degree:
            raise SettingError(
                f"modulating functions over {self.support:g} s hold {2 * half:g} samples at fs = {fs:g} Hz, "
                f"too few for degree {self.degree}: use a longer support"
            )
        reach = int(half)
        u = np.arange(-reach, reach + 1) / half
        phi = (1 - u**2) ** self.degree
        slope = -2 * self.degree * u * (1 - u**2) ** (self.degree - 1) * fs / half
        return phi / phi.sum(), -slope / phi.sum()
