"""Errors of the identification package: each says the value, what is allowed and what to try. And checks of settings."""

from collections.abc import Callable, Mapping
from numbers import Real

import numpy as np


class IdentificationError(ValueError):
    """Root of all errors that `identify` raises on purpose."""


class InvariantError(Exception):
    """A fault of this package that no input should cause: it is reported with its traceback, not as wrong input."""


class LogError(IdentificationError):
    """A motion log that cannot be used as it is."""


class TimeError(LogError):
    """Sample times that are not uniform."""


class SettingError(IdentificationError):
    """A setting that is out of its range, or does not fit the log it meets."""


class RangeError(SettingError):
    """A search whose best value lies at an end of the range that it looks at."""


class ExcitationError(IdentificationError):
    """A motion that does not show every parameter; without those that are `hidden` it shows all that remain."""

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


def require_positive(**settings: float) -> None:
    """Raise SettingError unless every setting is a finite number above zero."""
    _require(settings, lambda x: x > 0, "a finite number above 0")


def require_finite(**settings: float) -> None:
    """Raise SettingError unless every setting is a finite number."""
    _require(settings, lambda _: True, "a finite number")


def require_not_negative(**settings: float) -> None:
    """Raise SettingError unless every setting is a finite number, 0 or above."""
    _require(settings, lambda x: x >= 0, "a finite number, 0 or above")


def require_whole(least: int, **settings: int) -> None:
    """Raise SettingError unless every setting is a whole number, at least `least`."""
    _require(settings, lambda x: x == int(x) and x >= least, f"a whole number, at least {least}")


def _require(settings: Mapping[str, float], fits: Callable[[float], bool], what: str) -> None:
    for name, value in settings.items():
        is_number = isinstance(value, Real) and not isinstance(value, bool) and np.isfinite(float(value))
        if not (is_number and fits(value)):
            raise SettingError(f"{name} = {value!r} must be {what}")


def require_below_nyquist(name: str, frequency: float, fs: float) -> None:
    """Raise SettingError unless `frequency` [Hz] is below half of `fs` [Hz]."""
    if frequency >= fs / 2:
        raise SettingError(
            f"{name} = {frequency:g} Hz is not below the Nyquist frequency, {fs / 2:g} Hz, of a log at fs = {fs:g} Hz: "
            "lower it, or log faster"
        )
