"""Errors of the experiments: each says the value, what was allowed and what to try."""


class ExperimentError(Exception):
    """Root of all errors that `experiments` raises on purpose."""


class ResultsError(ExperimentError):
    """A results folder that cannot be written or read."""


class StudyError(ExperimentError):
    """A study that cannot be run: a file, an axis, a folder, a cluster."""
