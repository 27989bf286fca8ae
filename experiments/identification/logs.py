"""The logs of an identification: those of the fit, those held out to judge it, and what was done to them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from idbench.identify import Basis, Chain, IdentificationError, MotionLog
from idbench.identify.judge.delay import DelayEstimate, estimate_delay
from idbench.identify.rows.long_logs import is_long

LEAST = 0.05
"""Share of a sample by which a delay must move to matter."""

WITH_LAWS = "torque delay with the laws of friction that were chosen"


@dataclass(frozen=True, eq=False)
class Logs:
    """The logs of one fit."""

    fitted: tuple[MotionLog, ...]
    """The logs, and the pieces of those with gaps."""
    names: tuple[str, ...] = ()
    """What to call them."""
    held_out: Mapping[str, MotionLog] | None = None
    """Logs on which the fit is judged, by name; without any, the last quarter of the longest fitted log."""
    notes: tuple[str, ...] = ()
    """What was read, done and assumed."""
    truth: Mapping[str, float] | None = None
    """The true parameters, where they are known."""
    delay_sought: bool = False
    """Whether the delay of the torques was estimated, and may be estimated again with more laws of friction."""

    def delayed(self, basis: Basis, chain: Chain) -> tuple["Logs", bool]:
        """Return the logs with the delay that explains their torques best with other laws, and whether it moved by a sigma.

        As they are if there is none.
        """
        found = dict[str, DelayEstimate]()
        for meaning in dict.fromkeys(log.torque.meaning for log in self.fitted):
            try:
                found[meaning] = estimate_delay([log for log in self.fitted if log.torque.meaning == meaning], basis, chain)
            except IdentificationError as error:
                return replace(self, notes=(*self._notes, f"{WITH_LAWS}: {error}")), False
        said = ", ".join(f"{1e3 * each.delay:.4g} ms, sigma {1e3 * each.sigma:.2g} ms" for each in found.values())
        first = next(iter(found.values()))
        moved = any(_moved(log, found[log.torque.meaning]) for log in self.fitted)
        delayed = replace(
            self,
            fitted=tuple(with_delay(log, found[log.torque.meaning]) for log in self.fitted),
            held_out={
                name: with_delay(log, found.get(log.torque.meaning, first)) for name, log in (self.held_out or {}).items()
            },
            notes=(*self._notes, f"{WITH_LAWS}: {said}"),
        )
        return delayed, moved

    @property
    def _notes(self) -> tuple[str, ...]:
        """What was noted but for delays with other laws."""
        return tuple(note for note in self.notes if not note.startswith(WITH_LAWS))

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


def _moved(log: MotionLog, found: DelayEstimate) -> bool:
    return abs(log.torque.delay - found.delay) > max(found.sigma, LEAST / log.fs)


def with_delay(log: MotionLog, found: DelayEstimate) -> MotionLog:
    """Return a log whose torques have a delay."""
    return replace(log, torque=replace(log.torque, delay=found.delay))
