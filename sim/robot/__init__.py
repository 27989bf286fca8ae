"""Robots: MJCF and URDF files, their motors, payloads and dynamics."""

from idbench.sim.robot.robot import Robot as Robot
