"""What an estimator is."""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, final, get_args

import numpy as np

from idbench.identify.blame import expect
from idbench.identify.errors import IdentificationError, PluginError
from idbench.identify.estimators.estimate import Estimate
from idbench.identify.estimators.problem import Problem
from idbench.identify.rows.factors import Status

Need = Literal["factors", "rows", "logs", "loop", "plant"]


class AbstractEstimator(ABC):
    """Turns a problem into an estimate of X."""

    acronym: ClassVar[str] = ""
    """What the field calls it, as the table does."""

    needs: ClassVar[frozenset[Need]] = frozenset({"rows"})
    """What it uses of a problem: `factors` of its rows, which every log has; its `rows`, which are not kept of logs that are
    too long; its `logs`; the `loop` in which they were recorded, or the robot by itself, its `plant`, which the caller may
    give."""

    takes_prior: ClassVar[bool] = False
    """Whether what is known before, `Problem.prior`, is among its rows."""

    full_rank: ClassVar[bool] = True
    """Whether it needs a motion that shows every parameter; one with a prior or a penalty does not."""

    begins: ClassVar[bool] = False
    """Whether it goes on from a start, which the caller may give."""

    filtered: ClassVar[bool] = True
    """Whether what it minimises is the chain's; others take from it no more than where they begin and how large noise is."""

    @abstractmethod
    def solve(self, problem: Problem) -> Estimate:
        """Return the estimate of `problem`, every run by itself."""

    @final
    def fit(self, problem: Problem, *, throw: bool = True) -> Estimate:
        """Return the estimate of `problem`, checked.

        Raises
        ------
        IdentificationError
            If the problem lacks what this estimator needs; with `throw`, if it finds no finite value for a parameter.
        PluginError
            If it returns something else than an estimate of all parameters.
        """
        self.require(problem)
        estimate, status = self.solve(problem), problem.factors.together.status
        if throw and self.full_rank:
            problem.factors.together.check()
        if not isinstance(estimate, Estimate):
            raise PluginError(f"plug-in {type(self).__name__}.solve returned {estimate!r:.60}, expected an Estimate")
        p = len(problem.names)
        expect(self, "solve", estimate.X, (*status.shape, p))
        expect(self, "solve", estimate.own_covariance, (*status.shape, p, p))
        if throw and estimate.failures:
            raise IdentificationError(next(iter(estimate.failures.values())))
        lost = ~np.isfinite(estimate.X) & (status == Status.OK)[..., None]
        if throw and lost.any():
            names = ", ".join(np.array(problem.names)[lost.reshape(-1, len(problem.names)).any(axis=0)])
            if not np.isfinite(problem.factors.fit(2).X).all():  # nor does weighted least squares
                raise IdentificationError(
                    f"{self.called} finds no finite value for {names}: use a longer log, in which all joints move"
                )
            raise IdentificationError(
                f"{self.called} gives NaN or infinity for {names}, where least squares finds all parameters: "
                "the estimator fails here, not the log; use another, such as WLS"
            )
        return estimate

    @final
    def require(self, problem: Problem) -> None:
        """Raise IdentificationError if a problem lacks what this estimator needs."""
        self.require_needs()
        if problem.prior is not None and not self.takes_prior:
            raise IdentificationError(f"{self.called} takes nothing that is known before: use GLS, WLS or OLS")
        if "loop" in self.needs and problem.simulation.loop is None:
            raise IdentificationError(
                f"{self.called} simulates the closed loop in which a log was recorded, which is not known: name the "
                "scenario that describes it (--loop scenario.toml)"
            )
        if "plant" in self.needs and problem.simulation.plant is None:
            raise IdentificationError(
                f"{self.called} simulates the robot from the torques of the log, and the caller gave no simulator"
            )
        if missing := sorted({j + 1 for log in problem.logs for j in log.missing}):
            of = f"the torque of joint {', '.join(map(str, missing))} was not logged"
            if self.needs & {"logs", "loop", "plant"}:
                raise IdentificationError(f"{of}, and {self.called} needs those of all: use GLS, WLS or OLS")
            if not problem.some_rows.valid.any():
                raise IdentificationError(f"{of}, and the sum over joints needs it: take the explicit or the implicit model")
        if any(log.poses for log in problem.logs):
            if self.needs & {"logs", "loop", "plant"}:
                raise IdentificationError(f"poses at rest hold no motion, and {self.called} needs one: use GLS, WLS or OLS")
            if problem.basis.n * sum(log.samples for log in problem.logs) < len(problem.names):
                count = sum(log.samples for log in problem.logs)
                raise IdentificationError(f"{count} poses are too few for {len(problem.names)} parameters: log more")
            if not problem.alike:
                raise IdentificationError("poses at rest have no power: take the explicit or the implicit model")
        if "rows" in self.needs:
            problem.require_rows(f"{self.called} needs rows, and ")

    @final
    def require_needs(self) -> None:
        """Raise PluginError unless what it says that it needs is a set of what there is."""
        known, given = get_args(Need), self.needs
        if not isinstance(given, (set, frozenset)) or not given <= set(known):
            raise PluginError(
                f"plug-in {type(self).__name__}.needs is {given!r:.60}, expected a frozenset of {', '.join(map(repr, known))}, "
                'such as frozenset({"rows"})'
            )

    @property
    def called(self) -> str:
        """What messages call it: its acronym, or the name of its class."""
        return self.acronym or type(self).__name__
