"""What is known of a servo before it is identified."""

from dataclasses import dataclass
from typing import final

import numpy as np

from idbench.identify.errors import SettingError, require_positive

PUBLISHED: dict[str, tuple[float, float, int]] = {
    "STS3215": (0.166, 0.97, 4096),
    "MX-64": (0.158, 0.9625, 4096),
    "MX-106": (0.158, 0.9625, 4096),
    "XL-320": (0.0505, 1.0, 1024),
    "XL330": (4096 / (2 * np.pi * 256 * 885), 1.0, 4096),
}
"""Duty per unit of kp and rad, largest duty and counts a turn, as published with BAM (arXiv 2410.08650, measured with an
oscilloscope) and for the STS3215 at GitHub kscalelabs/sysid."""


@final
@dataclass(frozen=True)
class Servo:
    """What is known of a servo: its firmware, its supply, its encoder.

    Raises
    ------
    SettingError
        If a value is out of its range.
    """

    gain: float
    """Duty per unit of the firmware's kp and rad of position error."""
    kp: float = 1.0
    """Firmware gain of the logs, unless they state another."""
    supply: float = 1.0
    """V [V]. At 1, a is the torque at full duty."""
    duty_limit: float = 1.0
    """Largest duty."""
    counts: int = 4096
    """Counts of the encoder a turn."""

    def __post_init__(self) -> None:
        require_positive(gain=self.gain, kp=self.kp, supply=self.supply, duty_limit=self.duty_limit, counts=self.counts)
        if self.duty_limit > 1:
            raise SettingError(f"duty_limit = {self.duty_limit:g} must be at most 1, the whole supply")

    @property
    def step(self) -> float:
        """Angle of one count [rad]."""
        return 2 * np.pi / self.counts
