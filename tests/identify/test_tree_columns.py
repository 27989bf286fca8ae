"""The columns of any tree against pinocchio's regressors, and the identities between them."""

import ast
import sys
from itertools import count
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest
from builders import at, defects, matrix

import idbench.identify.basis.tree_links
from idbench.identify import Joint, KinematicTree, State, TreeLinks
from idbench.identify.data.kinematics import INERTIAL

TIMES = 25

PINOCCHIO = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")
"""Pinocchio's order of a body's ten parameters, the inertia about the origin of its frame."""


def states(n, times=TIMES):
    return np.random.default_rng(2).uniform(-3, 3, (3, n, times))


def order(n):
    return [f"{x}{j + 1}" for j in range(n) for x in PINOCCHIO]


def test_explicit_columns_are_pinocchios_torque_regressor(peer):
    n, data = peer.tree.n, peer.model.createData()
    q, qd, qdd = states(n)
    mine = matrix(TreeLinks(peer.tree).explicit(at(q, qd, qdd)), n, order(n), TIMES)
    for k in range(TIMES):
        theirs = pin.computeJointTorqueRegressor(peer.model, data, q[:, k], qd[:, k], qdd[:, k])
        np.testing.assert_allclose(mine[k], theirs, atol=1e-10)


def test_energy_columns_are_pinocchios_energy_regressors(peer):
    n, data = peer.tree.n, peer.model.createData()
    q, qd, qdd = states(n)
    mine = matrix(TreeLinks(peer.tree).energy(at(q, qd, qdd)), 1, order(n), TIMES)
    for k in range(TIMES):
        kinetic = pin.computeKineticEnergyRegressor(peer.model, data, q[:, k], qd[:, k])
        potential = pin.computePotentialEnergyRegressor(peer.model, data, q[:, k])
        np.testing.assert_allclose(mine[k, 0], np.ravel(kinetic) + np.ravel(potential), atol=1e-10)


def test_momentum_columns_are_the_mass_matrix_times_velocity(peer):
    n, data = peer.tree.n, peer.model.createData()
    q, qd, qdd = states(n)
    X = np.concatenate([inertia.toDynamicParameters() for inertia in peer.model.inertias[1:]])
    mine = matrix(TreeLinks(peer.tree).momentum(at(q, qd, qdd)), n, order(n), TIMES) @ X
    for k in range(TIMES):
        M = pin.crba(peer.model, data, q[:, k])
        np.testing.assert_allclose(mine[k], (np.triu(M) + np.triu(M, 1).T) @ qd[:, k], atol=1e-10)


def oblique():
    """Hinges and slides about slanted axes beside their frames, on two branches, one body with two joints, gravity askew."""

    def rotation(seed):
        Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        Q = Q * np.sign(np.diagonal(R))
        return Q * np.linalg.det(Q)

    rng, kinds = np.random.default_rng(9), ("hinge", "slide", "hinge", "hinge", "slide", "hinge")
    joints = [
        Joint(f"j{k}", kind, parent, rng.normal(size=3), rotation(k), rng.normal(size=3), rng.normal(size=3), zero=0.3 * k)
        for k, (kind, parent) in enumerate(zip(kinds, (-1, 0, 1, 0, 3, 4), strict=True))
    ]
    return KinematicTree("oblique", tuple(joints), [1.0, -2.0, -9.0])


def identities(block, n=6):
    return defects(block, [p.name for p in block.parameters(n)], *states(n))


def test_identities_of_a_tree_without_any_right_angle():
    assert max(identities(TreeLinks(oblique()))) < 1e-9  # signals up to 1e4, rounding 1e-12


def test_identities_of_other_peoples_arms(peer):
    assert max(identities(TreeLinks(peer.tree), peer.tree.n)) < 1e-10


def test_leading_axes_are_runs_and_narrowing_changes_no_bit(peer):
    n = peer.tree.n
    q, qd, qdd = states(n, 12).reshape(3, n, 3, 4).transpose(0, 2, 1, 3)
    block, some = TreeLinks(peer.tree), frozenset({"ZZ1", f"MX{n}", "M2"})
    for function in ("explicit", "momentum", "remainder", "energy"):
        many = getattr(block, function)(State(q, qd, lambda _: qdd))
        alone = getattr(block, function)(State(q[1], qd[1], lambda _: qdd[1]))
        few = getattr(block.narrowed(some), function)(State(q, qd, lambda _: qdd))
        assert few.keys() == {address for address in many if address[1] in some}
        for address, signal in many.items():
            np.testing.assert_array_equal(signal[1], alone[address])
            np.testing.assert_array_equal(signal, few.get(address, signal))


def test_what_is_zero_at_all_times_has_no_column():
    """A vertical hinge in the origin: of ten parameters only ZZ1 shows, and a slide shows its mass alone."""
    hinge = Joint("a", "hinge", -1, [0, 0, 0], np.eye(3), [0, 0, 1], [0, 0, 0])
    slide = Joint("b", "slide", 0, [1, 0, 0], np.eye(3), [0, 0, 2], [0, 0, 0])
    columns = TreeLinks(KinematicTree("two", (hinge, slide), [0, 0, -9.81])).explicit(at(*states(2)))
    assert {p.name for row, p in columns if p.joint == 0} == {"ZZ1"}
    assert {p.name for row, p in columns if row == 1} == {"M2"}


MODULES = ("twists", "tree_links")


def sites(tree):
    """Yield functions that change one sign of a syntax tree, in place, and change it back."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "minus" and len(node.args) == 2:
                yield (lambda n=node: setattr(n.func, "id", "plus")), (lambda n=node: setattr(n.func, "id", "minus"))
            if node.func.id in ("cross", "bracket"):
                yield (lambda n=node: n.args.reverse()), (lambda n=node: n.args.reverse())
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value in (-1.0, 1.0, 0.5):
            yield (lambda n=node: setattr(n, "value", -n.value)), (lambda n=node: setattr(n, "value", -n.value))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield (lambda n=node: setattr(n, "op", ast.UAdd())), (lambda n=node: setattr(n, "op", ast.USub()))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub):
            yield (lambda n=node: setattr(n, "op", ast.Add())), (lambda n=node: setattr(n, "op", ast.Sub()))


def loaded(trees, monkeypatch):
    """Return the class of the block, its modules made anew of syntax trees."""
    for name, tree in trees.items():
        module = ModuleType(f"idbench.identify.basis.{name}")
        monkeypatch.setitem(sys.modules, module.__name__, module)
        exec(compile(ast.fix_missing_locations(tree), name, "exec"), module.__dict__)
        module.__dict__.setdefault("plus", sys.modules["idbench.identify.basis.twists"].plus)  # what `minus` may become
    return sys.modules["idbench.identify.basis.tree_links"].TreeLinks


def pinocchio_defect(block, peer):
    n, data = peer.tree.n, peer.model.createData()
    q, qd, qdd = states(n, 3)
    mine = matrix(block.explicit(at(q, qd, qdd)), n, order(n), 3)
    regressor = pin.computeJointTorqueRegressor
    return max(np.abs(mine[k] - regressor(peer.model, data, q[:, k], qd[:, k], qdd[:, k])).max() for k in range(3))


def zero_defect(block):
    """Return by how much columns differ from those of a tree whose frames are placed at zero, positions counted from there."""
    tree, (q, qd, qdd) = oblique(), states(6)
    shifted = KinematicTree("shifted", tuple(Joint(**{**vars(joint), "zero": 0.0}) for joint in tree.joints), tree.gravity)
    zero = np.array([[joint.zero] for joint in tree.joints])
    one, two = block(tree).explicit(at(q, qd, qdd)), block(shifted).explicit(at(q - zero, qd, qdd))
    return max(np.abs(one[address] - two[address]).max() for address in one)


def test_positions_count_from_where_the_frames_are_placed():
    assert zero_defect(TreeLinks) < 1e-12


@pytest.mark.thorough
def test_any_sign_that_is_changed_is_noticed(peer, monkeypatch):
    """By pinocchio's explicit columns or by an identity; changes that leave all columns as they are do not count."""
    folder = Path(idbench.identify.basis.tree_links.__file__).parent
    trees = {name: ast.parse((folder / f"{name}.py").read_text()) for name in MODULES}
    slanted, changed, number = oblique(), 0, count()
    right = {f: getattr(TreeLinks(slanted), f)(at(*states(6))) for f in ("explicit", "momentum", "remainder", "energy")}
    for name, tree in trees.items():
        for change, back in list(sites(tree)):
            change()
            same = False
            try:
                block = loaded(trees, monkeypatch)
                mutated = {f: getattr(block(slanted), f)(at(*states(6))) for f in right}
                same = all(
                    mutated[f].keys() == right[f].keys()
                    and all(np.allclose(mutated[f][a], right[f][a], atol=1e-12) for a in right[f])
                    for f in right
                )
                found = *identities(block(slanted)), pinocchio_defect(block(peer.tree), peer), zero_defect(block)
                noticed = same or max(found) > 1e-6
            except (TypeError, ValueError, AttributeError, IndexError):
                noticed = True  # no longer a program
            finally:
                back()
            changed += not same
            assert noticed, f"{name}: change number {next(number)} of a sign goes unnoticed"
    assert changed > 50


@pytest.mark.parametrize("letter", INERTIAL)
def test_the_wrong_frame_is_noticed(letter, peer):
    """Columns of a link whose frame is a little elsewhere are others: a millimetre shows."""
    joints = list(peer.tree.joints)
    moved = Joint(**{**vars(joints[2]), "position": joints[2].position + [0.001, 0, 0]})
    other = KinematicTree("moved", (*joints[:2], moved, *joints[3:]), peer.tree.gravity)
    q, qd, qdd = states(peer.tree.n)
    one, two = (TreeLinks(tree).explicit(at(q, qd, qdd)) for tree in (peer.tree, other))
    assert max(np.abs(one[a] - two[a]).max() for a in one if (a[1].symbol, a[1].joint) == (letter, 2) or letter != "M") > 1e-4
