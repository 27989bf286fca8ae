"""Simulating a scenario: robot, drives, encoders and controller in closed loop."""

from idbench.sim.engine.simulation import Progress as Progress
from idbench.sim.engine.simulation import simulate as simulate
