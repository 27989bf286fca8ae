"""FIR low-pass and decimate."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import final

import scipy

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import require_below_nyquist, require_positive
from idbench.identify.rows.grid import Grid, Kernel
from idbench.identify.rows.operators.low_pass import AbstractLowPass, decimation
from idbench.identify.rows.row_map import Window


@final
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
    return frozen(scipy.signal.firwin(2 * half + 1, cutoff, window="hamming", fs=fs))
