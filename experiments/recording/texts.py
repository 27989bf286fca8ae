"""Texts in recordings."""

from collections.abc import Iterator, Sequence
from itertools import chain

from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.lack import lacking
from idbench.experiments.reports.estimates import EstimatesTable, markdown

WHERE = {"velocity": "friction", "position": "friction", "load": "friction", "time": "parameters"}
"""Tabs that show what residuals depend on."""


def estimates_table(fit: Fit) -> str:
    """Return estimates, with error or sigma, as a markdown table."""
    table = EstimatesTable(fit)
    made = markdown(_title(fit), [" ".join(head) for head in table.heads], chain(table.rows(), table.whole()))
    return f"{made}\n\n{_escaped(table.legend)}"


def short_table(fit: Fit) -> str:
    """Return the estimates of the models alone, beside the truth if it is known, as a markdown table."""
    table, known = EstimatesTable(fit), ["true"] * (fit.truth is not None)
    found = [f"{markdown(_title(fit), [*known, *fit.estimates], table.short())}", _escaped(table.legend), *_pointers(fit)]
    return "\n\n".join(filter(None, found))


def _escaped(text: str) -> str:
    """Return a text whose stars Markdown leaves alone."""
    return text.replace("*", "\\*")


def _pointers(fit: Fit) -> Iterator[str]:
    """Yield where to look at what the fit lacks."""
    wrong = lacking(fit.lack)
    for over, tab in WHERE.items():
        if joints := [fit.robot_model.robot.joints[lack.joint] for lack in wrong if lack.over == over]:
            yield f"The residual torque of {', '.join(joints)} depends on {over}: tab *{tab}*."


def noise_table(fit: Fit, joints: Sequence[str]) -> str:
    """Return the noise found in the log, joint by joint, as a markdown table."""
    every = zip(joints, *(fit.noise[name] for name in ("torque", "position", "encoder_step")), strict=True)
    rows = ([joint, *("" if x is None else f"{x:.2g}" for x in values)] for joint, *values in every)
    return markdown("Noise found in the log, rms", ["torque [N m]", "position [rad]", "encoder step [rad]"], rows)


def _title(fit: Fit) -> str:
    return f"Chain **{fit.request.chain}**, {fit.request.estimator}"


DRAWN = {
    "true": "where it is",
    "planned": "yellow wires where it was planned to be",
    "measured": "blue wires where its encoders see it",
}
"""How arms are drawn; the first of a recording is solid."""


def about(name: str, origin: str, roles: Sequence[str]) -> str:
    """Return what a recording shows, with the arms of these roles."""
    first = "where its encoders see it" if roles[0] == "measured" else DRAWN[roles[0]]
    arms = ", ".join([f"The arm is solid {first}", *(DRAWN[role] for role in roles[1:])])
    kinds = "Planned or asked for: broad and light. Measured or logged: thin and light. True: in the joint's own colour."
    return "\n\n".join(filter(None, [f"# {name}", origin, f"{arms}.", kinds]))
