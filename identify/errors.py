"""Errors of the identification package: each says the value, what was allowed and what to try."""


class IdentificationError(ValueError):
    """Root of all errors that `identify` raises on purpose."""


class LogError(IdentificationError):
    """A motion log that cannot be used as it is."""


class TimeError(LogError):
    """Sample times that are not uniform."""


class SettingError(IdentificationError):
    """A setting that is out of its range, or does not fit the log it meets."""


class RangeError(SettingError):
    """A search whose best value lies at an end of the range that it looks at."""


class ExcitationError(IdentificationError):
    """A motion that does not show every parameter.

    Parameters
    ----------
    message : str
        The message.
    hidden : tuple of str
        Parameters that, left out, leave some that the motion does show.
    """

    def __init__(self, message: str, hidden: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.hidden = hidden


class UnknownNameError(IdentificationError, KeyError):
    """A name that no table knows."""

    __str__ = Exception.__str__  # a KeyError would show its message in quotes


class PluginError(IdentificationError):
    """A plug-in of another package that cannot be loaded, or is not what its entry point promises."""


class KinematicsError(IdentificationError):
    """A description of a robot that makes no sense."""
