"""The description of a study, and the runs that it makes."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from idbench.experiments.errors import StudyError
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import CHAIN, ESTIMATOR, Parameters
from idbench.experiments.study.axis import (
    FRICTION,
    SERVO,
    Axis,
    Combination,
    Setting,
    combinations,
    methods_of,
    servo_methods,
    whole_first,
)
from idbench.experiments.study.statistics import NAMED
from idbench.identify import MODELS, AbstractModel
from idbench.identify.models import THREE, rows_per_sample
from idbench.sim.drives import ServoDrive
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import from_dict
from idbench.sim.settings import NotNegative, Seed, Truth, Whole, fields_of, settings

MOST_POINTS = 1_000_000
"""Combinations of settings of simulation, above which axes are taken for a slip: each is looked at before the first is run."""

MOST_METHODS = 1000  # Identifications of every run, above which axes are taken for a slip

OF_RUN = "run", "seed", "chain", "estimator", "model", "failure", "condition_number", "rows", "residual_rms", "simulations"
RESULTS = (*OF_RUN, *NAMED)
"""Columns of the results beside those of axes and parameters."""

SEVERITY = "severity"
"""The axis of how large faults are."""

Names = Annotated[tuple[str, ...], Field(min_length=1)]


@dataclass(frozen=True)
class Point:
    """One combination of the settings of simulation."""

    scenario: Scenario
    settings: tuple[Setting, ...]


@settings
class Study:
    """A scenario over axes and seeds, and how its logs are identified."""

    name: Annotated[str, Field(pattern=r"^\w[\w.-]*$")]
    """Name of the study: letters, digits, dot, hyphen and underscore."""
    question: str
    """What it is to answer."""
    scenario: dict[str, Any]
    """The scenario: name of one that ships, path of a file (TOML), or a table."""
    axes: tuple[Axis, ...]
    """What varies: the grid is every combination."""
    seeds: Annotated[Whole, Field(ge=2)] = 32
    """Independent runs of every combination."""
    seed: Seed = 0
    """The same seed gives the same runs."""
    motion: Literal["drawn", "shared"] = "drawn"
    """drawn: every run draws a motion of its own (trajectory of kind random); shared: all follow the scenario's."""
    models: Names = THREE
    """Names of models."""
    chains: Names = (CHAIN,)
    """Names of chains."""
    estimators: Names = (ESTIMATOR,)
    """Names of estimators."""
    friction: Names = ("standard",)
    """Laws of friction that are identified: standard, or a sum such as standard+stribeck; several are compared. Blanks part
    laws of single joints: "standard 2=standard+load"."""
    start: NotNegative = 0.0
    """Standard deviation of the relative error of the parameters at which estimators begin that simulate or filter, drawn for
    each run; 0: they begin at the least-squares estimate."""
    bound: Truth = False
    """Whether the least error that encoders and torque noise allow is computed beside (Cramer-Rao)."""
    data: Literal["simulated", "ideal"] = "simulated"
    """simulated: closed loops; ideal: robots that follow their motions exactly, with exact sensors."""
    realizations: Annotated[Whole, Field(ge=1)] = 1
    """Logs of every run: the same motion, repeated with independent noise, in one fit."""
    causes: Truth = False
    """Whether the doctor is asked of every run: how often does it name the faults of the scenario?"""
    rows: Literal["own", "equal"] = "own"
    """equal: models with one row per instant, power and energy, get n times the logs of n joints, and all models leave out
    the same time at the ends of a log; own: all models get the same logs."""

    def __post_init__(self) -> None:
        if not self.axes:
            raise StudyError("axes is empty: write [[axes]], with a field and values")
        every = [field for axis in self.every_axis for field in axis.all_fields]
        if twice := {field for field in every if every.count(field) > 1}:
            raise StudyError(f"two axes vary {', '.join(sorted(twice))}")
        if taken := [axis.field for axis in self.every_axis if axis.cases and axis.field in RESULTS]:
            raise StudyError(f"an axis of cases is called {taken[0]}, which is a column of the results: give it another name")
        if fixed := {"seed", "name", "trajectory.seed"} & set(every):
            raise StudyError(f"an axis varies {', '.join(sorted(fixed))}, which a study draws itself: use seeds")
        for group in (self.models, self.chains, self.estimators, self.friction):
            if len(set(group)) < len(group):
                raise StudyError(f"{', '.join(group)}: a name is given twice")
        methods = prod(len(axis.points) for axis in self.every_axis if axis.identification)
        if methods > MOST_METHODS:
            raise StudyError(f"{methods:,} combinations of identification settings are more than {MOST_METHODS:,}")
        points = prod(len(axis.points) for axis in self.axes if not axis.identification)
        if points > MOST_POINTS:
            raise StudyError(f"the grid has {points:,} combinations, more than {MOST_POINTS:,}: give its axes fewer values")
        _ = self.methods, self.parameters
        if self.of_servos != (self.models == (SERVO,)):
            raise StudyError(f'models = {list(self.models)}: a study of servos has models = ["{SERVO}"], any other has not')
        if not self.of_servos:
            _ = self.created_models, self.subjects
        if taken := [axis.field for axis in self.axes if axis.cases and axis.field in self.parameters]:
            raise StudyError(f"an axis of cases is called {taken[0]}, which is a parameter: give it another name")
        if self.causes and self.of_servos:
            raise StudyError("causes = true does not go with a study of servos")
        self._require_realizations()
        self._require(next(self._points()))  # the whole grid is looked at when it is known not to be endless

    def _require_realizations(self) -> None:
        """Raise StudyError if several logs of a run, or ideal ones, go with nothing else that is asked for."""
        keys = {
            f"realizations = {self.realizations}": self.realizations > 1,
            "rows = 'equal'": self.rows == "equal",
            "data = 'ideal'": self.data == "ideal",
        }
        given = [key for key, there in keys.items() if there]
        if not given:
            return
        loops = [one.method.estimator_name for one in self.methods if "loop" in one.method.estimator.needs]
        refused = {
            "a study of servos": self.of_servos,
            "bound = true": self.bound,
            f"estimator {', '.join(loops)}, which simulates the loop of one log: leave it out": bool(loops),
        }
        if self.data == "ideal":
            refused |= {
                "motion = 'shared': use motion = 'drawn'": self.motion == "shared",
                f"{' and '.join(given[:-1])}: ideal logs of a motion are all the same": len(given) > 1,
            }
            spoiled = [name for point in self._points() for name in point.scenario.imperfections]
            refused[f"a scenario with {spoiled[0] if spoiled else ''}, which ideal logs do not have"] = bool(spoiled)
        if found := [what for what, wrong in refused.items() if wrong]:
            raise StudyError(f"{given[-1]} does not go with {found[0]}")

    def logs_of(self, model: str) -> int:
        """Number of logs of a run for a model."""
        if self.of_servos or self.rows == "own":
            return self.realizations
        n = next(iter(self.subjects.values())).basis.n
        return self.realizations * max(1, n // rows_per_sample(self.created_models[model], n))

    @cached_property
    def most_logs(self) -> int:
        """Logs that every run makes."""
        return max(map(self.logs_of, self.models))

    @property
    def size(self) -> int:
        """Number of simulated runs."""
        return self.seeds * prod(len(axis.points) for axis in self.axes if not axis.identification)

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """The grid of simulations; raise ScenarioError or StudyError if a combination makes no sense."""
        found, _ = tuple(self._points()), self.parameters
        for point in found:
            self._require(point)
        return found

    def _require(self, point: Point) -> None:
        """Raise StudyError if the runs of a combination cannot be made."""
        if point.scenario.robot != (first := self._first.robot):
            raise StudyError(f"robots {first!r} and {point.scenario.robot!r} have other parameters: make a study of each")
        if self.motion == "drawn":
            _random(point.scenario)
        if self.motion == "drawn" and point.scenario.start:
            raise StudyError("motion = 'drawn' has no way to the start: leave out start, or motion = 'shared'")

    @cached_property
    def _first(self) -> Scenario:
        return next(self._points()).scenario

    def _points(self) -> Iterator[Point]:
        for combination in combinations([axis for axis in self.axes if not axis.identification]):
            content = json.loads(json.dumps(self.scenario))
            for setting in whole_first(combination):
                setting.into(content)
            yield Point(from_dict(content), combination)

    @cached_property
    def methods(self) -> tuple[Combination, ...]:
        """The grid of identifications."""
        axes = [axis for axis in self.every_axis if axis.identification]
        if self.of_servos:
            return tuple(servo_methods(self.friction[0], axes))
        return tuple(methods_of(self.chains, self.estimators, self.friction[0], axes))

    @cached_property
    def of_servos(self) -> bool:
        """Whether servos are identified, from commands and positions."""
        return isinstance(self._first.drive, ServoDrive)

    @property
    def every_axis(self) -> tuple[Axis, ...]:
        """The axes, and that of the laws of friction where several are compared."""
        laws = (Axis(field=FRICTION, values=self.friction),) if len(self.friction) > 1 else ()
        return (*self.axes, *laws)

    @cached_property
    def created_models(self) -> dict[str, AbstractModel]:
        """The models, by name."""
        return {name: MODELS.create(name) for name in self.models}

    @property
    def main_axis(self) -> Axis:
        """The axis with the most values, of a study of causes the severity of the faults: figures are drawn against it."""
        axes = [axis for axis in self.every_axis if axis.field in self.varied]
        return max(axes, key=lambda axis: (self.causes and axis.field == SEVERITY, len(axis.points)))

    @property
    def varied(self) -> tuple[str, ...]:
        """Fields of the axes with more than one value, or of all axes if none has."""
        every = self.every_axis
        return tuple(axis.field for axis in every if len(axis.points) > 1) or tuple(axis.field for axis in every)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that are identified, with any of the laws of friction."""
        if self.of_servos:
            from idbench.experiments.study.servo_rows import names_of  # half a second that other studies do not need

            return names_of(self._first, self.friction)
        return tuple(dict.fromkeys(name for robot_model in self.subjects.values() for name in robot_model.basis.names))

    @cached_property
    def subjects(self) -> dict[str, RobotModel]:
        """The robot of all its runs, by the laws of friction that are identified."""
        found = {laws: RobotModel(self._first.robot, Parameters(friction=tuple(laws.split()))) for laws in self.friction}
        for robot_model in found.values():
            robot_model.require_laws()
        return found

    def scenario_of(self, run: int) -> Scenario:
        """Return the scenario of a run by itself, the same whatever runs beside it; StudyError if the study has no such run."""
        if not 0 <= run < self.size:
            raise StudyError(f"run {run} does not exist: the study {self.name!r} has runs 0 to {self.size - 1}")
        point, number = divmod(run, self.seeds)
        scenario = self.points[point].scenario
        drawn = self._drawn(point, number)
        if self.motion == "drawn":
            scenario = replace(scenario, trajectory=replace(_random(scenario), seed=drawn[1]))
        return replace(scenario, seed=drawn[0])

    def seeds_of(self, run: int) -> list[int]:
        """Return the seeds of all logs of a run, the first that of its scenario."""
        first, _, *others = self._drawn(*divmod(run, self.seeds))
        return [first, *others]

    def _drawn(self, point: int, number: int) -> list[int]:
        """Return the seeds of a run: of its first log, its motion, and further logs."""
        drawn = np.random.SeedSequence(self.seed, spawn_key=(point, number)).generate_state(1 + self.most_logs, np.uint64)
        return [int(x) for x in drawn >> np.uint64(1)]

    @cached_property
    def fingerprint(self) -> str:
        """What distinguishes this study from any other."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @cached_property
    def text(self) -> str:
        """The study in JSON, the scenario in full."""
        return json.dumps(self.content, sort_keys=True)

    @property
    def edges(self) -> int:
        """Edges that are counted in a line of its encoders."""
        return int(self.scenario.get("encoder", {}).get("quadrature", 4))

    @property
    def content(self) -> dict[str, Any]:
        """The study as the keys of a TOML document."""
        axes = []
        for axis in self.axes:
            listed = {"values": list(axis.values)} if axis.values else {"cases": axis.cases} if axis.cases else {}
            spaced = {k: getattr(axis, k) for k in ("lowest", "highest", "count", "spacing")} if not listed else {}
            axes.append({"field": axis.field, **listed, **spaced, **({"also": list(axis.also)} if axis.also else {})})
        others = {key: getattr(self, key) for key in fields_of(Study) if key not in ("axes", "scenario")}
        plain = {key: x for key, x in others.items() if not isinstance(x, tuple)}
        lists = {key: list(x) for key, x in others.items() if isinstance(x, tuple)}
        return {**plain, **lists, "axes": axes, "scenario": self.scenario}


def _random(scenario: Scenario) -> Any:
    """The trajectory of a scenario whose motion can be drawn: it has a seed."""
    if not hasattr(scenario.trajectory, "seed"):
        raise StudyError(
            "motion = 'drawn' needs a trajectory of kind random, random_time_optimal, pace or steps, or motion = 'shared'"
        )
    return scenario.trajectory
