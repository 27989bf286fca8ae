"""A chain and an estimator with the names by which they are known."""

from dataclasses import dataclass, replace
from typing import Self

from idbench.experiments.requests.shared import CHAIN, ESTIMATOR
from idbench.identify import CHAINS, ESTIMATORS, AbstractEstimator, Chain


@dataclass(frozen=True)
class Method:
    """How parameters are identified: signal processing and estimator, with settings of their own where these were asked for."""

    chain_name: str
    """Name of the chain from which `chain` starts."""
    estimator_name: str
    """Name of the estimator."""
    chain: Chain
    """The signal processing."""
    estimator: AbstractEstimator
    """The estimator."""

    @classmethod
    def named(cls, chain: str = CHAIN, estimator: str = ESTIMATOR) -> Self:
        """Method of two names, with their default settings; IdentificationError if there is none of a name."""
        return cls(chain, estimator, CHAINS.create(chain), ESTIMATORS.create(estimator))

    def trimmed(self, rest: float) -> Self:
        """The same, without rows of the first and last `rest` seconds of a log."""
        return replace(self, chain=replace(self.chain, trim=rest))
