"""Which sample and which command a physics step belongs to."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Clock:
    """Samples are taken every `per_sample` physics steps, from step 0; a command acts `delay` after its sample."""

    per_sample: int
    """Physics steps a sample."""
    h: float
    """Physics step [s]."""
    delay: float
    """Computing delay [s], not below zero."""

    @property
    def late(self) -> int:
        """Whole physics steps between a sample and the step in which its command begins to act."""
        return int(self.delay / self.h + 1e-9)

    @property
    def old(self) -> float:
        """Share of that step in which the command before still acts."""
        return max(0.0, self.delay / self.h - self.late)

    def sample(self, step: int) -> int | None:
        """Return the sample that is taken at the beginning of a step, if one is."""
        k, after = divmod(step, self.per_sample)
        return None if after else k

    def command(self, step: int) -> tuple[int, int]:
        """Return the command that acts in a step, below zero before the first, and how many steps it has acted for."""
        return divmod(step - self.late, self.per_sample)

    def undisturbed(self, step: int) -> int:
        """Return for how many steps, this one included, neither a sample is taken nor a command begins to act."""
        _, after = self.command(step)
        return min(self.per_sample - after, self.per_sample - step % self.per_sample)
