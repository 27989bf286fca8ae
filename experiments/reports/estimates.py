"""The table of estimates, made once for screen, page and recording, and what limits their standard errors, in words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

import numpy as np

from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.judgement.warnings import FLAGS, doubtful, used
from idbench.experiments.text import WORTHLESS, number, percent, relative, with_unit
from idbench.identify import Estimate
from idbench.identify.arrays import TINY, Array
from idbench.identify.tables import concise


@dataclass(frozen=True, eq=False)
class EstimatesTable:
    """Of each model its estimate, error or sigma, and %sigma, beside the truth if it is known."""

    fit: Fit
    """The identification."""
    models: tuple[str, ...] = ()
    """Those that are shown; all of it by default."""

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Of the models that are shown."""
        return {name: self.fit.estimates[name] for name in self.models or self.fit.estimates}

    @property
    def heads(self) -> list[tuple[str, str]]:
        """The two lines above each column but the first."""
        known = self.fit.truth is not None
        what = ("X", "%e", "%sigma") if known else ("X", "%sigma")
        return [("", "unit"), *[("true", "X")] * known, *((model, each) for model in self.estimates for each in what)]

    def rows(self) -> Iterator[list[str]]:
        """Yield the cells of every parameter, its name first; marks stand behind what is doubtful."""
        for i, name in self._shown:
            each = (self._cells(model, estimate, i) for model, estimate in self.estimates.items())
            yield [name, self.fit.basis.units[i], *self._true(i), *(cell for cells in each for cell in cells)]

    def short(self) -> Iterator[list[str]]:
        """Yield the truth and the estimates alone, with all marks, units beside the names."""
        for i, name in self._shown:
            each = ((e.X[i], e.standard_errors[i], self._marks[m][i]) for m, e in self.estimates.items())
            yield [
                with_unit(name, self.fit.basis.units[i]),
                *self._true(i),
                *(f"{concise(x, sigma)}{''.join(marks).strip()}" for x, sigma, marks in each),
            ]

    def whole(self) -> Iterator[list[str]]:
        """Yield the cells of what is said of each fit as a whole."""
        # Unit and truth have no cells, nor have the other columns of a model: as many.
        estimates, before = self.estimates.values(), [""] * (1 + (self.fit.truth is not None))
        every = {"Cond(W)": [f"{e.condition_number:.1f}" for e in estimates], "rows": [f"{e.row_count}" for e in estimates]}
        for j in range(self.fit.basis.n):
            every[f"tau{j + 1} explained"] = [_explained(self.fit.explained[model][j]) for model in self.estimates]
        for name, cells in every.items():
            yield [name, *before, *(cell for first in cells for cell in (first, *before))]

    @property
    def _shown(self) -> list[tuple[int, str]]:
        """Places and names of the parameters but for smooth functions, which are no physical ones."""
        return [(i, self.fit.basis.names[i]) for i in self.fit.basis.without_random_effects]

    @cached_property
    def legend(self) -> str:
        """What the marks mean that are used."""
        return "; ".join(f"{flag} {FLAGS[flag]}" for flag in used(self._marks))

    @cached_property
    def _marks(self) -> dict[str, list[tuple[str, str, str]]]:
        return {model: marks for model, marks in doubtful(self.fit).items() if model in self.estimates}

    def _true(self, i: int) -> list[str]:
        return [] if self.fit.truth is None else [f"{list(self.fit.truth.values())[i]:g}"]

    def _cells(self, model: str, estimate: Estimate, i: int) -> Iterator[str]:
        x, sigma = estimate.X[i], estimate.standard_errors[i]
        share = relative(x, sigma)
        first, second, last = self._marks[model][i] if self.legend else ("", "", "")
        if self.fit.truth is None:
            yield from (f"{concise(x, sigma)}{first}", f"{share}{last}")
            return
        error = float(estimate.error_percent(list(self.fit.truth.values()))[i])
        yield from (f"{number(x)}{first}", f"{percent(error) if isfinite(error) else ''}{second}", f"{share}{last}")


def _explained(share: float) -> str:
    if not isfinite(share):
        return "no torque"
    return f"{100 * share:.3f} %" if share > -WORTHLESS / 100 else f"<-{WORTHLESS:g} %"


LEAST = 0.01  # Difference in sigma that means nothing


def differing(fit: Fit, whole: Sequence[str]) -> Iterator[str]:
    """Yield a line on how far the models are from the leading one that are not shown whole."""
    if far := {model: _sigmas_apart(fit, model, whole[0]) for model in fit.estimates if model not in whole}:
        each = ", ".join(f"{model} by {_far(x)} sigma" for model, x in far.items())
        yield f"other models differ: {each} (identify --model all shows them)"


def _far(sigmas: float) -> str:
    if not isfinite(sigmas):
        return "an unknown number of"
    return f"at most {sigmas:.1g}" if sigmas >= LEAST else f"less than {LEAST:g}"


def models_apart(fit: Fit) -> tuple[str, ...]:
    """Return the leading model, and those that differ from it by what means something."""
    return tuple(m for m in fit.estimates if m == fit.leading or _sigmas_apart(fit, m, fit.leading) >= LEAST)


def _sigmas_apart(fit: Fit, model: str, other: str) -> float:
    """Largest difference between the estimates of two models [sigma]; infinity where one is not known."""
    one, two = fit.estimates[model], fit.estimates[other]
    sigma = np.maximum(np.hypot(one.standard_errors, two.standard_errors), TINY)
    return float(np.max(np.nan_to_num(np.abs(one.X - two.X) / sigma, nan=np.inf)))


def explained(share: Array) -> str:
    """Explained shares of the torques, shape (joint,), in words."""
    known = 100 * share[np.isfinite(share)]
    each = [f"{max(x, 0):.3f}" for x in (known.min(), known.max())] if known.size else []
    return f"{' to '.join(dict.fromkeys(each))} %" if each else "nothing"


def all_units(robot_model: RobotModel) -> tuple[str, str]:
    """Units of the torques and of the positions of all joints, each once: slides may stand beside hinges."""
    forces, ways = zip(*map(robot_model.units, range(robot_model.robot.n)), strict=True)
    return ", ".join(dict.fromkeys(forces)), ", ".join(dict.fromkeys(ways))


STRONG = 0.9  # Correlation above which two parameters are named: a change of one is then hardly told from one of the other

DELAY = "the delay"

NAMED = 4  # Pairs, or parameters, that are named; of more their number is

ENOUGH = 20.0
"""Length of logs [s] below which the error of the model is not well known: of fewer than ten stretches of 2 s, a standard
deviation is known to a quarter at best."""

SHOWN = 3.0  # Standard errors that a parameter must exceed for its scatter to be named as a share of it
DISTINCT = 0.05  # Share of its value below which the scatter of a parameter between logs is not named


def words_of_uncertainty(fit: Fit) -> Iterator[str]:
    """Yield what limits the standard errors of the leading model."""
    estimate = fit.estimates[fit.leading]
    if pairs := correlated(estimate):
        each = [f"{a} and {b} ({r:+.2f})" if b != DELAY else f"{a} and {b} ({r:.2f}, of its size)" for a, b, r in pairs[:NAMED]]
        yield f"strongly correlated: {', '.join(each)}{_more(len(pairs))}"
    if estimate.between_logs is not None:
        X, sigma = estimate.X, estimate.standard_errors
        share = np.sqrt(estimate.between_logs.variance) / np.maximum(np.abs(X), TINY)
        if order := [k for k in np.argsort(-share) if share[k] > DISTINCT and abs(X[k]) > SHOWN * sigma[k]]:
            each = [f"{estimate.names[k]} {100 * share[k]:.2g} %" for k in order[:NAMED]]
            yield f"from log to log parameters move, beyond what one log shows, by {', '.join(each)}{_more(len(order))}"
    error, seconds = estimate.model_error, sum(log.samples / log.fs for log in fit.logs.fitted)
    if error is not None and error.covariance.any() and seconds < ENOUGH and not fit.logs.fitted[0].poses:
        yield f"{seconds:.2g} s are too few to know what this model misses: a longer log, or a second one, shows it"


def error_shares(estimate: Estimate) -> Iterator[tuple[str, float, str, float]]:
    """Yield what the variances of the parameters consist of: cause, median share [%], the parameter with most of it, its share.

    var X = noise + delay + model + what changes from log to log
    """
    total = np.maximum(estimate.standard_errors**2, TINY)
    delay, error = np.diagonal(estimate.delay_covariance), estimate.model_error
    parts = {"noise of the logs": estimate.noise_sigma**2 - delay, "delay of the torques": delay}
    if error is not None:
        parts["what the model misses"] = np.diagonal(np.broadcast_to(error.covariance, estimate.covariance.shape))
        parts["change from log to log"] = np.broadcast_to(error.scatter, total.shape)
    for cause, variance in parts.items():
        share = 100 * variance / total
        if not np.isfinite(share).any() or not np.any(variance):  # a cause that is not known here
            continue
        most = int(np.nanargmax(share))
        yield cause, float(np.nanmedian(share)), estimate.names[most], float(share[most])


def correlated(estimate: Estimate) -> list[tuple[str, str, float]]:
    """Return the pairs of parameters, or of a parameter and the delay, that are strongly correlated, the strongest first."""
    C = estimate.within_covariance
    sigma = np.sqrt(np.maximum(np.diagonal(C), TINY))
    R = C / np.outer(sigma, sigma)
    of_functions = [p.is_random_effect for p in estimate.problem.basis.parameters]
    R[of_functions], R[:, of_functions] = 0.0, 0.0
    found = [(estimate.names[i], estimate.names[j], float(R[i, j])) for i, j in np.argwhere(np.triu(np.abs(R), 1) > STRONG)]
    if estimate.delay_covariance.any():
        of_delay = np.sqrt(np.maximum(np.diagonal(estimate.delay_covariance), 0.0)) / sigma
        found += [(estimate.names[k], DELAY, float(of_delay[k])) for k in np.flatnonzero(of_delay > STRONG)]
    return sorted(found, key=lambda pair: -abs(pair[2]))


def _more(count: int) -> str:
    return f", and {count - NAMED} more" if count > NAMED else ""
