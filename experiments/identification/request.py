"""What is asked for: a robot, models, a chain and an estimator, checked before any log is read."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.simulators import RobotPlant, ScenarioLoop
from idbench.experiments.identification.smooth_friction import places_of, prior_of, sizes_of
from idbench.experiments.requests.words import Start
from idbench.identify import MODELS, Basis, Chain, ExplicitModel, MotionLog, Problem, Simulation
from idbench.identify.blame import blamed
from idbench.identify.estimators.settle import settled
from idbench.identify.models import THREE
from idbench.identify.parameters.prior import prior_sum
from idbench.identify.rows.factors import Prior
from idbench.identify.signals.masks import ReversalMask
from idbench.sim.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Request:
    """What is asked for of logs; names and settings are checked when it is made.

    Raises
    ------
    ExperimentError, IdentificationError, BenchError
        If a name is unknown, or a setting would not be used.
    """

    robot_model: RobotModel = field(default_factory=RobotModel)
    """The robot."""
    models: tuple[str, ...] = THREE
    """Names of the models."""
    method: Method = field(default_factory=Method.named)
    """Chain and estimator."""
    name: str = ""
    """What to call it beside others of the same log; by default chain and estimator."""
    loops: tuple[Scenario, ...] = ()
    """The closed loops in which the logs were recorded, for estimators that simulate them: one for each log."""
    start: Start = "least-squares"
    """Where estimators begin that simulate or filter: at the least-squares estimate, or at the parameters of the robot's
    file."""
    share: float | None = None
    """Relative change of the links of the file that is expected, where they are roughly known; by default the log decides."""
    mask_speed: tuple[float, ...] = ()
    """Speeds up to which joints count as standing or turning, of all or of each [rad/s, m/s]; by default they follow the
    log."""
    mask_reach: tuple[float, ...] = ()
    """Reach of the mask of each joint (`ReversalMask.reach`), as the logs decide; without it all have the short mask."""
    smooth: tuple[float, ...] = ()
    """Standard deviations of the smooth functions of friction, joint by joint [N m]; by default a tenth of the rms torques."""
    wdyn: tuple[float, str] | None = None
    """Bandwidth of the position loop [Hz], and its source; by default that of the loops, if there are any."""

    def __post_init__(self) -> None:
        if self.wdyn is not None and not 0 < self.wdyn[0] < np.inf:
            raise ExperimentError(f"--wdyn {self.wdyn[0]:g} must be above 0 [Hz], and finite")
        self.robot_model.check()
        for name in self.models:
            MODELS.create(name)
        method, n, given = self.method, self.robot_model.robot.n, " ".join(f"{x:g}" for x in self.mask_speed)
        if self.mask_speed and not isinstance(self.processing.mask, ReversalMask):
            raise ExperimentError(
                f"--mask-speed {given}: --chain {method.chain_name} with these options masks nothing; leave it out"
            )
        if len(self.mask_speed) not in (0, 1, n) or not all(0 < x < np.inf for x in self.mask_speed):
            raise ExperimentError(f"--mask-speed {given} must be one speed above 0 for all {n} joints, or one for each")
        rough = "--prior" if self.robot_model.asked.prior else "--friction smooth" if self.robot_model.laws.smooth else ""
        if rough and not method.estimator.takes_prior:
            raise ExperimentError(
                f"{rough}: {method.estimator_name} takes nothing that is known before; use --estimator GLS, WLS or OLS, "
                "or --hold"
            )
        if self.start != "least-squares" and not method.estimator.begins:
            raise ExperimentError(
                f"--start {self.start}: {method.estimator_name} needs no start; leave it out, or use --estimator IV or DIDIM"
            )

    @property
    def processing(self) -> Chain:
        """The chain, with the mask of this robot and these speeds."""
        chain = self.method.chain
        if not isinstance(chain.mask, ReversalMask):
            return chain
        couplings = tuple(c.weights for c in self.robot_model.tree.couplings)
        threshold, reach = self.mask_speed or chain.mask.threshold, self.mask_reach or chain.mask.reach
        return replace(chain, mask=replace(chain.mask, couplings=couplings, threshold=threshold, reach=reach))

    def with_chain(self, chain: Chain, name: str = "") -> Self:
        """The same with another chain, which starts from that of a name."""
        return replace(self, method=replace(self.method, chain=chain, chain_name=name or self.method.chain_name))

    @property
    def label(self) -> str:
        """What distinguishes this identification from others of the same log."""
        return self.name or f"{self.method.chain_name}-{self.method.estimator_name}"

    def problem(self, logs: Sequence[MotionLog]) -> Problem:
        """Return logs, robot and chain, by the explicit model; nonlinear parameters at their operating point."""
        basis, simulation = self.robot_model.basis, self._simulation(tuple(logs))
        with blamed():
            prior = self._prior(basis, tuple(logs))
            return settled(Problem(tuple(logs), basis, ExplicitModel(), self.processing, simulation, prior))

    def _prior(self, basis: Basis, logs: tuple[MotionLog, ...]) -> Prior | None:
        """Prior of the parameters: of smooth functions by their sizes, of others as stated."""
        known = self.robot_model.prior(self.share)
        if not places_of(basis)[0]:
            return known
        functions = prior_of(basis, self.smooth or sizes_of(logs))
        return functions if known is None else prior_sum((functions, known))

    def _simulation(self, logs: tuple[MotionLog, ...]) -> Simulation:
        """Simulation of the robot, for estimators that need it."""
        needs, robot_model = self.method.estimator.needs, self.robot_model
        start = None if self.start == "least-squares" else np.array(list(robot_model.truth(robot_model.robot).values()))
        loop = ScenarioLoop.of(robot_model, self.loops, logs) if "loop" in needs and self.loops else None
        return Simulation(loop, RobotPlant(robot_model) if "plant" in needs else None, start)
