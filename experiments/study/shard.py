"""A shard: runs of one combination, simulated together and identified together."""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.simulators import RobotPlant, ScenarioLoop
from idbench.experiments.study.axis import SERVO, Combination
from idbench.experiments.study.statistics import BOUNDS
from idbench.experiments.study.study import Study
from idbench.identify import (
    Array,
    Estimate,
    ExplicitModel,
    IdentificationError,
    MotionLog,
    NoiseLevels,
    Problem,
    Simulation,
    Status,
    attempt_each,
    cramer_rao,
)
from idbench.identify.estimators.settle import settled
from idbench.identify.signals.prefilters import AbstractPrefilter, NoisePrefilter
from idbench.sim.engine.run import Run, ideal_run
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.errors import BenchError
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.trajectories import Reference

MIN_NOISE = 1e-9  # Noise [rad, N m] that counts as none: the bound is then that of rounding


def _known(study: Study, robot_model: RobotModel, simulated: Run) -> tuple[dict[str, float], dict[str, Array]]:
    """Truth of a robot's parameters, and, if asked for, the least standard deviations that noise allows, shape (run, p).

    Noise is that of encoders and torques. What else is wrong in a scenario, such as cogging, is no part of them.
    """
    scenario, basis, n = simulated.scenario, robot_model.basis, robot_model.basis.n
    truth = robot_model.truth(simulated.robots[0], scenario.friction)
    if not study.bound:
        return truth, {}
    noise = NoiseLevels(*(np.maximum(x, MIN_NOISE) for x in (scenario.torque.spread(n), scenario.encoder.spread(n))))
    X = np.array(list(truth.values()))
    found = {
        name: cramer_rao(basis, X, simulated.q, simulated.qd, scenario.fs, noise, reversals=reversals)
        for name, reversals in zip(BOUNDS, (False, True), strict=True)
    }
    return truth, {name: np.sqrt(np.diagonal(C, axis1=-2, axis2=-1)) for name, C in found.items()}


START = 5  # Stream of random numbers of where estimators begin
FARTHEST = 3.0  # Standard deviations at most by which a start is off

PARTS = ("", ".sigma", ".paper_sigma", ".truth")
"""Of every parameter: the estimate, its corrected sigma, that of the paper's formula, and the truth."""


def parts_of(study: Study) -> tuple[str, ...]:
    """Columns of a study's rows for every parameter."""
    return (*PARTS, *BOUNDS) if study.bound else PARTS


@dataclass
class Shard:
    """What a shard has found: a row for every run, method and model, and how long it took."""

    rows: list[dict[str, Any]] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))


def run_shard(study: Study, runs: range, *, progress: Progress | None = None) -> Shard:
    """Simulate and identify runs of one combination of the grid; a run that fails leaves its reason in its rows.

    `progress` receives the share that is done: the simulation and each method count alike.
    """
    shard = Shard()
    scenarios = {run: study.scenario_of(run) for run in runs}
    done = 0
    steps = 1 + len(study.methods)
    for together in _groups(study, scenarios, shard):
        start, tell = time.perf_counter(), _part(progress, done, len(together), steps * len(runs))
        try:
            simulated = _simulate(study, scenarios, together, tell)
            known = {} if study.of_servos else {x: _known(study, model, simulated) for x, model in study.subjects.items()}
        except BenchError as error:
            _fail(shard, study, scenarios, list(together), str(error))
            continue
        shard.seconds["simulation"] += time.perf_counter() - start
        done += len(together) * steps
        for k, combination in enumerate(study.methods):
            start = time.perf_counter()
            if study.of_servos:
                from idbench.experiments.study.servo_rows import rows_of

                common = [
                    _common(study, combination, run, SERVO, seed) for run, seed in zip(together, simulated.seeds, strict=True)
                ]
                shard.rows += rows_of(study.parameters, parts_of(study), combination.friction, simulated, common)
            else:
                truth, bounds = known[combination.friction]
                simulation = _simulation(study, combination, simulated, together, truth)
                shard.rows += _identify(study, combination, simulated, list(together), truth, bounds, simulation)
            shard.seconds[f"{combination.method.chain_name} {combination.method.estimator_name}"] += time.perf_counter() - start
            tell(2.0 + k)
    shard.rows.sort(key=lambda row: row["run"])
    return shard


def _groups(study: Study, scenarios: Mapping[int, Scenario], shard: Shard) -> Iterator[dict[int, Reference | None]]:
    """Yield the runs that can advance together: those whose motions are of equal length."""
    if study.motion == "shared":
        yield dict.fromkeys(scenarios)
        return
    groups: dict[int, dict[int, Reference | None]] = defaultdict(dict)
    for run, scenario in scenarios.items():
        try:
            motion = scenario.trajectory.sample(scenario.real_robot, scenario.fs)
        except BenchError as error:
            _fail(shard, study, scenarios, [run], str(error))
        else:
            groups[len(motion.q)][run] = motion
    yield from groups.values()


def _simulate(
    study: Study, scenarios: Mapping[int, Scenario], together: Mapping[int, Reference | None], progress: Progress
) -> Run:
    """Return the first log of every run, then the second of every run, and so on, as so many simulations on one thread."""
    first, motions = scenarios[next(iter(together))], [motion for motion in together.values() if motion is not None]
    seeds = [seed for each in zip(*map(study.seeds_of, together), strict=True) for seed in each]
    motions *= study.most_logs
    if study.data == "ideal":
        return ideal_run(first, seeds, motions)
    return simulate(first, seeds, motions=motions, threads=1, progress=progress, throw=False)


def _part(progress: Progress | None, done: int, part: int, whole: int) -> Progress:
    """Receiver of the steps that `part` runs have done, which tells the share of the whole."""

    def tell(steps: float) -> None:
        if progress is not None:
            progress((done + steps * part) / whole)

    return tell


def _identify(
    study: Study,
    combination: Combination,
    simulated: Run,
    runs: Sequence[int],
    truth: Mapping[str, float],
    bounds: Mapping[str, Array],
    simulation: Simulation,
) -> Iterator[dict[str, Any]]:
    """Yield a row for every run and model."""
    for places in _alike(study, combination, simulated, len(runs)):
        own = {name: x[places] for name, x in bounds.items()}
        begin = simulation.start if simulation.start is None or simulation.start.ndim < 2 else simulation.start[places]
        logs = [simulated.log.run(([k * len(runs) + i for i in places],)) for k in range(study.most_logs)]
        found = _outcomes(study, combination, simulated, logs, replace(simulation, start=begin))
        causes = [_causes(study, combination, simulated, i) for i in places]
        for model in study.models:
            outcome = found[model]
            columns = _columns(outcome, truth, own) if isinstance(outcome, Estimate) else {}
            for place, i in enumerate(places):
                common = _common(study, combination, runs[i], model, simulated.seeds[i]) | causes[place]
                ends = (simulated.failures.get(i + k * len(runs)) for k in range(study.logs_of(model)))
                if reason := next(filter(None, ends), None) or _failure(outcome, place):
                    yield common | {"failure": reason}
                else:
                    yield common | {name: values[place] for name, values in columns.items()}


def _causes(study: Study, combination: Combination, simulated: Run, i: int) -> dict[str, float]:
    """What the doctor says of a run, where the study asks for it."""
    if not study.causes or i in simulated.failures:
        return {}
    from idbench.experiments.study.named_faults import named_faults

    robot_model, log = study.subjects[combination.friction], simulated.log.run((i,))
    return named_faults(combination.method, robot_model, log, simulated.scenario.faults)


def _outcomes(
    study: Study, combination: Combination, simulated: Run, logs: Sequence[MotionLog], simulation: Simulation
) -> dict[str, Estimate | IdentificationError]:
    """What each model gives of some runs."""
    found, chain = dict[str, Estimate | IdentificationError](), combination.method.chain
    if study.rows == "equal" and chain.trim is None:  # with the longest margin of all models
        chain = replace(chain, trim=max(chain.of_model(m).margin(simulated.log) for m in study.created_models.values()))
    for count in dict.fromkeys(map(study.logs_of, study.models)):
        models = {name: model for name, model in study.created_models.items() if study.logs_of(name) == count}
        basis = study.subjects[combination.friction].basis
        try:
            problem = settled(Problem(tuple(logs[:count]), basis, ExplicitModel(), chain, simulation))
            found |= attempt_each(problem, models, combination.method.estimator, throw=False)
        except IdentificationError as error:
            found |= dict.fromkeys(models, error)
    return found


def _alike(study: Study, combination: Combination, simulated: Run, runs: int) -> list[list[int]]:
    """Places of runs whose logs get the same prefilters: each is identified as if it were alone.

    Estimators that simulate robots take all runs at once, and the prefilter that the noisiest of them needs.
    """
    groups: dict[tuple[AbstractPrefilter, ...], list[int]] = defaultdict(list)
    if {"loop", "plant"} & combination.method.estimator.needs or not isinstance(
        combination.method.chain.prefilter, NoisePrefilter
    ):
        return [list(range(runs))]
    for i in range(runs):
        logs = (simulated.log.run((k * runs + i,)) for k in range(study.most_logs))
        groups[tuple(map(combination.method.chain.suited_prefilter, logs))].append(i)
    return list(groups.values())


def _simulation(
    study: Study, combination: Combination, simulated: Run, together: Mapping[int, Reference | None], truth: Mapping[str, float]
) -> Simulation:
    """Simulation of the runs' robots, by estimators that need it, and where these begin."""
    motions = tuple(motion for motion in together.values() if motion is not None)
    needs = combination.method.estimator.needs
    robot_model = study.subjects[combination.friction]
    start = None
    loop = ScenarioLoop(robot_model, (simulated.scenario,), (simulated.log,), motions) if "loop" in needs else None
    if study.start:
        first = simulated.seeds[: len(together)]
        drawn = np.stack([np.random.default_rng([seed, START]).standard_normal(len(truth)) for seed in first])
        start = np.array(list(truth.values())) * (1 + study.start * np.clip(drawn, -FARTHEST, FARTHEST))
    return Simulation(loop, RobotPlant(robot_model) if "plant" in needs else None, start)


def _failure(outcome: Estimate | IdentificationError, i: int) -> str:
    """Reason why a run has no estimate; empty if it has one."""
    if isinstance(outcome, IdentificationError):
        return str(outcome)
    if (i,) in outcome.failures:
        return outcome.failures[(i,)]
    if outcome.status[i] != Status.OK:
        return outcome.problem.factors.together.explain((i,))
    return "" if np.isfinite(outcome.X[i]).all() else "the estimator finds no finite value"


def _columns(estimate: Estimate, truth: Mapping[str, float], bounds: Mapping[str, Array]) -> dict[str, list[Any]]:
    """Results of an estimate of many runs, each a list with the value of each run."""
    runs = len(estimate.X)
    found = estimate.X, estimate.standard_errors, estimate.own_sigma, np.tile(list(truth.values()), (runs, 1))
    parts = {**dict(zip(PARTS, found, strict=True)), **bounds}
    columns = {
        "condition_number": estimate.condition_number.tolist(),
        "rows": estimate.row_count.tolist(),
        "residual_rms": estimate.residual_rms.tolist(),
        "simulations": [0] * runs if estimate.simulations is None else estimate.simulations.tolist(),
    }
    for p, name in enumerate(estimate.names):
        columns |= {name + part: x[:, p].tolist() for part, x in parts.items()}
    return columns


def _fail(shard: Shard, study: Study, scenarios: Mapping[int, Scenario], runs: Sequence[int], reason: str) -> None:
    """Write the reason why runs could not be simulated into all their rows."""
    for run in runs:
        for combination in study.methods:
            for model in study.models:
                shard.rows.append(_common(study, combination, run, model, scenarios[run].seed) | {"failure": reason})


def _common(study: Study, combination: Combination, run: int, model: str, seed: int) -> dict[str, Any]:
    """Columns of every row."""
    settings = {s.axis.field: s.label for s in (*study.points[run // study.seeds].settings, *combination.settings)}
    names = {"chain": combination.method.chain_name, "estimator": combination.method.estimator_name, "model": model}
    return {"run": run, "seed": seed, **settings, **names, "failure": None}
