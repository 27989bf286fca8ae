"""Errors of the simulation package: each says the value, what was allowed and what to try."""


class BenchError(ValueError):
    """Root of all errors that `sim` raises on purpose."""


class RobotError(BenchError):
    """A robot that cannot be found or simulated."""


class ScenarioError(BenchError):
    """A scenario, or a trajectory in it, that makes no sense."""
