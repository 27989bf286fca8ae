"""Robots: MJCF and URDF files, their motors, payloads and dynamics."""
