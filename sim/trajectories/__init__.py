"""Trajectories, and their table."""

from idbench.identify.plugins import PluginTable
from idbench.sim.trajectories.fourier import Fourier as Fourier
from idbench.sim.trajectories.point_to_point import PointToPoint as PointToPoint
from idbench.sim.trajectories.quintic import Quintic as Quintic
from idbench.sim.trajectories.quintic import RandomMoves as RandomMoves
from idbench.sim.trajectories.quintic import RandomPace as RandomPace
from idbench.sim.trajectories.recorded import Recorded as Recorded
from idbench.sim.trajectories.steps import RandomSteps as RandomSteps
from idbench.sim.trajectories.time_optimal import RandomTimeOptimal as RandomTimeOptimal
from idbench.sim.trajectories.time_optimal import TimeOptimal as TimeOptimal
from idbench.sim.trajectories.trajectory import AbstractTrajectory as AbstractTrajectory
from idbench.sim.trajectories.trajectory import Reference as Reference

TRAJECTORIES: PluginTable[AbstractTrajectory] = PluginTable(
    "trajectories",
    AbstractTrajectory,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "fourier": Fourier,
        "pace": RandomPace,
        "quintic": Quintic,
        "random": RandomMoves,
        "random_time_optimal": RandomTimeOptimal,
        "recorded": Recorded,
        "steps": RandomSteps,
        "time_optimal": TimeOptimal,
    },
)
