"""The rows on which torques are judged: the same for all that is compared, whatever the fit left out."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.estimators.problem import Problem
from idbench.identify.models.explicit import ExplicitModel
from idbench.identify.rows.row_map import RowMap
from idbench.identify.signals.masks import NoMask, ReversalMask
from idbench.identify.signals.masks.mask import AbstractMask

FEW = 0.1
"""Share of the sum of an operator's weights, by size, that their sum must be for rows to say what a constant becomes."""


def as_judged(problem: Problem) -> Problem:
    """Return a problem by the explicit model whose mask leaves reversals out as it does where no speed is given."""
    mask = problem.chain.mask
    if isinstance(mask, NoMask):
        usual: AbstractMask = _WhereItMoves()
    elif isinstance(mask, ReversalMask) and mask.threshold is not None:
        usual = replace(mask, threshold=None)
    else:
        return problem.with_model(ExplicitModel())
    return Problem(problem.logs, problem.basis, ExplicitModel(), replace(problem.chain, mask=usual))


def shares(rows: RowMap) -> Array:
    """Return the share of a constant that the mask leaves in each row, shape (..., kind, count); 1 where nothing is masked."""
    ones = np.ones_like(rows.inside)
    whole = rows.kernel.apply(ones)
    if np.abs(whole).min(initial=np.inf) < FEW * np.abs(rows.response).sum():  # the operator leaves nothing of a constant
        return rows.outside
    return np.asarray(rows.outside * rows.kernel.apply(rows.inside) / whole)


@final
@dataclass(frozen=True)
class _WhereItMoves(AbstractMask):
    """Leaves out where joints reverse or rest, except those that rest all the time."""

    mask: ReversalMask = ReversalMask()  # noqa: RUF009  # frozen

    def halo(self, fs: float) -> float:
        return self.mask.halo(fs)

    def weight(self, qd: Array, fs: float) -> Array:
        weight = self.mask.weight(qd, fs)
        return np.where((weight == 0).all(axis=-1, keepdims=True), 1.0, weight)
