"""Simulating a scenario: robot, drives, encoders and controller in closed loop."""

from sim.engine.simulation import Progress as Progress
from sim.engine.simulation import simulate as simulate
