"""What was logged of one servo: commands and positions."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from idbench.identify.arrays import Array, frozen
from idbench.identify.errors import LogError, require_positive
from idbench.identify.servo.load import JointLoad

MIN_SAMPLES = 20
"""Samples that a run must have."""

SPIKE = 5.0
"""Times the longest way of the joint in a sample: a position that is further from those about it was not read well."""

BESIDE = 5
"""Samples whose median a position is compared with."""


def well_read(q: Array) -> npt.NDArray[np.bool_]:
    """Return whether each position of a joint [rad], shape (time,), is no spike."""
    typical = median_filter(q, BESIDE, mode="nearest")
    moves = np.abs(np.diff(q))
    longest = max(np.abs(np.diff(typical)).max(), moves[moves > 0].min(initial=np.inf) if moves.any() else 0.0)
    return np.asarray(np.abs(q - typical) <= SPIKE * longest)


def without_spikes(t: Array, q: Array) -> Array:
    """Return positions of a joint [rad], shape (time,), spikes interpolated."""
    well = well_read(q)
    return np.interp(t, t[well], q[well])


@final
@dataclass(frozen=True, eq=False)
class ServoRun:
    """Commands and positions of one joint, with their times as logged.

    Raises
    ------
    LogError
        If shapes differ, values are missing, time does not increase, or there are too few samples.
    """

    t: Array
    """Times [s], increasing; steps may differ, shape (time,)."""
    q: Array
    """Position that the servo reports [rad], shape (time,)."""
    command: Array
    """Commanded position from each sample on [rad], shape (time,)."""
    load: JointLoad
    """What the joint carries."""
    kp: float
    """Gain of the firmware, in its own unit."""
    on: npt.NDArray[np.bool_] | None = None
    """Whether torque is enabled; by default always, shape (time,)."""
    voltage: Array | None = None
    """Supply [V], where it was logged, shape (time,)."""
    name: str = field(default="the log", kw_only=True)
    """What messages call the run."""

    def __post_init__(self) -> None:
        require_positive(kp=self.kp)
        for name in ("t", "q", "command", "voltage"):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, self._checked(name, frozen(values)))
        on = np.ones(len(self.t), dtype=bool) if self.on is None else np.array(self.on, dtype=bool)
        if on.shape != self.t.shape:
            raise LogError(f"{self.name}: torque on has shape {on.shape}, t {self.t.shape}")
        object.__setattr__(self, "on", on)
        if len(self.t) < MIN_SAMPLES:
            raise LogError(f"{self.name} has {len(self.t)} samples; at least {MIN_SAMPLES} are needed")
        if (np.diff(self.t) <= 0).any():
            k = int(np.argmax(np.diff(self.t) <= 0))
            raise LogError(f"{self.name}: time does not increase after t = {self.t[k]:.6g} s; remove repeated rows")

    def _checked(self, name: str, values: Array) -> Array:
        if values.ndim != 1 or np.shape(values) != np.shape(self.t):
            raise LogError(f"{self.name}: {name} has shape {values.shape}, t {np.shape(self.t)}: one value per sample")
        if not np.isfinite(values).all():
            k = int(np.argmax(~np.isfinite(values)))
            raise LogError(f"{self.name}: {name} is {values[k]} at sample {k}; remove or repair such samples first")
        return values

    @property
    def enabled(self) -> npt.NDArray[np.bool_]:
        """Whether torque is enabled, shape (time,)."""
        assert self.on is not None
        return self.on

    @property
    def T(self) -> float:
        """Typical time between samples [s]."""
        return float(np.median(np.diff(self.t)))

    @cached_property
    def read_well(self) -> npt.NDArray[np.bool_]:
        """Whether each position can be one, shape (time,): spikes of the bus come back at once, joints do not."""
        return well_read(self.q)

    @cached_property
    def clean(self) -> Array:
        """Positions without spikes, which are interpolated [rad], shape (time,)."""
        return without_spikes(self.t, self.q)
