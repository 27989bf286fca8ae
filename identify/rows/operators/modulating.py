"""Products with smooth functions that vanish outside a stretch of time."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.errors import SettingError, require_positive, require_whole
from idbench.identify.rows.operators.weak_form import AbstractWeakForm, Kernels


@final
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

    def kernels(self, fs: float) -> Kernels:
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
        return Kernels(phi / phi.sum(), -slope / phi.sum())
