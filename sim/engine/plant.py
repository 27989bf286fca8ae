"""The rigid bodies of many simulations, in MuJoCo."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import ClassVar

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch, SimulationError

from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.varied import VariedRobots, vary_fields
from idbench.sim.scenario.scenario import Physics

ALL = slice(None)

SWITCHED_OFF = (
    mujoco.mjtDisableBit.mjDSBL_ACTUATION,
    # Shapes of neighbours overlap in many files, and a torque of contact is none of the models'.
    mujoco.mjtDisableBit.mjDSBL_CONTACT,
    # A simulation that diverges would begin anew without a word.
    mujoco.mjtDisableBit.mjDSBL_AUTORESET,
)
"""Of MuJoCo."""


class Plant:
    """Simulations of a robot whose joints are driven by torques, in steps of `h` [s]; its actuators are switched off.

    `vary` has fields of MuJoCo's model with a value for each simulation, shape (nsim, ...); no threads are all processors.
    """

    has_play: ClassVar[bool] = False

    def __init__(
        self, robot: Robot, nsim: int, physics: Physics, h: float, vary: Mapping[str, npt.ArrayLike], threads: int
    ) -> None:
        self._begin(robot.model, physics, h, nsim, threads)
        vary_fields(self.batch, vary)
        self.robots: Sequence[Robot] = VariedRobots(robot, nsim, vary) if vary else (robot,) * nsim
        self.q, self.qd, self._applied = (self.batch.bind(name) for name in ("qpos", "qvel", "qfrc_applied"))
        expanded = self.batch.expanded("dof_frictionloss")
        model = robot.model
        self.Fs: Array = np.array(np.broadcast_to(model.dof_frictionloss, (nsim, robot.n)) if expanded is None else expanded)

    def _begin(self, described: mujoco.MjModel, physics: Physics, h: float, nsim: int, threads: int) -> None:
        self._settings = h, physics.integrator
        self.batch = Batch(_stepping(described, *self._settings), nsim, threads)
        self._errors: dict[int, str] = {}

    def become(self, robots: Sequence[Robot]) -> None:
        """Make every simulation of a plant, of which no fields vary, that of a robot which differs in parameters alone.

        Raises
        ------
        RobotError
            If they differ in more: MuJoCo's data would have another layout.
        """
        try:
            self.batch.set_models([_stepping(robot.model, *self._settings) for robot in robots])
        except mujoco.FatalError as error:
            raise RobotError(f"robots of one batch differ in more than parameters: {error}") from error
        self.robots = tuple(robots)
        self.Fs = np.stack([robot.model.dof_frictionloss for robot in robots])

    @property
    def joints(self) -> Batch:
        """The simulations as frictions see them: fields of a value a joint."""
        return self.batch

    @property
    def rotors(self) -> tuple[Array, Array]:
        """Positions [rad] and velocities [rad/s] of the rotors behind the gear, shape (nsim, joint)."""
        return self.q, self.qd

    def put(self, q: Array, some: npt.NDArray[np.intp] | slice = ALL) -> None:
        """Put simulations where they are at rest: q [rad], shape (joint,) or (nsim, joint)."""
        self.q[some], self.qd[some] = q, 0.0

    def step(self, torques: Array, steps: int, going: npt.NDArray[np.intp] | None = None) -> None:
        """Advance simulations by `steps` physics steps.

        Parameters
        ----------
        torques : Array, shape (steps or 1, nsim, joint)
            On the joints in every step, or the same in all of them [N m].
        steps : int
            How many.
        going : int array, optional
            The simulations that advance; all by default.
        """
        try:
            if len(torques) == 1:
                self._applied[:] = torques[0]
                self.batch.step(going, steps)
            else:
                control = np.ascontiguousarray(np.swapaxes(torques if going is None else torques[:, going], 0, 1))
                self.batch.rollout(steps, control, int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), record=(), ids=going)
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


def _stepping(described: mujoco.MjModel, h: float, integrator: str) -> mujoco.MjModel:
    """Return a robot's model with a physics step [s] and an integrator, driven by torques alone."""
    model = copy(described)
    model.opt.timestep = h
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    for flag in SWITCHED_OFF:
        model.opt.disableflags |= int(flag)
    return model
