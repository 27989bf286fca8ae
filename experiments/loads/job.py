"""The jobs `payload` and `gains`: a request becomes logs with a payload and without it, and what follows from them."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.document import Conclusion, Document, Listing
from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.friction_choice import chosen_friction, words
from idbench.experiments.identification.load import in_band, load
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.loads import loads_text as text
from idbench.experiments.loads.known_load import PAYLOAD, LoadJudgement, payload_parameters
from idbench.experiments.requests.jobs import GainsRequest, LoadRequest, PayloadRequest
from idbench.experiments.text import printed
from idbench.identify import Array
from idbench.identify.loads.drive_gains import GainEstimate, identify_drive_gains
from idbench.identify.loads.loaded_robot import LETTERS, LoadedRobot
from idbench.identify.loads.payload import WAYS, PayloadEstimate, with_known_robot

GAIN_STEP = 1e-3
"""Relative change of a gain by which derivatives are taken: small beside what changes weights, large beside rounding."""

OF_GAINS = "sigma of the payload has no part of an error of the torque constants (--gain-sigma), which looks like mass"


@dataclass(frozen=True, eq=False, repr=False)
class LoadFit:
    """What logs with a payload and logs without it show: the payload, or the gains of the drives."""

    judgement: LoadJudgement
    """The robot with its logs, read with the gains that were found."""
    found: PayloadEstimate | GainEstimate
    """The payload, or the gains."""
    headline: str
    """The same in a line."""
    step: str
    """What to do with it, if it is good."""
    listing: Listing
    """The same as a table."""
    lines: tuple[str, ...]
    """What belongs to the table, and what was read, done and assumed."""
    content: Mapping[str, Any]
    """What was found, for summary.json."""
    leading: PayloadEstimate | None = None
    """The payload by the first way that gives one."""
    gains: Array | None = None
    """The gains to read logs with: those that the logs show, otherwise the given ones, shape (joint,)."""
    doubts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Gains of which the payload says nothing."""

    @cached_property
    def document(self) -> Document:
        """What the fit says, judged."""
        judgement, robot = self.judgement, self.judgement.request.robot_model.name
        warnings = judgement.warnings(self.leading)
        word = judgement.word(warnings)
        each = [(v.word, f"{log}: {v.word}: {'; '.join(v.reasons)}") for log, v in judgement.verdicts.items()]
        every = {**warnings, **self.doubts}
        doubts = [text for about in (PAYLOAD, *every) for text in every[about]] if word != "good" else []
        answer = Conclusion(word, f"Result: {word}: {self.headline}", [*doubts, self.step][0])
        return Document(
            self.listing.title, Path(robot).name, answer, each, {**self.doubts, **warnings}, [self.listing], self.lines
        )

    def summary(self) -> dict[str, Any]:
        """The summary.json of the command, but for the names of files."""
        logs = {name: verdict.summary() for name, verdict in self.judgement.verdicts.items()}
        return {
            **self.content,
            "conclusion": (answer := self.document.conclusion).summary(),
            "judgement": {"verdict": answer.word, "logs": logs},
        }

    def show(self, console: Console) -> None:
        """Print what was found."""
        self.listing.show(console)
        for line in self.lines:
            console.print(Text(line), soft_wrap=True)

    def __repr__(self) -> str:
        return printed(self.show)


def payload_of(asked: PayloadRequest) -> LoadFit:
    """The payload in the gripper.

    ExperimentError, IdentificationError or BenchError if something is wrong with the request or its logs, or no way gives one.
    """
    if asked.before is not None and asked.unloaded:
        raise ExperimentError("--before and --unloaded both say what the robot is: give one")
    if asked.before is not None and asked.gain_sigma:
        raise ExperimentError("--gain-sigma needs the logs without the payload: give --unloaded instead of --before")
    judgement, notes = _loaded(asked)
    robot, n = judgement.robot, judgement.robot.tree.n
    if len(asked.gain_sigma) not in (0, 1, n) or not all(0 <= x < 1 for x in asked.gain_sigma):
        given = " ".join(f"{x:g}" for x in asked.gain_sigma)
        raise ExperimentError(f"--gain-sigma {given}: give a share from 0 to 1, for all {n} joints or for each")
    if asked.before is None:
        notes = (*notes, f"{OF_GAINS}; a payload of known mass shows them: {judgement.gains_command}")
        return _payload(judgement, notes if not asked.gain_sigma else notes[:-1], asked.way, _by_way(judgement, asked))
    names, X, C = _before(asked.before)
    if missing := [name for name in names if name not in robot.robot.names]:
        raise ExperimentError(
            f"--before {asked.before} is of another robot, or of other laws of friction: this one has no "
            f"{', '.join(missing[:3])}; give the options of that identification, such as --add offset or --friction"
        )
    judgement = replace(judgement, before=dict(zip(names, X.tolist(), strict=True)))
    return _payload(judgement, notes, "fixed", with_known_robot(robot, names, X, C))


def _payload(judgement: LoadJudgement, notes: Sequence[str], way: str, leading: PayloadEstimate) -> LoadFit:
    robot_model = judgement.request.robot_model
    lines = (*text.payload_lines(leading), *notes)
    content = {"robot": robot_model.name, **text.payload_summary(way, leading)}
    table = text.payload_table(way, leading, robot_model.robot.joints[-1])
    step = "--write arm-with-load.xml adds the payload to the robot's file"
    return LoadFit(judgement, leading, text.words_of_payload(leading), step, table, lines, content, leading)


def gains_of(asked: GainsRequest) -> LoadFit:
    """Torque constants of the drives.

    ExperimentError, IdentificationError or BenchError if something is wrong with the request or its logs.
    """
    if asked.known.mass is None:
        raise ExperimentError("--mass is missing: the gains follow from a payload whose mass is known")
    judgement, notes = _loaded(asked)
    robot = judgement.robot
    found = identify_drive_gains(robot)
    given = np.broadcast_to(robot.loaded[0].torque.gain, (robot.tree.n,)) * judgement.gain
    found = replace(found, gains=found.gains * judgement.gain, sigma=found.sigma * judgement.gain)
    gains, robot_model = np.where(found.shown, found.gains, given), judgement.request.robot_model
    joints = robot_model.robot.joints
    return LoadFit(
        judgement.with_gains(gains / given),
        found,
        text.words_of_gains(found, given, joints),
        f"--gain {' '.join(f'{gain:.5g}' for gain in gains)} reads logs with these gains",
        text.gains_table(found, given.tolist(), joints),
        notes,
        {"robot": robot_model.name, **text.gains_summary(found, given.tolist(), joints)},
        gains=gains,
        doubts={"the gains": text.doubts_of_gains(found, joints)},
    )


def _loaded(asked: LoadRequest) -> tuple[LoadJudgement, tuple[str, ...]]:
    """Return the robot with its logs, to be judged, and what was done to them."""
    if not asked.log:
        raise ExperimentError("name the logs with the payload")
    if asked.robot is None:
        raise ExperimentError("--robot is missing: the file that describes the arm, or the name of one that ships")
    known = payload_parameters(asked.known.mass, asked.known.at, asked.known.inertia)
    robot_model = RobotModel(absolute(asked.robot), asked.parameters, asked.mounting.mounting)
    request = Request(
        robot_model, models=("explicit",), method=Method.named(estimator=asked.estimator), mask_speed=asked.mask_speed
    )
    if asked.cutoff is not None:
        request = in_band(request, asked.cutoff)
    paths, band, first = (*asked.unloaded, *asked.log), asked.cutoff is None, len(asked.unloaded)
    loaded = load(paths, asked, request, band=band, more=len(LETTERS), alike=first or None)
    request, notes = loaded.request, list(loaded.notes)
    without, with_it = loaded.logs(slice(first)), loaded.logs(slice(first, None))
    if robot_model.laws.auto or robot_model.laws.smooth:
        request, choice = chosen_friction(request, without or with_it)
        notes += words(choice, request.robot_model.laws.names, robot_model.robot.joints)
    tree, standard = request.robot_model.tree, request.robot_model.grouping.standard
    robot = LoadedRobot(tree, standard, without, with_it, request.processing, request.method.estimator, known)
    gain = np.array(loaded.read[-1].columns.gain or 1.0)
    return LoadJudgement(robot, request, loaded.names, gain, _gains_command(asked)), tuple(notes)


def _by_way(judgement: LoadJudgement, asked: PayloadRequest) -> PayloadEstimate:
    """Return the payload; its covariance has what torque constants contribute: C + sum over joints sigma^2 dX/dg (dX/dg)'."""
    if not judgement.robot.without:
        raise ExperimentError("give logs without the payload (--unloaded), or the robot as it was identified before (--before)")
    sigma, way = np.broadcast_to(asked.gain_sigma or 0.0, judgement.robot.tree.n), WAYS[asked.way]
    found, C = way(judgement.robot), 0.0
    for j in np.flatnonzero(sigma):
        ratio = np.ones(len(sigma))
        ratio[j] += GAIN_STEP
        slope = (way(judgement.with_gains(ratio).robot).X - found.X) / GAIN_STEP
        C = C + sigma[j] ** 2 * np.outer(slope, slope)
    return replace(found, covariance=found.covariance + C)


def _gains_command(asked: LoadRequest) -> str:
    """Return the command that identifies the torque constants from the same logs."""
    words = ["uv", "run", "idbench", "gains", *map(str, asked.log), "--unloaded", *map(str, asked.unloaded)]
    words += ["--robot", str(asked.robot)]
    for option, value in (("--torque", asked.torque), ("--torque-delay", asked.torque_delay)):
        words += [option, value] if value else []
    words += ["--resample"] if asked.reading.resample else []
    stated = [f"{asked.known.mass:g}"] if asked.known.mass else ["KG"]
    at = [f"{x:g}" for x in asked.known.at] if asked.known.at else ["X", "Y", "Z"]
    return shlex.join([*words, "--mass", *stated, "--at", *at])


def _before(path: Path) -> tuple[tuple[str, ...], Array, Array]:
    """Return names, values and covariance of base parameters in a file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        parameters = content["parameters"]
        names = tuple(str(p["name"]) for p in parameters)
        X, C = np.array([float(p["value"]) for p in parameters]), np.array(content["covariance"], dtype=np.float64)
        if C.shape != (len(names),) * 2 or any(p["column"] is None for p in parameters):
            raise ValueError
    except OSError as error:
        raise ExperimentError(f"--before {path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ExperimentError(
            f"--before {path} holds no base parameters of an arm with their covariance: make it by idbench identify ... "
            "--write FILE.json"
        ) from error
    return names, X, C
