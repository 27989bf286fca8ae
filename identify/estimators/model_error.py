"""The part of an estimate's error that comes from the model: from residuals beyond those of noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self, final

import numpy as np

from idbench.identify.arrays import TINY, Array
from idbench.identify.basis.block import Kind, Parameter
from idbench.identify.estimators.log_rows import LogRows

MEMORY = 3.0
"""Time [s] over which residuals are correlated: 0.2 to 3 s on real robots. With 1.5 or 6 s, agreement of fits of single logs
changes by less than 1 % of the cases (UR10e, six logs)."""

IN_PHASE = 0.25
"""Share of the largest effect of a residual that is in phase with the columns, as in a motion that repeats: no covariance of
residuals contains it. Fits of single logs agree, with 0.2 and 0.25, in 98 and 99 % (UR10e) and 80 and 83 % (KR300); 0.25 is
from simulated arms whose friction depends on load, of which intervals then hold 90 % of the parameters."""

MOST = 0.75
"""Share of independent residuals, at most, that the parameters are taken to absorb: of fewer nothing is left to count. From 0.5
to 0.9 no figure of UR10e and KR300 changes; shorter logs are said to be too short."""

MARGIN = 1.3
"""Residuals up to this multiple of those of noise count as noise: levels of noise are known to some 20 %. With 1, sigma is ten
times that of noise in one of six simulated PUMAs with encoder noise alone (1.13 on average with 1.3 and with 1.6); from 1 to 2,
fits of single logs agree in 99.1 to 97.1 % (UR10e) and 85 to 82 % (KR300)."""

CHANCE = 0.1
"""Share of residuals beyond noise that chance may give: with noise alone 0.00 to 0.02 on average over motions and robots."""

CHANGES: dict[Kind, float] = {"viscous friction": 0.10, "Coulomb friction": 0.05, "friction": 0.05}
"""Standard deviation of friction between logs, as a share of its value, where a single log is fitted: friction changes with
temperature and wear. UR10e: 6 % (3 to 20 % by joint) and 2 % (1 to 8 %) beyond what a log by itself shows."""


@final
@dataclass(frozen=True, eq=False)
class ModelError:
    """The error that a wrong model gives an estimate X = G' Y. Leading axes are runs."""

    covariance: Array
    """Of the error of X within a log, shape (..., p, p)."""
    scatter: Array
    """Variance of X from log to log beyond that, shape (..., p)."""
    share: Array
    """Share of residuals significantly beyond `MARGIN` times noise, at the frequencies of the torque, shape (..., kind)."""
    independent: Array
    """Number of independent residuals: those of a time as long as their correlation count as one, shape (...)."""

    @classmethod
    def of(cls, parts: Sequence[LogRows], X: Array, influence: Sequence[Array], whole: float, *, pieces: bool = False) -> Self:
        """Return the error of an estimate, from its residuals.

        The residual of kind j has a spectrum S_j, from its autocorrelation up to `MEMORY` (Hann taper), of which noise explains
        S0_j. With E_j = max(0, S_j - (1 + 2 epsilon) S0_j), epsilon being the relative standard error of S_j, and R_j the
        Toeplitz matrix of E_j, the covariance is that of a stationary residual (HAC), to which a share of the largest effect
        that a residual of this spectrum may have on each parameter is added, g_j being the transform of G_j:

            sum over j of  G_j' R_j G_j   and   IN_PHASE^2 (sum over f of |g_j(f)| sqrt(N E_j(f)) / N)^2

        where E_j counts in the second as far as it is beyond `MARGIN`^2 (1 + 2 epsilon) S0_j. Both are divided by 1 - p over
        the independent residuals: parameters absorb that share.

        Parameters
        ----------
        parts : sequence of LogRows
            Rows of the estimate.
        X : Array, shape (..., p)
            The estimate.
        influence : sequence of Array, shape (..., r, p)
            G of each part.
        whole : float
            Share of all rows that the parts make.
        pieces : bool
            Whether parts are pieces of the same logs, whose effects that are in phase add before they are squared.
        """
        steps = [round(part.rows.maps[0].grid.step / part.rows.maps[0].signals.fs, 6) for part in parts]
        if len(set(steps)) > 1:  # lags of one are not those of the other
            chosen = [[k for k, step in enumerate(steps) if step == own] for own in sorted(set(steps))]
            found = [cls.of([parts[k] for k in own], X, [influence[k] for k in own], whole, pieces=pieces) for own in chosen]
            covariance = np.sum([one.covariance for one in found], axis=0)
            independent = np.sum([one.independent for one in found], axis=0)
            return cls(covariance, np.zeros(X.shape), np.max([one.share for one in found], axis=0), independent)
        each = [_Residuals.of(part, X, G) for part, G in zip(parts, influence, strict=True)]
        lags = min(max(one.lags for one in each), max(one.rho.shape[-1] for one in each))
        taper = 0.5 + 0.5 * np.cos(np.pi * np.arange(lags) / lags)
        rows, time = (np.sum([getattr(part, x) for part in each], axis=0) for x in ("rows", "time"))
        ratio = np.sum([part.ratios(lags) * part.rows[..., None] for part in each], axis=0) / np.maximum(rows, TINY)[..., None]
        beyond_chance = 1 + 2 * np.sqrt(0.75 * MEMORY / np.maximum(time, MEMORY))[..., None]
        share, worst = np.zeros(ratio.shape[:-1]), np.zeros(X.shape)
        meat = np.zeros((*X.shape, X.shape[-1]))
        for part in each:
            S, S0 = part.spectra(taper * ratio, beyond_chance)
            share = np.maximum(share, part.share(S, S0))
            sandwich, most = part.sandwich(S, S0)
            meat = meat + sandwich / whole
            worst = worst + (np.sqrt(most) / whole if pieces else most / whole)
        worst = worst**2 if pieces else worst
        products = np.sum([part.products(lags) for part in each], axis=0)
        correlation = taper * products / np.maximum(products[..., :1], TINY)
        independent = np.sum(rows / whole / (1 + 2 * np.sum(correlation[..., 1:] ** 2, axis=-1)), axis=-1)
        absorbed = np.minimum(X.shape[-1] / np.maximum(independent, 1.0), MOST)
        diagonal = np.maximum(np.diagonal(meat, axis1=-2, axis2=-1), TINY)
        scale = np.sqrt((1 + IN_PHASE**2 * worst / diagonal) / (1 - absorbed)[..., None])
        return cls(meat * scale[..., :, None] * scale[..., None, :], np.zeros(X.shape), share, independent)

    def changes(self, parameters: Sequence[Parameter], X: Array) -> Array:
        """Return the variance of friction from log to log (`CHANGES`), as far as noise does not explain the residuals.

        A robot whose residuals are noise has constant friction.
        """
        last = self.share.shape[-1] - 1
        share = np.stack([self.share[..., min(p.joint or 0, last)] for p in parameters], axis=-1)
        sigma = np.array([CHANGES.get(p.kind, 0.0) for p in parameters]) * X
        return np.asarray(share * sigma**2)


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Residuals of one log, by kind, and what belongs to them."""

    rho: Array
    """Shape (..., kind, count)."""
    Y: Array
    """Measured, shape (..., kind, count)."""
    left: Array
    """Standard deviation of noise in each row over the largest: what mask and velocities leave, shape (..., kind, count)."""
    G: Array
    """Shape (..., kind, count, p)."""
    noise: Array
    """Expected sums of products of noise with that of later rows, shape (..., kind, lag)."""
    reference: Array
    """The same of noise that explains the residuals, shape (..., kind, lag)."""
    step: float
    """Time between rows [s]."""

    @classmethod
    def of(cls, part: LogRows, X: Array, G: Array) -> Self:
        rows, to_rows = part.rows, part.rows.maps[0]
        Y = rows.by_kind(rows.Y * rows.valid)
        likely = part.likely_covariance
        deviation = np.broadcast_to(rows.by_kind(np.sqrt(likely.variance)) * rows.by_kind(rows.valid), Y.shape)
        most = np.max(deviation, axis=-1, keepdims=True)
        left = np.divide(deviation, most, out=np.array(np.broadcast_to(to_rows.outside, Y.shape)), where=most > 0)
        by_kind = np.swapaxes(G.reshape(*G.shape[:-2], -1, rows.kinds, G.shape[-1]), -2, -3) * left[..., None]
        expected = part.covariance.autocovariance, likely.autocovariance
        rho = Y - rows.by_kind(rows.predicted(X) * rows.valid)
        return cls(rho, Y, left, by_kind, *expected, to_rows.grid.step / to_rows.signals.fs)

    @property
    def lags(self) -> int:
        return max(2, int(MEMORY / self.step))

    @property
    def rows(self) -> Array:
        return np.sum(self.left**2, axis=-1)

    @property
    def time(self) -> Array:
        return np.count_nonzero(self.left, axis=-1) * self.step

    @property
    def size(self) -> int:
        """Of transforms."""
        return 1 << int(np.ceil(np.log2(self.rho.shape[-1] + self.lags)))

    def products(self, lags: int) -> Array:
        """Return the sums of products of residuals with later ones, shape (..., kind, lag)."""
        return _lags(np.abs(np.fft.rfft(self.rho, self.size)) ** 2, lags)

    def ratios(self, lags: int) -> Array:
        """Return the transform of the residuals' squares over those of the reference, shape (..., kind, lag)."""
        reference = self._spectrum(self.reference)
        squares = np.abs(np.fft.rfft(self.rho, self.size)) ** 2
        return _lags(np.divide(squares, reference, out=np.zeros_like(squares), where=reference > 0), lags)

    def spectra(self, ratio: Array, beyond_chance: Array) -> tuple[Array, Array]:
        """Return S, and S0 with its margin, shape (..., kind, frequency).

        Residuals are divided by the reference before they are averaged over frequencies: noise of positions grows with f^4.
        """
        rows = np.maximum(self.rows, TINY)[..., None]
        return self._spectrum(self.reference) * self._spectrum(ratio) / rows, beyond_chance * self._spectrum(self.noise) / rows

    def share(self, S: Array, S0: Array) -> Array:
        """Return the share of S beyond `MARGIN`, as the mean over the torque's spectrum, shape (..., kind)."""
        weight = np.abs(np.fft.rfft(self.Y, self.size)) ** 2
        beyond = np.maximum(1 - MARGIN**2 * np.divide(S0, S, out=np.ones_like(S), where=S > 0), 0.0)
        share = np.sum(weight * beyond, axis=-1) / np.maximum(np.sum(weight, axis=-1), TINY)
        return np.asarray(np.maximum(share - CHANCE, 0.0) / (1 - CHANCE))

    def sandwich(self, S: Array, S0: Array) -> tuple[Array, Array]:
        """Return sum over kinds of G' R G, R having the spectrum E, shape (..., p, p), and of the largest effects, squared."""
        F = np.fft.rfft(np.swapaxes(self.G, -1, -2), self.size)
        counted = np.r_[1.0, np.full(S.shape[-1] - 2, 2.0), 1.0]  # how often a frequency is among those of a complex transform
        root = F * np.sqrt(np.maximum(S - S0, 0.0) * counted / self.size)[..., None, :]
        meat = np.matmul(root, np.conj(np.swapaxes(root, -1, -2))).real.sum(axis=-3)
        beyond = np.sqrt(np.maximum(S - MARGIN**2 * S0, 0.0))
        most = np.sum(np.abs(F) * (beyond * counted)[..., None, :], axis=-1) / self.size
        return np.asarray(meat), np.sum(most**2 * self.rows[..., None], axis=-2)

    def _spectrum(self, products: Array) -> Array:
        """Return the spectrum of what is even, from its values at lags 0, 1, ..., shape (..., size / 2 + 1), not negative."""
        some = products[..., : self.size // 2]
        zeros = np.zeros((*some.shape[:-1], self.size - 2 * some.shape[-1] + 1))
        return np.maximum(np.fft.rfft(np.concatenate([some, zeros, some[..., :0:-1]], axis=-1)).real, 0.0)


def _lags(squares: Array, lags: int) -> Array:
    """Return the transform of a spectrum, at lags 0, 1, ..., shape (..., lag)."""
    found = np.fft.irfft(squares)
    return np.pad(found[..., :lags], [(0, 0)] * (found.ndim - 1) + [(0, max(0, lags - found.shape[-1]))])
