"""The Cramer-Rao bound."""

import numpy as np
import pytest

from idbench.identify import Basis, CoulombFriction, NoiseLevels, ViscousFriction, cramer_rao, scara
from idbench.identify.basis.joint_law import Armature

FS = 100.0


def one_joint():
    """J qdd + Fv qd + Fs sign(qd)."""
    return Basis(1, (Armature(), ViscousFriction(), CoulombFriction()))


def motion(seconds, runs=()):
    """A joint that always moves forward, with accelerations that vary."""
    t = np.arange(round(seconds * FS)) / FS
    q, qd = 3 * t + np.sin(2 * t), 3 + 2 * np.cos(2 * t)
    return (np.broadcast_to(x[:, None], (*runs, len(t), 1)) for x in (q, qd))


def closed_form(q, qd, X, sq, st):
    """The whole Gaussian: positions are start, velocity, and torques of each period through J q'' = u, Fv small."""
    N, T = len(q), 1 / FS
    J, Fv = X[0], X[1]
    a, b = np.exp(-Fv / J * T), J / Fv
    step, push = np.array([[1, b * (1 - a)], [0, a]]), np.array([(T - b * (1 - a)) / Fv, (1 - a) / Fv])
    qdd = np.diff(qd[:, 0]) / T
    middle = (qd[:-1, 0] + qd[1:, 0]) / 2
    W = np.stack([qdd, middle, np.ones(N - 1)], axis=1)
    response = np.zeros((N, N - 1))
    state = np.zeros((2, N - 1))
    start, power = np.zeros((N, 2)), np.eye(2)
    for k in range(N):
        response[k], start[k] = state[0], power[0]
        if k < N - 1:
            state = step @ state
            state[:, k] += push
            power = step @ power
    C = sq**2 * np.eye(N) + st**2 * response @ response.T
    A = np.concatenate([response @ W, start], axis=1)
    return np.linalg.inv(A.T @ np.linalg.solve(C, A))[:3, :3]


@pytest.mark.parametrize(("sq", "st"), [(2.8e-5, 1e-4), (2.8e-5, 0.1), (4e-4, 0.01)])
def test_one_joint_against_the_whole_gaussian(sq, st):
    X = np.array([3.5, 0.5, 0.4])
    q, qd = motion(3.0)
    order = [one_joint().names.index(name) for name in one_joint().names]
    found = cramer_rao(one_joint(), X[order], q, qd, FS, NoiseLevels(np.array([st]), np.array([sq])))
    wanted = closed_form(q, qd, X, sq, st)
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(wanted)), rtol=0.01)


def test_it_scales_with_the_noise_and_runs_are_independent(truth):
    t = np.arange(600) / FS
    phase = np.array([0.0, 0.4, 0.9])[:, None, None]
    q = np.stack([np.sin(2 * t), np.cos(3 * t)], axis=-1) + 0 * phase + phase
    qd = np.broadcast_to(np.stack([2 * np.cos(2 * t), -3 * np.sin(3 * t)], axis=-1), q.shape)
    noise = NoiseLevels(np.full(2, 0.01), np.full(2, 1e-5))
    found = cramer_rao(scara(), truth, q, qd, FS, noise)
    alone = cramer_rao(scara(), truth, q[1], qd[1], FS, noise)
    np.testing.assert_allclose(found[1], alone, rtol=1e-9)
    # Friction's jump stands for an unknown torque where joints turn, which does not grow with the noise.
    double = cramer_rao(scara(), truth, q[1], qd[1], FS, NoiseLevels(np.full(2, 0.02), np.full(2, 2e-5)))
    np.testing.assert_allclose(np.sqrt(np.diag(double) / np.diag(alone)), 2.0, rtol=0.1)


def driven(X, start, u):
    """Positions and velocities of J qdd = u - Fv qd - Fs sign(qd) at the samples, u held for a period: piece by piece."""
    (J, Fv, Fs), (q, v) = X, start
    found = [(q, v)]
    for torque in u:
        left = 1 / FS
        while left > 0:
            sign = np.sign(v) or np.sign(torque)
            end = (torque - Fs * sign) / Fv  # velocity that it tends to
            turn = J / Fv * np.log1p(-v / end) if v * end < 0 else np.inf  # v - end falls by exp(-Fv t / J), to -end at zero
            step = min(left, turn)
            decay = np.exp(-Fv / J * step)
            q, v = q + end * step + (v - end) * J / Fv * (1 - decay), end + (v - end) * decay
            if step == turn:
                assert abs(torque) > Fs, "it sticks"
                v = 0.0
            left -= step
        found.append((q, v))
    return np.array(found).T


def slopes_of(function, x, size):
    steps = np.diag(size * np.ones(len(x)))
    return np.stack([(function(x + step) - function(x - step)) / (2 * step.sum()) for step in steps], axis=-1)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("sq", "st"), [(2.8e-5, 1e-4), (4e-4, 1e-3), (2.8e-5, 0.1)])
def test_reversals_against_differences_of_a_simulation(seed, sq, st):
    """The whole Gaussian of a joint that reverses: of start, parameters and torques, by simulating it anew for each."""
    X, rng = np.array([3.5, 0.5, 0.4]), np.random.default_rng(seed)
    t = np.arange(150) / FS
    w, phase = 4 * np.pi, rng.uniform(0, 2 * np.pi)
    u = 30 * np.sin(w * t + phase) + 6 * np.sin(0.37 * w * t)
    start = np.array([0.0, -30 / (X[0] * w) * np.cos(phase)])
    q, qd = driven(X, start, u)
    assert np.count_nonzero(qd[1:] * qd[:-1] < 0) >= 3
    of_X = slopes_of(lambda x: driven(x, start, u)[0], X, 1e-6)
    of_start = slopes_of(lambda x: driven(X, x, u)[0], start, 1e-6)
    of_u = slopes_of(lambda x: driven(X, start, x)[0], u, 1e-5)
    C, A = sq**2 * np.eye(len(q)) + st**2 * of_u @ of_u.T, np.concatenate([of_X, of_start], axis=1)
    wanted = np.sqrt(np.diag(np.linalg.inv(A.T @ np.linalg.solve(C, A)))[:3])
    order = [one_joint().names.index(name) for name in one_joint().names]
    noise = NoiseLevels(np.array([st]), np.array([sq]))
    found, masked = (
        np.sqrt(np.diag(cramer_rao(one_joint(), X[order], q[:, None], qd[:, None], FS, noise, reversals=used)))
        for used in (True, False)
    )
    np.testing.assert_allclose(found, wanted, rtol=0.01)
    assert (masked > found).all()


def test_joints_that_reverse_in_one_period_are_not_known_there():
    """Two joints that do not feel each other: the first is known better if the second reverses at other instants."""
    basis = Basis(2, (Armature(), ViscousFriction(), CoulombFriction()))
    X = np.array([{"Ia": 3.5, "Fv": 0.5, "Fs": 0.4}[name[:2]] for name in basis.names])
    t = np.arange(150) / FS
    u = 30 * np.sin(4 * np.pi * t + 1)
    q, qd = driven((3.5, 0.5, 0.4), (0.0, -30 / (3.5 * 4 * np.pi) * np.cos(1)), u)
    noise = NoiseLevels(np.full(2, 1e-3), np.full(2, 2.8e-5))
    together, apart = (
        cramer_rao(
            basis, X, *(np.stack([x[10:], x[start : start + len(x) - 10]], axis=1) for x in (q, qd)), FS, noise, reversals=True
        )
        for start in (10, 0)
    )
    first = basis.names.index("Fs1")
    assert together[first, first] > 1.5 * apart[first, first]
