"""What the runs of a study say, with confidence, and whether two ways of identification differ on the same runs."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations
from typing import Any

import numpy as np
import scipy

from idbench.experiments.text import SIGMAS
from idbench.identify import Array

CONFIDENCE = 0.95  # Of every interval
DRAWS = 300  # Of a bootstrap: its ends are then known to a tenth of its width
RIGHT = float(2 * scipy.special.ndtr(SIGMAS) - 1)  # Coverage if sigma is right and errors are normal
MIN_ERROR = 1e-16  # Relative error that counts as none: logarithms of 0 would say too much of rounding

BOUNDS = (".bound", ".bound_through_reversals")
"""Of every parameter, in studies that ask for it: the least error that noise allows where friction near rest is not known, and
where it is what its law says up to the instant of a reversal."""

NAMED = ("named", "misnamed")
"""Of every run, in studies that ask for causes: whether the first cause, or a rival named with it, is a fault of the run, and
whether another cause is named. `something else` is neither."""

NUMBER = re.compile(r"\d[\d.,e+-]*")


@dataclass(frozen=True, eq=False)
class Cell:
    """The runs of one combination of settings, identified by one model."""

    settings: Mapping[str, Any]
    """Value of each axis."""
    names: tuple[str, str, str]
    """Chain, estimator and model."""
    parameters: tuple[str, ...]
    """Names of X."""
    run: np.typing.NDArray[np.int64]
    """Numbers of the runs that gave an estimate, shape (runs,)."""
    X: Array
    """Estimates of those runs, shape (runs, p)."""
    sigma: Array
    """Their standard errors, shape (runs, p)."""
    paper_sigma: Array
    """Standard errors by the paper's formula, shape (runs, p)."""
    truth: Array
    """True values, shape (runs, p)."""
    failures: Mapping[str, np.typing.NDArray[np.int64]]
    """Reasons of the others, as the first of them has it, and the runs that failed so: reasons that differ in numbers alone are
    one."""
    bounds: Mapping[str, Array] = field(default_factory=dict)
    """The least standard deviations that noise allows, of a study that asks for them: see `BOUNDS`, shape (runs, p)."""
    simulations: Array | None = None
    """How often the estimator simulated each run, shape (runs,)."""
    named: Array | None = None
    """Whether each run's fault was named, and whether another cause was, of a study that asks for causes, shape (2, runs)."""
    shared: np.typing.NDArray[np.bool_] | None = None
    """Parameters that all methods of the study identify; all by default, shape (p,)."""

    @property
    def runs(self) -> int:
        """Number of runs that gave an estimate."""
        return len(self.run)

    @property
    def failed(self) -> int:
        """Number of runs that did not."""
        return sum(len(runs) for runs in self.failures.values())

    @cached_property
    def error(self) -> Array:
        """(X - truth) / |truth|, shape (runs, p); NaN where the truth is 0."""
        return (self.X - self.truth) / np.where(self.truth == 0, np.nan, np.abs(self.truth))

    @property
    def bias(self) -> Array:
        """Mean relative error, shape (p,)."""
        return self.error.mean(axis=0)

    @property
    def bias_margin(self) -> Array:
        """Half the width of the confidence interval of the bias (Student's t), shape (p,)."""
        t = scipy.special.stdtrit(max(self.runs - 1, 1), (1 + CONFIDENCE) / 2)
        return t * self.deviation / np.sqrt(self.runs)

    @property
    def deviation(self) -> Array:
        """Standard deviation of the relative error, shape (p,)."""
        return self.error.std(axis=0, ddof=1) if self.runs > 1 else np.full(len(self.parameters), np.nan)

    @property
    def rmse(self) -> Array:
        """Root mean square of the relative error, shape (p,)."""
        return np.sqrt(np.mean(self.error**2, axis=0))

    @property
    def typical(self) -> float:
        """Geometric mean over the parameters of their rmse: one figure that no parameter's unit or size decides."""
        return float(np.exp(np.mean(np.log(np.maximum(self.rmse[self.relative], MIN_ERROR)))))

    @cached_property
    def typical_interval(self) -> tuple[float, float]:
        """Confidence interval of `typical`, by the bootstrap over the runs; the same at every call."""
        squares = self.error[:, self.relative] ** 2
        draws = np.random.default_rng(0).integers(self.runs, size=(DRAWS, self.runs))
        typical = [np.mean(np.log(np.maximum(np.mean(squares[drawn], axis=0), MIN_ERROR**2))) / 2 for drawn in draws]
        low, high = np.exp(np.quantile(typical, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]))
        return float(low), float(high)

    def least(self, bound: str = BOUNDS[0]) -> Array:
        """Return the rms of the least relative errors that noise allows (Cramer-Rao), shape (p,); NaN if not asked for."""
        if bound not in self.bounds:
            return np.full(len(self.parameters), np.nan)
        return np.sqrt(np.mean((self.bounds[bound] / np.where(self.truth == 0, np.nan, self.truth)) ** 2, axis=0))

    @property
    def named_share(self) -> tuple[float, float]:
        """Share of the runs whose fault was named, and of those of which another cause was; NaN if no causes were asked for."""
        if self.named is None or not self.runs:
            return np.nan, np.nan
        right, wrong = self.named.mean(axis=1).tolist()
        return right, wrong

    @property
    def mean_simulations(self) -> float:
        """Mean number of simulations that the estimator made of a run; 0 for one that makes none."""
        return 0.0 if self.simulations is None or not self.runs else float(np.nan_to_num(self.simulations).mean())

    def typical_least(self, bound: str = BOUNDS[0]) -> float:
        """Return the geometric mean over the parameters of `least`."""
        return float(np.exp(np.mean(np.log(np.maximum(self.least(bound)[self.relative], MIN_ERROR)))))

    @property
    def relative(self) -> np.typing.NDArray[np.bool_]:
        """Parameters that all methods identify and whose truth is not 0: they have a relative error to compare, shape (p,)."""
        known = np.isfinite(self.truth).all(axis=0) & (self.truth != 0).all(axis=0)
        return known if self.shared is None else known & self.shared

    def coverage(self, sigma: Array) -> Array:
        """Return the share of truths within SIGMAS `sigma` of the estimate, of the runs that have one, shape (p,)."""
        inside, known = self._inside(sigma)
        return np.where(known > 0, inside / np.maximum(known, 1), np.nan)

    def coverage_interval(self, sigma: Array) -> Array:
        """Return the confidence interval of the coverage (Wilson), shape (p, 2)."""
        pairs = zip(*(counts.tolist() for counts in self._inside(sigma)), strict=True)
        found = [scipy.stats.binomtest(k, n).proportion_ci(CONFIDENCE, "wilson") if n else None for k, n in pairs]
        return np.array([(i.low, i.high) if i else (np.nan, np.nan) for i in found])

    def _inside(self, sigma: Array) -> tuple[np.typing.NDArray[np.int64], np.typing.NDArray[np.int64]]:
        """Number of truths within SIGMAS `sigma`, and number that have a sigma, shape (p,) each."""
        inside = np.abs(self.X - self.truth) <= SIGMAS * sigma
        return inside.sum(axis=0), np.isfinite(sigma).sum(axis=0)


def cells(rows: Mapping[str, np.typing.NDArray[Any]], axes: Sequence[str], parameters: tuple[str, ...]) -> list[Cell]:
    """Return the cells of a study's rows, a column each, in the order in which they appear."""
    members: dict[tuple[Any, ...], list[int]] = {}
    for i, key in enumerate(zip(*(rows[name].tolist() for name in (*axes, "chain", "estimator", "model")), strict=True)):
        members.setdefault(key, []).append(i)
    found = [_cell(rows, key, np.array(index), axes, parameters) for key, index in members.items()]
    known = [np.isfinite(cell.truth).any(axis=0) for cell in found if cell.runs]
    return [replace(cell, shared=np.logical_and.reduce(known)) for cell in found] if known else found


def _cell(
    rows: Mapping[str, np.typing.NDArray[Any]],
    key: tuple[Any, ...],
    index: np.typing.NDArray[np.intp],
    axes: Sequence[str],
    parameters: tuple[str, ...],
) -> Cell:
    failed = np.array([reason is not None for reason in rows["failure"][index]])
    ok = index[~failed]

    def of(part: str) -> Array:
        return np.stack([rows[name + part][ok].astype(np.float64) for name in parameters], axis=-1)

    chain, estimator, model = key[len(axes) :]
    return Cell(
        settings=dict(zip(axes, key, strict=False)),
        names=(chain, estimator, model),
        parameters=parameters,
        run=rows["run"][ok],
        X=of(""),
        sigma=of(".sigma"),
        paper_sigma=of(".paper_sigma"),
        truth=of(".truth"),
        bounds={bound: of(bound) for bound in BOUNDS if parameters[0] + bound in rows},
        named=np.array([rows[name][ok] for name in NAMED], dtype=np.float64) if NAMED[0] in rows else None,
        simulations=rows["simulations"][ok].astype(np.float64) if "simulations" in rows else None,
        failures=_grouped(rows["failure"][index[failed]], rows["run"][index[failed]]),
    )


def _grouped(reasons: np.typing.NDArray[Any], runs: np.typing.NDArray[np.int64]) -> dict[str, np.typing.NDArray[np.int64]]:
    """Return the runs of every reason."""
    kinds: dict[str, tuple[str, list[int]]] = {}
    for reason, run in zip(reasons, runs.tolist(), strict=True):
        kinds.setdefault(NUMBER.sub("#", reason), (reason, []))[1].append(run)
    return {reason: np.array(members, dtype=np.int64) for reason, members in kinds.values()}


SURE = 0.01  # Probability below which two ways of identification count as different
PERMUTATIONS = 20_000  # Draws of the permutation test, at least
EACH = 2 / SURE  # Draws for each pair, at least, or Holm's correction would leave nothing significant
TOGETHER = 1000  # Draws that are made at a time
ENOUGH = 200  # Draws with a gap as large from which on no more are needed: nothing is significant then, and p is known to 7 %


@dataclass(frozen=True, eq=False)
class Difference:
    """Whether two ways of identification differ, on the same runs."""

    better: Cell
    """The one of smaller typical error."""
    worse: Cell
    """The other."""
    ratio: float
    """Typical error of the worse over that of the better: the geometric mean, over the parameters, of the rms over the runs."""
    p: float
    """Probability of so large a ratio if there were no difference (permutation test, paired over the runs, Holm's correction
    for all pairs)."""
    runs: int
    """Runs that both could identify."""


def differences(group: Sequence[Cell]) -> list[Difference]:
    """Return, for every pair of cells of the same runs, which is better and how sure that is."""
    pairs = list(combinations(group, 2))
    found = [_difference(a, b, max(PERMUTATIONS, int(EACH * len(pairs)))) for a, b in pairs]
    p = np.array([d.p for d in found])
    order, times = np.argsort(p, kind="stable"), np.arange(len(p), 0, -1)
    p[order] = np.maximum.accumulate(np.minimum(1.0, times * p[order]))
    return [replace(d, p=corrected) for d, corrected in zip(found, p.tolist(), strict=True)]


@lru_cache(maxsize=4096)
def _difference(a: Cell, b: Cell, draws: int) -> Difference:
    _, mine, theirs = np.intersect1d(a.run, b.run, return_indices=True)
    if not len(mine):
        return Difference(a, b, 1.0, 1.0, 0)
    known = a.relative & b.relative
    one, other = a.error[mine][:, known] ** 2, b.error[theirs][:, known] ** 2
    gap = float(ln_typical(one.mean(axis=0)) - ln_typical(other.mean(axis=0)))
    better, worse = (a, b) if gap <= 0 else (b, a)
    return Difference(better, worse, float(np.exp(abs(gap))), _probability(one, other, abs(gap), draws), len(mine))


def _probability(one: Array, other: Array, gap: float, draws: int) -> float:
    """Permutation p value of a gap between the typical errors of two methods, in logarithms, by at most so many draws.

    `one` and `other` are squares of their errors, shape (run, p).
    """
    rng = np.random.default_rng(0)
    count = 1
    drawn = 1
    middle, half = (one + other).mean(axis=0) / 2, (one - other) / (2 * len(one))
    while drawn < draws and count < ENOUGH:
        swapped = (1.0 - 2.0 * rng.integers(0, 2, (TOGETHER, len(one)), dtype=np.int8)) @ half
        gaps = ln_typical(middle + swapped) - ln_typical(middle - swapped)
        count, drawn = count + int(np.count_nonzero(np.abs(gaps) >= gap * (1 - 1e-9))), drawn + TOGETHER
    return count / drawn


def ln_typical(squares: Array) -> Array:
    """Return the logarithm of the typical error of mean squares, shape (..., p)."""
    return np.asarray(np.mean(np.log(np.maximum(squares, MIN_ERROR**2)), axis=-1) / 2)
