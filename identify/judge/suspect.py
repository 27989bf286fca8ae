"""What a diagnosis finds."""

from dataclasses import dataclass, field

from idbench.identify.arrays import Array


@dataclass(frozen=True)
class Suspect:
    """A mistake that would explain residuals."""

    cause: str
    """What is wrong, in a word."""
    of: str
    """What it is a mistake of: torque, position, friction, drive, base, link or clock; of a servo: loop."""
    joint: int | None
    """Of which joint, from 0; None if it is the whole robot's."""
    size: tuple[float, ...]
    """How large, as far as it is small."""
    sigma: tuple[float, ...]
    """Standard deviations of that, with residuals as correlated as they are."""
    unit: str
    """Of both."""
    p: float
    """Probability that any mistake seems as significant by chance."""
    t: float
    """Its size over sigma, or the root of the sum of squares of independent ones."""
    alternatives: tuple[tuple[str, int | None], ...]
    """Causes, and joints, that explain as much: the log cannot distinguish them."""
    held_out: tuple[float, float]
    """Largest error of a torque that changes, on stretches that were not fitted, without and with it [%]; of a servo the rms of
    its position's, large ones counting less [rad]."""
    evidence: float
    """What it takes of minus twice the logarithm of the likelihood."""
    setting: float = 0.0
    """Of a ripple: waves a turn; of a length: along which axis."""
    band: float = 0.0
    """Highest frequency of a ripple that is above the band of the rows [Hz]; 0 of others."""
    instant: float | None = None
    """When it happened in a log, or from when on it is there [s]."""
    log: int | None = None
    """In which of several logs, from 0."""
    gains: tuple[tuple[float, ...], ...] = ()
    """By what every torque is to be multiplied, joint by joint: several ways where the log cannot tell them apart."""
    explained: Array | None = field(default=None, compare=False, repr=False)
    """What it explains of the residuals of the explicit model's rows, where it is small, shape (r,) [N m]."""
