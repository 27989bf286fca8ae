"""Where estimators begin that simulate or filter."""

from typing import Literal

Start = Literal["least-squares", "file"]
"""At the least-squares estimate, or at the parameters of the robot's file."""
