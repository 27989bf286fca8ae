"""The motion of joints with servos, a step at a time: one body a joint, or rotor and link with free play between them."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple, final

import numpy as np

from identify.arrays import Array
from identify.servo.friction import budget
from identify.servo.servo import Servo

FRICTION = ("Fs", "Fst", "vs", "Fl", "Fls", "Fle", "Flm", "Flq", "Fgd", "Fgb")

WAY = 6
"""Ranges of its motion that a joint may cross in a step: beyond, it is lost, and numbers would overflow."""

LIGHT = 1e-9
"""Inertia of a link that has none, beside that of its rotor."""


@final
@dataclass(frozen=True, eq=False)
class Inputs:
    """What acts at the steps of a simulation, shape (step, run), or (1, run) where it does not change."""

    command: Array
    drive: Array
    on: Array
    inertia: Array
    sine: Array
    cosine: Array
    rest: Array


class Start(NamedTuple):
    """Where runs begin, and what tells them apart, shape (run,).

    Parameters
    ----------
    q, qd : Array
        Angle of the log [rad], or (lane, run), and speed [rad/s].
    kp : Array
        Firmware gains.
    range : float
        Of the motion [rad].
    """

    q: Array
    qd: Array
    kp: Array
    range: float


class Torques(NamedTuple):
    """What acts in a step, shape (lane, run): the motor's push and damping, torque of the load, its inertia, share of on."""

    push: Array
    damping: Array
    external: Array
    J: Array
    on: Array


class Motion:
    """The state of the joints of all lanes and runs: angle of the file and speed, shape (lane, run).

    Parameters
    ----------
    servo : Servo
        What is known.
    inputs : Inputs
        What acts.
    p : mapping of str to Array, shape (lane, 1)
        Parameters.
    h : float
        Step [s].
    start : Start
        Where runs begin.
    """

    def __init__(self, servo: Servo, inputs: Inputs, p: Mapping[str, Array], h: float, start: Start) -> None:
        self._p, self._inputs, self._h = p, inputs, h
        self.q = start.q + p["offset"] + np.zeros((len(p["a"]), len(start.qd)))
        self._qd = start.qd + np.zeros_like(self.q)
        self._friction = {name: p[name] for name in FRICTION if name in p}
        self._step = servo.step
        self._gain, self._limit = servo.gain * start.kp, servo.duty_limit
        self._unknown, self._when_off = p.get("Mg", 0.0), p.get("Fo", 0.0)
        self._lead, self._band = p.get("lead"), p.get("dead_band")
        self._geared, self._upright = "Fgd" in p, bool(inputs.cosine.any())
        self._most = WAY * start.range / h

    def advance(self, i: int, target: Array) -> None:
        """Advance by a step with the target of the firmware, an angle of the log."""
        torques = self._torques(i, target)
        self._qd = self._limited(self._together(torques, self._qd, torques.push + torques.external)[0])
        self.q = self.q + self._h * self._qd

    def keep(self, n: int) -> None:
        """Go on with the first runs alone."""
        self.q, self._qd, self._gain = self.q[:, :n].copy(), self._qd[:, :n].copy(), self._gain[:n]
        self._inputs = Inputs(*(getattr(self._inputs, x.name)[:, :n] for x in fields(Inputs)))

    def _torques(self, i: int, target: Array) -> Torques:
        inputs = self._inputs
        V, on, J = (_at(x, i) for x in (inputs.drive, inputs.on, inputs.inertia))
        error = target - np.rint((self.q - self._p["offset"]) / self._step) * self._step
        if self._lead is not None:
            error = error - self._lead * self._qd
        if self._band is not None:
            error = error - np.minimum(np.maximum(error, -self._band), self._band)
        duty = np.minimum(np.maximum(self._gain * error, -self._limit), self._limit)
        return Torques(self._p["a"] * V * duty, self._p["b"] * on, self._external(i), J, on)

    def _external(self, i: int) -> Array:
        sine, cosine, rest = (_at(x, i) for x in (self._inputs.sine, self._inputs.cosine, self._inputs.rest))
        external = -((sine + self._unknown) * np.sin(self.q) + rest)
        return external - cosine * np.cos(self.q) if self._upright else external

    def _together(self, of: Torques, speed: Array, torque: Array) -> tuple[Array, Array]:
        """Return the speed of rotor and link as one body after a step with a torque, and its inertia."""
        whole = of.J + self._p["Ia"]
        motor = of.push - of.damping * speed
        half = self._h / 2 * (of.damping + self._p["Fv"]) / whole
        free = ((1 - half) * speed + self._h / whole * torque) / (1 + half)
        sent = np.sign(free) * (of.J * motor - self._p["Ia"] * of.external) / whole if self._geared else motor
        return self._slowed(of, free, speed, (motor, of.external, sent), whole * (1 + half)), whole

    def _slowed(self, of: Torques, free: Array, speed: Array, loads: tuple[Array, Array, Array], inertia: Array) -> Array:
        """Return speeds after friction.

        It resists the motion that there was until that ends, within the step or not, and takes of what drives it on from there
        at most all.
        """
        most = self._h / inertia * (budget(self._friction, speed, *loads) + self._when_off * (1 - of.on))
        change = free - speed
        slower = change - np.copysign(most, speed)
        onward = speed + slower
        driven = change - np.minimum(np.maximum(change, -most), most)
        left = 1 - speed / np.where(onward * speed < 0, -slower, np.inf)
        return np.where(onward * speed > 0, onward, left * driven)

    def _limited(self, speed: Array) -> Array:
        return np.minimum(np.maximum(speed, -self._most), self._most)


@final
class GearedMotion(Motion):
    """Rotor and link with free play: each by itself, and one body where one would leave the play, without rebound."""

    def __init__(self, servo: Servo, inputs: Inputs, p: Mapping[str, Array], h: float, start: Start) -> None:
        super().__init__(servo, inputs, p, h, start)
        self._half, self._rotor = p["backlash"] / 2, self._qd.copy()
        self._gap = -self._half * np.sign(self._external(0))  # links rest on the side to which their loads push them

    def advance(self, i: int, target: Array) -> None:
        """Advance by a step with the target of the firmware, an angle of the log."""
        of, h, p = self._torques(i, target), self._h, self._p
        J = np.maximum(of.J, LIGHT * p["Ia"])
        link, rotor = self._qd + h / J * of.external, self._alone(of)
        gap = self._gap + h * (rotor - link)
        away = np.abs(gap) > self._half
        ends = np.minimum(np.maximum(gap, -self._half), self._half)
        # Momentum of both, and how fast the rotor goes to the end of the play within the step.
        closing = (ends - self._gap) / h
        whole = J + p["Ia"]
        common = (J * (self._qd + closing) + p["Ia"] * self._rotor) / whole
        with_link, _ = self._together(of, common, of.push + of.external)
        self._rotor = self._limited(np.where(away, with_link, rotor))
        self._qd = self._limited(np.where(away, with_link - closing, link))
        self._gap = ends
        self.q = self.q + h * self._qd

    def keep(self, n: int) -> None:
        """Go on with the first runs alone."""
        super().keep(n)
        self._gap, self._rotor = self._gap[:, :n].copy(), self._rotor[:, :n].copy()

    def _alone(self, of: Torques) -> Array:
        """Return the speed of the rotor after a step without its link."""
        Ia, speed = self._p["Ia"], self._rotor
        motor = of.push - of.damping * speed
        half = self._h / 2 * (of.damping + self._p["Fv"]) / Ia
        free = ((1 - half) * speed + self._h / Ia * of.push) / (1 + half)
        none = np.zeros_like(free)
        return self._slowed(of, free, speed, (motor, none, none), Ia * (1 + half))


def _at(x: Array, i: int) -> Array:
    return np.asarray(x[i if len(x) > 1 else 0])
