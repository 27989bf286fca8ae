"""Simulations that a log drives, in MuJoCo's own batches: many robots, or one with other parameters each."""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch, SimulationError

from idbench.sim.engine.plant import stepping
from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.varied import vary_fields
from idbench.sim.scenario.scenario import Physics


class BatchedPlant:
    """Simulations of a robot whose joints are driven by torques, in steps of `h` [s]; its actuators are switched off.

    `vary` has fields of MuJoCo's model with a value for each simulation, shape (nsim, ...); no threads are all processors.
    """

    def __init__(
        self, robot: Robot, nsim: int, physics: Physics, h: float, vary: Mapping[str, npt.ArrayLike], threads: int
    ) -> None:
        self._settings = h, physics.integrator
        self.batch = Batch(stepping(robot.model, *self._settings), nsim, threads)
        vary_fields(self.batch, vary)
        self.q, self.qd, self._applied = (self.batch.bind(name) for name in ("qpos", "qvel", "qfrc_applied"))
        self._errors: dict[int, str] = {}

    def become(self, robots: Sequence[Robot]) -> None:
        """Make every simulation of a plant, of which no fields vary, that of a robot which differs in parameters alone.

        Raises
        ------
        RobotError
            If they differ in more: MuJoCo's data would have another layout.
        """
        try:
            self.batch.set_models([stepping(robot.model, *self._settings) for robot in robots])
        except mujoco.FatalError as error:
            raise RobotError(f"robots of one batch differ in more than parameters: {error}") from error

    def put(self, q: Array, sim: int) -> None:
        """Put a simulation where it is at rest: q [rad], shape (joint,)."""
        self.q[sim], self.qd[sim] = q, 0.0

    def step(self, torques: Array) -> None:
        """Advance by as many physics steps as there are torques on the joints [N m], shape (steps, nsim, joint)."""
        try:
            if len(torques) == 1:
                self._applied[:] = torques[0]
                self.batch.step()
            else:
                control = np.ascontiguousarray(np.swapaxes(torques, 0, 1))
                self.batch.rollout(len(torques), control, int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), record=())
        except SimulationError as error:
            self._errors |= {int(sim): " ".join(self.batch.error(int(sim)).split()) for sim in error.ids}

    @property
    def troubles(self) -> dict[int, str]:
        """What MuJoCo has complained of, by the number of the simulation."""
        found = dict(self._errors)
        if not self.batch.warning[..., 1].any():
            return found
        for sim, kind in np.argwhere(self.batch.warning[..., 1]).tolist():
            found.setdefault(sim, mujoco.mju_warningText(kind, int(self.batch.warning[sim, kind, 0])))
        return found
