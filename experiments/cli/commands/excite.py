"""The command that designs motions."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from idbench.experiments.cli.command_text import command_of
from idbench.experiments.cli.options.excite import Excite
from idbench.experiments.cli.page import new_page, progress_of, shown
from idbench.experiments.cli.saving import Files, saved, write_scenario
from idbench.experiments.errors import ExperimentError
from idbench.experiments.excite.design import Design
from idbench.experiments.excite.excited import Excited
from idbench.experiments.excite.motion_file import write_motion
from idbench.experiments.excite.sequence import MotionSequence
from idbench.experiments.identification.reading import ReadOptions, file_of, read
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel, absolute
from idbench.experiments.judgement.warnings import FILE, warnings_of_robot
from idbench.experiments.recording.audience import Audience
from idbench.experiments.reports.excite import print_excited, print_sequence
from idbench.experiments.results.folder import ResultsFolder
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import write_log
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.limits.motion_limits import MotionLimits, limits_of, looser
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load

if TYPE_CHECKING:
    from idbench.experiments.recording.folder import Streams

LONGEST, FASTEST = 3600.0, 10000.0
"""Time of a motion, repeated [s], and sampling frequency [Hz] above which they are taken for a slip."""

BITS, TORQUE_NOISE, QUIET, LOUD = 17.0, (0.05,), 1e-6, 1e6
"""Noise without a scenario: resolution of the encoders [bits], rms of the torques [N m]; and the least and most of that."""


LEFT_OUT = ("out", "force", "json", "watching")
"""Options that make no difference to a motion, or stand elsewhere in the command."""


def excite(options: Excite) -> None:
    """Design a motion, or a sequence of them, save and show it."""
    design, stem, share = _designed(options), Path(options.robot).stem, _percent(options.until)
    command = command_of("excite", options, "robot", ("force", "json", "watching"))
    whole = command_of("excite", options, "robot", LEFT_OUT, absolute=True)
    read = (Robot.path(options.robot), *options.log, *([options.limits] if options.limits else []))
    folder = ResultsFolder(options.out or Path("runs") / f"excited-{stem}", "excite", whole, options.force, read)
    page = new_page(machine=options.json)
    with options.watching.audience() as audience, shown(page), folder.held():
        with progress_of(f"designing a motion of {stem}") as progress:
            sequence = MotionSequence.of(design, share, progress) if share else None
            found = sequence.last if sequence else Excited.of(design, progress)
            print_excited(page, found)
        page.warn({FILE: warnings_of_robot(design.robot_model.robot), "limits": looser(design.robot_model.robot, design.asked)})
        if sequence:
            print_sequence(page, sequence)
        what, hint = command.removeprefix("uv run idbench excite "), options.watching.hint(folder.out)
        summary = found.summary() | {"path": what} | (sequence.summary() if sequence else {})
        with saved(page, folder, summary, _files(found, sequence), hint) as attempts:
            attempts.file("report.html", lambda: _report(found, command))
            if options.watching.rerun:
                attempts.recording(lambda: _recorded(found, audience))
        page.print(f"try it on the simulated robot: uv run idbench run {folder.out / 'scenario.toml'}", soft_wrap=True)


def _files(found: Excited, sequence: MotionSequence | None) -> Files:
    """Return what writes motions, logs and scenario."""
    files = dict[str, Callable[[Path], object]]()
    for number, each in enumerate(sequence.rounds if sequence else (), 1):
        files[f"log{number}.parquet"] = partial(write_log, each.log)
        files[f"motion{number}.csv"] = partial(write_motion, each.excited)
    return files | {"motion.csv": partial(write_motion, found), "scenario.toml": partial(write_scenario, found.scenario)}


def _report(found: Excited, command: str) -> str:
    from idbench.experiments.reports.excite import report

    return report(found, command)


def _recorded(found: Excited, audience: Audience | None) -> "Streams":
    from idbench.experiments.recording.excite_recording import record_excited

    return record_excited(found, audience)


def _designed(options: Excite) -> Design:
    """Return what is asked for, checked."""
    if options.fs is not None:
        _require_between("fs", options.fs, 10, FASTEST)
    scenario = _scenario(options)
    _require_between("duration", options.duration, 0, LONGEST)
    _require_between("frequency", options.frequency, 0, scenario.fs / 4)
    _require_between("repeat", options.repeat, 1, max(1.0, LONGEST // options.duration))
    if options.seed < 0:
        raise ExperimentError(f"--seed {options.seed} must be at least 0")
    if options.until is not None and options.log:
        raise ExperimentError("--until simulates its own logs: leave --log out")
    robot_model, limits = RobotModel(absolute(options.robot), options.parameters), _limits(options)
    limits_of(robot_model.robot, limits)  # what is missing is said before the parameters are grouped
    robot_model.require_linear()
    if len(options.torque_noise) not in (0, 1, robot_model.robot.n):
        count = len(options.torque_noise)
        raise ExperimentError(
            f"--torque-noise has {count} values for {robot_model.robot.n} joints: give one for all, or one per joint"
        )
    return Design(
        robot=absolute(options.robot),
        scenario=scenario,
        kind=options.kind,
        duration=options.duration,
        frequency=options.frequency,
        asked=limits,
        repeat=options.repeat,
        seed=options.seed,
        weights=_weights(options.weigh),
        criterion=options.criterion,
        logs=tuple(_log(path, robot_model) for path in options.log),
        parameters=options.parameters,
    )


def _require_between(name: str, value: float, least: float, most: float) -> None:
    if not (least <= value <= most and value > 0):
        above = f"at least {least:g}" if least else "above 0"
        raise ExperimentError(f"--{name} {value:g} must be {above} and at most {most:g}")


def _limits(options: Excite) -> MotionLimits:
    """Return what a motion must keep: options before the file of --limits."""
    limits = MotionLimits.read(options.limits)
    for name in ("velocity", "acceleration"):
        values: tuple[float, ...] = getattr(options, name)
        if wrong := [x for x in values if not 0 < x < float("inf")]:
            raise ExperimentError(f"--{name} {wrong[0]:g} must be a number above 0")
        if values:
            limits = replace(limits, **{name: values})  # type: ignore[arg-type]  # of one of these names
    return limits


def _scenario(options: Excite) -> Scenario:
    """Return what says how noisy the log will be, and how the motion is simulated: options before the scenario's own."""
    scenario = load(options.noise or "ideal")
    bits = options.encoder_bits if options.encoder_bits is not None or options.noise else BITS
    noise = options.torque_noise or (() if options.noise else TORQUE_NOISE)
    if bits is not None:
        _require_between("encoder-bits", bits, 4, 40)
        scenario = replace(scenario, encoder=IncrementalEncoder(lines=(max(1, round(2**bits / 4)),)))
    if noise:
        if not all(QUIET <= x <= LOUD for x in noise):
            given = " ".join(f"{x:g}" for x in noise)
            raise ExperimentError(f"--torque-noise {given} must be at least {QUIET:g} and at most {LOUD:g} N m")
        scenario = replace(scenario, torque=TorqueMeasurement(noise=noise))
    elif not max(scenario.torque.noise):
        raise ExperimentError(f"scenario {options.noise} has no torque noise: add --torque-noise, such as 0.05")
    return scenario if options.fs is None else replace(scenario, fs=options.fs)


def _weights(given: tuple[str, ...]) -> Mapping[str, float]:
    """Return weights by the names of parameters; raise ExperimentError if one is no number above 0."""
    found = dict[str, float]()
    for text in given:
        name, _, value = text.partition("=")
        if name in found:
            raise ExperimentError(f"--weigh gives {name} twice")
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = -1.0
        if not 1e-6 <= found[name] <= 1e6:
            raise ExperimentError(f"--weigh {text}: give a parameter and a weight from 1e-6 to 1e6, such as LMY2=4")
    return found


def _percent(text: str | None) -> float | None:
    """Return a share given in percent."""
    if text is None:
        return None
    try:
        share = float(text.removesuffix("%")) / 100
    except ValueError:
        share = -1.0
    if not 0 < share < 1:
        raise ExperimentError(f"--until {text}: give a share between 0 and 100 %, such as 0.1%")
    return share


def _log(path: Path, robot_model: RobotModel) -> MotionLog:
    """Return an earlier log: of its torques nothing counts, so that their meaning is not asked for."""
    return read(file_of(path), ReadOptions(fallback=TorqueChannel("held")), Request(robot_model)).longest
