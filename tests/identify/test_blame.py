"""Mistakes of plug-ins are reported by their names: what they raised, where, and what they returned instead of what."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from idbench.identify import (
    AbstractEstimator,
    AbstractFriction,
    AbstractMask,
    Chain,
    Estimate,
    ExplicitModel,
    IdentificationError,
    PluginError,
    SettingError,
    idbench_chain,
    identify,
    scara,
)


@dataclass(frozen=True)
class Law(AbstractFriction):
    """A law that does what the test says."""

    do: object = None
    symbol = "Fx"
    unit = "N m"

    def force(self, q, qd):
        return self.do(qd)


@dataclass(frozen=True)
class Solver(AbstractEstimator):
    """An estimator that does what the test says."""

    do: object = None

    def solve(self, problem):
        return self.do(problem)


@pytest.mark.parametrize(
    ("do", "error", "message"),
    [
        (lambda qd: None, PluginError, r"Law\.force returned None, expected an array of numbers, shape \(2, \d+\)"),
        (lambda qd: qd[0], PluginError, r"Law\.force returned an array of float64, shape \(\d+,\), expected"),
        (lambda qd: qd * np.nan, SettingError, "friction law Law gives nan at q = .*, qd = .*: let it be finite"),
        (
            lambda qd: np.divide(1.0, qd, where=qd != 0, out=np.full(qd.shape, np.inf)),
            SettingError,
            "gives inf at .* also at rest",
        ),
        (lambda qd: qd.nothing, PluginError, r"plug-in force raised AttributeError: .* \(.*test_blame\.py, line \d+\)"),
    ],
    ids=["None", "shape", "nan", "inf", "raises"],
)
def test_a_friction_law_that_goes_wrong(log, do, error, message):
    with pytest.raises(error, match=message):
        identify(log, scara() + Law(do), ExplicitModel())


@pytest.mark.parametrize(
    ("do", "error", "message"),
    [
        (lambda problem: None, PluginError, r"Solver\.solve returned None, expected an Estimate"),
        (lambda problem: Estimate.judge(problem, np.zeros(8))._replace, PluginError, "raised AttributeError"),
        (
            lambda problem: Estimate(problem, np.zeros(3), np.eye(3), None),
            PluginError,
            r"shape \(3,\), expected .* shape \(8,\)",
        ),
        (
            lambda problem: Estimate(problem, np.r_[np.nan, np.ones(7)], np.eye(8), None),
            IdentificationError,
            "gives NaN or infinity for ZZR1",
        ),
    ],
    ids=["None", "raises", "shape", "nan"],
)
def test_an_estimator_that_goes_wrong(log, do, error, message):
    with pytest.raises(error, match=message):
        identify(log, scara(), ExplicitModel(), estimator=Solver(do))


def test_a_mask_of_another_shape(log):
    @dataclass(frozen=True)
    class Mask(AbstractMask):
        """All but the first joint."""

        def halo(self, fs):
            return 0.0

        def weight(self, qd, fs):
            return np.ones_like(qd)[1:]

    with pytest.raises(PluginError, match=r"plug-in Mask\.weight returned an array of float64, shape \(1, 4600\)"):
        identify(log, scara(), ExplicitModel(), replace(idbench_chain(), mask=Mask()))


def test_our_own_mistakes_are_not_blamed_on_plugins(log, monkeypatch):
    space = {"__name__": "idbench.identify.broken"}
    exec("def broken(*args): return 1 / 0", space)
    monkeypatch.setattr(Chain, "rows", space["broken"])
    with pytest.raises(ZeroDivisionError):
        identify(log, scara(), ExplicitModel())
