"""Estimators that simulate the robot with the parameters that they find."""
