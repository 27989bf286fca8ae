"""The motion of one joint with its servo, step by step, as compiled code: one body, or rotor and link with free play."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.compiled import compiled
from idbench.identify.servo.law import TimeSteps
from idbench.identify.servo.parameters import ServoLaw

LIGHT = 1e-9  # Inertia of a link that has none, beside that of its rotor


class Firmware(NamedTuple):
    """What is known of a loop (see `Servo`): command per rad, and per rad/s, limits, angle of a count [rad] or 0, steps."""

    gain: float
    kd: float
    limit: float
    speed_limit: float
    angle: float
    steps: TimeSteps


class Track(NamedTuple):
    """What a joint gets at each step, shape (step,): command, voltage, share of the step with torque on, and its load."""

    command: Array
    forward: Array
    voltage: Array
    on: Array
    inertia: Array
    sine: Array
    cosine: Array
    rest: Array
    lightness: Array
    shaking: Array


class Acting(NamedTuple):
    """What acts in a step: share of it for which torque is on, inertia of the link, damping, torques of winding and load."""

    on: float
    J: float
    damping: float
    push: float
    external: float
    lightness: float
    shaking: float


@compiled
def friction(p: ServoLaw, speed: float, motor: float, external: float, sent: float) -> float:
    """Torque by which friction can resist at most [N m]."""
    total = p.Fs
    load = abs(external - motor)
    if p.Fst != 0.0 or p.Fls != 0.0:
        total += (p.Fst + p.Fls * load) * math.exp(-abs(speed) / p.vs)
    total += p.Fl * load + abs(p.Fle * external - p.Flm * motor)
    if external * motor < 0.0:
        total += p.Flq * min(external * external, motor * motor)
    return total + p.Fgd * max(sent, 0.0) + p.Fgb * max(-sent, 0.0)


@compiled
def _slowed(free: float, speed: float, most: float) -> float:
    """Speed after a step in which friction takes away at most `most`.

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


@compiled
def _pushed(
    p: ServoLaw, firmware: Firmware, q: float, speed: float, target: float, forward: float, voltage: float
) -> tuple[float, float]:
    """Torque of the winding without what damps, and the damping of the loop: nothing beyond its limit."""
    gain = firmware.gain * (1 + p.gain_error)
    seen = q - p.offset
    if firmware.angle > 0.0:
        seen = np.rint(seen / firmware.angle) * firmware.angle
    error = target * (1 + p.scale_error) + p.zero - seen
    damping = firmware.kd
    led = error - p.lead * speed
    if led > p.dead_band:
        error, damping = error - p.dead_band, damping + gain * p.lead
    elif led < -p.dead_band:
        error, damping = error + p.dead_band, damping + gain * p.lead
    else:
        error = 0.0
    free = gain * error + forward
    wanted = free - damping * speed
    highest = firmware.limit * min(max(1.0 - speed / firmware.speed_limit, 0.0), 1.0)
    lowest = -firmware.limit * min(max(1.0 + speed / firmware.speed_limit, 0.0), 1.0)
    if wanted > highest:
        return p.a * voltage * highest, 0.0
    if wanted < lowest:
        return p.a * voltage * lowest, 0.0
    return p.a * voltage * free, p.a * voltage * damping


@compiled
def _after(p: ServoLaw, firmware: Firmware, of: Acting, speed: float, h: float) -> float:
    """Speed of rotor and link as one body after a step."""
    damping = p.b * of.on + of.damping
    light = 1 / (of.J + p.Ia + firmware.steps.joint * p.Fv + firmware.steps.loop * damping)
    half = h / 2 * (damping + p.Fv) * light
    later = h * light / (1 + half)
    free = speed + later * (of.push + of.external - (damping + p.Fv) * speed)
    motor = of.push - damping * speed
    sent = math.copysign(light, free) * (of.J * motor - p.Ia * of.external)
    resisting = friction(p, speed, motor, of.external, sent) + p.Fo * (1 - of.on)
    if firmware.steps.decay > 0.0:  # MuJoCo's, which lets a joint creep: (a + B v) / (A + R) within the largest
        taken = 2 * (max(firmware.steps.joint, 0.0) * p.Fv + max(firmware.steps.loop, 0.0) * damping)
        A = (1 + taken * of.lightness) / (of.J + p.Ia + taken)
        seen = later * (firmware.steps.decay * speed + of.shaking)
        wanted = (A * (free - speed) + seen) / (A + firmware.steps.yielding)
        return free - min(max(wanted, -later * resisting), later * resisting)
    return _slowed(free, speed, later * resisting)


@compiled
def _apart(
    p: ServoLaw, firmware: Firmware, of: Acting, link: float, rotor: float, gap: float, h: float
) -> tuple[float, float, float]:
    """Speeds of link and rotor, and their gap: each by itself, and as one body where one would leave the play."""
    half = p.backlash / 2
    J = max(of.J, LIGHT * p.Ia)
    free_link = link + h / J * of.external
    free_rotor = _after(p, firmware, Acting(of.on, 0.0, of.damping, of.push, 0.0, 0.0, 0.0), rotor, h)
    free_gap = gap + h * (free_rotor - free_link)
    if abs(free_gap) <= half:
        return free_link, free_rotor, free_gap
    end = math.copysign(half, free_gap)
    closing = (end - gap) / h  # how fast the rotor goes to the end of the play within the step; they collide without rebound
    common = (J * (link + closing) + p.Ia * rotor) / (J + p.Ia)
    together = _after(p, firmware, Acting(of.on, J, of.damping, of.push, of.external, 0.0, 0.0), common, h)
    return together - closing, together, end


@compiled
def targets(command: Array, rate: float, h: float, lag: float = 0.0, ahead: float = 0.0) -> Array:
    """Mean over each step h [s] of what follows a command within a rate [rad/s], low-passed with a time constant.

    It begins `ahead` of the first command [rad].
    """
    means, target = np.empty(len(command)), command[0] + ahead
    follow = math.exp(-h / lag) if lag > 0.0 else 0.0
    late = target
    for i in range(len(command)):
        step = min(max(command[i] - target, -rate * h), rate * h)
        means[i] = target + (step * (1 - abs(step) / (2 * rate * h)) if rate < math.inf else step)
        target += step
        if lag > 0.0:
            before, held = late, means[i]
            late = held + (before - held) * follow
            means[i] = held + (before - held) * (1 - follow) * lag / h
    return means


@compiled
def motion(p: ServoLaw, firmware: Firmware, track: Track, start: tuple[float, float, float], h: float, fastest: float) -> Array:
    """Angle of the log at each step [rad]; no speed gets beyond the fastest.

    It starts from an angle of the log, a speed, and by how much the target is ahead of the command. Leapfrog: speeds in the
    middle of steps, positions at their ends; damping is implicit, so that the result is of second order
    in the step h [s]. A force acts for the step about its instant: means of the target over steps are delayed by parts of them.
    """
    n = len(track.command)
    q, speed, ahead = start
    out, means = np.empty(n), targets(track.command, p.rate, h, p.lag, ahead)
    first = track.command[0] + ahead
    late = (p.delay - firmware.steps.early) / h + 0.5
    whole = math.floor(late)
    part, half = late - whole, p.backlash / 2
    q += p.offset
    gap, rotor = 0.0, speed
    for i in range(n):
        out[i] = q - p.offset
        now = means[min(i - whole, n - 1)] if i >= whole else first
        past = means[min(i - whole - 1, n - 1)] if i > whole else first
        forward = track.forward[min(max(i - whole, 0), n - 1)]
        external = p.bias - ((track.sine[i] + p.Mg) * math.sin(q) + track.rest[i])
        if track.cosine[i] != 0.0:
            external -= track.cosine[i] * math.cos(q)
        if i == 0 and half > 0.0:
            gap = -half * np.sign(external)  # links rest on the side to which their loads push them
        push, damping = _pushed(p, firmware, q, speed, now + (past - now) * part, forward, track.voltage[i])
        of = Acting(track.on[i], track.inertia[i], damping, push, external, track.lightness[i], track.shaking[i])
        if half > 0.0:
            speed, rotor, gap = _apart(p, firmware, of, speed, rotor, gap, h)
        else:
            speed = _after(p, firmware, of, speed, h)
        speed = min(max(speed, -fastest), fastest)
        rotor = min(max(rotor, -fastest), fastest)
        q += h * speed
    return out


@compiled
def at_samples(q: Array, before: npt.NDArray[np.int64], share: Array, count: float) -> Array:
    """Positions between steps, linearly; at rest to the count [rad], if it is above 0."""
    out = np.empty(len(before))
    for k in range(len(before)):
        change = q[before[k] + 1] - q[before[k]]
        out[k] = q[before[k]] + change * share[k]
        if change == 0.0 and count > 0.0:
            out[k] = np.rint(out[k] / count) * count
    return out
