"""Options of identification: where estimators begin, and whether they are moved to where bodies can exist."""

from typing import Literal

Start = Literal["least-squares", "file"]
"""Where estimators begin that simulate or filter: at the least-squares estimate, or at the parameters of the robot's file."""

Consistency = Literal["no", "pullback", "entropic"]
"""Whether estimates are made physically consistent, and by which distance unidentifiable parameters are held."""
