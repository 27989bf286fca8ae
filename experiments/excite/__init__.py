"""Exciting trajectories, for any robot: `idbench excite`."""
