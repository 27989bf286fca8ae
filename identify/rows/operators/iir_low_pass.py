"""IIR low-pass and decimate."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import final

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_below_nyquist, require_positive, require_whole
from idbench.identify.rows.grid import Grid
from idbench.identify.rows.operators.low_pass import AbstractLowPass, decimation
from idbench.identify.rows.row_map import Window
from idbench.identify.signals.zero_phase import forward_backward, settling_time


@final
@dataclass(frozen=True)
class IirLowPass(AbstractLowPass):
    """Chebyshev low-pass run forward and backward, and decimation by n_d = 0.8 (fs/2) / cutoff (section 6.2).

    With order 8 and a ripple of 0.05 dB it is the filter of Matlab's `decimate`, in second-order sections.
    """

    cutoff: float = 4.0
    """End of the pass band, f_fp [Hz]."""
    order: int = 8
    """Order of one pass."""
    ripple: float = 0.05
    """Ripple [dB] of one pass in the pass band."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff, ripple=self.ripple)
        require_whole(2, order=self.order)  # above 1, or s f_p(s) does not reject high frequencies (section 6.3)

    def step(self, fs: float) -> int:
        """Return n_d = 0.8 (fs/2) / cutoff, rounded down."""
        return decimation(0.8, self.cutoff, fs)

    def halo(self, fs: float) -> float:
        """Return the settling time of one pass."""
        return _halo(self, fs)

    def window(self, fs: float, grid: Grid) -> Window:
        """Return the filter, run over all samples."""
        return _Recursion(_sections(self, fs), grid)

    def response(self, fs: float) -> Array:
        """Return the impulse response, as far as the halo."""
        return _response(self, fs)


@dataclass(frozen=True, eq=False)
class _Recursion:
    """A filter run forward and backward."""

    sections: Array
    grid: Grid

    def apply(self, x: Array) -> Array:
        """Return the filtered samples of the grid."""
        return forward_backward(self.sections, x)[..., self.grid.samples]


@lru_cache(maxsize=16)
def _sections(f: IirLowPass, fs: float) -> Array:
    require_below_nyquist("operator cutoff", f.cutoff, fs)
    return frozen(scipy.signal.cheby1(f.order, f.ripple, f.cutoff, fs=fs, output="sos"))


@lru_cache(maxsize=16)
def _response(f: IirLowPass, fs: float) -> Array:
    reach = ceil(f.halo(fs) * fs - 1e-9)
    impulse = np.zeros(6 * reach + 1)
    impulse[3 * reach] = 1.0
    return frozen(forward_backward(_sections(f, fs), impulse)[2 * reach : 4 * reach + 1])


@lru_cache(maxsize=16)
def _halo(f: IirLowPass, fs: float) -> float:
    return settling_time(_sections(f, fs), fs)
