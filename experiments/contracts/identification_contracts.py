"""Contracts of the plug-in points of identification."""

from collections.abc import Callable, Mapping
from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np

from idbench.experiments.contracts.contract import FS, Example, require, require_equal, untouched
from idbench.identify import (
    AbstractEstimator,
    Array,
    ExplicitModel,
    MotionLog,
    PowerModel,
    Problem,
    State,
    TorqueChannel,
    idbench_chain,
    identify,
    scara,
)
from idbench.identify.rows.row_map import Grid
from idbench.identify.rows.rows import Rows

SMALL = 1e-30  # Of complex steps: what they find is exact


def is_immutable(plugin: Any, _: Example) -> None:
    """It is a frozen dataclass, equal to a copy of itself, and documented."""
    require(is_dataclass(plugin), f"{type(plugin).__name__} is no dataclass")
    require(type(plugin).__dataclass_params__.frozen, f"{type(plugin).__name__} is not frozen: @dataclass(frozen=True)")
    require(replace(plugin) == plugin, "a copy of it is not equal to it")
    require(len((type(plugin).__doc__ or "").strip()) > 10, "its docstring does not say what it is")


def prefilter_keeps_constants(prefilter: Any, example: Example) -> None:
    """It keeps shapes, inputs and constants, and gives the same bits twice."""
    found = untouched(lambda x: prefilter.apply(x, FS), example.signals.copy())
    require(found.shape == example.signals.shape, f"signals of shape {example.signals.shape} come out as {found.shape}")
    require_equal(prefilter.apply(np.full((2, 500), 3.0), FS), 3.0, "a constant", rtol=1e-9)
    require(prefilter.halo(FS) >= 0, "its halo is negative")


def prefilter_has_no_phase(prefilter: Any, example: Example) -> None:
    """Time reversed in is time reversed out, away from the ends."""
    x = example.signals
    forward, back = prefilter.apply(x, FS), prefilter.apply(x[..., ::-1], FS)[..., ::-1]
    require_equal(forward[..., 300:-300], back[..., 300:-300], "the filter's phase", atol=1e-6)


def differentiator_knows_a_line(s: Any, example: Example) -> None:
    """It keeps shapes and inputs, and the derivative of a line is its slope."""
    found = untouched(lambda x: s.derivative(x, FS), example.signals.copy())
    require(found.shape == example.signals.shape, f"signals of shape {example.signals.shape} come out as {found.shape}")
    edge = int(np.ceil(s.halo(FS) * FS))
    require_equal(s.derivative(5 * example.t, FS)[edge : len(example.t) - edge], 5.0, "a slope", rtol=1e-9)


def mask_gives_weights(mask: Any, example: Example) -> None:
    """It gives a weight between 0 and 1 for every joint and instant."""
    weight = untouched(lambda qd: mask.weight(qd, FS), example.signals.copy())
    require(weight.shape == example.signals.shape, f"velocities of shape {example.signals.shape} give {weight.shape}")
    require(weight.min() >= 0 and weight.max() <= 1, f"weights go from {weight.min():g} to {weight.max():g}")


def block_names_its_parameters(block: Any, _: Example) -> None:
    """Its parameters have names, units and joints of their own."""
    parameters = block.parameters(2)
    names = [parameter.name for parameter in parameters]
    require(len(set(names)) == len(names), f"a name is given twice in {names}")
    wrong = [p.name for p in parameters if not p.unit or p.joint not in range(2)]
    require(not wrong, f"{', '.join(wrong)}: no unit, or no joint of 0 and 1")


def block_keeps_its_identities(block: Any, _: Example) -> None:
    """Explicit columns are d/dt momentum + remainder, and their power is d/dt energy + dissipation."""
    q, qd, qdd = np.random.default_rng(3).uniform(-2, 2, (3, 2, 50))
    logged = {"temperature": 30.0 + q, "payload": np.ones_like(q[:1])}
    at, ahead = State(q, qd, lambda _: qdd, logged), State(q + 1j * SMALL * qd, qd + 1j * SMALL * qdd, lambda x: x, logged)
    explicit = block.explicit(at)
    parameters = block.parameters(2)
    require({parameter for _, parameter in explicit} == set(parameters), "explicit columns are not those of its parameters")
    implicit = _sum(_rate(block.momentum, ahead), block.remainder(at))
    for row, parameter in explicit.keys() | implicit.keys():
        one, other = (columns.get((row, parameter), 0.0) for columns in (explicit, implicit))
        require_equal(one, other + 0 * q[0], f"the column of {parameter.name} in row {row}", atol=1e-10)
    power = _sum(_rate(block.energy, ahead), block.dissipation(at))
    for parameter in parameters:
        work = sum(qd[row] * x for (row, p), x in explicit.items() if p == parameter)
        require_equal(power[0, parameter], work, f"the power of {parameter.name}", atol=1e-10)


def _rate(columns: Callable[[State], Mapping[Any, Array]], ahead: State) -> dict[Any, Array]:
    return {address: np.imag(x) / SMALL for address, x in columns(ahead).items()}


def _sum(*parts: Mapping[Any, Array]) -> dict[Any, Any]:
    return {address: sum(part.get(address, 0.0) for part in parts) for address in set().union(*parts)}


def model_says_a_true_sentence(model: Any, example: Example) -> None:
    """B tau is [c + s e] X at every instant of noise-free data at which no joint reverses."""
    signals = idbench_chain().signals(example.log)
    equations = model.equations(scara(), signals)
    rest = equations.y - equations.predicted(example.truth)
    # Masked instants aside; 6th-order differences leave (w/fs)^6 / 140 with w below 20 rad/s, 5e-7 of 250 W.
    sliding = signals.weight.prod(axis=-2, keepdims=True) > 0
    off = np.abs(rest * equations.weight * sliding).max()
    require(off < 2e-4, f"it is off by up to {off:.3g} N m or W")


def operator_agrees_with_its_step(operator: Any, example: Example) -> None:
    """Its rows are as many as its step says, with a column for each parameter."""
    log = example.log
    equations = PowerModel().equations(scara(), idbench_chain().signals(log))
    grid = Grid.inside(log.samples, log.fs, 3.0, operator.step(log.fs))
    rows = Rows.of(equations, operator.map(equations, equations.weight, grid))
    expected = (log.samples - 600) // operator.step(log.fs)
    require(rows.W.shape == (expected, 8), f"W has the shape {rows.W.shape}, expected {(expected, 8)}")
    require(rows.valid.dtype == bool, "the rows' validity is not of booleans")
    require(operator.halo(log.fs) >= 0, "its halo is negative")


def chain_recovers_ideal_data(chain: Any, example: Example) -> None:
    """On noise-free data no parameter errs by more than 10 %, in no model."""
    for model in (ExplicitModel(), PowerModel()):
        error = identify(example.log, scara(), model, chain).relative_error_percent(list(example.truth)).max()
        require(error < 10.0, f"{type(model).__name__}: an error of {error:.3g} %")


def estimator_recovers_the_truth(estimator: AbstractEstimator, example: Example) -> None:
    """Without noise it gives the truth, to 1e-5 from rows, to 1 % if it simulates or filters."""
    of_rows = estimator.filtered and estimator.needs <= {"factors", "rows"}
    log = example.log if of_rows else example.run.alone()
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain(), example.simulation)
    require_equal(estimator.fit(problem).X, example.truth, "the estimate", rtol=1e-5 if of_rows else 1e-2)


def estimator_takes_every_run_by_itself(estimator: AbstractEstimator, example: Example) -> None:
    """A batch, one run of which stands still, gives the others what they get alone, to the bit."""
    log = example.run.alone()
    q = np.stack([log.q, np.zeros_like(log.q), log.q])
    tau = np.stack([log.tau, log.tau, log.tau * 1.01])
    batch, alone = (MotionLog(log.fs, q[k], tau[k], log.torque) for k in (slice(None), 2))
    found, one = (
        identify(each, scara(), ExplicitModel(), estimator=estimator, simulation=example.simulation, throw=False)
        for each in (batch, alone)
    )
    require_equal(found.X[2], one.X, "the estimate of a run in a batch")
    require_equal(found.covariance[2], one.covariance, "its covariance")


def alignment_keeps_constants(alignment: Any, example: Example) -> None:
    """A constant torque is itself, whatever its samples mean, and its power is it times the velocity."""
    for meaning in ("instantaneous", "held", "averaged"):
        torque = alignment.align(np.full(example.signals.shape, 2.0), TorqueChannel(meaning, 0.004), FS)
        require_equal(torque.mean, 2.0, f"the mean of a constant {meaning} torque", rtol=1e-12)
        power = torque.times(np.full((3, len(example.t)), 3.0), 1)
        require(power.shape == (3, len(example.t)), f"power has the shape {power.shape}")
        require_equal(power[..., 20:-20], 6.0, "its power", rtol=1e-9)
        require_equal(torque.average(np.full(50, 7.0)), 7.0, "an average", rtol=1e-12)
        require(torque.halo() >= 0, "its halo is negative")
