"""Recordings of simulations, and the window inside the loop that they show at the full rate."""

from typing import TYPE_CHECKING

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.recording.audience import Audience, Watching
from idbench.experiments.results.page import Page
from idbench.sim.scenario.scenario import Scenario

if TYPE_CHECKING:
    from idbench.experiments.recording.identification_recording import RunRecording


def require_window(inner: tuple[float, float] | None, watching: Watching) -> None:
    """Raise ExperimentError if a window inside the loop is none, or nothing is recorded."""
    if inner is not None and not (watching.rerun and 0 <= inner[0] < inner[1]):
        raise ExperimentError(f"--inner {inner[0]:g} {inner[1]:g} must be two times [s], in order, and needs a recording")


def doubt_window(page: Page, inner: tuple[float, float] | None, recording: "RunRecording | None") -> None:
    """Print if nothing of what a window should show was there."""
    if inner is not None and recording is not None and recording.base.inner is None:
        page.print(
            f"warning: nothing lies inside the loop from {inner[0]:g} to {inner[1]:g} s: the drive has no currents, "
            "or the run is shorter",
            soft_wrap=True,
        )


def recording_of(
    scenario: Scenario,
    audience: Audience | None,
    window: tuple[float, float] | None = None,
    robot_model: RobotModel | None = None,
) -> "RunRecording":
    """Return the recording of a scenario that is to be simulated."""
    from idbench.experiments.recording.identification_recording import RunRecording

    return RunRecording(scenario, audience, window, robot_model)
