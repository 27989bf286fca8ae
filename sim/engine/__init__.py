"""Simulating a scenario: robot, drives, encoders and controller in closed loop."""

from idbench.sim.engine.simulation import simulate as simulate
