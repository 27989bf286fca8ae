"""The logs of an identification: those of the fit, those held out to judge it, and what was done to them."""

from collections.abc import Mapping
from dataclasses import dataclass

from identify import MotionLog
from identify.rows.long_logs import is_long


@dataclass(frozen=True, eq=False)
class Logs:
    """The logs of one fit.

    Parameters
    ----------
    fitted : tuple of MotionLog
        The logs, and the pieces of those with gaps.
    names : tuple of str
        What to call them.
    held_out : mapping of str to MotionLog
        Logs on which the fit is judged, by name; without any, the last quarter of the longest fitted log.
    notes : tuple of str
        What was read, done and assumed.
    truth : mapping of str to float, optional
        The true parameters, where they are known.
    """

    fitted: tuple[MotionLog, ...]
    names: tuple[str, ...] = ()
    held_out: Mapping[str, MotionLog] | None = None
    notes: tuple[str, ...] = ()
    truth: Mapping[str, float] | None = None

    @property
    def longest_name(self) -> str:
        """What to call the longest of them, where it stands among others or by itself."""
        return self.name(self.longest) if len(self.fitted) > 1 else "the log"

    def name(self, k: int) -> str:
        """Return what to call one of the fitted logs."""
        return self.names[k] if self.names else f"log {k + 1}" if len(self.fitted) > 1 else "the log"

    @property
    def title(self) -> str:
        """What to call them at once."""
        return ", ".join(self.names) or "a log"

    @property
    def longest(self) -> int:
        """The number of the fitted log with the most samples."""
        return max(range(len(self.fitted)), key=lambda k: self.fitted[k].samples)

    @property
    def long(self) -> bool:
        """Whether they are too long for their rows to be kept."""
        return is_long(self.fitted)
