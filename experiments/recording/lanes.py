"""Lanes of states: what a joint does, what its drive does, and what identification makes of the instant."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
import numpy.typing as npt
import rerun as rr

from idbench.experiments.identification.fit import Fit
from idbench.experiments.recording.stream import Stream, time_columns
from idbench.experiments.reports.estimates import LEAST, EstimatesTable, models_apart
from idbench.experiments.text import MEASURED, PLANNED, STATES, Color, markdown
from idbench.identify import Array


def estimates_table(fit: Fit) -> str:
    """Return estimates, with error or sigma, as a markdown table."""
    table = EstimatesTable(fit)
    made = markdown(_title(fit), [" ".join(head) for head in table.heads], chain(table.rows(), table.whole()))
    return f"{made}\n\n{_escaped(table.legend)}"


def short_table(fit: Fit) -> str:
    """Return the estimates of the models alone, beside the truth if it is known, as a markdown table."""
    models, known = models_apart(fit), ["true"] * (fit.truth is not None)
    same = [f"{model}: the same to {LEAST:g} sigma" for model in fit.estimates if model not in models]
    table = EstimatesTable(fit, models)
    shown = markdown(_title(fit), [*known, *models], table.short())
    tab = {"friction": "friction", "drive": "friction"}  # residuals over what the mistake is one of
    where = [f"{cause.words}: tab *{tab.get(cause.suspect.of, 'parameters')}*." for cause in fit.diagnosis or ()]
    return "\n\n".join(filter(None, [shown, ", ".join(same), _escaped(table.legend), *where]))


def _escaped(text: str) -> str:
    """Return a text whose stars Markdown leaves alone."""
    return text.replace("*", "\\*")


def noise_table(fit: Fit, joints: Sequence[str]) -> str:
    """Return the noise found in the log, joint by joint, as a markdown table."""
    every = zip(joints, *(fit.noise[name] for name in ("torque", "position", "encoder_step")), strict=True)
    rows = ([joint, *("" if x is None else f"{x:.2g}" for x in values)] for joint, *values in every)
    return markdown("White noise of the log, rms", ["torque [N m]", "position [rad]", "encoder step [rad]"], rows)


def _title(fit: Fit) -> str:
    return f"Chain **{fit.request.method.chain_name}**, {fit.request.method.estimator_name}"


ROLES: dict[str, tuple[Color | None, str]] = {
    "true": (None, "where it is"),
    "planned": (PLANNED, "yellow wires where it was planned to be"),
    "measured": (MEASURED, "blue wires where its encoders see it"),
}
"""Arms that may be shown: the colour of those that are wires around the first, which is solid in its own, and words."""


def about(name: str, origin: str, roles: Iterable[str] = ROLES) -> str:
    """Content of a recording, with the arms of these roles."""
    first, *others = (ROLES[role][1] for role in roles)
    arms = ", ".join([f"The arm is solid {first.removeprefix('blue wires ')}", *others])
    kinds = "Planned or asked for: broad and light. Measured or logged: thin and light. True: in the joint's own colour."
    return "\n\n".join(filter(None, [f"# {name}", origin, f"{arms}.", kinds]))


STILL = 0.01
"""Share of the speed up to which a joint reverses, below which it rests: a 16-bit encoder shows one step of it in 0.1 s."""


@dataclass
class Lanes:
    """Lanes that grow; only changes are sent."""

    stream: Stream
    """Where they go."""
    fs: float
    """Sampling frequency [Hz]."""
    _last: dict[str, str] = field(default_factory=dict)

    def send(self, path: str, t: Array, states: npt.NDArray[np.str_]) -> None:
        """Send the states of a lane at the instants `t` [s]."""
        if path not in self._last:
            nothing = [" "] * len(STATES)  # words would be cut off where a state is short: the view's title tells the colours
            self.stream.keep(path, rr.StateConfiguration(values=list(STATES), labels=nothing, colors=list(STATES.values())))
        now = np.concatenate([[self._last.get(path, "")], states])
        self._last[path] = str(now[-1])
        if len(changed := np.flatnonzero(now[1:] != now[:-1])):
            self.stream.send(path, time_columns(t[changed], self.fs), rr.StateChange.columns(state=now[1 + changed].tolist()))


def joint_states(qd: Array, slow: float, limited: Array | None, before: float) -> npt.NDArray[np.str_]:
    """State of a joint at velocities [rad/s]: it moves, reverses or rests, or its drive is at a limit, whatever it does.

    Up to the speed `slow` it reverses; `limited` is the share of each sample for which the drive was at its limit of current
    or voltage, shape (time,) as `qd`; `before` is the velocity one sample before, or 0.
    """
    speed = np.abs(qd)
    reverses = np.concatenate([[before], qd[:-1]]) * qd < 0  # a fast joint reverses between two samples
    states = np.where(speed <= STILL * slow, "rests", np.where(reverses | (speed <= slow), "reverses", "moves"))
    return states if limited is None else np.where(limited > 0, "saturated", states)
