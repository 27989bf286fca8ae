"""IIR low-pass and decimate."""

from dataclasses import dataclass
from math import ceil
from typing import final

import numpy as np
import scipy

from identify.arrays import Array, require_below_nyquist, require_positive, require_whole
from identify.grid import Grid
from identify.operators.low_pass import AbstractLowPass, decimation
from identify.recursive import forward_backward, settling_time


@final
@dataclass(frozen=True)
class IirLowPass(AbstractLowPass):
    """Chebyshev low-pass run forward and backward, and decimation by n_d = 0.8 (fs/2) / cutoff (section 6.2).

    With order 8 and a ripple of 0.05 dB it is the filter of Matlab's `decimate`, in second-order sections.

    Parameters
    ----------
    cutoff : float
        End of the pass band, f_fp [Hz].
    order : int
        Order of one pass.
    ripple : float
        Ripple [dB] of one pass in the pass band.
    """

    cutoff: float = 4.0
    order: int = 8
    ripple: float = 0.05

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff, ripple=self.ripple)
        require_whole(2, order=self.order)  # above 1, or s f_p(s) does not reject high frequencies (section 6.3)

    def step(self, fs: float) -> int:
        """Return n_d = 0.8 (fs/2) / cutoff, rounded down."""
        return decimation(0.8, self.cutoff, fs)

    def halo(self, fs: float) -> float:
        """Return the settling time of one pass."""
        return settling_time(self._sections(fs), fs)

    def decimate(self, x: Array, fs: float, grid: Grid) -> Array:
        """Return the filtered samples of the grid."""
        return forward_backward(self._sections(fs), x)[..., grid.samples]

    def response(self, fs: float) -> Array:
        """Return the impulse response, as far as the halo."""
        reach = ceil(self.halo(fs) * fs - 1e-9)
        impulse = np.zeros(6 * reach + 1)
        impulse[3 * reach] = 1.0
        return forward_backward(self._sections(fs), impulse)[2 * reach : 4 * reach + 1]

    def _sections(self, fs: float) -> Array:
        require_below_nyquist("operator cutoff", self.cutoff, fs)
        return scipy.signal.cheby1(self.order, self.ripple, self.cutoff, fs=fs, output="sos")
