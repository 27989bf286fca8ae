"""Results as a Python session sees them: verdict first, then a table with units."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from idbench.experiments.api.keywords import in_python
from idbench.experiments.api.logs import given_log
from idbench.experiments.document import Conclusion
from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.exports import kind_of
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.job import summary_of
from idbench.experiments.identification.load import within
from idbench.experiments.identification.reading import late, read
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.held_out import Verdict
from idbench.experiments.judgement.judgement import Judgement, conclusion, judge
from idbench.experiments.judgement.remedies import checks
from idbench.experiments.requests.shared import LogRequest
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.writing import folder_for, write_text
from idbench.experiments.text import relative
from idbench.identify import Array, MotionLog, Problem, State, Validation, validate
from idbench.identify.arrays import combined
from idbench.identify.judge.torque_interval import torque_interval
from idbench.identify.rows.rows import manageable
from idbench.identify.tables import concise, html_table, text_table
from idbench.sim.engine.run import Run
from idbench.sim.robot.robot import Robot


def path_of(path: Any, who: str) -> Path:
    """Return a path; raise ExperimentError, which begins with `who`, if it is none."""
    if not isinstance(path, str | Path):
        raise ExperimentError(f"{who}: {path!r:.60} is no file: give its name")
    return Path(path)


@dataclass(frozen=True)
class ParameterEstimate:
    """One parameter with its standard error."""

    name: str
    """Its name, such as Fv1."""
    value: float
    """The estimate, in `unit`."""
    sigma: float
    """Its standard error, in `unit`."""
    unit: str
    """Its unit."""
    truth: float | None = None
    """The true value, where it is known."""


@dataclass(frozen=True, eq=False)
class Score:
    """Errors of the predicted torques of a held-out log, while joints move."""

    joints: tuple[str, ...]
    """Names of the joints."""
    units: tuple[str, ...]
    """Units of their torques."""
    validation: Validation
    """The errors on the rows of the log."""
    verdict: Verdict
    """What they mean."""

    @property
    def rms(self) -> Array:
        """Rms error of each joint's torque [N m, N], shape (joint,)."""
        return self.validation.rms

    @property
    def percent(self) -> Array:
        """The same in per cent of the rms torque, shape (joint,)."""
        return self.validation.percent

    def __repr__(self) -> str:
        return text_table(*self._table())

    def _repr_html_(self) -> str:
        return html_table(*self._table())

    def _table(self) -> tuple[str, list[str], list[list[str]]]:
        each = zip(self.joints, self.rms, self.units, self.percent, strict=True)
        rows = [[joint, f"{rms:.3g}", unit, f"{share:.2g}"] for joint, rms, unit, share in each]
        return f"{self.verdict.word}: {'; '.join(self.verdict.reasons)}", ["", "rms error", "unit", "% of torque"], rows


@dataclass(frozen=True, eq=False)
class Identification:
    """Logs, identified: parameters with standard errors, predictions, and a verdict on held-out data."""

    fit: Fit
    """The fit: `fit.estimates` has the estimate of every model."""
    delay_given: bool = True
    """Whether the delay of the torques was given, not estimated: checks then look for another."""

    @property
    def robot(self) -> RobotModel:
        """The robot, with the parameters that were identified."""
        return self.fit.robot_model

    @property
    def model(self) -> str:
        """The model whose parameters are shown: the first that has an estimate."""
        return self.fit.leading

    @property
    def parameters(self) -> Mapping[str, ParameterEstimate]:
        """The parameters by name."""
        found = self.fit.estimates[self.model]
        truth = self.fit.truth or {}
        each = zip(found.names, found.X.tolist(), found.standard_errors.tolist(), self.fit.basis.units, strict=True)
        return {name: ParameterEstimate(name, x, sigma, unit, truth.get(name)) for name, x, sigma, unit in each}

    @property
    def correlation(self) -> Array:
        """Correlations of the parameters, shape (p, p)."""
        C = self.fit.estimates[self.model].covariance
        sigma = np.sqrt(np.diagonal(C))
        return np.asarray(C / np.outer(sigma, sigma))

    @cached_property
    def judgement(self) -> Judgement:
        """The fit on each held-out log, or on the last quarter of the longest, predicted by a fit of the rest."""
        return judge(self.fit)

    @cached_property
    def doubts(self) -> Mapping[str, Sequence[str]]:
        """What to check, by what it is about."""
        return checks(self.judgement, delay=self.delay_given)

    @cached_property
    def answer(self) -> Conclusion:
        """The verdict on held-out data in a sentence, and the next step."""
        return conclusion(self.judgement, self.doubts)

    @property
    def verdict(self) -> str:
        """The verdict on held-out data in one sentence, and what to do next, as keywords."""
        return in_python(str(self.answer))

    def predict(
        self, q: Array, qd: Array, qdd: Array, model: str | None = None, *, interval: float | None = None
    ) -> Array | tuple[Array, Array]:
        """Return the torques of motions [N m, N], of the shape of q; with `interval`, also the half widths of their intervals.

        Parameters
        ----------
        q, qd, qdd : array_like, shape (..., joint)
            Positions, velocities and accelerations [rad, rad/s, rad/s^2], joints in the order of the robot.
        model : str, optional
            The model whose parameters are used; by default the one that is shown.
        interval : float, optional
            Share of torques that intervals shall contain, such as 0.95. They are from held-out stretches of the fit
            (`torque_interval`), and hold for torques up to 10 Hz; NaN where a joint is faster than in 99 % of the fit.

        Raises
        ------
        ExperimentError
            If a shape is another, the model has no estimate, or intervals are not known.
        """
        try:
            given = [np.asarray(x, dtype=np.float64) for x in (q, qd, qdd)]
        except (TypeError, ValueError) as error:
            raise ExperimentError(f"predict: q, qd and qdd are arrays of numbers: {error}") from None
        n = self.fit.basis.n
        if any(x.shape != given[0].shape for x in given) or given[0].shape[-1:] != (n,):
            shapes = ", ".join(str(x.shape) for x in given)
            raise ExperimentError(f"q, qd, qdd have the shapes {shapes}: give three of (..., {n}), one value a joint")
        flat = [x.reshape(-1, n).T for x in given]
        state = State(flat[0], flat[1], lambda _: flat[2])
        tau = combined(self.fit.basis.explicit(state), self._of(model).X, np.zeros(flat[0].shape))
        torques = tau.T.reshape(given[0].shape)
        return torques if interval is None else (torques, self._half(interval, model, np.abs(given[1])))

    def _half(self, level: float, model: str | None, speed: Array) -> Array:
        if not isinstance(level, int | float) or not 0 < level < 1:
            raise ExperimentError(f"predict: interval = {level!r:.40} must be a share between 0 and 1, such as 0.95")
        if (found := torque_interval(self._of(model), level)) is None:
            raise ExperimentError("predict: the rows of this fit are not kept, its log is too long: intervals are not known")
        return np.where(speed > found.speed, np.nan, found.half)

    def score(self, log: MotionLog | str | Path, model: str | None = None) -> Score:
        """Return the errors of the torques predicted for a held-out log, or for that of a file as `read_log` reads it.

        Raises
        ------
        ExperimentError, IdentificationError
            If the log has other joints, or no rows on which torques can be judged.
        """
        robot, estimate = self.robot, self._of(model)
        if isinstance(log, str | Path):
            known = replace(self.fit.logs.fitted[0].torque, gain=1.0)  # as for `held_out`; a gain is of its own file
            log = read(Path(log), LogRequest(), robot, known).longest
        if not isinstance(log, MotionLog):
            raise ExperimentError(f"score: {log!r:.60} is no log: give a file, or a MotionLog as read_log returns it")
        given = given_log("the held-out log", log, robot)
        held_out = (given if self.delay_given else late(given, self.fit.logs.fitted[0].torque)).longest
        if any(within(held_out, other) for other in self.fit.logs.fitted):
            raise ExperimentError("score: the log holds the motion that is identified: give another motion")
        problem = Problem((manageable([held_out])[0],), self.fit.basis, self.fit.problem.model, self.fit.processing)
        found = validate(problem, estimate.X, estimate.within_covariance)
        units = tuple(robot.units(j)[0] for j in range(self.fit.basis.n))
        return Score(robot.robot.joints, units, found, Verdict.of(self.fit, found, self.fit.diagnosis or ()))

    def write(self, *paths: str | Path, force: bool = False) -> list[str]:
        """Write files for other software, and return what is to be said of them.

        .xml, .urdf, .sdf: the identified robot; .yaml, its actuators; .json, base parameters; .py, .c, functions for a
        controller; .toml, robots for training with code; .ensemble, the same in a folder; sysid.py, parameters for
        mujoco.sysid; cogmap.csv, the joints' cogging.

        Raises
        ------
        ExperimentError, ResultsError, IdentificationError, BenchError
            If a name ends with something else, a file is there that idbench did not write, or cannot be written; if the robot
            has no consistent bodies.

        Warns
        -----
        UserWarning
            If the file lacks something that was identified.
        """
        read = (Robot.path(self.robot.name),)  # never written over
        for path in (path_of(path, "write") for path in paths):
            kind_of(path, "write").require_free(path, "write", force=force, read=read)
            kind_of(path, "write").require(self.robot, path)
        notes = list[str]()
        for path in map(Path, paths):
            made = kind_of(path, "write").render(self.fit, self.model, path)
            if path not in made.texts:  # a folder of files
                folder_for(path, "write")
            for target, text in made.texts.items():
                write_text(target, text, "write", force=force, read=read)
            for doubt in made.warnings:
                warnings.warn(f"{path}: {doubt}", stacklevel=2)
            notes += [note for note in made.notes if note not in notes]
        return notes

    def report(self, path: str | Path, force: bool = False) -> None:
        """Write the report: one HTML file with verdict, parameters, torques, residuals.

        Raises
        ------
        ResultsError
            If there is a file that idbench did not write, or it cannot be written.
        """
        from idbench.experiments.reports.page import report

        path = path_of(path, "report")
        with Attempts("the fit is kept") as attempts:
            text = report(self.judgement, self.answer, self.doubts, self.fit.logs.notes, "idbench.fit(...)", attempts)
            write_text(path, text, "report", force=force)

    def summary(self) -> dict[str, Any]:
        """The summary.json of `idbench identify`, but for the names of files."""
        return summary_of(self.fit) | self.judgement.summary() | {"conclusion": self.answer.summary()}

    def _of(self, model: str | None) -> Any:
        name = self.model if model is None else model
        if not isinstance(name, str) or name not in self.fit.estimates:
            raise ExperimentError(f"there is no estimate of the {name!s:.60} model; there are {', '.join(self.fit.estimates)}")
        return self.fit.estimates[name]

    def __repr__(self) -> str:
        lines = in_python("\n".join(self.answer.lines))
        return f"{lines}\n\n{text_table(*self._table())}"

    def _repr_html_(self) -> str:
        return html_table(self.verdict, *self._table()[1:])

    def _table(self) -> tuple[str, list[str], list[list[str]]]:
        known = self.fit.truth is not None
        heads = [f"{self.model} model", "value", "unit", "%sigma", *(["truth"] if known else [])]
        return f"{self.fit.logs.title}, {self.fit.request.method.estimator_name}", heads, list(self._rows())

    def _rows(self) -> Iterator[list[str]]:
        functions = {p.name for p in self.fit.basis.parameters if p.is_random_effect}
        for p in (p for p in self.parameters.values() if p.name not in functions):
            truth = [] if p.truth is None else [f"{p.truth:.6g}"]
            yield [p.name, concise(p.value, p.sigma), p.unit, relative(p.value, p.sigma), *truth]


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """A scenario that was simulated: a log as a robot would give it, and the truth behind it."""

    run: Run
    """The simulation: true positions, velocities and torques."""
    robot: RobotModel
    """The robot, to identify the log with."""

    @property
    def log(self) -> MotionLog:
        """What the robot logged."""
        return self.run.alone()

    @property
    def truth(self) -> dict[str, float]:
        """The true parameters of the robot, by name."""
        return self.robot.truth(self.run.robots[0], self.run.scenario.friction)

    def __repr__(self) -> str:
        rows = [[name, f"{x:.6g}", unit] for (name, x), unit in zip(self.truth.items(), self.robot.basis.units, strict=True)]
        return text_table(f"scenario {self.run.scenario.name}: {self.log!r}", ["", "truth", "unit"], rows)
