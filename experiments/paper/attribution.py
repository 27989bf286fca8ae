"""What does each imperfection do to each parameter, alone? Everything else is ideal, and given to identification.

Expected: what shifts the torque in time (hold, computing delay, half a physics step) turns inertia into viscous friction, most
where friction is small; quantization and ripple are noise; standstill touches the friction of the dynamic models and leaves
the power model alone; a gain error scales everything.
"""

from dataclasses import dataclass, replace
from typing import TypeAlias

from idbench.experiments.study.job import LocalPool
from idbench.identify import (
    Array,
    AsLogged,
    Chain,
    MotionLog,
    NoMask,
    TorqueChannel,
    WeightedLeastSquares,
    idbench_chain,
    identify_each,
    scara,
)
from idbench.identify.models import ExplicitModel, PowerModel
from idbench.sim.drives import AveragedDrive, SwitchedDrive
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import Progress, simulate
from idbench.sim.frictions import Stribeck
from idbench.sim.robot.scara import scara_truth
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Physics, Scenario, Timing

Errors: TypeAlias = dict[str, Array]
"""Model -> signed error of every parameter [%]."""

COMPARED = {"explicit": ExplicitModel(), "power": PowerModel()}
"""The implicit model's errors are the explicit one's to a few per cent of themselves."""


@dataclass(frozen=True)
class Imperfection:
    """One imperfection."""

    name: str
    """What it is."""
    scenario: Scenario
    """An ideal loop but for it."""
    chain: Chain
    """Chain `idbench`, but for what it is about."""
    assumed: TorqueChannel | None = None
    """What identification believes of the torque; by default what is true."""


def imperfections(table2: Scenario) -> list[Imperfection]:
    """Return the imperfections of the robot of scenario `table2`, each alone, and some more."""
    ideal = Scenario("ideal", table2.trajectory, table2.robot, table2.fs, table2.seed)
    chain, prompt = idbench_chain(), TorqueChannel("held")
    logged, unmasked = replace(chain, alignment=AsLogged()), replace(chain, mask=NoMask())
    delay, coarse = Timing(delay=table2.timing.delay), Physics(integrator="implicitfast")
    chopper = table2.drive if isinstance(table2.drive, SwitchedDrive) else SwitchedDrive()
    plain = replace(chopper, emf_compensation=0.0)
    return [
        Imperfection("nothing", ideal, chain),
        Imperfection("hold, not given", ideal, logged),
        Imperfection(f"computing delay of {1e3 * delay.delay:g} ms, not given", replace(ideal, timing=delay), chain, prompt),
        Imperfection("half a physics step of 1 ms, not given", replace(ideal, physics=coarse), chain, prompt),
        Imperfection("half a physics step of 1 ms, given", replace(ideal, physics=coarse), chain),
        Imperfection("quantization", replace(ideal, encoder=table2.encoder), chain),
        Imperfection("quantization, 20 bits", replace(ideal, encoder=IncrementalEncoder(lines=(2**18,))), chain),
        Imperfection("cogging and commutation", replace(ideal, drive=AveragedDrive(), ripple=table2.ripple), chain),
        Imperfection("chopper", replace(ideal, drive=chopper), chain),
        Imperfection("chopper without EMF compensation", replace(ideal, drive=plain), chain),
        Imperfection("standstill, not masked", ideal, unmasked),
        Imperfection("Stribeck friction", replace(ideal, friction=Stribeck()), chain),
        Imperfection("gain error of 2 %", replace(ideal, torque=TorqueMeasurement(gain_error=(0.02,))), chain),
    ]


class Attribution:
    """Errors of all imperfections; their logs are simulated on threads, while the twin is. No bit depends on the threads."""

    def __init__(self, table2: Scenario, threads: int = 2) -> None:
        self._imperfections = imperfections(table2)
        self._scenarios = every = [one.scenario for one in self._imperfections]  # some are alike
        self._pool = LocalPool(lambda which, progress: _simulated(every[which.start], progress), threads)
        self._logs = {k: self._pool.submit(range(k, k + 1)) for k, one in enumerate(every) if every.index(one) == k}

    def errors(self, progress: Progress | None = None) -> dict[str, Errors]:
        """Return, for every imperfection, the signed error [%] of every parameter in each model."""
        found = dict[str, Errors]()
        try:
            for one in self._imperfections:
                log, truth = self._logs[self._scenarios.index(one.scenario)].result()
                assumed = MotionLog(log.fs, log.q, log.tau, one.assumed or log.torque)
                estimates = identify_each(assumed, scara(), COMPARED, one.chain, WeightedLeastSquares())
                found[one.name] = {form: estimate.error_percent(truth) for form, estimate in estimates.items()}
                if progress:
                    progress(len(found) / len(self._imperfections))
        finally:
            self.stop()
        return found

    def stop(self) -> None:
        """End simulations that are not finished."""
        self._pool.close()


def _simulated(scenario: Scenario, progress: Progress) -> tuple[MotionLog, list[float]]:
    """Return the log of a scenario, and the true parameters."""
    run = simulate(scenario, progress=progress)
    return run.alone(), list(scara_truth(run.robots[0]).values())
