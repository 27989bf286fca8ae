"""Which sample and which command a physics step belongs to."""

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class Clock:
    """Samples are taken every `per_sample` physics steps, from step 0; a command acts `delay` after its sample."""

    per_sample: int
    """Physics steps a sample."""
    h: float
    """Physics step [s]."""
    delay: float
    """Computing delay [s], not below zero."""

    @cached_property
    def late(self) -> int:
        """Whole physics steps between a sample and the step in which its command begins to act."""
        return int(self.delay / self.h + 1e-9)

    @cached_property
    def old(self) -> float:
        """Share of that step in which the command before still acts."""
        return max(0.0, self.delay / self.h - self.late)

    def final(self, step: int) -> int:
        """Number of samples that are final at the beginning of a step: recorded, and their commands as well."""
        return min(step // self.per_sample, max(0, (step - self.late - 1) // self.per_sample + 1))
