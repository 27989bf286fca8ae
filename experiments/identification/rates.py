"""Sampling and filter frequencies as multiples of the bandwidth of the position loop, as in the paper's rules."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from idbench.identify import Array, Chain

CONTROLLER = "of the scenario's controller"  # Source of a bandwidth that a run states
MOST = 0.99  # Share of the power of the velocities below the bandwidth of a motion


@dataclass(frozen=True)
class Rates:
    """The frequencies of a fit beside the rules of section 6: fs = 100 wdyn, wfp = 5 wdyn, wfq above 10 wdyn."""

    wdyn: float
    """Bandwidth of the position loop, or of the motion [Hz]."""
    source: str
    """Its source."""
    fs: float
    """Sampling frequency [Hz]."""
    wfp: float | None
    """Cut-off of the filter before the decimation [Hz]; None of integrals."""
    wfq: float | None
    """Cut-off of the prefilter [Hz]; None without one."""
    step: int
    """Samples from row to row, n_d."""
    rows: int
    """Rows of the first model."""

    @classmethod
    def of(cls, chain: Chain, fs: float, rows: int, stated: float | None, source: str, qd: Array) -> "Rates":
        """Return the rates of a chain; without a stated wdyn, that of the log's velocities qd, shape (joint, time)."""
        wdyn = moved(qd, fs) if stated is None else stated
        wfp, wfq = (getattr(stage, "cutoff", None) for stage in (chain.operator, chain.prefilter))
        return cls(wdyn, source, fs, wfp, wfq, chain.operator.step(fs), rows)

    def __str__(self) -> str:
        shares = {"fs": self.fs, "wfp": self.wfp, "wfq": self.wfq}
        each = [f"{name} {x / self.wdyn:.3g} wdyn ({x:g} Hz)" for name, x in shares.items() if x is not None]
        return f"wdyn {self.wdyn:.3g} Hz ({self.source}); {', '.join(each)}, n_d {self.step}, rows {self.rows}"

    def summary(self) -> dict[str, Any]:
        """Return the rates as summary.json has them."""
        return {"wdyn": self.wdyn, "source": self.source, "fs": self.fs, "wfp": self.wfp, "wfq": self.wfq, "n_d": self.step}


def moved(qd: Array, fs: float) -> float:
    """Return the frequency [Hz] below which velocities, shape (joint, time), have `MOST` of their power, of all joints.

    Joints that hardly move do not count: theirs is the power of the encoder's noise.
    """
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(qd - qd.mean(axis=-1, keepdims=True))) ** 2, axis=0))
    first = int(np.argmax(power >= MOST * power[-1]))
    return max(float(np.fft.rfftfreq(qd.shape[-1], 1 / fs)[first]), fs / qd.shape[-1])
