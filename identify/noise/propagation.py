"""How noise of a log's torques and positions reaches its rows."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import chain
from math import ceil, floor

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.noise.band_matrix import BandMatrix
from idbench.identify.noise.covariance import BandedCovariance, Whitening
from idbench.identify.noise.linearization import Linearization, smoothed
from idbench.identify.rows.row_map import Grid, RowMap, in_order
from idbench.identify.signals.filters import CentralDifference, between_samples

RATE, EDGES = 50.0, 200.0
"""Least frequencies [Hz] at which noise is propagated: rows and motion have little beyond some 10 Hz, edges of masks more.

At 100 Hz sigma of motions that are slow throughout is off by up to 13 %, at 200 Hz by up to 6 %, of others by 2 %."""

ALIASED = 0.01  # Share of a variance by which it may be off for being summed at few samples: 0.5 % of sigma
TAIL = 1e-7
"""Share of the energy of a response, at either end, that is left out. Slow motion is seen where noise is least: with
1e-4 its sigma is 1.7 times too small."""


@dataclass(frozen=True, eq=False)
class NoiseLevels:
    """Standard deviations of white noise in a log, joint by joint. Leading axes are runs."""

    torque: Array
    """Of the torques [N m]; NaN of all joints in runs that cannot be solved, and of joints whose rows are all masked, shape
    (..., joint)."""
    position: Array
    """Of the positions [rad], shape (..., joint)."""
    repeats: Array = field(default_factory=lambda: np.ones(()))
    """How many times the variance of averages is what it would be if the positions' noise did not repeat itself, shape (...,
    joint), optional."""

    @property
    def in_rows(self) -> Array:
        """The noise of the torques as far as rows have it, shape (..., joint): none of joints whose rows are all masked."""
        masked = np.isnan(self.torque) & np.isfinite(self.torque).any(axis=-1, keepdims=True)
        return np.where(masked, 0.0, self.torque)

    @property
    def effective_position(self) -> Array:
        """Standard deviation of independent noise of the positions that averages as badly as theirs, shape (..., joint)."""
        return self.position * np.sqrt(self.repeats)


@dataclass(frozen=True, eq=False)
class Paths:
    """How unit noise of each joint reaches rows: see `BandedCovariance.of`."""

    grid: Grid
    """The rows, among the samples of the signals."""
    windows: list[Array]
    """What rows sum, shape (length,)."""
    signals: list[Array]
    """What they multiply the noise by, as many, shape (..., kind, joint, time)."""
    outside: Array
    """Weights of the rows, shape (..., kind, instant)."""

    def covariance(self, level: Array, most: int | None = None) -> BandedCovariance:
        """Covariance, over `most` lags, that noise of these standard deviations, shape (..., joint), gives the rows."""
        leveled = [signal * level[..., None, :, None] for signal in self.signals]
        return BandedCovariance.of(self.grid, self.windows, leveled, self.outside, most)

    def variance(self, level: Array) -> Array:
        """Return the variances that noise of these standard deviations, shape (..., joint), gives the rows, shape (..., r)."""
        return self.covariance(level, 1).variance

    def each(self) -> Iterator[BandedCovariance]:
        """Yield the covariances that unit noise gives the rows, joint by joint."""
        for j in range(self.signals[0].shape[-2]):
            yield BandedCovariance.of(self.grid, self.windows, [x[..., j : j + 1, :] for x in self.signals], self.outside)


def torque_paths(rows: RowMap) -> Paths:
    """Paths of torque noise to the rows.

    A row weighs the torques by its response times w B. Prefilter and alignment act on the response, as if w and B were constant
    over the little that they look at.
    """
    signals = rows.signals
    reach = ceil((signals.prefilter.halo(signals.fs) + signals.torque.halo()) * signals.fs - 1e-9)
    windows, grid, places, _ = _thinned([signals.torque_adjoint(np.pad(rows.response, reach))], rows)
    inside = between_samples(rows.inside, places)
    torques = np.zeros((*inside.shape[:-1], signals.log.n, inside.shape[-1]))
    for (row, joint), B in rows.B.items():
        factor = B if isinstance(B, float) else between_samples(signals.torque.average(B), places)
        torques[..., row, joint, :] = inside[..., row, :] * factor
    return Paths(grid, windows, [torques], rows.outside)


def position_paths(rows: RowMap, linear: Linearization) -> Paths:
    """Paths of position noise to the rows.

    The rows of every model are, to first order, those of B times the explicit model's error, so that one linearization serves
    all. A row of response h sums h w B (M s^2 + D s + K) n over time, M, D and K being inertia, damping and stiffness. By parts

        h w B (M s^2 + D s + K) n -> [h'' w B M + h' (2 (w B M)' - w B D) + h ((w B M)'' - (w B D)' + w B K)] n
    """
    windows, grid, places, per_second = _thinned(_responses(rows), rows)
    M, D, K = linear.at(places)
    s = partial(CentralDifference(spacing=1 / per_second).derivative, fs=per_second)
    M_rate, D_rate = s(M), s(D)
    M_bend = s(M_rate)
    inertia, damping, stiffness = (np.zeros((*M.shape[:-3], rows.outside.shape[-2], *M.shape[-2:])) for _ in range(3))
    for row, joint, u, rate, bend in _multipliers(rows, places):
        of_M, of_D, of_K = (x[..., joint, :, :] for x in (M, D, K))
        inertia[..., row, :, :] += u * of_M
        damping[..., row, :, :] += u * (of_D - 2 * M_rate[..., joint, :, :]) - 2 * rate * of_M
        of_K = of_K - D_rate[..., joint, :, :] + M_bend[..., joint, :, :]
        stiffness[..., row, :, :] += u * of_K + rate * (2 * M_rate[..., joint, :, :] - of_D) + bend * of_M
    return Paths(grid, windows, [stiffness, damping, inertia], rows.outside)


def _multipliers(rows: RowMap, places: Array) -> Iterator[tuple[int, int, Array, Array, Array]]:
    """Yield row, joint, w B at places [samples] and its two derivatives, by the product rule.

    Those of w are made of all samples, since the edges of a mask are sharp; the prefilter blurs them for the noise. B may be a
    measured velocity: it is smoothed, as in the linearization, or the derivatives would be those of its own noise.
    """
    fs = rows.signals.fs
    s = partial(CentralDifference(spacing=1 / fs).derivative, fs=fs)
    weights = [rows.signals.prefilter.apply(rows.inside, fs)]
    for _ in range(2):
        weights.append(s(weights[-1]))
    for (row, joint), B in rows.B.items():
        w, w1, w2 = (between_samples(x[..., row, None, :], places) for x in weights)
        slow = [] if isinstance(B, float) else [smoothed(B, fs)]
        factors = [between_samples(x[..., None, :], places) for x in (*slow, *map(s, slow), *map(s, map(s, slow)))]
        B0, B1, B2 = factors or (B, 0.0, 0.0)
        yield row, joint, w * B0, w1 * B0 + w * B1, w2 * B0 + 2 * w1 * B1 + w * B2


def _thinned(windows: Sequence[Array], rows: RowMap) -> tuple[list[Array], Grid, Array, float]:
    """Return windows at as few places as sums of their products need, as weights; the rows among these; places, and rate [Hz].

    A low-pass at 5 Hz needs far fewer than a log of 1 kHz has. Places divide the time from a row to the next, so that all rows
    have the same window; they may lie between samples [samples].
    """
    fs, grid = rows.signals.fs, rows.grid
    windows = _without_tails(windows, grid.first)
    before, samples = (len(windows[0]) - 1) // 2, rows.inside.shape[-1]
    H = np.stack(windows)
    full = np.matmul(H, H.T)
    size = ALIASED * np.sqrt(np.outer(np.diag(full), np.diag(full)))
    least = RATE if (rows.inside == 1).all() else EDGES
    for parts in range(ceil(grid.step * least / fs), grid.step // 2 + 1):
        apart = grid.step / parts
        ahead, after = floor(before / apart), floor((H.shape[-1] - 1 - before) / apart)
        thin = between_samples(H, before + apart * np.arange(-ahead, after + 1))
        first = floor(grid.first / apart)
        count = first + floor((samples - 1 - grid.first) / apart) + 1
        places = grid.first + apart * (np.arange(count) - first)
        if (np.abs(apart * np.matmul(thin, thin.T) - full) <= size).all():
            return list(np.sqrt(apart) * thin), Grid(first, parts, grid.count), places, fs / apart
    return windows, grid, np.arange(float(samples)), fs


def _without_tails(windows: Sequence[Array], first: int) -> list[Array]:
    """Return windows as far as they have energy, and a log goes before its first row: halos are rounded up one by one."""
    energies = [np.cumsum(h**2) for window in windows for h in (window, window[::-1])]
    tails = [int(np.searchsorted(energy, TAIL * energy[-1])) for energy in energies]
    beyond = max(0, (len(windows[0]) - 1) // 2 - first, min(tails))
    return [h[beyond : len(h) - beyond] for h in windows]


def _responses(rows: RowMap) -> tuple[Array, Array, Array]:
    """Return h, -h' and h'' as prefilter and differences make them of the response h of rows: of n, of s n and of s^2 n."""
    signals, by_parts = rows.signals, rows.rate_kernel
    reach = ceil((signals.prefilter.halo(signals.fs) + 2 * signals.differentiator.halo(signals.fs)) * signals.fs - 1e-9)
    back = signals.position_adjoint
    h = np.pad(signals.torque.average(np.pad(rows.response, 1)), reach)
    zero = np.zeros_like(h)
    if by_parts is None:
        return back((h, zero, zero)), back((zero, h, zero)), back((zero, zero, h))
    rate = np.pad(by_parts.weights, reach + 1)
    return back((h, zero, zero)), back((rate, zero, zero)), back((zero, rate, zero))


@dataclass(frozen=True, eq=False)
class NoisyRows:
    """The rows of one log as noise reaches them; each part is made when it is first asked for."""

    to_rows: RowMap
    """How samples become rows."""
    linear: Linearization
    """Of the explicit model, about the signals of the log."""

    @cached_property
    def torque(self) -> Paths:
        """How noise of the torques reaches the rows."""
        return torque_paths(self.to_rows)

    @cached_property
    def position(self) -> Paths:
        """How noise of the positions reaches the rows."""
        return position_paths(self.to_rows, self.linear)

    @cached_property
    def kept(self) -> npt.NDArray[np.bool_]:
        """Which rows are not void, shape (..., r)."""
        return in_order(self.to_rows.outside) > 0

    def covariance(self, levels: NoiseLevels, most: int | None = None) -> BandedCovariance:
        """Covariance, over `most` lags, that noise of these levels gives the rows."""
        found = self.torque.covariance(levels.in_rows, most)
        if levels.position.any():
            found = found + self.position.covariance(levels.effective_position, most)
        return found

    def variance(self, levels: NoiseLevels) -> Array:
        """Return the variance that noise of these levels gives the rows, shape (..., r)."""
        return self.covariance(levels, 1).variance

    @property
    def unmasked(self) -> "NoisyRows":
        """The rows as if nothing were masked."""
        to_rows = self.to_rows.unmasked()
        return self if to_rows is self.to_rows else NoisyRows(to_rows, self.linear)

    def whitening(self, levels: NoiseLevels) -> Whitening:
        """Whitening of the kept rows by noise of these levels; of `units` where they are there."""
        if "units" in self.__dict__:
            position = np.broadcast_to(levels.effective_position, levels.torque.shape)
            squares = np.concatenate([levels.in_rows, position], axis=-1) ** 2
            return Whitening(BandMatrix.weighted(self.units, squares), self.kept)
        return self.whitening_by([self.covariance(levels)], np.ones(1))

    def whitening_by(self, parts: Sequence[BandedCovariance], shares: Array) -> Whitening:
        """Whitening of the kept rows by shares of each covariance, shape (..., part)."""
        return Whitening(BandMatrix.weighted(self.matrices(parts), shares), self.kept)

    @cached_property
    def units(self) -> list[BandMatrix]:
        """Covariances that unit noise of torques, and of positions, gives the rows that are kept, joint by joint."""
        return self.matrices(chain(self.torque.each(), self.position.each()))

    def forget(self) -> None:
        """Drop what is large, and needed again by few: paths and units."""
        for name in ("torque", "position", "units"):
            self.__dict__.pop(name, None)

    def matrices(self, parts: Iterable[BandedCovariance]) -> list[BandMatrix]:
        """Return parts of the covariance of the rows that are kept."""
        return [C.kept(self.kept).matrix for C in parts]
