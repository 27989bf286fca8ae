"""The command that designs motions."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path

from experiments.cli.command_text import command_of
from experiments.cli.excite import Excite
from experiments.cli.page import new_page, shown
from experiments.cli.progress import progress_of
from experiments.cli.reading import Question, file_of, read
from experiments.errors import ExperimentError
from experiments.excite.design import Design
from experiments.excite.excite_report import report
from experiments.excite.excite_text import print_excited, print_sequence
from experiments.excite.excited import Excited
from experiments.excite.motion_file import write_motion
from experiments.excite.sequence import MotionSequence
from experiments.identification.identified import Identified
from experiments.identification.results import Place, results_folder, tell_of, write_recording, write_summary
from experiments.identification.subject import Subject, absolute
from experiments.identification.warnings import FILE, warnings_of_robot
from identify import MotionLog, TorqueChannel
from identify.files.log_file import write_log
from sim.encoders import IncrementalEncoder
from sim.limits.motion_limits import MotionLimits, looser
from sim.scenario.measurement import TorqueMeasurement
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import load, to_toml

LONGEST, FASTEST = 3600.0, 10000.0
"""Time of a motion, repeated [s], and sampling frequency [Hz] above which they are taken for a slip."""

BITS, TORQUE_NOISE, QUIET = 17.0, (0.05,), 1e-6
"""Noise without a scenario: resolution of the encoders [bits], rms of the torques [N m]; and the least of that."""


def excite(asked: Excite) -> None:
    """Design a motion, or a sequence of them, and write it."""
    design = _designed(asked)
    stem = Path(asked.robot).stem
    what = _command(asked).removeprefix("uv run idbench excite ")
    place = Place(asked.out or Path("runs") / f"excited-{stem}", "excite", what, asked.force)
    place.check()
    page, lost = new_page(machine=asked.json), ""
    share = _percent(asked.until)
    with asked.watching.audience() as audience, shown(page):
        with results_folder(place) as folder, progress_of(f"designing a motion of {stem}") as progress:
            sequence = MotionSequence.of(design, share, progress) if share else None
            found = sequence.last if sequence else Excited.of(design, progress)
            print_excited(page, found)
            page.warn({FILE: warnings_of_robot(design.subject.robot), "limits": looser(design.subject.robot, design.asked)})
            if sequence:
                print_sequence(page, sequence)
                for number, each in enumerate(sequence.rounds, 1):
                    write_log(each.log, folder / f"log{number}.parquet")
                    write_motion(each.excited, folder / f"motion{number}.csv")
            write_motion(found, folder / "motion.csv")
            (folder / "scenario.toml").write_text(to_toml(found.scenario))
            summary = found.summary() | {"path": what} | (sequence.summary() if sequence else {})
            (folder / "report.html").write_text(report(found, _command(asked)), encoding="utf-8")
            page.found |= summary | {"folder": str(place.out)}
            write_summary(folder / "summary.json", summary)
            if asked.watching.rerun:
                from experiments.recording.excite_recording import record_excited

                lost = write_recording(folder, record_excited(found, audience))
        _forget(place.out, len(sequence.rounds) if sequence else 0)
        tell_of(lost, place.out)
        page.print(f"written to {place.out}{asked.watching.hint(place.out)}", soft_wrap=True)
        page.print(f"try it on the simulated robot: uv run idbench run {place.out / 'scenario.toml'}", soft_wrap=True)


def _forget(folder: Path, rounds: int) -> None:
    """Remove what an earlier and longer sequence left in the folder."""
    for path in (*folder.glob("log[0-9]*.parquet"), *folder.glob("motion[0-9]*.csv")):
        if int("".join(c for c in path.stem if c.isdigit())) > rounds:
            path.unlink()


def _designed(asked: Excite) -> Design:
    """Return what is asked, checked."""
    if asked.fs is not None:
        _require_between("fs", asked.fs, 10, FASTEST)
    scenario = _scenario(asked)
    _require_between("duration", asked.duration, 0, LONGEST)
    _require_between("frequency", asked.frequency, 0, scenario.fs / 4)
    _require_between("repeat", asked.repeat, 1, max(1.0, LONGEST // asked.duration))
    if asked.seed < 0:
        raise ExperimentError(f"--seed {asked.seed} must be at least 0")
    if asked.until is not None and asked.log:
        raise ExperimentError("--until simulates its own logs: leave --log out")
    subject = Subject(absolute(asked.robot), asked.parameters)
    subject.require_linear()
    if len(asked.torque_noise) not in (0, 1, subject.robot.n):
        count = len(asked.torque_noise)
        raise ExperimentError(
            f"--torque-noise has {count} values for {subject.robot.n} joints: give one for all, or one a joint"
        )
    return Design(
        robot=absolute(asked.robot),
        scenario=scenario,
        kind=asked.kind,
        duration=asked.duration,
        frequency=asked.frequency,
        asked=MotionLimits.read(asked.limits),
        repeat=asked.repeat,
        seed=asked.seed,
        weights=_weights(asked.weigh),
        criterion=asked.criterion,
        logs=tuple(_log(path, subject) for path in asked.log),
        parameters=asked.parameters,
    )


def _require_between(name: str, value: float, least: float, most: float) -> None:
    if not (least <= value <= most and value > 0):
        above = f"at least {least:g}" if least else "above 0"
        raise ExperimentError(f"--{name} {value:g} must be {above} and at most {most:g}")


def _scenario(asked: Excite) -> Scenario:
    """Return what says how noisy the log will be, and how the motion is simulated: options before the scenario's own."""
    scenario = load(asked.noise or "ideal")
    bits = asked.encoder_bits if asked.encoder_bits is not None or asked.noise else BITS
    noise = asked.torque_noise or (() if asked.noise else TORQUE_NOISE)
    if bits is not None:
        _require_between("encoder-bits", bits, 4, 40)
        scenario = replace(scenario, encoder=IncrementalEncoder(lines=(max(1, round(2**bits / 4)),)))
    if noise:
        if not all(isfinite(x) and x >= QUIET for x in noise):
            raise ExperimentError(f"--torque-noise {' '.join(f'{x:g}' for x in noise)} must be at least {QUIET:g} N m")
        scenario = replace(scenario, torque=TorqueMeasurement(noise=noise))
    elif not max(scenario.torque.noise):
        raise ExperimentError(f"scenario {asked.noise} has no noise of its torques: add --torque-noise, such as 0.05")
    return scenario if asked.fs is None else replace(scenario, fs=asked.fs)


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
        if not (isfinite(found[name]) and found[name] > 0):
            raise ExperimentError(f"--weigh {text}: give a parameter and a weight above 0, such as LMY2=4")
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


def _log(path: Path, subject: Subject) -> MotionLog:
    """Return an earlier log: of its torques nothing counts, so that their meaning is not asked for."""
    return read(file_of(path), Question(fallback=TorqueChannel("held")), Identified((), subject)).longest


def _command(asked: Excite) -> str:
    """Return what was asked, as a command."""
    return command_of("excite", asked, "robot", LEFT_OUT)


LEFT_OUT = ("out", "force", "json", "watching")
"""Options that make no difference to a motion, or stand elsewhere in the command."""
