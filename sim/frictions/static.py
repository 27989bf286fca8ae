"""Frictions that depend on the motion, the load or the temperature alone, not on what was before."""

from dataclasses import field, fields, is_dataclass
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from idbench.identify.basis import BLOCKS, AbstractFriction, Shape, ShapedFriction
from idbench.identify.basis.block import named
from idbench.identify.basis.friction.shape import with_settings
from idbench.sim.frictions.friction_law import AbstractContact, AbstractFrictionLaw, CompiledContact, PlantJoints
from idbench.sim.part import Addresses
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachNotNegative, EachNumber, Number, Positive, per_joint, settings

ANGLES = 9  # Positions within a turn at which a law may jump

SLOW, JUMP = 1e-9, 1e-6
"""Speed at which a joint is as good as at rest [rad/s], and change of a unit law over twice that which is a jump."""


@settings
class CoulombViscous(AbstractFrictionLaw):
    """Fs sign(qd) + Fv qd; near standstill MuJoCo's soft constraint decides."""

    steady: ClassVar[bool] = True

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return nothing more than MuJoCo's."""
        return CompiledContact("coulomb", Fs.shape, ())


@settings
class Stribeck(AbstractFrictionLaw):
    """Stribeck: Fs (1 + (static - 1) exp(-(qd/velocity)^2)) sign(qd) + Fv qd."""

    static: Annotated[Number, Field(ge=1)] = 1.5
    """Friction at the brink of motion, in multiples of Fs."""
    velocity: Positive = 0.1
    """Stribeck velocity [rad/s]: above it the rise is gone."""

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return Fst and vs."""
        rise = (self.static - 1) * robot.model.dof_frictionloss
        return {named("Fst", j): float(x) for j, x in enumerate(rise)} | {named("vs", j): self.velocity for j in range(robot.n)}

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return the law, which sets MuJoCo's Coulomb friction anew in every step: its constraint keeps standing joints."""
        rows = Fs, (self.static - 1) * Fs, self.velocity, SLOW
        return _lossy("stribeck", plant, rows)


@settings
class Law(AbstractFrictionLaw):
    """size g(q, qd) of a law that is identified, such as tanh or a law of one's own, beside Fs sign(qd) + Fv qd."""

    law: str = "tanh"
    """Name of the law, among the blocks of `idbench list` that have one parameter a joint."""
    size: EachNumber = (0.1,)
    """Its parameter, of all joints or of each, in the law's unit."""
    settings: dict[str, Number] = field(default_factory=dict)
    """Values of its settings, such as vt = 0.05; by default those at which their identification starts."""

    def __post_init__(self) -> None:
        _ = self._force

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return the law's parameter, and its shapes that are identified, too."""
        each, n = per_joint(self.size, robot.n, "friction.size"), robot.n
        found = {named(self._force.symbol, j): float(x) for j, x in enumerate(each)}
        for shape in self._shapes:
            found |= {named(shape.letters, j): float(getattr(self._force, shape.setting)) for j in range(n)}
        return found

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return the law: where it jumps at rest MuJoCo's Coulomb friction, set anew in every step, keeps standing joints."""
        return _LawContact(self._force, plant, Fs, per_joint(self.size, Fs.shape[-1], "friction.size"))

    @property
    def _shapes(self) -> tuple[Shape, ...]:
        block = BLOCKS.create(self.law)
        return block.shapes if isinstance(block, ShapedFriction) else ()

    @property
    def _force(self) -> AbstractFriction:
        block = BLOCKS.create(self.law)
        law = block.law if isinstance(block, ShapedFriction) else block
        if not isinstance(law, AbstractFriction):
            raise ValueError(f"{self.law} is no law of friction with one parameter a joint")
        start = {shape.setting: shape.start for shape in self._shapes}
        known: list[str] = [each.name for each in fields(law)] if is_dataclass(law) else []
        if unknown := sorted(self.settings.keys() - set(known)):
            raise ValueError(f"{self.law} has no setting {unknown[0]!r}; it has {', '.join(known) or 'none'}")
        return with_settings(law, {**start, **self.settings}) if known else law


class _LawContact(AbstractContact):
    def __init__(self, law: AbstractFriction, plant: PlantJoints, Fs: Array, size: Array) -> None:
        self._law = law
        self._Fs = Fs.copy()
        self._size = size
        self._q = plant.bind("qpos")
        q = np.linspace(-np.pi, np.pi, ANGLES)[:, None] * np.ones(Fs.shape[-1])
        ahead, back = (law.force(q, np.full(q.shape, x)) for x in (SLOW, -SLOW))
        self._frictionloss = plant.expand("dof_frictionloss") if np.any(np.abs(ahead - back) > JUMP) else None

    def torque(self, qd: Array) -> Array | float:
        if self._frictionloss is None:
            found: Array = -self._size * self._law.force(self._q, qd)
            return found
        moving = np.where(qd == 0, SLOW, qd)
        self._frictionloss[:] = np.maximum(self._Fs + self._size * self._law.force(self._q, moving) * np.sign(moving), 0.0)
        return 0.0


@settings
class Asymmetric(AbstractFrictionLaw):
    """Forwards Fs + offset and Fv + difference, backwards Fs - offset and Fv - difference."""

    offset: EachNumber = (0.0,)
    """Half of what Coulomb friction forwards has above that backwards [N m], of all joints or of each."""
    difference: EachNumber = (0.0,)
    """Half of what viscous friction forwards has above that backwards [N m s/rad], of all joints or of each."""
    edge: Positive = 0.002
    """Speed over which the offset rises [rad/s]: a joint that stands is not pushed."""

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return off and Fva."""
        pairs = (("off", self._each("offset", robot.n)), ("Fva", self._each("difference", robot.n)))
        return {named(letters, j): float(x) for letters, values in pairs for j, x in enumerate(values)}

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Difference between the directions; MuJoCo makes the rest."""
        n = Fs.shape[-1]
        return CompiledContact("asymmetric", Fs.shape, (self._each("offset", n), self._each("difference", n), self.edge))

    def _each(self, name: str, n: int) -> Array:
        return per_joint(getattr(self, name), n, f"friction.{name}")


@settings
class LoadDependent(AbstractFrictionLaw):
    """(Fs + share |load|) sign(qd) + Fv qd, the load being all torque but friction, of gravity and inertia of links and rotors.

    The friction in it is that of the physics step before.
    """

    share: EachNotNegative = (0.1,)
    """Friction over load, of all joints or of each."""

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return Fl."""
        return {named("Fl", j): float(x) for j, x in enumerate(per_joint(self.share, robot.n, "friction.share"))}

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Return the law, which sets MuJoCo's Coulomb friction anew in every step: its constraint keeps standing joints."""
        return _lossy("load_dependent", plant, (Fs, per_joint(self.share, Fs.shape[-1], "friction.share")))


def _lossy(name: str, plant: PlantJoints, rows: tuple[npt.ArrayLike, ...]) -> CompiledContact:
    """Return a friction in C that writes MuJoCo's Coulomb friction."""
    shape, names = np.shape(rows[0]), ("dof_frictionloss", "qfrc_passive", "qfrc_constraint")
    addresses = list(zip(*map(plant.addresses, names), strict=True))
    return CompiledContact(name, (shape[0], shape[1]), rows, objects=Addresses(addresses, plant), stride=plant.stride)


@settings
class Warming(AbstractFrictionLaw):
    """Fs sign(qd) + (Fv + slope (T - reference)) qd while the drives warm up from `cold` to `warm`; T is in the log."""

    slope: EachNumber = (-0.001,)
    """Change of Fv with the temperature [N m s/rad/K], of all joints or of each."""
    reference: Number = 45.0
    """Temperature at which Fv is what the robot has [deg C]."""
    cold: Number = 25.0
    """Temperature at the beginning [deg C]."""
    warm: Number = 45.0
    """Temperature in the end [deg C]."""
    time: Positive = 60.0
    """Time constant of the warming [s]."""

    def truth(self, robot: Robot) -> dict[str, float]:
        """Return FvT."""
        return {named("FvT", j): float(x) for j, x in enumerate(per_joint(self.slope, robot.n, "friction.slope"))}

    def conditions(self, t: Array, n: int) -> dict[str, Array]:
        """Return the temperature, the same of all joints."""
        return {"temperature": np.tile(self.at(t)[:, None], n)}

    def at(self, t: Array | float) -> Array:
        """Return the temperature at instants t [s]."""
        return np.asarray(self.warm + (self.cold - self.warm) * np.exp(-np.asarray(t) / self.time))

    def start(self, plant: PlantJoints, Fs: Array, h: float) -> AbstractContact:
        """Friction that the temperature adds."""
        slope = per_joint(self.slope, Fs.shape[-1], "friction.slope")
        return CompiledContact("warming", Fs.shape, (slope, self.reference, self.cold, self.warm, self.time, 0.0), h)
