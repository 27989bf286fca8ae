"""Estimating nonlinear parameters: the basis, linearized at its own estimate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import Kind, Parameter
from idbench.identify.basis.friction.shape import ShapedFriction, with_settings
from idbench.identify.basis.joint_law import AbstractFriction, AbstractJointLaw
from idbench.identify.basis.of_joints import OfJoints
from idbench.identify.estimators.problem import Problem
from idbench.identify.iterate import iterate
from idbench.identify.rows.factors import Factors, Status, triangular
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.signals import State

ROUNDS = 30  # At most; most laws take five
COARSE, FINE = 6, 32  # Values of a shape that are looked at to begin with, and once it has converged
FEWEST = 4  # Values of each shape of a law with several
AGAIN = 2  # How often others are looked at, at most
SETTLED = 1e-3  # Steps below this share of sigma no longer matter
SHARES = (0.5, 0.25, 0.1, 0.0)  # Of a step, in turn, until the rows are explained better


def settled(problem: Problem) -> Problem:
    """Return the problem with its basis linear about the estimate that it gives by weighted least squares.

    Variable projection: for fixed shapes of friction the other parameters are linear. G. Golub and V. Pereyra, "The
    differentiation of pseudo-inverses and nonlinear least squares problems whose variables separate", SIAM J. Numerical
    Analysis 10 (1973) 413-432; with columns of the shapes as slopes about the estimate, a round is a step of Gauss and
    Newton, X(k+1) = argmin |w (Y - W(b(X(k))) X)|. After convergence, other shapes are tried once more, joint by joint: the
    misfit has several minima. Of logs too long for their rows to be kept, some pieces say what the shapes are.
    """
    if not problem.basis.is_nonlinear:
        return problem
    rows = AdaptiveRows(problem.explicit)
    basis = _settled(rows, _scanned(rows, problem.basis, COARSE))
    for _ in range(AGAIN):
        looked = _scanned(rows, basis, FINE)
        if looked is basis:
            break
        basis = _settled(rows, looked)
    return problem.explicit.with_basis(basis).with_model(problem.model)


def _settled(rows: "AdaptiveRows", here: Basis) -> Basis:
    """Return the basis at its own estimate, near where it begins: b(k+1) = b(X(k)), X(k) = argmin |w (Y - W(b(k)) X)|."""

    def step(now: tuple[Basis, Factors, Array]) -> tuple[tuple[Basis, Factors, Array], bool]:
        here, there, cost = now
        X = _estimate(there, here)
        ahead, cost = _step(rows, here, X, cost)
        moved, factor = rows.factors(ahead), there.fit(2).factor
        sigma = np.sqrt(np.diagonal(factor.inverse(factor.status == Status.OK), axis1=-2, axis2=-1))
        return (ahead, moved, cost), not (np.abs(moved.fit(2).X - X) / sigma > SETTLED).any()

    return iterate(step, (here, rows.factors(here), rows.misfit(here)), ROUNDS)[0][0]


def _estimate(factors: Factors, basis: Basis) -> Array:
    """Return the estimate; where it leaves the shapes of friction open, that of the others, the shapes as they are."""
    X, shapes = factors.fit(2).X, basis.operating_point
    if np.isfinite(X).all():
        return X
    rest = _rest(basis)
    plain = np.empty_like(X)
    plain[..., rest] = factors.only(rest, shapes).fit(2).X
    for place, value in shapes.items():
        plain[..., place] = value
    return np.where(np.isfinite(X).all(axis=-1, keepdims=True), X, plain)


def _rest(basis: Basis) -> list[int]:
    """Return the places of what is linear."""
    return [place for place in basis.places.values() if place not in basis.operating_point]


def _step(rows: "AdaptiveRows", here: Basis, X: Array, cost: Array) -> tuple[Basis, Array]:
    """Return the basis about an estimate, or a share of the way there if that explains more, and its misfit, shape (...)."""
    share = np.ones(cost.shape)
    for smaller in SHARES:
        ahead = here.linearized_at(_between(here, X, share))
        found = rows.misfit(ahead)
        if not (worse := found > cost).any():
            break
        share = np.where(worse, smaller, share)
    return ahead, found


def _between(basis: Basis, X: Array, share: Array) -> Array:
    """Return X with the shapes of friction moved by a share of their step alone."""
    found = X.copy()
    for place, old in basis.operating_point.items():
        found[..., place] = old + share * (X[..., place] - old)
    return found


@dataclass(frozen=True, eq=False)
class AdaptiveRows:
    """The rows of a problem with other laws of friction: the columns of what does not depend on an estimate are made once."""

    problem: Problem
    """Of the explicit model."""

    def factors(self, basis: Basis) -> Factors:
        """Return the factors with the laws of a basis in the place of those of the problem."""
        if not self._last or self._last[0] is not basis:
            laws = basis.split()[1]
            moving = self._rows_of(laws)
            kept = [basis.places[parameter] for parameter in (*self._rest.parameters, *laws.parameters)]
            R = self._with(replace(moving, Y=moving.Y - self._measured).joined_by_kind, np.argsort(kept))
            self._last[:] = basis, Factors(R, self._fixed.count, basis.names).known(self.problem.prior)
        return self._last[1]

    def _with(self, moving: Array, order: npt.NDArray[np.intp]) -> Array:
        """Return the factor of fixed columns W and Y and moving ones V and y, [W V Y + y], columns of parameters in an order.

        With W = Q R, that of [W Y V y] is [R Q'Z; 0 S], Z = [V y], S of Z - Q Q'Z: rows are turned once, however often V moves.
        """
        Q, R = self._turned
        back = np.swapaxes(Q, -1, -2)
        inside = np.matmul(back, moving)
        left = moving - np.matmul(Q, inside)
        again = np.matmul(back, left)  # what rounding left of Q in it
        S = triangular(left - np.matmul(Q, again))
        below = np.zeros((*S.shape[:-1], R.shape[-1]))
        whole = np.concatenate([np.concatenate([R, inside + again], axis=-1), np.concatenate([below, S], axis=-1)], axis=-2)
        p = R.shape[-1] - 1
        columns = np.delete(whole, [p, whole.shape[-1] - 1], axis=-1)[..., order]
        return triangular(np.concatenate([columns, (whole[..., p] + whole[..., -1])[..., None]], axis=-1))

    @cached_property
    def _turned(self) -> tuple[Array, Array]:
        """Q and R of the columns that are made once, and of what is measured."""
        Q, R = np.linalg.qr(self._fixed.joined_by_kind)
        return Q, R

    def misfit(self, basis: Basis) -> Array:
        """Return the misfit with the current nonlinear parameters of friction, shape (...)."""
        return self.factors(basis).only(_rest(basis), basis.operating_point).misfit()

    @cached_property
    def _last(self) -> list[Any]:
        """The basis that was asked for last, and its factors."""
        return []

    @cached_property
    def _rest(self) -> Basis:
        """What does not depend on an estimate."""
        return self.problem.basis.split()[0]

    @cached_property
    def _fixed(self) -> Rows:
        return self._rows_of(self._rest)

    @cached_property
    def _measured(self) -> Array:
        return np.concatenate([rows.measurement(rows.signals.torque.mean) for rows in self._fixed.maps], axis=-1)

    def _rows_of(self, basis: Basis) -> Rows:
        return self.problem.with_basis(basis).some_rows


def _scanned(rows: AdaptiveRows, basis: Basis, count: int) -> Basis:
    """Return the basis with other shapes where they explain more, joint by joint; the same if there are none."""
    for block in basis.blocks:
        inner, joints = (block.block, block.joints) if isinstance(block, OfJoints) else (block, tuple(range(basis.n)))
        if isinstance(inner, ShapedFriction):
            found = _best(rows, basis, inner, joints, count)
            if found is not inner:
                basis = basis.exchanged(block, replace(block, block=found) if isinstance(block, OfJoints) else found)
    return basis


def _below(costs: Array) -> Array:
    """Depth of the parabola's minimum below each value of a grid that is less than its neighbours, shape (i,)."""
    found, costs = np.zeros(len(costs)), np.where(np.isfinite(costs), costs, np.nan)
    before = costs[:-2]
    here = costs[1:-1]
    after = costs[2:]
    bend = before - 2 * here + after
    inside = (here <= before) & (here <= after) & (bend > 0)
    found[1:-1][inside] = (after - before)[inside] ** 2 / (8 * bend[inside])
    return found


def _best(rows: AdaptiveRows, basis: Basis, shaped: ShapedFriction, joints: Sequence[int], count: int) -> ShapedFriction:
    """Return a law with the shapes of a grid that explain most beside the others, joint by joint; where it is, if that does."""
    n, settings = basis.n, [shape.setting for shape in shaped.shapes]
    each = max(FEWEST, round(count ** (1 / len(settings))))
    grid = [dict(zip(settings, at, strict=True)) for at in product(*(shape.grid(each) for shape in shaped.shapes))]
    here = [{name: x[..., None] for name, x in shaped.at_joints(n).items()}] if shaped.values else []
    candidates = Candidates(shaped.law, (*grid, *here))
    rest = basis.of([parameter for parameter in basis.parameters if parameter not in shaped.parameters(n)])
    there = rest + OfJoints(candidates, tuple(joints))
    factors = rows.factors(there)
    shapes = rest.operating_point
    plain = _rest(rest)
    chosen = np.full((*factors.R.shape[:-3], n), len(grid), dtype=np.intp)
    for run in np.ndindex(chosen.shape[:-1]):
        alone = Factors(factors.R[run], factors.rows[run], factors.names)
        at = {place: np.asarray(value)[run] if np.ndim(value) else value for place, value in shapes.items()}
        found = dict.fromkeys(joints, len(grid)) if here else {}
        for j in joints if here else (*joints, *joints):  # at first, a second time beside what the others have
            others = [there.places[candidates.parameter(i, k)] for k, i in found.items() if k != j]
            own = [there.places[candidates.parameter(i, j)] for i in range(len(candidates.grid))]
            costs = np.array([alone.only([*plain, *others, place], at).misfit() for place in own])
            costs[: len(grid)] -= _below(costs[: len(grid)]) if len(settings) == 1 else 0.0
            found[j] = int(np.argmin(costs))
        chosen[run][list(found)] = list(found.values())
    if here and (chosen == len(grid)).all():
        return shaped
    new = {name: np.array([*(at[name] for at in grid), np.nan])[chosen] for name in settings}
    now = shaped.at_joints(n)
    return shaped.at({name: np.where(np.isnan(x), now[name], x) for name, x in new.items()})


@dataclass(frozen=True, eq=False)
class Candidates(AbstractJointLaw):
    """One law with several settings, a parameter each: to see which of them explains most."""

    is_nonlinear: ClassVar[bool] = True
    """It stands for what is yet to be found."""

    law: AbstractFriction
    """The law."""
    grid: tuple[Mapping[str, Any], ...]
    """Values of its settings."""

    def letters(self) -> Mapping[str, tuple[Kind, str]]:
        """Return a name for each of the settings."""
        return {f"{self.law.symbol}@{i}:": (self.law.kind, self.law.unit) for i in range(len(self.grid))}

    def parameter(self, i: int, j: int) -> Parameter:
        """Return the parameter of one of the settings at a joint."""
        return Parameter(list(self.letters())[i], j, self.law.kind, self.law.unit)

    def torques(self, state: State) -> Mapping[str, Array]:
        """Return the torque with each of the settings."""
        each = (with_settings(self.law, at).force(state.q, state.qd) for at in self.grid)
        return dict(zip(self.letters(), each, strict=True))
