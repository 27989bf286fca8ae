"""Reports of servos and payloads: verdict, parameters, pictures; one HTML file that needs no other."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from idbench.experiments.loads.job import GainsFit, PayloadFit
from idbench.experiments.loads.loads_text import UNITS
from idbench.experiments.reports.figures import color_of, rendered
from idbench.experiments.reports.panels import Panel, figure
from idbench.experiments.servo.identification import unit_of
from idbench.experiments.servo.job import ServosFit
from idbench.experiments.servo.servo_text import value_of, warnings_of
from idbench.identify.loads.loaded_robot import LETTERS
from idbench.identify.loads.payload import PayloadEstimate
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.tables import concise

COMMAND, MEASURED = "#c9a227", "#8c8c8c"
"""Colours of positions; those simulated have the explicit model's."""


def report_of_servos(made: ServosFit, notes: Sequence[str], command: str) -> str:
    """Return the page of identified servos: verdicts, parameters, positions of the last log and their errors."""
    judged = made.others or made.servos
    path, columns = list(judged.logs.items())[-1]
    simulated = judged.simulated(made.fits, path)
    place = {joint: judged.place(joint) for joint in made.fits}
    moved, off = list[Panel](), list[Panel]()
    for joint, q in simulated.items():
        measured, commanded = columns.q[:, place[joint]], columns.command[:, place[joint]]
        panel, error = Panel(joint), Panel(joint)
        panel.line(columns.t, commanded, COMMAND, 1.0, "command")
        panel.line(columns.t, measured, MEASURED, 2.4, "measured")
        panel.line(columns.t, q, color_of("explicit"), 1.0, "simulated from the commands")
        error.line(columns.t, measured - q, color_of("explicit"), 0.8)
        moved.append(panel)
        off.append(error)
    rows = [
        [joint, name, value_of(fit, name), unit_of(fit.servo, name)]
        for joint, fit in made.fits.items()
        for name in SERVO_PARAMETERS
        if name in fit.p
    ]
    name = judged.name(path)
    return _page(
        f"{made.servos.robot}: {', '.join(made.fits)}",
        ", ".join(dict.fromkeys(f"driven by {fit.servo.kind}" for fit in made.fits.values())),
        verdicts=made.verdicts,
        warnings={"the servos": warnings_of(made.every, made.mistakes)},
        tables=[("Parameters", ["joint", "parameter", "value", "unit"], rows)],
        figures=[
            (f"Positions: {name}", figure(moved, 1.6, "time [s]", "position [rad]")),
            (f"Errors: {name}", figure(off, 1.35, "time [s]", "measured - simulated [rad]")),
        ],
        notes=notes,
        command=command,
    )


def report_of_load(made: PayloadFit | GainsFit, command: str) -> str:
    """Return the page of a payload, or of gains: verdict, values, what one robot with one payload leaves of each log."""
    judgement = made.judgement
    warnings = judgement.warnings(made.leading if isinstance(made, PayloadFit) else None)
    joints = judgement.request.robot_model.robot.joints
    if isinstance(made, PayloadFit):
        ways = {way: found for way, found in made.found.items() if isinstance(found, PayloadEstimate)}
        rows = [
            [name, *(concise(float(p.X[i]), float(p.sigma[i])) for p in ways.values()), _unit(name)]
            for i, name in enumerate(made.leading.names)
        ]
        table = f"Payload, about the origin of the frame of {joints[-1]}", ["parameter", *ways, "unit"], rows
    else:
        rows = [
            [joint, concise(gain, sigma) if told else "refused", f"{read:.5g}"]
            for joint, gain, sigma, told, read in zip(
                joints, *(x.tolist() for x in (made.found.gains, made.found.sigma, made.found.shown, made.given)), strict=True
            )
        ]
        table = "Gains of the drives: torque over what was logged", ["joint", "gain", "read with"], rows
    word = judgement.word(warnings)
    each = [(v.word, f"{log}: {v.word}: {'; '.join(v.reasons)}") for log, v in judgement.verdicts.items()]
    return _page(
        "payload" if isinstance(made, PayloadFit) else "gains of the drives",
        judgement.request.robot_model.name,
        verdicts=[(word, f"verdict: {word}"), *each],
        warnings=warnings,
        tables=[table],
        figures=[],
        notes=made.notes,
        command=command,
    )


def _page(title: str, subtitle: str, **words: Any) -> str:
    """Return a page of verdicts, warnings, tables, figures, notes and the command."""
    words["warnings"] = {about: said for about, said in words["warnings"].items() if said}
    own = {"title": title, "subtitle": subtitle, "version": version("idbench")}
    return rendered("idbench.experiments.reports", "plain.html.j2", **own, **words)


def _unit(name: str) -> str:
    return UNITS[LETTERS.index(name)] if name in LETTERS else ""
