"""Trajectories, and their table."""

from identify.plugins import PluginTable
from sim.trajectories.fourier import Fourier as Fourier
from sim.trajectories.point_to_point import PointToPoint as PointToPoint
from sim.trajectories.quintic import Quintic as Quintic
from sim.trajectories.random_moves import RandomMoves as RandomMoves
from sim.trajectories.recorded import Recorded as Recorded
from sim.trajectories.reference import Reference as Reference
from sim.trajectories.steps import RandomSteps as RandomSteps
from sim.trajectories.time_optimal import TimeOptimal as TimeOptimal
from sim.trajectories.trajectory import AbstractTrajectory as AbstractTrajectory

TRAJECTORIES: PluginTable[AbstractTrajectory] = PluginTable(
    "trajectories",
    AbstractTrajectory,  # type: ignore[type-abstract]  # only asked whether an instance is one
    {
        "fourier": Fourier,
        "quintic": Quintic,
        "random": RandomMoves,
        "recorded": Recorded,
        "steps": RandomSteps,
        "time_optimal": TimeOptimal,
    },
)
