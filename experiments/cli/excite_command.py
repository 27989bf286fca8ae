"""The command that designs motions."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path

from experiments.cli.excite import Excite
from experiments.cli.page import new_page, shown
from experiments.cli.progress import progress_of
from experiments.cli.reading import Question, file_of, read
from experiments.errors import ExperimentError
from experiments.excite.design import Design
from experiments.excite.excite_report import report
from experiments.excite.excite_text import print_excited
from experiments.excite.excited import Excited
from experiments.excite.motion_file import write_motion
from experiments.excite.sequence import Sequence, print_sequence
from experiments.identification.identified import Identified
from experiments.identification.results import Place, results_folder, tell_of, write_recording, write_summary
from experiments.identification.subject import Subject, absolute
from identify import MotionLog, TorqueChannel
from identify.data.log_file import write_log
from sim.encoders import IncrementalEncoder
from sim.planning.motion_limits import MotionLimits
from sim.scenario.measurement import TorqueMeasurement
from sim.scenario.scenario import Scenario
from sim.scenario.scenario_file import load, to_toml

LONGEST = 1000.0
"""Duration of a motion [s] above which it is taken for a slip."""


def excite(asked: Excite) -> None:
    """Design a motion, or a sequence of them, and write it."""
    design = _designed(asked)
    stem = Path(asked.robot).stem
    place = Place(asked.out or Path("runs") / f"excited-{stem}", "excite", stem, asked.force)
    place.check()
    page, lost = new_page(machine=asked.json), ""
    share = _percent(asked.until)
    with asked.watching.audience() as audience, shown(page):
        with results_folder(place) as folder, progress_of(f"designing a motion of {stem}") as progress:
            sequence = Sequence.of(design, share, progress) if share else None
            found = sequence.last if sequence else Excited.of(design, progress)
            print_excited(page, found)
            if sequence:
                print_sequence(page, sequence)
                for number, log in enumerate(sequence.logs, 1):
                    write_log(log, folder / f"log{number}.parquet")
            write_motion(found, folder / "motion.csv")
            (folder / "scenario.toml").write_text(to_toml(found.scenario))
            summary = found.summary() | (sequence.summary() if sequence else {})
            (folder / "report.html").write_text(report(found, _command(asked)), encoding="utf-8")
            page.found |= summary | {"folder": str(place.out)}
            write_summary(folder / "summary.json", summary)
            if asked.watching.rerun:
                from experiments.recording.excite_recording import record_excited

                lost = write_recording(folder, record_excited(found, audience))
        tell_of(lost, place.out)
        page.print(f"written to {place.out}{asked.watching.hint(place.out)}", soft_wrap=True)
        page.print(f"try it on the simulated robot: uv run idbench run {place.out / 'scenario.toml'}", soft_wrap=True)


def _designed(asked: Excite) -> Design:
    """Return what is asked, checked."""
    for name, value, most in (("duration", asked.duration, LONGEST), ("frequency", asked.frequency, asked.fs / 4)):
        if not (isfinite(value) and 0 < value <= most):
            raise ExperimentError(f"--{name} {value:g} must be above 0 and at most {most:g}")
    if asked.repeat < 1 or asked.seed < 0:
        raise ExperimentError(f"--repeat {asked.repeat} must be at least 1, and --seed {asked.seed} at least 0")
    subject = Subject(absolute(asked.robot), asked.parameters)
    limits = MotionLimits.read(asked.limits)
    return Design(
        robot=absolute(asked.robot),
        scenario=_scenario(asked, subject),
        kind=asked.kind,
        duration=asked.duration,
        frequency=asked.frequency,
        asked=limits,
        repeat=asked.repeat,
        seed=asked.seed,
        weights=_weights(asked.weigh),
        criterion=asked.criterion,
        logs=tuple(_log(path, subject) for path in asked.log),
        parameters=asked.parameters,
    )


def _scenario(asked: Excite, subject: Subject) -> Scenario:
    """Return what says how noisy the log will be, and how the motion is simulated."""
    if asked.noise is not None:
        return load(asked.noise)
    if not (isfinite(asked.encoder_bits) and 4 <= asked.encoder_bits <= 40):
        raise ExperimentError(f"--encoder-bits {asked.encoder_bits:g} must be between 4 and 40")
    if len(asked.torque_noise) not in (1, subject.robot.n):
        raise ExperimentError(
            f"--torque-noise has {len(asked.torque_noise)} values for {subject.robot.n} joints: give 1 or all"
        )
    lines = max(1, round(2**asked.encoder_bits / 4))
    return replace(
        load("ideal"),
        fs=asked.fs,
        encoder=IncrementalEncoder(lines=(lines,)),
        torque=TorqueMeasurement(noise=asked.torque_noise),
    )


def _weights(given: tuple[str, ...]) -> Mapping[str, float]:
    """Return weights by the names of parameters; raise ExperimentError if one is no number above 0."""
    found = {}
    for text in given:
        name, _, value = text.partition("=")
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
        raise ExperimentError(f"--until {text}: give a share between 0 and 100 %, such as 2%")
    return share


def _log(path: Path, subject: Subject) -> MotionLog:
    """Return an earlier log: of its torques nothing counts, so that their meaning is not asked for."""
    return read(file_of(path), Question(fallback=TorqueChannel("held")), Identified((), subject))[0]


def _command(asked: Excite) -> str:
    """Return what was asked, as a command."""
    words = ["uv run idbench excite", asked.robot, f"--duration {asked.duration:g}", f"--kind {asked.kind}"]
    words += [f"--frequency {asked.frequency:g}", f"--seed {asked.seed}", f"--criterion {asked.criterion}"]
    for name, value in (("repeat", asked.repeat if asked.repeat > 1 else ""), ("noise", asked.noise), ("limits", asked.limits)):
        words += [f"--{name} {value}"] if value else []
    if asked.noise is None:
        words += [f"--encoder-bits {asked.encoder_bits:g}", f"--torque-noise {' '.join(f'{x:g}' for x in asked.torque_noise)}"]
    words += [f"--{name} {' '.join(map(str, x))}" for name, x in (("log", asked.log), ("weigh", asked.weigh)) if x]
    return " ".join(words)
