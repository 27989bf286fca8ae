"""The closed loop in NumPy, one simulation: an independent route to what the compiled loop does."""

from functools import partial
from types import SimpleNamespace

import mujoco
import numpy as np

from idbench.identify.basis.friction.shape import StribeckFriction
from idbench.sim import controllers, drives, encoders, frictions
from idbench.sim.controllers import Error, Task
from idbench.sim.drives.averaged_drive import limits
from idbench.sim.drives.switched_drive import ExactPeriods
from idbench.sim.engine.bench import BLOCK, generators
from idbench.sim.engine.clock import Clock
from idbench.sim.engine.plant import stepping
from idbench.sim.robot.inverse_dynamics import InverseDynamics
from idbench.sim.robot.payload import with_play
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import per_joint


def within(x, limit):
    return np.minimum(np.maximum(x, -limit), limit)


class History:
    """Positions and velocities at physics steps; between them the cubic that has both."""

    def __init__(self, h):
        self.h, self.states = h, {}

    def put(self, step, q, qd):
        self.states[step], self.last = (q.copy(), qd.copy()), step

    def at(self, x):
        x = max(x, 0.0)
        if x in self.states:
            return self.states[x][0]
        before = min(int(np.floor(x)), self.last)
        after = min(before + 1, self.last)
        (q0, v0), (q1, v1) = self.states[before], self.states[after]
        s, v0, v1, rise = x - before, v0 * self.h, v1 * self.h, q1 - q0
        return q0 + s * (v0 + s * ((3 * rise - 2 * v0 - v1) + s * (v0 + v1 - 2 * rise)))


def law(settings, task):
    """What commands, as a function of sample and positions."""
    reference, n = task.reference, task.nominal.n
    if isinstance(settings, controllers.PositionCommand):
        return lambda k, q: reference.q[k]
    w, error = per_joint(settings.bandwidth, n, ""), Error(reference, 1, settings.cutoff)
    M, ahead, total = task.inertia[0], task.feedforward, np.zeros(n)

    def pd(k, q):
        e, rate = error.update(k, q)
        return settings.feedforward * ahead[k] + M * w**2 * e + M * 2 * settings.damping * w * rate[0]

    def pid(k, q):
        e, rate = error.update(k, q)
        total[:] += e
        return ahead[0] + 3 * M * w**2 * e + 3 * M * w * rate[0] + M * w**3 / reference.fs * total

    def computed(k, q):
        e, rate = error.update(k, q)
        qdd = reference.qdd[k] + w**2 * e + 2 * settings.damping * w * rate
        return (1 + settings.model_error) * task.model(q[None], reference.qd[k] - rate, qdd)[0]

    return {controllers.PDFeedforward: pd, controllers.PID: pid, controllers.ComputedTorque: computed}[type(settings)]


def reader(settings, n, samples, fs, rng):
    """What reads positions of a sample."""
    if isinstance(settings, encoders.ExactEncoder):
        return lambda k, q: q.copy()
    noisy = settings.noise or settings.missed_counts  # what draws
    noise = settings.noise * rng.standard_normal((samples, n)) if noisy else np.zeros((samples, n))
    missed = rng.random((samples, n)) < settings.missed_counts / fs if settings.missed_counts else None
    per_rad, period = per_joint(settings.lines, n, "") * settings.quadrature / (2 * np.pi), settings.quadrature
    lost, before = np.zeros(n), np.zeros(n)

    def read(k, q):
        x = (q + noise[k] if settings.noise else q) * per_rad
        if settings.interpolation_error:
            x = x + period * settings.interpolation_error * np.sin(2 * np.pi / period * x)
        counts = np.floor(x + settings.offset)
        if missed is None:
            return counts / per_rad
        lost[:] += np.sign(counts - before) * missed[k] * (k > 0)
        before[:] = counts
        return (counts - lost) / per_rad

    return read


class Averaged:
    """i follows the loop with rate w; where that needs more than the bus voltage, the winding's own rate R/L comes first."""

    def __init__(self, settings, robot, h):
        self.m, self.w, self.h, self.i = robot.motors, 2 * np.pi * settings.bandwidth, h, np.zeros(robot.n)
        self.V, self.I = limits(robot, settings.bus_voltage, settings.current_limit)

    def __call__(self, demand, speed, q, steps):
        R, L, K, V, w, i0, dt = self.m.R, self.m.L, self.m.K, self.V, self.w, self.i, steps * self.h
        e = K * speed[len(speed) // 2]
        target = np.minimum(np.maximum(within(demand / K, self.I), (-V - e) / R), (V - e) / R)
        asked = R * i0 + L * w * (target - i0) + e
        saturated, v = np.abs(asked) > V, np.copysign(np.where(np.isfinite(V), V, 0.0), asked)
        end, released = (v - e) / R, (v - e - L * w * target) / (R - L * w)
        share = (released - end) / np.where(i0 == end, 1.0, i0 - end)
        t = np.where(saturated, np.minimum(-np.log(np.minimum(np.maximum(share, 1e-300), 1.0)) * L / R, dt), 0.0)
        i1 = np.where(saturated, end + (i0 - end) * np.exp(-t * R / L), i0)
        charge = np.where(saturated, end * t - (i1 - i0) * L / R, 0.0)
        away, rest = i1 - target, dt - t
        self.i = target + away * np.exp(-w * rest)
        return (K * ((charge + target * rest - away * (np.expm1(-w * rest) / w)) / dt))[None]


class Servo:
    """Firmware, winding and gear of a servo, step by step."""

    def __init__(self, settings, robot, h):
        self.s, self.h, self.t, self.target, self.speed = settings, h, h / 2, None, np.zeros(robot.n)
        self.each = lambda name: per_joint(getattr(settings, name) or (np.inf,), robot.n, name)

    def followed(self, command):
        rate, a, h = self.s.rate or np.inf, self.s.acceleration, self.h
        before = command.copy() if self.target is None else self.target
        way = command - before
        if not a:
            move = within(way, rate * h)
            self.target = before + move
            return self.target - move * np.abs(move) / (2 * rate * h)
        left = np.maximum(np.abs(way) - np.sign(way) * self.speed * h / 2, 0.0)
        fastest = np.sqrt(2 * a * left + (a * h / 2) ** 2) - a * h / 2
        speed = np.clip(np.sign(way) * np.minimum(fastest, rate), self.speed - a * h, self.speed + a * h)
        self.target, self.speed = before + (self.speed + speed) / 2 * h, speed
        return (before + self.target) / 2

    def __call__(self, demand, speed, q, steps):
        s, K, R = self.s, self.each("torque_constant"), self.each("resistance")
        out = np.empty((steps, len(demand)))
        for k in range(steps):
            at = k % len(q)
            target, on = self.followed(demand), not any(first <= self.t < last for first, last in s.off)
            self.t += self.h
            count = 2 * np.pi / s.counts if s.counts else 0.0
            error = target - (np.rint(q[at] / count) * count if count else q[at]) - s.lead * speed[at]
            error = error - within(error, s.dead_band) if s.dead_band else error
            duty = within(s.gain * self.each("kp") * error * on, s.duty_limit)
            wanted = (on or s.winding == "shorted") * (s.supply * duty - K * speed[at]) / R
            out[k] = K * within(wanted, self.each("current_limit"))
        return out


def drive(settings, robot, h):
    """Torques in the steps to come, one row or one a step."""
    if isinstance(settings, drives.IdealDrive):
        return lambda demand, speed, q, steps: demand[None]
    if isinstance(settings, drives.AveragedDrive):
        return Averaged(settings, robot, h)
    if isinstance(settings, drives.ServoDrive):
        return Servo(settings, robot, h)
    exact = ExactPeriods(settings, robot.motors, *limits(robot, settings.bus_voltage, settings.current_limit), 1, h)
    return lambda demand, speed, q, steps: exact.step(demand[None], speed[:, None], steps)[:, 0]


def friction(settings, model, data, stride, h):
    """Torque on the joints beside MuJoCo's own, for torques and velocities; some set MuJoCo's Coulomb friction anew."""
    loss, n = model.dof_frictionloss[::stride], model.nv // stride
    Fs, steps, z = loss.copy(), iter(range(10**9)), np.zeros(n)
    each = lambda name: per_joint(getattr(settings, name), n, name)  # noqa: E731

    def none(tau, qd):
        return np.zeros(n)

    def stribeck(tau, qd):
        force = StribeckFriction(settings.velocity).force(np.zeros(n), np.where(qd == 0, 1e-9, np.abs(qd)))
        loss[:] = np.maximum(Fs + (settings.static - 1) * Fs * force, 0.0)
        return 0.0

    def load(tau, qd):
        loss[:] = Fs + each("share") * np.abs(tau + data.qfrc_passive[::stride] + data.qfrc_constraint[::stride])
        return 0.0

    def asymmetric(tau, qd):
        return -each("offset") * np.tanh(np.abs(qd) / settings.edge) - each("difference") * np.abs(qd)

    def warming(tau, qd):
        return -each("slope") * (settings.at((next(steps) + 0.5) * h) - settings.reference) * qd

    def lugre(tau, qd, damping=0.0, static=1.0, velocity=0.1):
        fading = np.exp(-((qd / velocity) ** 2))
        u, g, z0 = qd / settings.deflection, 1 + (static - 1) * fading, z.copy()
        x, limit = np.abs(u) * h / g, np.sign(u) * g
        z[:] = limit + (z0 - limit) * np.exp(-x)
        mean = np.where(x > 0, limit + (z0 - limit) * -np.expm1(-x) / np.where(x > 0, x, 1.0), z0)
        s1 = 2 * damping * np.sqrt(Fs / settings.deflection / model.dof_invweight0[::stride])
        return -(Fs * mean + s1 * settings.deflection * fading * (z - z0) / h)

    kind = type(settings)
    if kind in (frictions.LuGre, frictions.Dahl):
        loss[:] = 0.0
    if kind is frictions.LuGre:
        return partial(lugre, damping=settings.damping, static=settings.static, velocity=settings.velocity)
    named = {frictions.Stribeck: stribeck, frictions.LoadDependent: load, frictions.Asymmetric: asymmetric}
    return (named | {frictions.Warming: warming, frictions.Dahl: lugre}).get(kind, none)


def ripple(series, q):
    return series.amplitude * sum(a * np.sin(k * (series.order * q + series.phase)) for k, a in enumerate(series.harmonics, 1))


def offsets(scenario, seed, samples, clock):
    """By how many steps samples are taken off their instant."""
    rng, width = generators((seed,), 1)[0], scenario.timing.jitter / clock.h
    off, period = width * (rng.random(samples) - 0.5), scenario.timing.refresh / clock.h
    return off - (np.arange(samples) * clock.per_sample + off - period * rng.random()) % period if period else off


def begun(scenario, seed):
    """All that a simulation needs, by name."""
    robot, fs = scenario.real_robot, scenario.fs
    planned, n = scenario.trajectory.sample(robot, fs), robot.n
    h, play = scenario.drive.step_length(fs, scenario.physics.step), scenario.drive.play(robot)
    edits = scenario.payload.edit, scenario.friction.edit, scenario.drive.edit, partial(with_play, play=play, h=h)
    stride = 2 if play.any() else 1
    model = stepping(Robot.load(scenario.robot, *edits).model if play.any() else robot.model, h, scenario.physics.integrator)
    data, samples, clock = mujoco.MjData(model), len(planned.q), Clock(round(1 / fs / h), h, scenario.timing.delay)
    data.qpos[::stride] = planned.q[0]
    timing, steady = scenario.timing, scenario.drive.steady and scenario.ripple.steady
    stepwise = timing.jitter or timing.refresh or scenario.torque.source == "current" or not scenario.friction.steady
    still = planned.q[:1] * 0
    return SimpleNamespace(
        model=model,
        data=data,
        stride=stride,
        samples=samples,
        clock=clock,
        law=law(scenario.controller, Task(scenario.nominal_robot, planned, 1)),
        reader=reader(scenario.encoder, n, samples, fs, generators((seed,), 0)[0]),
        drive=drive(scenario.drive, robot, h),
        friction=friction(scenario.friction, model, data, stride, h),
        ripples=scenario.ripple.start(robot),
        steady=steady,
        off=offsets(scenario, seed, samples, clock) if timing.jitter or timing.refresh else np.zeros(samples),
        most=1 if stepwise else clock.per_sample if steady else max(1, round(BLOCK / h)),
        holds=planned.q[0]
        if scenario.drive.commands == "position"
        else InverseDynamics(robot, 1)(planned.q[:1], still, still)[0],
    )


def torques(scenario, s, demand, state, before, steps):
    """Velocities in the middle of steps, and torques of the motors in them without and with ripple."""
    (rotor, rotor_qd, q, qd), (before_qd, before_steps), rows = state, before, 1 if s.steady else steps
    t = (np.arange(rows)[:, None] + 0.5) * (steps / rows * s.clock.h)
    rate = (rotor_qd - before_qd) / (before_steps * s.clock.h)
    mid_qd, mid_q = rotor_qd + rate * t, rotor + rotor_qd * t + rate * (t**2 / 2)
    smooth, (cogging, commutation) = scenario.ripple.steady, s.ripples
    constant = 1.0 if smooth else 1 + ripple(commutation, mid_q)
    apart = s.stride == 2 and not scenario.drive.before_gear
    seen = mid_q + (q - rotor) + (qd - rotor_qd) * t if apart else mid_q
    electric = s.drive(demand, mid_qd * constant, seen, steps)
    return mid_qd, electric, electric if smooth else electric * constant + ripple(cogging, mid_q)


def simulated(scenario, seed=0, length=np.inf):
    """Measured and commanded, true positions, velocities and torques, shape (sample, joint) each, of the first seconds."""
    s = begun(scenario, seed)
    clock, data, stride, history = s.clock, s.data, s.stride, History(s.clock.h)
    out = {name: np.zeros((s.samples, len(s.holds))) for name in ("measured", "command", "current", "q", "qd", "tau")}
    command = demand = s.holds
    sensed, before, step, last = 0 * s.holds, (0 * s.holds, 1), 0, int(min(s.samples, length * scenario.fs))
    cut = 2 * np.pi * (scenario.torque.cutoff or np.inf)
    while step < last * clock.per_sample + clock.late:
        rotor, rotor_qd = data.qpos[::stride].copy(), data.qvel[::stride].copy()
        q = rotor if stride == 1 else rotor + data.qpos[1::2]
        qd = rotor_qd if stride == 1 else rotor_qd + data.qvel[1::2]
        k, late = divmod(step, clock.per_sample)
        if late == 0 and k < s.samples:
            out["q"][k], out["qd"][k], out["current"][k] = q, qd, sensed
        history.put(step, *((rotor, rotor_qd) if scenario.drive.before_gear else (q, qd)))
        c, after = divmod(step - clock.late, clock.per_sample)
        if after == 0 and c >= 0:
            earlier, out["measured"][c] = command, s.reader(c, history.at(step - clock.late + s.off[c]))
            out["command"][c] = command = np.ravel(s.law(c, out["measured"][c]))
            demand = command if clock.old == 0 else clock.old * earlier + (1 - clock.old) * command
        elif after == 1:
            demand = command
        steps = min(clock.per_sample - after, clock.per_sample - late, s.most)
        steps = 1 if after == 0 and (s.steady or clock.old > 0) else steps
        mid_qd, electric, tau = torques(scenario, s, demand, (rotor, rotor_qd, q, qd), before, steps)
        before = rotor_qd, steps
        for part in electric:
            sensed = part - (part - sensed) * np.exp(-cut * (steps * clock.h) / len(electric))
        total = tau + s.friction(tau[0], mid_qd[0])
        for i in range(steps):
            data.qfrc_applied[::stride] = total[min(i, len(total) - 1)]
            mujoco.mj_step(s.model, data)
        if k < s.samples:
            out["tau"][k] += np.add.reduce(tau) / len(tau) * steps / clock.per_sample
        step += steps
    return {name: values[:last] for name, values in out.items()}
