"""Signals of a log: motion, torque, mask weights, and what makes them."""
