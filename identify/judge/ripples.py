"""Ripples of joints' torques: of which numbers of waves a turn residuals have most."""

from collections.abc import Iterator, Sequence

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.estimators.log_rows import LogRows, split_by_log

WAVES = np.arange(1, 91)
"""Waves a turn that are looked for: a cable has 1, harmonic drives 2, motors of 6 to 90 slots without a gear as many."""

LIKELY = 2  # Numbers of waves that residuals have most of, for each joint, whose columns are made
APART = 2  # Waves about these whose columns are made, too: parameters have taken a part of what residuals had
SEEN = 0.02  # Share of the motion in which a wave must be within the band of the rows


def likely_waves(
    parts: Sequence[LogRows], e: Array, sizes: Sequence[Array], cutoff: float, hinges: Sequence[int]
) -> Iterator[tuple[int, int]]:
    """Yield hinges, each with numbers of waves a turn that residuals may have most of.

        s_k = |sum_t e(t) x(t) exp(i k q(t))|^2 / sum_t x(t)^2 [k |qd| < 2 pi f_c]

    Rows have what passes the operator, so that e between them is interpolated, and a wave counts where it is in their band.

    Parameters
    ----------
    parts : sequence of LogRows
        The explicit rows of each log.
    e : Array, shape (r,)
        Their residuals.
    sizes : sequence of Array, shape (joint, time)
        Amplitude of the wave over its size in each log, x: 1, or the torque that a ripple is a share of.
    cutoff : float
        Band of the rows, f_c [Hz].
    hinges : sequence of int
        The joints that are looked at.
    """
    every = zip(parts, split_by_log(e, parts), sizes, strict=True)
    scores = np.sum([_scores(part, own, x, cutoff) for part, own, x in every], axis=0)
    for j in hinges:
        likely, score = set[int](), scores[j]
        for _ in range(LIKELY):
            near = np.abs(WAVES - WAVES[score.argmax()]) <= APART
            if score.max() > TINY:
                likely |= set(WAVES[near].tolist())
            score[near] = 0.0
        yield from ((j, k) for k in sorted(likely))


def _scores(part: LogRows, e: Array, size: Array, cutoff: float) -> Array:
    """Score of each number of waves in one log, shape (joint, wave)."""
    state, fs, rows = part.signals.state, part.signals.fs, part.rows
    t, inside = np.arange(state.q.shape[-1]) / fs, rows.maps[0].inside
    found = np.zeros((len(size), len(WAVES)))
    for j, x in enumerate(inside * size):
        own = rows.group == j
        left, squares = np.interp(t, rows.time[own], e[own]) * x, x**2
        phase = np.exp(1j * state.q[j])
        wave = phase ** WAVES[0]
        for i, k in enumerate(WAVES):
            seen = float(np.sum(squares[k * np.abs(state.qd[j]) < 2 * np.pi * cutoff]))
            if seen > SEEN * np.sum(squares):
                found[j, i] = np.abs(left @ wave) ** 2 / seen
            wave = wave * phase
    return found
