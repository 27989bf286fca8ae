"""Everything that defines a run, from TOML or Python."""

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np

from sim.errors import ScenarioError
from sim.trajectory import PointToPoint

MOST_SAMPLES = 1e8
"""Samples of a joint above which a scenario is taken for a slip: 0.8 GB."""


@dataclass(frozen=True)
class Scenario:
    """A run of ideal data: a robot on a point-to-point trajectory.

    Parameters
    ----------
    name : str
        Name of the run.
    robot : str
        Name of a robot that ships, or path of an MJCF file.
    fs : float
        Sampling frequency [Hz].
    rest : float
        Time at rest before the first and after the last move [s]: filters settle there.
    waypoints : tuple of tuple of float
        Positions at rest [rad], joint by joint.
    durations : tuple of float
        Time of every move [s].
    seed : int
        Seed of whatever is random in it.
    origin : str
        Where the trajectory comes from.
    """

    name: str
    robot: str
    fs: float
    rest: float
    waypoints: tuple[tuple[float, ...], ...]
    durations: tuple[float, ...]
    seed: int = 0
    origin: str = ""

    def __post_init__(self) -> None:
        for name in ("fs", "rest"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ScenarioError(f"{name} = {getattr(self, name)} must be a finite number above 0")
        if len({len(point) for point in self.waypoints}) != 1:
            raise ScenarioError("waypoints must all have the same number of joints, at least 1")
        if len(self.durations) != len(self.waypoints) - 1:
            w, d = len(self.waypoints), len(self.durations)
            raise ScenarioError(f"{w} waypoints need {w - 1} durations, not {d}")
        if self.trajectory.duration * self.fs > MOST_SAMPLES:  # making it says what else is wrong with the motion
            raise ScenarioError(f"fs = {self.fs:g} Hz makes more than {MOST_SAMPLES:.0e} samples of this motion: lower it")

    @property
    def trajectory(self) -> PointToPoint:
        """The motion, with its rest at both ends."""
        dwells = np.zeros(len(self.waypoints))
        dwells[[0, -1]] = self.rest
        return PointToPoint(np.array(self.waypoints), np.array(self.durations), dwells)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a scenario from a TOML file.

        Raises
        ------
        ScenarioError
            If the file cannot be read, is not TOML, lacks a key, or has one that is unknown or of the wrong type.
        """
        try:
            content = tomllib.loads(path.read_text())
        except OSError as error:
            raise ScenarioError(f"cannot read scenario {path}: {error.strerror}") from error
        except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise ScenarioError(f"cannot read scenario {path}: {error}") from error
        return cls.from_dict(content, str(path))

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], where: str = "scenario") -> Self:
        """Make a scenario from the keys of a TOML document; `where` names it in errors."""
        known = {field.name for field in fields(cls)}
        needed = known - {"seed", "origin"}
        if unknown := sorted(set(content) - known):
            raise ScenarioError(f"{where}: unknown key {unknown[0]!r}; known: {', '.join(sorted(known))}")
        if missing := sorted(needed - set(content)):
            raise ScenarioError(f"{where}: key {missing[0]!r} is missing")
        try:
            return cls(
                name=str(content["name"]),
                robot=str(content["robot"]),
                fs=float(content["fs"]),
                rest=float(content["rest"]),
                waypoints=tuple(tuple(float(x) for x in point) for point in content["waypoints"]),
                durations=tuple(float(x) for x in content["durations"]),
                seed=int(content.get("seed", 0)),
                origin=str(content.get("origin", "")),
            )
        except (TypeError, ValueError) as error:
            raise ScenarioError(f"{where}: {error}") from error

    def to_dict(self) -> dict[str, Any]:
        """Return the scenario as the keys of a TOML or JSON document."""
        return asdict(self)
