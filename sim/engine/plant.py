"""The rigid bodies of many simulations, in MuJoCo, as the compiled loop takes them."""

import ctypes
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from copy import copy
from itertools import pairwise
from os import cpu_count
from typing import Any

import mujoco
import numpy as np

from idbench.identify.compiled import function, pointer
from idbench.sim.engine import loop as c
from idbench.sim.engine.failures import Bounds
from idbench.sim.part import mujoco_function
from idbench.sim.robot.motors import Array
from idbench.sim.scenario.scenario import Physics

SWITCHED_OFF = (
    mujoco.mjtDisableBit.mjDSBL_ACTUATION,
    # Shapes of neighbours overlap in many files, and a torque of contact is none of the models'.
    mujoco.mjtDisableBit.mjDSBL_CONTACT,
    # A simulation that diverges would begin anew without a word.
    mujoco.mjtDisableBit.mjDSBL_AUTORESET,
)
"""Of MuJoCo."""


class Plant:
    """Simulations of robots whose joints are driven by torques, in steps of `h` [s]; their actuators are switched off.

    Parameters
    ----------
    models : sequence of mujoco.MjModel
        For each simulation.
    physics : Physics
        Whose integrator steps them.
    bounds : Bounds
        Where they are at work.
    stride : int
        Degrees of freedom of a joint: two with free play, rotor behind the gear, and link relative to it. MuJoCo solves the
        contact at the ends of the play together with all else, so that it is stable however light the link is; a dead zone in
        the drive would need steps as short as the lightest link wants.
    """

    def __init__(self, models: Sequence[mujoco.MjModel], physics: Physics, h: float, bounds: Bounds, stride: int = 1) -> None:
        nsim, n = len(models), models[0].nv // stride
        self.stride, self.n = stride, n
        self.models = [stepping(model, h, physics.integrator) for model in models]
        self.datas = [mujoco.MjData(model) for model in self.models]
        self.numbers = np.zeros((nsim, c.BEFORE_STEPS + 1), dtype=np.int64)
        self._complaints = np.zeros((nsim, 1024), dtype=np.uint8)
        middle, half, fastest = self._box = [np.ascontiguousarray(x) for x in bounds.box]
        self.bodies = (c.LoopBody * nsim)()
        for i, (body, m, d) in enumerate(zip(self.bodies, self.models, self.datas, strict=True)):
            arrays = d.qpos, d.qvel, d.qfrc_applied
            warned = d.warning.number.ctypes.data  # a column of pairs
            places = map(pointer, (middle[i], half[i], fastest[i], self.numbers[i], self._complaints[i]))
            body.__init__(mujoco_function("mj_step"), m._address, d._address, *map(pointer, arrays), warned, n, stride, *places)
        self.Fs: Array = np.stack([model.dof_frictionloss[::stride] for model in self.models])
        self._bound, self._expanded = dict[str, Array](), dict[str, Array]()

    @property
    def q(self) -> Array:
        """Positions of the links [rad], shape (nsim, joint)."""
        return self._of_links("qpos")

    @property
    def qd(self) -> Array:
        """Velocities of the links [rad/s], shape (nsim, joint)."""
        return self._of_links("qvel")

    def _of_links(self, name: str) -> Array:
        every = np.stack([getattr(d, name) for d in self.datas])
        return every if self.stride == 1 else every[:, ::2] + every[:, 1::2]

    def put(self, q: Array) -> None:
        """Put links where they are at rest [rad], in the middle of their play; shape (joint,) or (nsim, joint)."""
        for d, position in zip(self.datas, np.broadcast_to(q, (len(self.datas), self.n)), strict=True):
            d.qpos[:: self.stride] = position

    def bind(self, name: str) -> Array:
        """Return a field of the data, shape (nsim, joint), that `before_friction` keeps as it is."""
        self._bound[name] = np.stack([getattr(d, name)[:: self.stride] for d in self.datas])
        return self._bound[name]

    def expand(self, name: str) -> Array:
        """Return a field of the model, shape (nsim, joint), which `after_friction` takes as it is."""
        return self._expanded.setdefault(name, np.stack([getattr(m, name)[:: self.stride] for m in self.models]))

    def addresses(self, name: str) -> list[int]:
        """Where a field of the model or the data begins, in each simulation."""
        owners = self.models if hasattr(self.models[0], name) else self.datas
        return [getattr(owner, name).ctypes.data for owner in owners]

    def before_friction(self) -> None:
        """Bring what is bound up to date."""
        for name, values in self._bound.items():
            for d, value in zip(self.datas, values, strict=True):
                value[:] = getattr(d, name)[:: self.stride]

    def after_friction(self) -> None:
        """Write what was expanded into the models."""
        for name, values in self._expanded.items():
            for m, value in zip(self.models, values, strict=True):
                getattr(m, name)[:: self.stride] = value

    def trouble(self, sim: int) -> str:
        """What MuJoCo complains of in a simulation; empty if of nothing."""
        if self.numbers[sim, c.STATE] == c.STOPPED:
            return " ".join(self._complaints[sim].tobytes().split(b"\0")[0].decode(errors="replace").split())
        warnings = self.datas[sim].warning
        return next((mujoco.mju_warningText(k, int(w.lastinfo)) for k, w in enumerate(warnings) if w.number), "")


@contextmanager
def side_by_side(count: int, threads: int) -> Iterator[Callable[[Callable[[int, int], Any]], list[Any]]]:
    """Yield what calls a function with (first, number) of shares of simulations, on native threads: 0 are all processors."""
    # An error of MuJoCo ends its simulation, not the process. Each time: others may have set a handler of their own.
    function("catch_errors", ctypes.c_void_p)(mujoco_function("mju_setLogHandler"))
    edges = np.linspace(0, count, min(threads or cpu_count() or 1, count) + 1).astype(int).tolist()
    shares = [(a, b - a) for a, b in pairwise(edges)]
    if len(shares) == 1:
        yield lambda call: [call(*shares[0])]
        return
    with ThreadPoolExecutor(len(shares)) as pool:
        yield lambda call: list(pool.map(lambda share: call(*share), shares))


def stepping(described: mujoco.MjModel, h: float, integrator: str) -> mujoco.MjModel:
    """Return a robot's model with a physics step [s] and an integrator, driven by torques alone."""
    model = copy(described)
    model.opt.timestep = h
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    for flag in SWITCHED_OFF:
        model.opt.disableflags |= int(flag)
    return model
