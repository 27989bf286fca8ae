"""The motion of one joint with its servo, step by step, as compiled code: one body, or rotor and link with free play."""

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from idbench.identify.arrays import Array

LIGHT = 1e-9
"""Inertia of a link that has none, beside that of its rotor."""


def _remove_stale() -> None:
    """Remove compiled code that is older than this file: of an earlier version numba cannot even read the index."""
    here = Path(__file__)
    with suppress(OSError):  # a folder that cannot be written: nothing was kept there
        for path in (here.parent / "__pycache__").glob(f"{here.stem}.*.nb?"):
            if path.stat().st_mtime < here.stat().st_mtime:
                path.unlink()


_remove_stale()


def _compiled(function: Callable[..., Any]) -> Any:
    """Return compiled code, kept for the next process where there is a place for it."""
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:  # neither the project's folder nor a cache of the user can be written
        return njit(nogil=True)(function)


class ServoLaw(NamedTuple):
    """Parameters of a servo, by the letters of `SERVO_PARAMETERS`, and what makes those of other laws do nothing."""

    a: float
    b: float
    Ia: float
    Fs: float
    Fv: float
    offset: float
    delay: float
    rate: float = math.inf
    lead: float = 0.0
    dead_band: float = 0.0
    backlash: float = 0.0
    Mg: float = 0.0
    Fo: float = 0.0
    Fst: float = 0.0
    vs: float = 1.0
    Fl: float = 0.0
    Fls: float = 0.0
    Fle: float = 0.0
    Flm: float = 0.0
    Flq: float = 0.0
    Fgd: float = 0.0
    Fgb: float = 0.0


class Firmware(NamedTuple):
    """What is known of a servo: duty per rad, largest duty, angle of a count of the encoder [rad]."""

    gain: float
    limit: float
    angle: float


class Track(NamedTuple):
    """What a joint gets at each step, shape (step,): command, voltage, share of the step with torque on, and its load."""

    command: Array
    voltage: Array
    on: Array
    inertia: Array
    sine: Array
    cosine: Array
    rest: Array


class Acting(NamedTuple):
    """What acts in a step: share of it for which torque is on, inertia of the link, torques of winding and load."""

    on: float
    J: float
    push: float
    external: float


@_compiled
def friction(p: ServoLaw, speed: float, motor: float, external: float, sent: float) -> float:
    """Return the torque by which friction can resist at most [N m]."""
    total = p.Fs
    load = abs(external - motor)
    if p.Fst != 0.0 or p.Fls != 0.0:
        total += (p.Fst + p.Fls * load) * math.exp(-abs(speed) / p.vs)
    total += p.Fl * load + abs(p.Fle * external - p.Flm * motor)
    if external * motor < 0.0:
        total += p.Flq * min(external * external, motor * motor)
    return total + p.Fgd * max(sent, 0.0) + p.Fgb * max(-sent, 0.0)


@_compiled
def _slowed(free: float, speed: float, most: float) -> float:
    """Return the speed after a step in which friction takes away at most `most`.

    It resists the motion that there was until that ends, within the step or not, and takes of what drives it on from there at
    most all.
    """
    change = free - speed
    slower = change - math.copysign(most, speed)
    onward = speed + slower
    if onward * speed > 0.0:
        return onward
    left = 1.0 + speed / slower if onward * speed < 0.0 else 1.0
    return left * (change - min(max(change, -most), most))


@_compiled
def _pushed(p: ServoLaw, firmware: Firmware, q: float, speed: float, target: float, voltage: float) -> float:
    """Return the torque of the winding without its back-EMF."""
    error = target - np.rint((q - p.offset) / firmware.angle) * firmware.angle - p.lead * speed
    error -= min(max(error, -p.dead_band), p.dead_band)
    return p.a * voltage * min(max(firmware.gain * error, -firmware.limit), firmware.limit)


@_compiled
def _after(p: ServoLaw, of: Acting, speed: float, h: float) -> float:
    """Return the speed of rotor and link as one body after a step."""
    light, damping = 1 / (of.J + p.Ia), p.b * of.on
    half = h / 2 * (damping + p.Fv) * light
    later = h * light / (1 + half)
    free = speed + later * (of.push + of.external - (damping + p.Fv) * speed)
    motor = of.push - damping * speed
    sent = math.copysign(light, free) * (of.J * motor - p.Ia * of.external)
    resisting = friction(p, speed, motor, of.external, sent) + p.Fo * (1 - of.on)
    return _slowed(free, speed, later * resisting)


@_compiled
def _apart(p: ServoLaw, of: Acting, link: float, rotor: float, gap: float, h: float) -> tuple[float, float, float]:
    """Return speeds of link and rotor, and their gap: each by itself, and as one body where one would leave the play."""
    half = p.backlash / 2
    J = max(of.J, LIGHT * p.Ia)
    free_link, free_rotor = link + h / J * of.external, _after(p, Acting(of.on, 0.0, of.push, 0.0), rotor, h)
    free_gap = gap + h * (free_rotor - free_link)
    if abs(free_gap) <= half:
        return free_link, free_rotor, free_gap
    end = math.copysign(half, free_gap)
    closing = (end - gap) / h  # how fast the rotor goes to the end of the play within the step; they collide without rebound
    common = (J * (link + closing) + p.Ia * rotor) / (J + p.Ia)
    together = _after(p, Acting(of.on, J, of.push, of.external), common, h)
    return together - closing, together, end


@_compiled
def targets(command: Array, rate: float, h: float) -> Array:
    """Return the mean over each step h [s] of what follows a command within a rate [rad/s]."""
    means, target = np.empty(len(command)), command[0]
    for i in range(len(command)):
        step = min(max(command[i] - target, -rate * h), rate * h)
        means[i] = target + (step * (1 - abs(step) / (2 * rate * h)) if rate < math.inf else step)
        target += step
    return means


@_compiled
def motion(p: ServoLaw, firmware: Firmware, track: Track, start: tuple[float, float], h: float, fastest: float) -> Array:
    """Return the angle of the log at each step [rad], from an angle of the log and a speed; no speed gets beyond the fastest.

    Leapfrog: speeds in the middle of steps, positions at their ends; damping is implicit, so that the result is of second order
    in the step h [s]. A force acts for the step about its instant: means of the target over steps are delayed by parts of them.
    """
    n = len(track.command)
    out, means = np.empty(n), targets(track.command, p.rate, h)
    late = p.delay / h + 0.5
    whole = int(late)
    part, half = late - whole, p.backlash / 2
    q, speed = start
    q += p.offset
    gap, rotor = 0.0, speed
    for i in range(n):
        out[i] = q - p.offset
        now = means[max(i - whole, 0)] if i >= whole else track.command[0]
        past = means[i - whole - 1] if i > whole else track.command[0]
        external = -((track.sine[i] + p.Mg) * math.sin(q) + track.rest[i])
        if track.cosine[i] != 0.0:
            external -= track.cosine[i] * math.cos(q)
        if i == 0 and half > 0.0:
            gap = -half * np.sign(external)  # links rest on the side to which their loads push them
        push = _pushed(p, firmware, q, speed, now + (past - now) * part, track.voltage[i])
        of = Acting(track.on[i], track.inertia[i], push, external)
        if half > 0.0:
            speed, rotor, gap = _apart(p, of, speed, rotor, gap, h)
        else:
            speed = _after(p, of, speed, h)
        speed = min(max(speed, -fastest), fastest)
        rotor = min(max(rotor, -fastest), fastest)
        q += h * speed
    return out


@_compiled
def at_samples(q: Array, before: npt.NDArray[np.int64], share: Array, count: float) -> Array:
    """Return positions between steps, linearly; at rest to the count [rad], if it is above 0."""
    out = np.empty(len(before))
    for k in range(len(before)):
        change = q[before[k] + 1] - q[before[k]]
        out[k] = q[before[k]] + change * share[k]
        if change == 0.0 and count > 0.0:
            out[k] = np.rint(out[k] / count) * count
    return out
