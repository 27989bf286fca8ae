"""Ripples of joints' torques: of which numbers of waves a turn residuals have most."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

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

    Scores of waves that are not there scatter as chi squared with two degrees of freedom, with the median of them all.

    Parameters
    ----------
    problem : Problem
        Of one run, whose rows are kept.
    X : Array, shape (p,)
        Its estimate.
    certain : float
        Probability that any wave of any joint seems as significant by chance, below which one is suspected.
    proof : float
        Share of the squares of z_b that the mean of the other stretches may leave, and of residuals beyond noise.
    """
    if not (cutoff := problem.own_chain.cutoff) or problem.logs[0].poses:
        return
    parts, hinges = problem.explicit.parts, problem.basis.hinges
    torque = [torques(problem.basis, part.signals.state, X) for part in parts]
    measured = (replace(part.signals, prefilter=NoPrefilter()).torque.mean for part in parts)
    left = [tau - x for tau, x in zip(measured, torque, strict=True)]
    for j in hinges:
        e, found, own = [x[j] for x in left], list[Suspect](), [x[j] for x in torque]
        first, noise = _squares(e), sum(float(np.sum(np.diff(x, 2) ** 2)) / 6 for x in e)
        for _ in range(LIKELY):
            kinds = [_fastest(parts, j, e, x, cutoff) for x in ([np.ones_like(x) for x in own], own)]
            of = int(np.argmax([one.score for one in kinds]))
            wave, p = kinds[of], len(hinges) * kinds[of].p
            z = np.concatenate([_by_stretch(x, unit) for x, unit in zip(e, wave.units, strict=True)])
            others = (z.sum() - z) / max(len(z) - 1, 1)
            if p > certain or len(z) < STRETCHES or np.sum(np.abs(z - others) ** 2) > proof * np.sum(np.abs(z) ** 2):
                break
            before, e = e, [x - (z.mean().conjugate() * unit).real for x, unit in zip(e, wave.units, strict=True)]
            before_after = tuple(float(100 * np.sqrt(_squares(x) / max(_squares(own), TINY))) for x in (before, e))
            found.append(wave.suspect(j, of, z, p, (before_after[0], before_after[1])))
        # What is left beyond white noise, of which squares of second differences have six times as much.
        yield from found if _squares(e) - noise < proof * (first - noise) else ()


class _FastWave(NamedTuple):
    """The wave that samples above a band have most of."""

    score: float
    p: float
    """Probability that any wave of the joint has this score by chance."""
    k: int
    """Waves a turn."""
    top: float
    """Its highest frequency [Hz]."""
    units: list[Array]
    """x exp(i k q) in each log, 0 within the band, shape (time,)."""

    def suspect(self, j: int, of: int, z: Array, p: float, held_out: tuple[float, float]) -> Suspect:
        """The ripple of a joint, by z of each stretch: cogging, or of the torque constant."""
        cause, unit = (("cogging", "N m"), ("commutation", "1"))[of]
        size, sigma = float(np.abs(z.mean())), float(np.std(np.abs(z), ddof=1) / np.sqrt(len(z)))
        t = size / max(sigma, TINY)
        return Suspect(
            cause, "drive", j, (size,), (sigma,), unit, p, t, (), held_out, self.score, setting=float(self.k), band=self.top
        )


def _squares(e: Sequence[Array]) -> float:
    """Sum of squares of a signal in all logs."""
    return sum(float(np.sum(x**2)) for x in e)


def _fastest(parts: Sequence[LogRows], j: int, e: Sequence[Array], sizes: Sequence[Array], cutoff: float) -> _FastWave:
    """The wave that samples above the band have most of."""
    each = zip(parts, e, sizes, strict=True)
    scores = np.sum([_of_joint(part, j, x, size, (cutoff, np.inf)) for part, x, size in each], axis=0)
    usual = float(np.median(scores[scores > 0])) if scores.any() else TINY
    score, k = 2 * np.log(2) * float(scores.max()) / usual, int(WAVES[scores.argmax()])
    states = [part.signals.state for part in parts]
    outside = [k * np.abs(state.qd[j]) >= 2 * np.pi * cutoff for state in states]
    units = [at * x * np.exp(1j * k * s.q[j]) for at, x, s in zip(outside, sizes, states, strict=True)]
    top = k / (2 * np.pi) * max(float(np.abs(state.qd[j]).max()) for state in states)
    return _FastWave(score, 2 * len(WAVES) * float(np.exp(-score / 2)), k, top, units)


def _by_stretch(e: Array, wave: Array) -> Array:
    """z_b of each stretch of a log, shape (stretch,)."""
    seen = np.flatnonzero(wave)
    every = np.array_split(seen, STRETCHES) if len(seen) > STRETCHES else [seen]
    return np.array([2 * np.sum(e[at] * wave[at]) / max(float(np.sum(np.abs(wave[at]) ** 2)), TINY) for at in every])


def _scores(part: LogRows, e: Array, size: Array, cutoff: float) -> Array:
    """Score of each number of waves in one log, shape (joint, wave)."""
    state, rows = part.signals.state, part.rows
    t, inside = np.arange(state.q.shape[-1]) / part.signals.fs, rows.maps[0].inside
    every = [np.interp(t, rows.time[rows.group == j], e[rows.group == j]) for j in range(len(size))]
    return np.stack([_of_joint(part, j, x, inside[j] * size[j], (0.0, cutoff)) for j, x in enumerate(every)])


def _of_joint(part: LogRows, j: int, e: Array, size: Array, band: tuple[float, float]) -> Array:
    """Score of each number of waves in a signal of one joint, of the instants at which it is in a band [Hz], shape (wave,)."""
    state, (low, high) = part.signals.state, 2 * np.pi * np.array(band)
    # Of rows all instants count: what they have where a wave is above their band is none of its own.
    some = slice(None, None, max(1, len(e) // ENOUGH) if low else 1)
    left, squares, found = (e * size)[some], size[some] ** 2, np.zeros(len(WAVES))
    phase, speed, every = np.exp(1j * state.q[j, some]), np.abs(state.qd[j, some]), np.sum(squares)
    wave = phase ** WAVES[0]
    for i, k in enumerate(WAVES):
        at = (k * speed >= low) & (k * speed < high)
        seen = float(np.sum(squares[at]))
        if seen > SEEN * every:
            found[i] = np.abs((left * at if low else left) @ wave) ** 2 / seen
        wave = wave * phase
    return found
