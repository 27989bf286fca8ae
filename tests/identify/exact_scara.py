"""A SCARA by the paper's Eq. 51, held torques, and friction that jumps: each reversal is found, and each stop kept.

Another simulator than MuJoCo, whose friction is soft near rest. Runs are the first axis throughout.
"""

import numpy as np

PERIOD, STEPS, HALVINGS, EVENTS = 0.01, 10, 40, 8
X = np.array([3.5, 0.05, 0.5, 0.06, 0.12, 0.005, 0.01, 0.1])
VISCOUS, COULOMB = X[[1, 6]], X[[2, 7]]


def coulomb(v, sign):
    return COULOMB * sign


def stribeck(speed, more):
    return lambda v, sign: COULOMB * sign * (1 + more * np.exp(-((v / speed) ** 2)))


def soft(speed):
    return lambda v, sign: COULOMB * np.tanh(v / speed)


def rigid(q, v, X=X):
    """Return M11, M12, M22 and the Coriolis torques."""
    ZZR1, _, _, ZZ2, LMX2, LMY2, _, _ = X
    c, s = np.cos(q[..., 1]), np.sin(q[..., 1])
    k, g = LMX2 * c - LMY2 * s, LMX2 * s + LMY2 * c
    coriolis = np.stack([-g * (2 * v[..., 0] + v[..., 1]) * v[..., 1], g * v[..., 0] ** 2], axis=-1)
    return ZZR1 + ZZ2 + 2 * k, ZZ2 + k, ZZ2 + 0 * k, coriolis


def momentum(X, q, v):
    """Return M(q) v."""
    M11, M12, M22, _ = rigid(q, v, X)
    return np.stack([M11 * v[..., 0] + M12 * v[..., 1], M12 * v[..., 0] + M22 * v[..., 1]], axis=-1)


def torque(X, q, v, a):
    """Return the torques of a motion (Eq. 51)."""
    return momentum(X, q, a) + rigid(q, v, X)[-1] + X[[1, 6]] * v + X[[2, 7]] * np.sign(v)


def acceleration(q, v, u, sign, sticks, law):
    M11, M12, M22, coriolis = rigid(q, v)
    free = np.where(sticks, 0.0, u - coriolis - VISCOUS * v - law(v, sign))
    M11, M22 = np.where(sticks[:, 0], 1.0, M11), np.where(sticks[:, 1], 1.0, M22)
    M12 = np.where(sticks.any(axis=1), 0.0, M12)
    f, g = free.T
    return np.stack([M22 * f - M12 * g, M11 * g - M12 * f], axis=1) / (M11 * M22 - M12**2)[:, None]


def stepped(q, v, h, *how):
    """Return q and v after times h, shape (run,), by Runge and Kutta."""
    h = h[:, None]
    a1 = acceleration(q, v, *how)
    a2 = acceleration(q + h / 2 * v, v + h / 2 * a1, *how)
    a3 = acceleration(q + h / 2 * (v + h / 2 * a1), v + h / 2 * a2, *how)
    a4 = acceleration(q + h * (v + h / 2 * a2), v + h * a3, *how)
    return q + h * v + h**2 / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def simulated(motion, law=coulomb, static=1.0, jumps=True):
    """Return positions, velocities and torques, shape (run, time, joint) each, of a robot that a controller leads.

    `static` is friction at rest over that of slow motion.
    """
    reference, rate, bend = motion
    q, v = reference[:, 0].copy(), rate[:, 0].copy()
    sign = np.sign(v)
    sticks = (sign == 0) & jumps
    found = np.zeros((3, *reference.shape))
    for k in range(reference.shape[1]):
        wanted = bend[:, k] + 50 * (rate[:, k] - v) + 625 * (reference[:, k] - q)
        u = momentum(X, q, wanted)
        u += rigid(q, v)[-1] + VISCOUS * v + COULOMB * np.tanh(rate[:, k] / 0.02)
        found[:, :, k] = q, v, u
        for _ in range(STEPS):
            if jumps:
                q, v, sign, sticks = through_events(q, v, u, sign, sticks, law, static)
            else:
                q, v = stepped(q, v, np.full(len(q), PERIOD / STEPS), u, sign, sticks, law)
    return found


def through_events(q, v, u, sign, sticks, law, static):
    """Return the state after a step, in which joints may stop, and go on if torque is more than friction holds."""
    left = np.full(len(q), PERIOD / STEPS)
    for _ in range(EVENTS):
        _, M12, _, coriolis = rigid(q, v)
        a = acceleration(q, v, u, sign, sticks, law)
        held = u - coriolis - M12[:, None] * a[:, ::-1]
        goes = sticks & (np.abs(held) > static * np.abs(law(0.0, 1.0)))
        sign, sticks = np.where(goes, np.sign(held), np.where(sticks, 0.0, sign)), sticks & ~goes
        q1, v1 = stepped(q, v, left, u, sign, sticks, law)
        events = np.flatnonzero((sign * v1 < 0).any(axis=1))
        if not len(events):
            return q1, v1, sign, sticks
        low, high = np.zeros(len(events)), left[events]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            some = (x[events] for x in (u, sign, sticks))
            late = (sign[events] * stepped(q[events], v[events], middle, *some, law)[1] < 0).any(axis=1)
            low, high = np.where(late, low, middle), np.where(late, middle, high)
        until = left.copy()
        until[events] = high
        q, v = stepped(q, v, until, u, sign, sticks, law)
        stops = sign * v < 0
        v, sign, sticks, left = np.where(stops, 0.0, v), np.where(stops, 0.0, sign), sticks | stops, left - until
    return q, v, sign, sticks


def series(runs, seconds=26, harmonics=range(2, 15), period=26, seed=0, acceleration=(8, 20)):
    """Return random sums of sines, by default of periods of 2 to 13 s: about 26 reversals of the first joint."""
    t, rng = np.arange(round(seconds / PERIOD)) * PERIOD, np.random.default_rng(seed)
    w = 2 * np.pi / period * np.array(harmonics)
    a, b = rng.standard_normal((2, runs, 2, len(w)))
    sine, cosine = np.sin(w * t[:, None]), np.cos(w * t[:, None])
    q, qd, qdd = (
        np.einsum("rjk,tk->rtj", a * scale, x) + np.einsum("rjk,tk->rtj", b * scale, y)
        for scale, x, y in ((1 / w, sine, -cosine), (np.ones_like(w), cosine, sine), (w, -sine, cosine))
    )
    size = np.minimum(1.5 / np.abs(q).max(axis=1), 3 / np.abs(qd).max(axis=1))
    size = np.minimum(size, np.array(acceleration) / np.abs(qdd).max(axis=1))[:, None]
    return size * q, size * qd, size * qdd


def moves(runs, seconds=26, durations=(0.8, 1.3), begin=0.3, seed=0):
    """Return random fifth-order moves with rests."""
    t, rng = np.arange(round(seconds / PERIOD)) * PERIOD, np.random.default_rng(seed)
    found = np.zeros((3, runs, len(t), 2))
    for run, joint in np.ndindex(runs, 2):
        start, here = begin, 0.0
        while start < seconds:
            duration, there = rng.uniform(*durations), rng.uniform(-1.5, 1.5)
            inside, s = (start <= t) & (start + duration > t), np.clip((t - start) / duration, 0, 1)
            found[0, run, t >= start, joint] = (here + (there - here) * (10 * s**3 - 15 * s**4 + 6 * s**5))[t >= start]
            found[1, run, inside, joint] = ((there - here) * 30 * (s - s**2) ** 2 / duration)[inside]
            found[2, run, inside, joint] = ((there - here) * 60 * (s - 3 * s**2 + 2 * s**3) / duration**2)[inside]
            start, here = start + duration + rng.uniform(0.1, 0.3), there
    return found
