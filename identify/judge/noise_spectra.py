"""The spectra that the noise of a log should have in the residuals of the explicit model."""

import numpy as np
import scipy

from idbench.identify.arrays import Array
from idbench.identify.estimators.problem import Problem
from idbench.identify.noise.propagation import NoiseLevels

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
    inertia, damping, stiffness = problem.parts[0].linear.at(some)

    def mean(x: Array) -> Array:
        """Return the mean of x, shape (joint, joint, time), where joints move, times the squared noise of each position."""
        return np.sum(x * moving, axis=-1) / np.maximum(np.sum(moving, axis=-1), 1) @ levels.position**2

    parts = (
        (mean(stiffness**2), plain**2),
        (-2 * mean(stiffness * inertia), plain * twice),
        (mean(inertia**2), twice**2),
        (mean(damping**2), rate**2),
    )
    of_position = np.sqrt(np.maximum(sum(np.outer(of_joint, of_f) for of_joint, of_f in parts), 0.0))
    return np.sqrt(2 / fs) * levels.torque[:, None] * aligned, np.sqrt(2 / fs) * of_position
