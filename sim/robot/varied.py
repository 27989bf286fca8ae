"""Robots with other parameters: fields of MuJoCo's model, without compiling it anew."""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import INERTIAL
from idbench.sim.errors import RobotError, ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import TENDON, fixed_tendons, tendon_name

DRIVE = {"Ia": "dof_armature", "Fv": "dof_damping", "Fs": "dof_frictionloss", "K": "jnt_stiffness"}
"""Letters of the parameters of a drive, and MuJoCo's fields of them."""

RESISTING = ("dof_frictionloss", "tendon_frictionloss")  # Fields in which MuJoCo takes what is below zero for zero


def model_fields(robot: Robot, standard: Mapping[str, Array]) -> dict[str, Array]:
    """Return the fields of MuJoCo's model of robots with other standard parameters, shape (nsim, ...) each.

    The inertia of a link stands at the body that its joint moves; bodies that are welded to it become massless. A link need not
    be one that can exist: its torques are what its parameters say, as long as M(q) is positive definite. `standard` has values
    of shape (nsim,) by the names of `standard_parameters`; those that it leaves out stay.

    Raises
    ------
    RobotError
        If a link has no mass, but a first moment.
    """
    model, nsim = robot.model, len(next(iter(standard.values())))
    names = ("body_mass", "body_inertia", "body_ipos", "body_iquat", *DRIVE.values())
    names += tuple(TENDON.values()) if model.ntendon else ()
    found = {name: np.repeat(getattr(model, name)[None], nsim, axis=0).astype(np.float64) for name in names}
    for j in range(robot.n):
        if named("M", j) in standard:
            _set_link(robot, j, np.stack([standard[named(x, j)] for x in INERTIAL], axis=-1), found)
        for letters, name in DRIVE.items():
            if named(letters, j) in standard:
                found[name][:, j] = standard[named(letters, j)]
    for i in fixed_tendons(model):
        for letters, name in TENDON.items():
            if (key := f"{letters}_{tendon_name(model, i)}") in standard:
                found[name][:, i] = standard[key]
    for name in RESISTING:
        if name in found:
            found[name] = np.maximum(found[name], 0.0)
    return {name: values for name, values in found.items() if values.size}


def vary_fields(batch: Batch, fields: Mapping[str, npt.ArrayLike]) -> None:
    """Give fields of the model the values of every simulation, shape (nsim, ...); raise ScenarioError if there is none such."""
    for name, given in fields.items():
        values = np.asarray(given, dtype=np.float64)
        try:
            field = batch.expand(name)
        except (AttributeError, ValueError, KeyError, TypeError) as error:
            raise ScenarioError(f"vary: MuJoCo's model has no field {name!r} that could vary: {error}") from error
        if values.shape != field.shape:
            raise ScenarioError(f"vary: {name} needs the shape {field.shape}, not {values.shape}")
        field[:] = values
    if fields:
        batch.set_const()


def varied_models(robot: Robot, nsim: int, fields: Mapping[str, npt.ArrayLike]) -> list[mujoco.MjModel]:
    """MuJoCo's model of every simulation: the robot's own where no fields vary."""
    if not fields:
        return [robot.model] * nsim
    batch = Batch(robot.model, nsim)
    vary_fields(batch, fields)
    return [batch.get_model(i) for i in range(nsim)]


class VariedRobots(Sequence[Robot]):
    """Robots of which fields of MuJoCo's model vary, shape (nsim, ...), each made when it is asked for."""

    def __init__(self, robot: Robot, nsim: int, vary: Mapping[str, npt.ArrayLike]) -> None:
        self._robot, self._vary = robot, vary
        self._places = tuple(range(nsim))

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, place: Any) -> Any:  # a robot, or the robots of a slice: the overloads are those of a sequence
        if isinstance(place, slice):
            return [self[i] for i in self._places[place]]
        i = self._places[place]
        own = {name: np.asarray(values, dtype=np.float64)[i : i + 1] for name, values in self._vary.items()}
        return Robot(self._robot.name, varied_models(self._robot, 1, own)[0])


def _set_link(robot: Robot, joint: int, values: Array, fields: dict[str, Array]) -> None:
    """Give a link inertia about its origin, first moments and mass, shape (nsim, 10), and the bodies welded to it none."""
    link, model = int(robot.model.jnt_bodyid[joint]), robot.model
    mass, first = values[:, 9], values[:, 6:9]
    empty = mass == 0
    if (empty & first.any(axis=-1)).any():
        raise RobotError(f"link {joint + 1} has no mass, but a first moment: no such link can be simulated")
    centre = first / np.where(empty, 1.0, mass)[:, None]
    upper = np.triu_indices(3)
    inertia = np.zeros((len(values), 3, 3))
    inertia[:, upper[0], upper[1]] = inertia[:, upper[1], upper[0]] = values[:, :6]
    square = np.sum(centre**2, axis=-1)[:, None, None] * np.eye(3) - centre[:, :, None] * centre[:, None, :]
    moments, axes = np.linalg.eigh(inertia - mass[:, None, None] * square)
    axes[..., 0] *= np.linalg.det(axes)[:, None]  # a rotation, no reflection
    for body in range(link + 1, model.nbody):
        if model.body_weldid[body] == link:
            fields["body_mass"][:, body], fields["body_inertia"][:, body] = 0.0, 0.0
    fields["body_mass"][:, link], fields["body_inertia"][:, link] = mass, moments
    fields["body_ipos"][:, link] = centre
    for k, matrix in enumerate(axes.reshape(-1, 9)):
        mujoco.mju_mat2Quat(fields["body_iquat"][k, link], matrix)
