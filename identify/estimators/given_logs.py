"""What a problem asks of the logs that it is given."""

from collections.abc import Sequence

from idbench.identify.data.motion_log import MotionLog
from idbench.identify.errors import LogError

ROUNDING = 1e-9  # Share by which frequencies may differ that are the same: of a file they are the mean of its steps


def same_form(one: MotionLog, other: MotionLog) -> bool:
    """Return whether two logs have the same samples, joints and, but for rounding, frequency."""
    return one.q.shape[-2:] == other.q.shape[-2:] and abs(one.fs / other.fs - 1) < ROUNDING


def require_logs(logs: Sequence[object]) -> None:
    """Raise LogError unless all are logs, of which there is one at least."""
    if not logs:
        raise LogError("there is no log to identify")
    for log in logs:
        if not isinstance(log, MotionLog):
            raise LogError(f"{log!r:.60} is given where a MotionLog is needed, such as read_log(path)")
