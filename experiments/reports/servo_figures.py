"""Pictures of servos for pages."""

from idbench.experiments.reports.figures import color_of
from idbench.experiments.reports.panels import Panel, figure
from idbench.experiments.servo.job import ServosFit

COMMAND, MEASURED = "#c9a227", "#8c8c8c"
"""Colours of positions; those simulated have the explicit model's."""


def servo_figures(made: ServosFit) -> list[tuple[str, str]]:
    """Titles and pictures of the positions of the last log, and of their errors."""
    judged = made.others or made.servos
    path, columns = list(judged.logs.items())[-1]
    moved, off = list[Panel](), list[Panel]()
    for joint, q in judged.simulated(made.fits, path).items():
        place = judged.place(joint)
        measured, panel, error = columns.q[:, place], Panel(joint), Panel(joint)
        panel.line(columns.t, columns.command[:, place], COMMAND, 1.0, "command")
        panel.line(columns.t, measured, MEASURED, 2.4, "measured")
        panel.line(columns.t, q, color_of("explicit"), 1.0, "simulated from the commands")
        error.line(columns.t, measured - q, color_of("explicit"), 0.8)
        moved.append(panel)
        off.append(error)
    name = judged.name(path)
    return [
        (f"Positions: {name}", figure(moved, 1.6, "time [s]", "position [rad]")),
        (f"Errors: {name}", figure(off, 1.35, "time [s]", "measured - simulated [rad]")),
    ]
