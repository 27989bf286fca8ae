"""Joints with backlash: rotor and link of each are two bodies, with free play between them."""

from collections.abc import Mapping
from functools import partial

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from idbench.sim.engine.plant import ALL, Plant
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.payload import with_play
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.scenario import Scenario

ROTOR, GAP = slice(0, None, 2), slice(1, None, 2)
"""Degrees of freedom: the rotor's behind the gear, and the link's relative to it."""


def plant_of(scenario: Scenario, robot: Robot, nsim: int, h: float, vary: Mapping[str, npt.ArrayLike], threads: int) -> Plant:
    """Return the bodies of a scenario."""
    play = scenario.drive.play(robot)
    if not play.any():
        return Plant(robot, nsim, scenario.physics, h, vary, threads)
    if vary:
        raise ScenarioError(f"a robot with backlash has the parameters of its file: {', '.join(vary)} cannot vary")
    edits = scenario.payload.edit, scenario.friction.edit, scenario.drive.edit, partial(with_play, play=play, h=h)
    return GearedPlant(robot, Robot.load(scenario.robot, *edits).model, nsim, scenario, h, threads)


class GearedPlant(Plant):
    """Two hinges (or slides) a joint: the drive's torque, armature and friction act on the first, the link turns on the second.

    MuJoCo solves the contact at the ends of the play together with all else, so that it is stable however light the link is;
    a dead zone in the drive would need steps as short as the lightest link wants. `robot` has no play, its `model` has it.
    """

    has_play = True

    def __init__(self, robot: Robot, model: mujoco.MjModel, nsim: int, scenario: Scenario, h: float, threads: int) -> None:
        self._begin(model, scenario.physics, h, nsim, threads)
        self.robot, self.robots = robot, (robot,) * nsim
        self._qpos, self._qvel, self._applied = (self.batch.bind(name) for name in ("qpos", "qvel", "qfrc_applied"))
        self.Fs: Array = np.array(np.broadcast_to(model.dof_frictionloss[ROTOR], (nsim, robot.n)))

    @property
    def q(self) -> Array:
        """Positions of the links [rad], shape (nsim, joint)."""
        return np.asarray(self._qpos[:, ROTOR] + self._qpos[:, GAP])

    @property
    def qd(self) -> Array:
        """Velocities of the links [rad/s], shape (nsim, joint)."""
        return np.asarray(self._qvel[:, ROTOR] + self._qvel[:, GAP])

    @property
    def rotors(self) -> tuple[Array, Array]:
        """Positions [rad] and velocities [rad/s] of the rotors behind the gear, shape (nsim, joint)."""
        return self._qpos[:, ROTOR], self._qvel[:, ROTOR]

    @property
    def joints(self) -> Batch:
        """The simulations as frictions see them: at the rotors."""
        return _Rotors(self.batch)

    def put(self, q: Array, some: npt.NDArray[np.intp] | slice = ALL) -> None:
        """Put simulations where they are at rest, in the middle of their play."""
        self._qpos[some, GAP], self._qvel[some] = 0.0, 0.0
        self._qpos[some, ROTOR] = q

    def step(self, torques: Array, steps: int, going: npt.NDArray[np.intp] | None = None) -> None:
        """Advance as `Plant` does; torques act on the rotors."""
        whole = np.zeros((*torques.shape[:-1], 2 * torques.shape[-1]))
        whole[..., ROTOR] = torques
        super().step(whole, steps, going)


class _Rotors:
    """Fields of the rotors."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch

    def expand(self, name: str) -> Array:
        return np.asarray(self._batch.expand(name))[:, ROTOR]

    def bind(self, name: str) -> Array:
        return np.asarray(self._batch.bind(name))[:, ROTOR]
