"""Servos of a robot: loads of their joints, what is printed, and what is written."""
