"""The spectra that the noise of a log should have in what the explicit model leaves over."""

import numpy as np
import scipy

from identify.arrays import Array
from identify.estimators.problem import Problem
from identify.rows.noise_propagation import NoiseLevels

EVERY = 50.0
"""Frequency of the instants over which the robot's slopes are averaged [Hz]."""


def noise_spectra(problem: Problem, levels: NoiseLevels, f: Array) -> tuple[Array, Array]:
    """Return amplitude densities [N m/sqrt(Hz)] of torque and position noise in the torques, shape (joint, len(f)) each.

    White noise of a torque has the density sigma sqrt(2 / fs), before alignment and prefilter. That of positions is multiplied
    by inertia s^2 + damping s + stiffness, whose squares are averaged over the instants at which joints move.

    Parameters
    ----------
    problem : Problem
        Of one run of one log.
    levels : NoiseLevels
        Of its log.
    f : Array
        Frequencies [Hz].
    """
    signals = problem.signals[0]
    fs, some = signals.fs, slice(0, None, max(1, int(signals.fs / EVERY)))
    impulse = np.zeros(4 * int(np.ceil(problem.chain.halo(fs, signals.log.torque) * fs)) + 101)
    impulse[len(impulse) // 2] = 1.0
    zero = np.zeros_like(impulse)
    aligned, plain, rate, twice = (
        np.abs(scipy.signal.freqz(h, worN=f, fs=fs)[1])
        for h in (
            signals.torque_adjoint(impulse),
            signals.position_adjoint((impulse, zero, zero)),
            signals.position_adjoint((zero, impulse, zero)),
            signals.position_adjoint((zero, zero, impulse)),
        )
    )
    moving = (signals.weight[:, None, some] > 0).astype(np.float64)
    inertia, damping, stiffness = (x[..., None] for x in problem.linear(signals).at(some))
    squares = (stiffness * plain - inertia * twice) ** 2 + (damping * rate) ** 2
    mean = np.sum(squares * moving[..., None], axis=2) / np.maximum(np.sum(moving, axis=2), 1)[..., None]
    of_position = np.sqrt(np.einsum("jkf,k->jf", mean, levels.position**2))
    return np.sqrt(2 / fs) * levels.torque[:, None] * aligned, np.sqrt(2 / fs) * of_position
