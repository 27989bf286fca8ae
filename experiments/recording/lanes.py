"""Lanes of states: what a joint does, what its drive does, and what identification makes of the instant."""

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
import numpy.typing as npt
import rerun as rr

from idbench.experiments.identification.fit import Fit
from idbench.experiments.recording.columns import time_columns
from idbench.experiments.recording.stream import Stream
from idbench.experiments.reports.estimates import LEAST, EstimatesTable, models_apart
from idbench.experiments.text import STATES, markdown
from idbench.identify import Array

WHERE = {"friction": "friction", "drive": "friction"}
"""Tabs that show residuals over what a mistake is one of; of others that of the parameters."""


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
    found = [shown, ", ".join(same), _escaped(table.legend), *_pointers(fit)]
    return "\n\n".join(filter(None, found))


def _escaped(text: str) -> str:
    """Return a text whose stars Markdown leaves alone."""
    return text.replace("*", "\\*")


def _pointers(fit: Fit) -> Iterator[str]:
    """Yield where to look at what the fit lacks."""
    for cause in fit.diagnosis or ():
        yield f"{cause.words}: tab *{WHERE.get(cause.suspect.of, 'parameters')}*."


def noise_table(fit: Fit, joints: Sequence[str]) -> str:
    """Return the noise found in the log, joint by joint, as a markdown table."""
    every = zip(joints, *(fit.noise[name] for name in ("torque", "position", "encoder_step")), strict=True)
    rows = ([joint, *("" if x is None else f"{x:.2g}" for x in values)] for joint, *values in every)
    return markdown("White noise of the log, rms", ["torque [N m]", "position [rad]", "encoder step [rad]"], rows)


def _title(fit: Fit) -> str:
    return f"Chain **{fit.request.method.chain_name}**, {fit.request.method.estimator_name}"


DRAWN = {
    "true": "where it is",
    "planned": "yellow wires where it was planned to be",
    "measured": "blue wires where its encoders see it",
}
"""How arms are drawn; the first of a recording is solid."""


def about(name: str, origin: str, roles: Sequence[str]) -> str:
    """Content of a recording, with the arms of these roles."""
    first = "where its encoders see it" if roles[0] == "measured" else DRAWN[roles[0]]
    arms = ", ".join([f"The arm is solid {first}", *(DRAWN[role] for role in roles[1:])])
    kinds = "Planned or asked for: broad and light. Measured or logged: thin and light. True: in the joint's own colour."
    return "\n\n".join(filter(None, [f"# {name}", origin, f"{arms}.", kinds]))


STILL = 0.01
"""Share of the speed up to which a joint reverses, below which it rests: a 16-bit encoder shows one step of it in 0.1 s."""


class Lanes:
    """Lanes that grow; only changes are sent.

    Parameters
    ----------
    stream : Stream
        Where they go.
    fs : float
        Sampling frequency [Hz].
    """

    def __init__(self, stream: Stream, fs: float) -> None:
        self._stream = stream
        self._fs = fs
        self._last = dict[str, str]()

    def send(self, path: str, t: Array, states: npt.NDArray[np.str_]) -> None:
        """Send the states of a lane at the instants `t` [s]."""
        if path not in self._last:
            nothing = [" "] * len(STATES)  # words would be cut off where a state is short: the view's title tells the colours
            style = rr.StateConfiguration(values=list(STATES), labels=nothing, colors=list(STATES.values()))
            self._stream.keep(path, style)
        now = np.concatenate([[self._last.get(path, "")], states])
        self._last[path] = str(now[-1])
        changed = np.flatnonzero(now[1:] != now[:-1])
        if len(changed):
            columns = rr.StateChange.columns(state=now[1 + changed].tolist())
            self._stream.send(path, time_columns(t[changed], self._fs), columns)


def joint_states(qd: Array, slow: float, limited: Array | None, before: float) -> npt.NDArray[np.str_]:
    """State of a joint: it moves, reverses or rests, or its drive is at a limit, whatever it does.

    Parameters
    ----------
    qd : Array, shape (time,)
        Velocity [rad/s].
    slow : float
        Speed [rad/s] up to which it reverses.
    limited : Array, shape (time,), optional
        Share of each sample for which the drive was at its limit of current or voltage.
    before : float
        Velocity one sample before, or 0.
    """
    speed = np.abs(qd)
    reverses = np.concatenate([[before], qd[:-1]]) * qd < 0  # a fast joint reverses between two samples
    states = np.where(speed <= STILL * slow, "rests", np.where(reverses | (speed <= slow), "reverses", "moves"))
    return states if limited is None else np.where(limited > 0, "saturated", states)


def mask_states(weight: Array) -> npt.NDArray[np.str_]:
    """True where an instant is used, from its weight, shape (time,)."""
    return np.where(weight == 0, "masked", np.where(weight < 1, "partly", "used"))
