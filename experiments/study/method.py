"""How the runs of a study are identified: chain, estimator, and their settings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from idbench.experiments.identification.defaults import CHAIN, ESTIMATOR
from idbench.experiments.study.axis import FRICTION, Axis, Setting
from idbench.identify import CHAINS, ESTIMATORS, AbstractEstimator, Chain


@dataclass(frozen=True)
class Method:
    """One combination of chain, estimator and their settings; all models of a study are identified with it."""

    chain_name: str
    estimator_name: str
    chain: Chain
    estimator: AbstractEstimator
    friction: str
    settings: tuple[Setting, ...]

    @property
    def names(self) -> tuple[str, str]:
        """Of chain and estimator."""
        return self.chain_name, self.estimator_name

    def fits(self, settings: Mapping[str, Any]) -> bool:
        """Return whether this method has the values of the axes, where they are given."""
        return all(settings.get(s.axis.field, s.label) == s.label for s in self.settings)


def methods_of(chains: Sequence[str], estimators: Sequence[str], friction: str, axes: Sequence[Axis]) -> Iterator[Method]:
    """Yield every combination of chains, estimators and the values of axes; estimators that see no chain with the first."""
    for name, way, combination in product(chains, estimators, list(combinations(axes))):
        chain, estimator = CHAINS.create(name), ESTIMATORS.create(way)
        if name != chains[0] and not estimator.filtered:
            continue
        for setting in whole_first(combination):
            chain, estimator = setting.chain(chain), setting.estimator(estimator)
        laws = next((str(setting.value) for setting in combination if setting.axis.field == FRICTION), friction)
        yield Method(name, way, chain, estimator, laws, combination)


def servo_methods(friction: str, axes: Sequence[Axis]) -> Iterator[Method]:
    """Yield what the closed loop of servos is fitted with: every law of friction."""
    chain, estimator = CHAINS.create(CHAIN), ESTIMATORS.create(ESTIMATOR)  # which see no servo
    for combination in combinations(axes):
        laws = next((str(setting.value) for setting in combination if setting.axis.field == FRICTION), friction)
        yield Method("commands", "closed loop", chain, estimator, laws, combination)


def of_currents(method: Method) -> Method:
    """Return what identifies the torque of servos' currents, in the place of what their closed loop is fitted with."""
    return replace(method, chain_name=CHAIN, estimator_name=ESTIMATOR, friction="standard", settings=())


def combinations(axes: Sequence[Axis]) -> Iterator[tuple[Setting, ...]]:
    """Yield every combination of the axes' values, the last axis fastest."""
    return product(*([Setting(axis, value) for value in axis.points] for axis in axes))


def whole_first(combination: tuple[Setting, ...]) -> list[Setting]:
    """Return settings such that a part that is replaced whole does not undo a setting of that part."""
    return sorted(combination, key=lambda setting: setting.axis.field.count("."))
