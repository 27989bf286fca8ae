"""The files that an identification can be written to, and their table."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from idbench.experiments.exports.base_parameters import interval_of, json_text
from idbench.experiments.exports.c_code import c_texts
from idbench.experiments.exports.code import Content
from idbench.experiments.exports.functions import require_formulas
from idbench.experiments.exports.python_code import python_text
from idbench.experiments.exports.robots import Exported, actuators, mjcf, origin, sdf, urdf
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.results.writing import require_free, require_free_folder
from idbench.sim.robot.rewrite import rewritten

FOLDER = ".ensemble"  # Ending of the name of a folder with robots


@dataclass(frozen=True)
class FileKind:
    """A kind of file."""

    what: str
    """What is in it, for a sentence."""
    render: Callable[[Fit, str, Path], Exported]
    """Returns the texts, with the parameters of a model."""
    require: Callable[[RobotModel, Path], object]
    """Raises an error before the work if a robot cannot be written so."""
    beside: tuple[str, ...] = ()
    """What replaces the ending in the names of the files that are written beside it."""

    def require_free(self, path: Path, option: str, *, force: bool, read: Sequence[Path] = ()) -> None:
        """Raise ResultsError if one of the files may not be written."""
        if path.suffix == FOLDER:
            require_free_folder(path, option, force=force)
            return
        for target in self.paths(path):
            require_free(target, option, force=force, read=read)

    def paths(self, path: Path) -> Iterator[Path]:
        """Yield all files that are written."""
        yield path
        yield from (path.with_name(path.stem + ending) for ending in self.beside)


def base_parameters(fit: Fit, model: str, path: Path) -> Exported:
    """Return base parameters, their covariance and what the regressor is made of."""
    return Exported({path: json_text(fit, model)})


def python_module(fit: Fit, model: str, path: Path) -> Exported:
    """Return the functions of the robot as a module of Python."""
    return Exported({path: python_text(_content(fit, model, path))})


def c_source(fit: Fit, model: str, path: Path) -> Exported:
    """Return the functions of the robot in C, and their header."""
    return Exported({path.with_suffix(end): x for end, x in c_texts(_content(fit, model, path), path).items()})


def ensemble(fit: Fit, model: str, path: Path) -> Exported:
    """Return robots drawn from what the estimate leaves open, in a folder."""
    from idbench.experiments.exports.ensemble import ensemble_of, notes, robot_texts

    drawn = ensemble_of(fit, model)
    return Exported(robot_texts(drawn, path), WrittenRobot(fit, model).warnings, notes(drawn))


def training_ranges(fit: Fit, model: str, path: Path) -> Exported:
    """Return ranges of what the estimate leaves open, and code that takes them."""
    from idbench.experiments.exports import ranges
    from idbench.experiments.exports.ensemble import ensemble_of, notes

    drawn = ensemble_of(fit, model)
    return Exported(ranges.texts(drawn, path), WrittenRobot(fit, model).warnings, notes(drawn))


def _content(fit: Fit, model: str, path: Path) -> Content:
    estimate = fit.estimates[model]
    functions = require_formulas(estimate.problem.basis, fit.robot_model.tree, path)
    return Content(
        functions, estimate.X.tolist(), estimate.standard_errors.tolist(), interval_of(fit, model), origin(fit, model)
    )


def require_functions(robot_model: RobotModel, path: Path) -> None:
    """Raise ExperimentError if a part of the robot cannot be written as formulas."""
    require_formulas(robot_model.basis, robot_model.tree, path)


def require_written_back(robot_model: RobotModel, path: Path) -> None:
    """Raise BenchError if the file of a robot cannot be written with parameters of one's own choice."""
    rewritten(robot_model.name, {}, path.absolute().parent, robot_model.mounting)


def require_nothing(robot_model: RobotModel, path: Path) -> None:
    """Accept all robots."""
    del robot_model, path


CODE = ("_mjlab.py", "_isaaclab.py", "_playground.py", "_band.svg")
"""Endings of the code beside ranges, and of the picture of free runs."""

EXPORTS: dict[str, FileKind] = {
    ".xml": FileKind("the robot", mjcf, require_written_back),
    ".urdf": FileKind("the robot", urdf, require_written_back),
    ".sdf": FileKind("the robot", sdf, require_written_back),
    ".yaml": FileKind("values of the joints' actuators", actuators, require_written_back),
    ".json": FileKind("base parameters and regressor", base_parameters, require_nothing),
    ".py": FileKind("dynamics and regressors in Python", python_module, require_functions),
    ".c": FileKind("dynamics and regressors in C, with their header,", c_source, require_functions, (".h",)),
    ".toml": FileKind("ranges, with code for training,", training_ranges, require_written_back, CODE),
    FOLDER: FileKind("robots drawn from what is not known", ensemble, require_written_back),
}
"""What is written, by the ending of its name."""
