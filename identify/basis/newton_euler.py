"""Torques of links whose parameters are known, by recursive Newton and Euler: linear in the number of joints."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.basis.block import Parameter
from idbench.identify.basis.tree_links import KINDS, MX, M, TreeLinks, Wrench, parameters_of_link
from idbench.identify.basis.twists import Term, Twists, Vector, add, apply, cross, dot, is_zero, plus, scaled
from idbench.identify.data.kinematics import GROUND, KinematicTree
from idbench.identify.signals.signals import State


def link_torques(tree: KinematicTree, state: State, values: Mapping[Parameter, Term]) -> list[Term]:
    """Return the torques of the joints that move the links [N m], each (..., time).

    Forwards velocities and accelerations of the links, V_j and dV_j; then, from the last link to the first,

        F_j = inertial force of link j + sum over its children of X_c' F_c,    tau_j = S_j' F_j.

    J. Luh, M. Walker and R. Paul, "On-line computational scheme for mechanical manipulators", ASME J. Dynamic Systems,
    Measurement, and Control 102 (1980) 69-76. Base parameters in the place of those that are grouped into them give the same
    torques. Values of parameters are each (..., time) or a number; those that are missing are zero.
    """
    at = state.shared(tree, lambda state: Twists(tree, state))
    torques: list[Term] = [0.0] * tree.n
    waiting: list[list[tuple[Vector, Vector]]] = [[] for _ in range(tree.n)]
    for j in reversed(range(tree.n)):
        own = [values.get(parameter, 0.0) for parameter in parameters_of_link(j)]
        if tree.joints[j].massive and not all(map(is_zero, own)):
            waiting[j].append(_inertial(Wrench.inertial(at.velocity[j], at.acceleration[j], at.up[j]), own))
        if not waiting[j]:
            continue
        force, moment = (add(*parts) for parts in zip(*waiting[j], strict=True))
        place, parent = at.placements[j], tree.joints[j].parent
        torques[j] = plus(dot(place.S.v, force), dot(place.S.w, moment))
        if parent != GROUND:
            out = place.outward(force)
            waiting[parent].append((out, add(place.outward(moment), cross(place.position, out))))
    return torques


def torques(basis: Basis, state: State, X: Array) -> Array:
    """Torques tau = D X of known X, shape (..., p) [N m], shape (..., joint, time): those of links without their columns."""
    return _total(basis, state, X, "explicit", lambda tree, values: link_torques(tree, state, values))


def momenta(basis: Basis, state: State, X: Array) -> Array:
    """Return M(q) qd (Eq. 9), shape (..., joint, time): torques of accelerations qd at rest, without weight."""
    begun = State(state.q, np.zeros_like(state.qd), lambda _: state.qd, state.conditions)
    still = np.zeros(3)
    return _total(basis, state, X, "momentum", lambda tree, values: link_torques(replace(tree, gravity=still), begun, values))


def _total(
    basis: Basis, state: State, X: Array, function: str, links: Callable[[KinematicTree, Mapping[Parameter, Term]], list[Term]]
) -> Array:
    """Sum over all blocks, shape (..., joint, time): links as `links` has it, others by their columns."""
    total = np.zeros(np.broadcast_shapes(state.q.shape, (*X.shape[:-1], 1, 1)))
    for block in basis.blocks:
        if isinstance(block, TreeLinks):
            for j, torque in enumerate(links(block.tree, _values(basis, block, X))):
                total[..., j, :] += torque
            continue
        held = basis.held_of(block)
        for (row, parameter), column in getattr(block, function)(state).items():
            if (value := basis.value(parameter, X)) is not None:
                total[..., row, :] += value[..., None] * column
            if parameter in held:
                total[..., row, :] += np.asarray(held[parameter])[..., None] * column
    return total


def _values(basis: Basis, block: TreeLinks, X: Array) -> dict[Parameter, Term]:
    """Return the parameters of links, those that are held included, shape (..., 1) each."""
    found = dict[Parameter, Term]()
    for parameter in block.parameters(basis.n):
        if parameter in basis.held:
            found[parameter] = np.asarray(basis.held[parameter])[..., None]
        elif (value := basis.value(parameter, X)) is not None:
            found[parameter] = value[..., None]
    return found


def _inertial(wrench: Wrench, own: list[Term]) -> tuple[Vector, Vector]:
    """Return force and moment that move a link: M a + A MS, and J (XX ... ZZ) + MS x a."""
    first = Vector(*own[MX : MX + 3])
    force = add(scaled(own[M], wrench.a), apply(wrench.A, first))
    turning = add(*(scaled(x, column) for x, column in zip(own[: len(KINDS) - 4], wrench.J, strict=True)))
    return force, add(turning, cross(first, wrench.a))
