"""The identification of a servo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np

from identify.arrays import Array
from identify.errors import ExcitationError, IdentificationError, SettingError
from identify.one_thread import one_thread
from identify.servo.closed_loop import ServoLoop
from identify.servo.covariance import covariance
from identify.servo.excitation import Excitation
from identify.servo.friction import SERVO_FRICTIONS
from identify.servo.parameters import SERVO_PARAMETERS, parameters_of
from identify.servo.pieces import pieces
from identify.servo.rows import ServoRows
from identify.servo.run import ServoRun
from identify.servo.search import Found, Search
from identify.servo.servo import Servo

TRIED = 48
"""Starts of the rows that are simulated."""

FIRST = {"Fst": 0.3, "vs": 0.1, "Fl": 0.05, "Fls": 0.02, "Fle": 0.05, "Flm": 0.05, "Flq": 0.0, "Fgd": 0.1, "Fgb": 0.05}
"""Where parameters of friction begin: Fst as a share of Fs, vs of the largest speed."""

FEW = 20
"""Runs of which all are looked at from the beginning."""

REFINED = 15
"""Rounds with all runs, at most."""

TORQUES = ("a", "b", "Ia", "Fs", "Fv", "Fst")
"""Parameters that scale together where no known load sets the scale."""

SCALED = 1.5
"""Factor on all of them."""

CONTRAST = 0.05
"""Share by which that must make the objective larger: a model is never exact, and below this its errors set the scale."""

UNEXPLAINED = 0.2
"""Typical residual, as a share of the range of the motion, from which on a fit explains nothing."""

PLAYS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
"""Backlash that is tried first [counts]."""

MOST_RUNS = 120
"""Runs that a search looks at; of more, as many evenly spread ones."""


@final
@dataclass(frozen=True, eq=False)
class ServoFit:
    """What was identified of a servo.

    Parameters
    ----------
    servo : Servo
        What was known.
    friction : str
        Law of friction.
    free : tuple of str
        Parameters that were searched for.
    found : Found
        The search's result.
    loop : ServoLoop
        The runs that it looked at.
    excitation : Excitation
        What the runs can show.
    """

    servo: Servo
    friction: str
    free: tuple[str, ...]
    found: Found
    loop: ServoLoop
    excitation: Excitation

    @property
    def p(self) -> dict[str, float]:
        """All parameters, in SI units."""
        return self.found.p

    @cached_property
    def covariance(self) -> Array:
        """Of the free parameters, from the scatter of the residuals, shape (p, p)."""
        return covariance(self.found, self.loop, 3 * self.scale)

    @property
    def standard_errors(self) -> dict[str, float]:
        """Of the free parameters."""
        return dict(zip(self.free, np.sqrt(np.diagonal(self.covariance)).tolist(), strict=True))

    @cached_property
    def bound(self) -> dict[str, float]:
        """Standard errors that the rounding of the encoder alone leaves (Cramer-Rao)."""
        J, n = self.found.sensitivity, len(self.free)
        rounded = replace(self.found.beginning, certainty=1.0)
        free = rounded.free_of(J, np.ones(J.shape[:2])).reshape(-1, n)
        J = J.reshape(-1, n)
        size = np.sqrt((J**2).sum(axis=0))
        inverse = np.linalg.pinv((free / size).T @ (J / size))
        return dict(
            zip(self.free, (self.servo.step / np.sqrt(12) * np.sqrt(np.diagonal(inverse)) / size).tolist(), strict=True)
        )

    @property
    def scale(self) -> float:
        """Typical size of a residual [rad]."""
        return max(float(np.median(np.abs(self.found.residual[self.loop.kept]))), self.servo.step / 4)

    def simulate(self, runs: Sequence[ServoRun]) -> list[Array]:
        """Return the positions of runs from their commands alone [rad], at their samples."""
        loop = ServoLoop(self.servo, runs, self.loop.h)
        q = loop.simulate(self.p)[0]
        return [x[: len(run.t)] for x, run in zip(q, runs, strict=True)]

    def errors(self, runs: Sequence[ServoRun]) -> Array:
        """Return the mean absolute error of the position of each run, simulated from its commands alone [rad]."""
        return np.array([np.abs(run.q - q).mean() for run, q in zip(runs, self.simulate(runs), strict=True)])


def identify_servo(
    servo: Servo,
    runs: Sequence[ServoRun],
    friction: str = "load",
    more: Sequence[str] = (),
    held: dict[str, float] | None = None,
    start: dict[str, float] | None = None,
) -> ServoFit:
    """Return the parameters of a servo, from commands and positions alone.

    Rows that are linear in all but delay and rate limit make the start (`ServoRows`); the closed loop, simulated from the
    commands, is then fitted to the positions (`Search`).

    Parameters
    ----------
    servo : Servo
        What is known.
    runs : sequence of ServoRun
        What was logged, with known loads.
    friction : str
        A law of `SERVO_FRICTIONS`.
    more : sequence of str
        Further parameters to be found: lead, dead_band.
    held : dict of str to float, optional
        Parameters that are known, by their letters.
    start : dict of str to float, optional
        Where to begin; by default what rows say.

    Raises
    ------
    IdentificationError
        If nothing moves, torque is never on, duty always at its limit, or commands cannot explain the motion.
    SettingError
        If a name is unknown.
    """
    held = held or {}
    parameters_of(friction, (*more, *held))
    _require_possible(held)
    excitation = Excitation.of(servo, runs)
    whole = _evenly(runs)
    with one_thread():
        loop = ServoLoop(servo, whole)
        begin = {**(start or _start(servo, whole, loop, excitation)), **held}
        if len(whole) <= FEW:  # few runs are simulated in pieces, side by side; many are whole, as they are judged
            loop = ServoLoop(servo, [piece for run in whole for piece in pieces(run, servo.step, 1.5 * begin["delay"])])
        begin["offset"] *= excitation.tilts
        begin = {**_first(friction, more, begin, excitation), **begin, **held}
        if "backlash" in more and "backlash" not in held:
            begin["backlash"] = _play(servo, loop, begin)
        free = tuple(x for x in _names(friction, more, begin, excitation) if x not in held)
        some = ServoLoop(servo, whole[::2]) if len(whole) > FEW else loop
        rough = Search(some, free, excitation.scales, _scale(servo, some, begin)).best(begin).p
        found = Search(loop, free, excitation.scales, _scale(servo, loop, rough)).best(rough, REFINED)
        fit = ServoFit(servo, friction, free, found, loop, excitation)
        _require_explained(fit)
        if not any(name in held for name in TORQUES):
            _require_scale(fit, Search(loop, free, excitation.scales, 3 * fit.scale))
    return fit


def _start(servo: Servo, runs: Sequence[ServoRun], loop: ServoLoop, excitation: Excitation) -> dict[str, float]:
    """Return the start of the rows whose simulation fits best."""
    starts = ServoRows(servo, runs).starts()[:TRIED]
    if not starts:
        raise IdentificationError(
            f"{runs[0].name}: more duty does not make more torque in the direction of the command; has the command the sign "
            "and the unit of the position, and is it the one that the servo received?"
        )
    lanes = {name: np.array([p[name] for p in starts]) for name in starts[0]} | {"Fv": np.zeros(len(starts))}
    cost = Search(loop, (), excitation.scales, excitation.range / 10).cost(loop.simulate(lanes))
    best = {**starts[int(cost.argmin())], "Fv": 0.0}
    if not np.isfinite(best["rate"]):
        del best["rate"]
    return best


def _names(friction: str, more: Sequence[str], begin: dict[str, float], excitation: Excitation) -> list[str]:
    """Return the parameters that are searched for, in the order of `SERVO_PARAMETERS`."""
    names = {"a", "b", "Ia", "Fs", "offset", "delay", *SERVO_FRICTIONS[friction], *more}
    names |= {"Fv"} if excitation.off else set()
    names -= set() if excitation.tilts else {"offset"}
    names |= {"rate"} if "rate" in begin else set()
    return [name for name in SERVO_PARAMETERS if name in names]


def _first(friction: str, more: Sequence[str], begin: dict[str, float], excitation: Excitation) -> dict[str, float]:
    first = {name: FIRST[name] for name in SERVO_FRICTIONS[friction]}
    if "Fst" in first:
        first["Fst"] *= begin["Fs"]
        first["vs"] *= excitation.scales["speed"]
    return {**first, **dict.fromkeys(more, 0.0)}


def _play(servo: Servo, loop: ServoLoop, begin: dict[str, float]) -> float:
    """Return the backlash of some that fits best: where there is none to begin with, its sensitivity is none."""
    tried = servo.step * PLAYS
    r = np.abs(loop.q - loop.simulate({name: np.full(len(tried), x) for name, x in begin.items()} | {"backlash": tried}))
    return float(tried[int((r * loop.kept).mean(axis=(1, 2)).argmin())])


def _scale(servo: Servo, loop: ServoLoop, begin: dict[str, float]) -> float:
    r = np.abs(loop.q - loop.simulate(begin)[0])[loop.kept]
    return 3 * max(float(np.median(r)), servo.step / 4)


def _evenly(runs: Sequence[ServoRun]) -> list[ServoRun]:
    stride = -(-len(runs) // MOST_RUNS)
    # a shift a block, so that no factor of a table of runs falls together with the stride
    return [runs[i] for i in (k * stride + k % stride for k in range(len(runs) // stride))]


def _require_explained(fit: ServoFit) -> None:
    if fit.scale > UNEXPLAINED * fit.excitation.range:
        raise IdentificationError(
            f"{fit.loop.runs[0].name}: commands explain the motion to {fit.scale:.2g} rad only, of {fit.excitation.range:.2g} "
            "rad: check kp, gain and counts of the servo, and that the joint moves freely"
        )


def _require_scale(fit: ServoFit, search: Search) -> None:
    """Raise ExcitationError if other torques explain the motion as well."""
    scaled = {name: x * SCALED if name in TORQUES else x for name, x in fit.p.items()}
    cost = search.cost(fit.loop.simulate({name: np.array([x, scaled[name]]) for name, x in fit.p.items()}))
    if cost[1] < (1 + CONTRAST) * cost[0]:
        raise ExcitationError(
            f"{fit.loop.runs[0].name}: torque constant, friction and armature scale together, because the known load is small "
            "beside them: add a known mass to the robot's file, or give one of them (--hold a=0.5)"
        )


def _require_possible(held: dict[str, float]) -> None:
    for name, x in held.items():
        parameter = SERVO_PARAMETERS[name]
        if not np.isfinite(x) or x < parameter.low or (parameter.relative and x <= 0):
            raise SettingError(
                f"{name} = {x:g} {parameter.unit} is impossible: {parameter.meaning} must be finite and not negative"
            )
