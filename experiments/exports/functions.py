"""What a controller computes of an identified robot, as formulas of its motion and its parameters."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify import AbstractBlock, Basis, Parameter, ShapedFriction
from idbench.identify.basis import LoadFriction, TreeLinks
from idbench.identify.basis.block import RIGID, AbstractWithoutMomentum
from idbench.identify.basis.friction.shape import STEP, with_settings
from idbench.identify.basis.loads import DriveGains, PayloadLink
from idbench.identify.basis.newton_euler import link_torques
from idbench.identify.basis.of_joints import block_of_all_joints
from idbench.identify.basis.operations import recorded_state
from idbench.identify.basis.symbols import SymbolArray, flat, inputs, solved
from idbench.identify.basis.tape import Tape, Value
from idbench.identify.data.kinematics import KinematicTree
from idbench.identify.signals.signals import State

Torques = list[Any]
"""Of each joint: something recorded, or a number."""


@dataclass(frozen=True)
class Function:
    """A function of a robot, as formulas."""

    name: str
    """What it is called."""
    about: str
    """What it computes, with its unit."""
    takes: tuple[str, ...]
    """Its arguments beside the parameters: q, qd, qdd, tau."""
    result: str
    """What its result is called."""
    shape: tuple[int, ...]
    """Of its result."""
    values: list[Value]
    """Its result, in a row."""


@dataclass(frozen=True, eq=False)
class RobotFunctions:
    """Functions of a robot with the parameters of a basis, which stay symbols: another identification only has other values."""

    basis: Basis
    """What was identified."""
    tree: KinematicTree
    """The robot's links."""
    tape: Tape = field(default_factory=Tape)
    """What was computed."""

    @cached_property
    def functions(self) -> list[Function]:
        """All of them."""
        return [self.function(name) for name in _TABLE]

    def function(self, name: str) -> Function:
        """Return one of them."""
        about, takes, result, shape, made = _TABLE[name]
        sizes = {"n": self.n, "p": len(self.basis.parameters)}
        values = [x for one in made(self) for x in flat(one)]
        return Function(name, about, takes, result, tuple(sizes[x] for x in shape), values)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.basis.n

    @cached_property
    def _state(self) -> State:
        return recorded_state(self.tape, self.n)

    @cached_property
    def _values(self) -> dict[Parameter, Any]:
        """What the columns of the blocks are multiplied by: symbols of parameters, and numbers of those that are held."""
        found: dict[Parameter, Any] = {p: float(np.asarray(x)) for p, x in self.basis.held.items()}
        for parameter, place in self.basis.places.items():
            own = self.basis.parameters[place]
            symbol = self.tape.input("parameter", place)
            found[parameter] = SymbolArray([symbol]) / own.scale if own.scale != 1 else SymbolArray([symbol])
        return found

    def inverse_dynamics(self) -> Torques:
        """Return the torques of all."""
        return _sums(self._rigid(self._state), self._resisting(self._state, self._load))

    @cached_property
    def _load(self) -> Torques:
        return self._rigid(self._state)

    def _rigid(self, state: State, gravity: bool = True) -> Torques:
        """Return the torques of links and rotors."""
        tree = self.tree if gravity else replace(self.tree, gravity=np.zeros(3))
        links: Torques = link_torques(tree, state, self._values)
        for block in self._others:
            if any(parameter.kind in RIGID for parameter in block.parameters(self.n)):
                links = _sums(links, self._torques(block.explicit(state), rotors=True))
        return links

    def _resisting(self, state: State, load: Torques) -> Torques:
        """Return the torques of all else: friction, springs, offsets."""
        total: Torques = [0.0] * self.n
        for block in self._others:
            total = _sums(total, self._torques(self._unit_torques(block, state, load), rotors=False))
        return total

    def _torques(self, columns: Mapping[tuple[int, Parameter], Any], rotors: bool) -> Torques:
        total: Torques = [0.0] * self.n
        for (row, parameter), column in columns.items():
            if (parameter.kind in RIGID) == rotors and parameter in self._values:
                total[row] = total[row] + self._values[parameter] * column
        return total

    def _unit_torques(self, block: AbstractBlock, state: State, load: Torques) -> Mapping[tuple[int, Parameter], Any]:
        """Return the columns of a block about its parameters, those of shapes left out."""
        inner = block_of_all_joints(block)
        if isinstance(inner, LoadFriction):
            return {(j, p): np.abs(load[j]) * np.sign(state.qd[..., j, :]) for j, p in self._by_joint(block)}
        if isinstance(inner, ShapedFriction):
            force = self._shaped(inner, state, 0.0, "")
            return {(j, p): force[..., j, :] for j, p in self._by_joint(block) if p.symbol == inner.law.symbol}
        return block.explicit(state)

    def _by_joint(self, block: AbstractBlock) -> Iterator[tuple[int, Parameter]]:
        for parameter in block.parameters(self.n):
            if parameter.joint is not None:
                yield parameter.joint, parameter

    def _shaped(self, friction: ShapedFriction, state: State, ahead: float, setting: str) -> Any:
        """Return the force of a law, its shapes being parameters; one of them `ahead`, as a share of itself."""
        settings: dict[str, Any] = {}
        for shape in friction.shapes:
            own = [self._values.get(p, shape.start) for p in friction.parameters(self.n) if p.symbol == shape.letters]
            each = SymbolArray([flat(x) for x in own])
            settings[shape.setting] = each * (float(np.exp(ahead)) if shape.setting == setting else 1.0)
        return with_settings(friction.law, settings).force(state.q, state.qd)

    @property
    def _others(self) -> Iterator[AbstractBlock]:
        return (block for block in self.basis.blocks if not isinstance(block, TreeLinks))

    def _still(self, qdd: Any) -> State:
        """Return the state at rest, with accelerations."""
        still: Any = SymbolArray(np.zeros((self.n, 1)))
        return replace(self._state, qd=still, s=lambda _: qdd)

    def mass_matrix(self) -> Torques:
        """Return the mass matrix, row by row."""
        M: list[Torques] = [[0.0] * self.n for _ in range(self.n)]
        for j in range(self.n):
            column = self._rigid(self._still(SymbolArray(np.eye(self.n)[:, [j]])), gravity=False)
            for i in range(j, self.n):
                M[i][j] = M[j][i] = column[i]
        return [x for row in M for x in row]

    def gravity(self) -> Torques:
        """Return the torques of links at rest."""
        return self._rigid(self._still(SymbolArray(np.zeros((self.n, 1)))))

    def friction(self) -> Torques:
        """Return the torques of all but links and rotors."""
        return self._resisting(self._state, self._load)

    def forward_dynamics(self) -> Torques:
        """Return M^-1 (load - h), with h the torques of links and rotors without acceleration.

        A load that resists itself, Fl |load| sign(qd), is (tau - all else) over 1 + Fl sign(qd) sign(load).
        """
        tau, n = inputs(self.tape, "tau", self.n), self.n
        unloaded = replace(self._state, s=lambda _: SymbolArray(np.zeros((n, 1))))  # type: ignore[arg-type,return-value]
        left = [tau[j] - x for j, x in enumerate(self._resisting(unloaded, [0.0] * n))]
        for block in self._others:
            if isinstance(block_of_all_joints(block), LoadFriction):
                for j, p in self._by_joint(block):
                    share = self._values.get(p, 0.0) * np.sign(self._state.qd[..., j, :])
                    left[j] = left[j] / (1.0 + share * np.sign(left[j]))
        right = [x - h for x, h in zip(left, self._rigid(unloaded), strict=True)]
        flat_M = self.mass_matrix()
        return solved([flat_M[i * n : (i + 1) * n] for i in range(n)], right)

    def columns(self, what: str) -> Torques:
        """Return the columns of the parameters, row by row."""
        rows = 1 if what in ("energy", "dissipation") else self.n
        found = getattr(self._linear, what)(self._state)
        return [found.get((i, k), 0.0) for i in range(rows) for k in range(len(self.basis.parameters))]

    @cached_property
    def _linear(self) -> Basis:
        """The basis with blocks that are linear about the parameters."""
        blocks = (_AboutParameters(block, self) if block.is_nonlinear else block for block in self.basis.blocks)
        return replace(self.basis, held={}, blocks=tuple(blocks))

    def slopes(self, block: AbstractBlock, state: State) -> dict[tuple[int, Parameter], Any]:
        """Return the columns of a block that is nonlinear: slopes at the parameters, as the identification takes them."""
        found = dict(self._unit_torques(block, state, self._load))
        inner = block_of_all_joints(block)
        if isinstance(inner, ShapedFriction):
            for shape in inner.shapes:
                ahead, behind = (self._shaped(inner, state, h, shape.setting) for h in (STEP, -STEP))
                sizes = {p.joint: self._values.get(p, 0.0) for p in inner.parameters(self.n) if p.symbol == inner.law.symbol}
                for j, p in self._by_joint(block):
                    if p.symbol == shape.letters:
                        change = (ahead[..., j, :] - behind[..., j, :]) / (2 * STEP * self._values.get(p, shape.start))
                        found[j, p] = sizes[j] * change
        return found

    @cached_property
    def used(self) -> set[str]:
        """Return the names of the inputs that functions take beside motion and parameters, such as temperature."""
        needed = self.tape.needed(x for function in self.functions for x in function.values)
        sources = {self.tape.steps[k][1] for k in needed if self.tape.steps[k][0] == "input"}
        return sources - {"q", "qd", "qdd", "tau", "parameter"}


@dataclass(frozen=True, eq=False)
class _AboutParameters(AbstractWithoutMomentum):
    """A block whose columns are slopes at parameters that are symbols."""

    block: AbstractBlock
    of: RobotFunctions

    def parameters(self, n: int) -> tuple[Parameter, ...]:
        return self.block.parameters(n)

    def remainder(self, state: State) -> Any:
        return self.of.slopes(self.block, state)

    def dissipation(self, state: State) -> Any:
        return {(0, p): state.qd[..., row, :] * column for (row, p), column in self.of.slopes(self.block, state).items()}


def _sums(a: Torques, b: Torques) -> Torques:
    return [x + y for x, y in zip(a, b, strict=True)]


_POSITION = ("q",)
_VELOCITY = ("q", "qd")
_MOTION = ("q", "qd", "qdd")

_TABLE: dict[str, tuple[str, tuple[str, ...], str, str, Callable[[RobotFunctions], Torques]]] = {
    "inverse_dynamics": ("torques of the joints [N m]", _MOTION, "tau", "n", RobotFunctions.inverse_dynamics),
    "forward_dynamics": (
        "accelerations of the joints [rad/s^2]", ("q", "qd", "tau"), "qdd", "n", RobotFunctions.forward_dynamics
    ),
    "mass_matrix": ("the mass matrix [kg m^2], row by row", _POSITION, "M", "nn", RobotFunctions.mass_matrix),
    "gravity": ("torques that hold the robot against gravity [N m]", _POSITION, "tau", "n", RobotFunctions.gravity),
    "friction": ("torques of friction, springs and offsets [N m]", _MOTION, "tau", "n", RobotFunctions.friction),
    "regressor": (
        "the columns D of tau = D X, row by row (Eq. 5, 6); what is held comes to it", _MOTION, "D", "np",
        lambda of: of.columns("explicit"),
    ),
    "regressor_momentum": (
        "the columns M of tau = d(M X)/dt + R X, row by row (Eq. 9)", _VELOCITY, "M", "np", lambda of: of.columns("momentum")
    ),
    "regressor_remainder": ("the columns R of it (Eq. 9)", _MOTION, "D", "np", lambda of: of.columns("remainder")),
    "regressor_energy": (
        "the columns h of qd' tau = d(h X)/dt + f X (Eq. 10)", _VELOCITY, "h", "p", lambda of: of.columns("energy")
    ),
    "regressor_dissipation": ("the columns f of it (Eq. 10)", _MOTION, "f", "p", lambda of: of.columns("dissipation")),
}  # fmt: skip
"""What they compute, what they take and return, its shape (n: joints, p: parameters), and its formulas."""


def require_formulas(basis: Basis, tree: KinematicTree, target: object) -> RobotFunctions:
    """Return the functions of a robot; ExperimentError if a part of it cannot be written as formulas."""
    made = RobotFunctions(basis, tree)
    for block in basis.blocks:
        inner = block_of_all_joints(block)
        if isinstance(inner, DriveGains | PayloadLink):
            raise ExperimentError(f"{target}: gains of drives and payloads are no part of the robot: write it without them")
        if block.is_nonlinear and not isinstance(inner, LoadFriction | ShapedFriction):
            raise ExperimentError(
                f"{target}: {type(inner).__name__} is nonlinear in its parameters, only its slopes are known: write the .json"
            )
    try:
        _ = made.functions
    except Exception as error:  # whatever a plug-in does with what is no number
        raise ExperimentError(f"{target}: {error}") from error
    return made
