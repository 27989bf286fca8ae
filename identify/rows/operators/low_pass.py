"""Low-pass and decimate: what the FIR and the IIR filter have in common."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor
from typing import final

import numpy as np
import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_below_nyquist, require_positive, require_whole
from idbench.identify.models import Equations
from idbench.identify.rows.row_map import Grid, Kernel, RowMap, Window
from idbench.identify.signals.filters import forward_backward, settling_time
from idbench.identify.signals.spectra import windowed_sinc

SEEN = 0.05
"""Share of a row's variance that the mask must leave: of the edge of a mask alone, variance and model are not known well."""


class AbstractOperator(ABC):
    """A linear operator that turns B tau = [c + s e] X into rows of Y = W X + rho.

    It owns s, the weights and the decimation, and knows no robot.
    """

    @abstractmethod
    def step(self, fs: float) -> int:
        """Samples between rows (n_d in the paper); raise SettingError if `fs` does not fit."""

    @abstractmethod
    def halo(self, fs: float) -> float:
        """Reach of a row to either side of its sample [s]."""

    @abstractmethod
    def response(self, fs: float) -> Array:
        """Return the weights of the samples around k in the row of sample k, shape (length,); k is (length - 1) // 2."""

    @abstractmethod
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return the linear map from samples, with weights of shape (..., kind of row, time), to the rows of `grid`."""


class AbstractLowPass(AbstractOperator):
    """The paper's parallel filter f_p (Eq. 15-19, 23): zero phase, the same for both sides, then one sample in n_d.

    e is differentiated at the acquisition rate, before the weights and the filter: differentiating the decimated
    signal, as Eq. 19 and 23 read literally, costs errors of 3 to 560 %.
    """

    @abstractmethod
    def window(self, fs: float, grid: Grid) -> Window:
        """Return the filter at the rows of `grid`."""

    @final
    def map(self, equations: Equations, weight: Array, grid: Grid) -> RowMap:
        """Return f_p of w B tau and of w (c + s e); a row is void if the mask leaves at most `SEEN` of its variance."""
        fs = equations.signals.fs
        squares = self.response(fs) ** 2
        seen = Kernel(squares, (len(squares) - 1) // 2, grid).apply(weight**2)
        valid = (seen > SEEN * squares.sum()).astype(np.float64)
        return RowMap(equations.signals, equations.B, grid, self.window(fs, grid), None, weight, valid, self.response(fs))


def decimation(share: float, cutoff: float, fs: float) -> int:
    """Return n_d = share (fs/2) / cutoff of section 6.2, rounded down, at least 1."""
    return max(1, floor(share * fs / 2 / cutoff + 1e-9))  # 0.8 * 50 / 4 must not round down to 9


@dataclass(frozen=True)
class FirLowPass(AbstractLowPass):
    """Windowed-sinc low-pass and decimation by n_d = (fs/2) / cutoff, the paper's rule for a FIR filter (section 6.2).

    Its memory ends, and only the kept samples are computed.
    """

    cutoff: float = 5.0
    """Frequency [Hz] at which it attenuates by 6 dB; the rows come at twice this rate."""
    transition: float = 5.0
    """Width [Hz] of the transition from pass band to stop band (below -50 dB), around the cut-off."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff, transition=self.transition)

    def step(self, fs: float) -> int:
        """Return n_d = (fs/2) / cutoff, rounded down."""
        return decimation(1.0, self.cutoff, fs)

    def halo(self, fs: float) -> float:
        """Return half the length of the impulse response."""
        return self._half(fs) / fs

    def window(self, fs: float, grid: Grid) -> Window:
        """Return the filter, of which only the kept samples are computed."""
        return Kernel(self.response(fs), self._half(fs), grid)

    def response(self, fs: float) -> Array:
        """Return the impulse response."""
        return _taps(self._half(fs), self.cutoff, fs)

    def _half(self, fs: float) -> int:
        require_below_nyquist("operator cutoff", self.cutoff, fs)
        # A Hamming window of M + 1 samples makes a transition of about 3.3 fs / M.
        return ceil(3.3 * fs / self.transition / 2 - 1e-9)


@lru_cache(maxsize=16)
def _taps(half: int, cutoff: float, fs: float) -> Array:
    return frozen(windowed_sinc(2 * half + 1, cutoff, fs))


@dataclass(frozen=True)
class IirLowPass(AbstractLowPass):
    """Chebyshev low-pass run forward and backward, and decimation by n_d = 0.8 (fs/2) / cutoff (section 6.2).

    With order 8 and a ripple of 0.05 dB it is the filter of Matlab's `decimate`, in second-order sections.
    """

    cutoff: float = 4.0
    """End of the pass band, f_fp [Hz]."""
    order: int = 8
    """Order of one pass; by the rule above 1, so that s f_p(s) rejects high frequencies (section 6.3)."""
    ripple: float = 0.05
    """Ripple [dB] of one pass in the pass band."""

    def __post_init__(self) -> None:
        require_positive(cutoff=self.cutoff, ripple=self.ripple)
        require_whole(1, order=self.order)

    def step(self, fs: float) -> int:
        """Return n_d = 0.8 (fs/2) / cutoff, rounded down."""
        return decimation(0.8, self.cutoff, fs)

    def halo(self, fs: float) -> float:
        """Return the settling time of one pass."""
        return settling_time(_sections(self, fs), fs)

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
