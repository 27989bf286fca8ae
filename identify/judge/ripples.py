"""Ripples of joints' torques: of which numbers of waves a turn residuals have most."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.newton_euler import torques
from idbench.identify.estimators.log_rows import LogRows, split_by_log
from idbench.identify.estimators.problem import Problem
from idbench.identify.judge.suspect import Suspect
from idbench.identify.signals.prefilters import NoPrefilter

WAVES = np.arange(1, 91)
"""Waves a turn that are looked for: a cable has 1, harmonic drives 2, motors of 6 to 90 slots without a gear as many."""

LIKELY = 2  # Numbers of waves that residuals have most of, for each joint, whose columns are made
APART = 2  # Waves about these whose columns are made, too: parameters have taken a part of what residuals had
STRETCHES = 10  # Of the samples: the others predict the ripple of each
ENOUGH = 5000  # Samples of a log that are looked at: a ripple of 2 % of a torque with 5 % of noise is 28 sigma of so many
FEWEST = 10  # Samples of a stretch
SEEN = 0.02  # Share of the motion in which a wave must be within the band of the rows


def likely_waves(
    parts: Sequence[LogRows], e: Array, sizes: Sequence[Array], cutoff: float, hinges: Sequence[int], apart: int = APART
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
    apart : int
        Waves about these that are yielded, too.
    """
    every = zip(parts, split_by_log(e, parts), sizes, strict=True)
    scores = np.sum([_scores(part, own, x, cutoff) for part, own, x in every], axis=0)
    for j in hinges:
        likely, score = set[int](), scores[j]
        for _ in range(LIKELY):
            away = np.abs(WAVES - WAVES[score.argmax()])
            if score.max() > TINY:
                likely |= set(WAVES[away <= apart].tolist())
            score[away <= APART] = 0.0
        yield from ((j, k) for k in sorted(likely))


def fast_ripples(problem: Problem, X: Array, certain: float, proof: float) -> Iterator[Suspect]:
    """Yield ripples of hinges that rows have not, as they are above their band: samples of the torque have them.

        z_b = 2 sum e(t) x(t) exp(i k q(t)) / sum x(t)^2   over the instants of stretch b with k |qd| > 2 pi f_c

    Scores of waves that are not there scatter as chi squared with two degrees of freedom, with the median of them all. Each
    stretch is predicted by the others, and what is left beyond white noise then is at most a share.

    Parameters
    ----------
    problem : Problem
        Of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    certain : float
        Probability that any wave of any joint seems as significant by chance, below which one is suspected.
    proof : float
        Share of the squares of z_b that the other stretches may leave, and of residuals beyond noise.
    """
    if not (cutoff := problem.own_chain.cutoff) or problem.logs[0].poses:
        return
    hinges, signals = problem.basis.hinges, [part.signals for part in problem.explicit.parts]
    predicted = [torques(problem.basis, one.state, X) for one in signals]
    measured = [replace(one, prefilter=NoPrefilter()).torque.mean for one in signals]
    for j in hinges:
        each = zip(signals, measured, predicted, strict=True)
        rows = [np.array([s.state.q[j], s.state.qd[j], tau[j], own[j]]) for s, tau, own in each if j not in s.log.missing]
        if rows:
            yield from _fast_of_joint(j, np.concatenate(rows, axis=1), cutoff, certain / len(hinges), proof)


def _fast_of_joint(j: int, rows: Array, cutoff: float, certain: float, proof: float) -> Iterator[Suspect]:
    """Ripples of a joint above a band [Hz], of samples (q, qd, measured and predicted torque), shape (4, time)."""
    q, qd, measured, predicted = rows
    e, found = measured - predicted, list[Suspect]()
    first = rest = float(e @ e)
    for _ in range(LIKELY):
        kinds = [_fastest(q, qd, e, x, cutoff) for x in (np.ones_like(e), predicted)]
        of = int(np.argmax([score for score, _ in kinds]))
        score, k = kinds[of]
        p = 2 * len(WAVES) * float(np.exp(-score / 2))
        wave = np.where(k * np.abs(qd) > 2 * np.pi * cutoff, predicted if of else 1.0, 0.0) * np.exp(1j * k * q)
        stretches = np.array_split(np.flatnonzero(wave), STRETCHES)
        if p > certain or len(stretches[-1]) < FEWEST:
            break
        sums = np.array([2 * np.sum(e[at] * wave[at]) for at in stretches])
        sizes = np.array([np.sum(np.abs(wave[at]) ** 2) for at in stretches])
        z, mean, others = sums / sizes, sums.sum() / sizes.sum(), (sums.sum() - sums) / (sizes.sum() - sizes)
        if sizes @ np.abs(z - others) ** 2 > proof * (sizes @ np.abs(z) ** 2):
            break
        held_out = e.copy()
        for at, other in zip(stretches, others, strict=True):
            held_out[at] -= (other.conjugate() * wave[at]).real
        before, rest = rest, float(held_out @ held_out)
        errors = [100 * float(np.sqrt(x / max(measured @ measured, TINY))) for x in (before, rest)]
        along = (z * mean.conjugate()).real / abs(mean)  # of the same phase
        size, sigma = float(abs(mean)), float(np.std(along, ddof=1) / np.sqrt(len(z)))
        place = (*(("cogging", "drive"), ("commutation", "drive"))[of], j, (size,), (sigma,), ("N m", "1")[of], p)
        top = k / (2 * np.pi) * float(np.abs(qd).max())
        found.append(Suspect(*place, size / sigma, (), (errors[0], errors[1]), score, setting=float(k), band=top))
        e = e - (mean.conjugate() * wave).real
    # White noise has a sixth of the squares of its second differences.
    noise = float(np.sum(np.diff(e, 2) ** 2)) / 6
    yield from found if rest - noise < proof * (first - noise) else ()


def _fastest(q: Array, qd: Array, e: Array, size: Array, cutoff: float) -> tuple[float, int]:
    """Score of the number of waves that samples above a band have most of, as chi squared, and that number."""
    scores = _of_joint(q, qd, e, size, (cutoff, np.inf))
    usual = float(np.median(scores[scores > 0])) if scores.any() else TINY
    return 2 * np.log(2) * float(scores.max()) / usual, int(WAVES[scores.argmax()])


def _scores(part: LogRows, e: Array, size: Array, cutoff: float) -> Array:
    """Score of each number of waves in one log, shape (joint, wave)."""
    state, rows = part.signals.state, part.rows
    t, inside = np.arange(state.q.shape[-1]) / part.signals.fs, rows.maps[0].inside
    every = [np.interp(t, rows.time[rows.group == j], e[rows.group == j]) for j in range(len(size))]
    each = zip(state.q, state.qd, every, inside * size, strict=True)
    return np.stack([_of_joint(q, qd, x, own, (0.0, cutoff)) for q, qd, x, own in each])


def _of_joint(q: Array, qd: Array, e: Array, size: Array, band: tuple[float, float]) -> Array:
    """Score of each number of waves in a signal of one joint, of the instants at which it is in a band [Hz], shape (wave,)."""
    low, high = 2 * np.pi * np.array(band)
    # Of rows all instants count: what they have where a wave is above their band is none of its own.
    some = slice(None, None, max(1, len(e) // ENOUGH) if low else 1)
    left, squares, found = (e * size)[some], size[some] ** 2, np.zeros(len(WAVES))
    phase, speed, every = np.exp(1j * q[some]), np.abs(qd[some]), np.sum(squares)
    wave = phase ** WAVES[0]
    for i, k in enumerate(WAVES):
        at = (k * speed > low) & (k * speed < high) if low else k * speed < high
        seen = float(np.sum(squares[at]))
        if seen > SEEN * every:
            found[i] = np.abs((left * at if low else left) @ wave) ** 2 / seen
        wave = wave * phase
    return found
