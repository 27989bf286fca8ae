"""The column functions against the identities that tie them together, against MuJoCo, and against mutations."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np
import pytest

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import (
    AbstractBlock,
    AbstractConservativeBlock,
    AbstractFriction,
    Basis,
    CoulombFriction,
    Parameter,
    State,
    TreeLinks,
    ViscousFriction,
    scara,
)
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics

STATES = np.random.default_rng(5).uniform(-3, 3, (3, 2, 300))
"""q, qd, qdd of 300 random instants, shape (joint, time) each."""

PAPER_ORDER = ["ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2"]
EPS = 1e-30

FUNCTIONS = ["explicit", "momentum", "remainder", "energy", "dissipation"]

(TREE,) = (block for block in scara().blocks if isinstance(block, TreeLinks))
ZZ2 = scara().parameters[PAPER_ORDER.index("ZZ2")]

P = {
    name: Parameter(name.removesuffix("1").removesuffix("2"), joint, "inertia", "kg m^2")
    for name, joint in {"ZZR1": 0, "ZZ2": 1, "LMX2": 1, "LMY2": 1}.items()
}


@dataclass(frozen=True)
class ScaraLinks(AbstractConservativeBlock):
    """Links of a planar two-joint arm: ZZR1, ZZ2, LMX2, LMY2.

    ZZR1 = ZZ1 + Ia1 + L^2 M2 (both about joint 1), ZZ2 about joint 2, LMX2 = L MX2 and LMY2 = L MY2. The axes are
    parallel to gravity, so no parameter of it appears. The energy of ZZ2 is 1/2 (qd1 + qd2)^2; the paper prints
    1/2 (qd1^2 + qd2^2), which neither Eq. 10 nor its own explicit columns agree with.
    """

    def parameters(self, n):
        return tuple(P.values())

    def explicit(self, state):
        """Return D (Eq. 5, 6)."""
        c2, s2 = np.cos(state.q[..., 1, :]), np.sin(state.q[..., 1, :])
        qd1, qd2 = state.qd[..., 0, :], state.qd[..., 1, :]
        qdd1, qdd2 = state.qdd[..., 0, :], state.qdd[..., 1, :]
        qdd12, a = qdd1 + qdd2, 2 * qdd1 + qdd2
        b, qd1_squared = qd2 * (2 * qd1 + qd2), qd1 * qd1
        return {
            (0, P["ZZR1"]): qdd1,
            (0, P["ZZ2"]): qdd12,
            (1, P["ZZ2"]): qdd12,
            (0, P["LMX2"]): a * c2 - b * s2,
            (1, P["LMX2"]): qdd1 * c2 + qd1_squared * s2,
            (0, P["LMY2"]): -a * s2 - b * c2,
            (1, P["LMY2"]): qd1_squared * c2 - qdd1 * s2,
        }

    def momentum(self, state):
        """Return M_i(q) qd (Eq. 9)."""
        c2, s2 = np.cos(state.q[..., 1, :]), np.sin(state.q[..., 1, :])
        qd1, qd2 = state.qd[..., 0, :], state.qd[..., 1, :]
        qd12, a = qd1 + qd2, 2 * qd1 + qd2
        return {
            (0, P["ZZR1"]): qd1,
            (0, P["ZZ2"]): qd12,
            (1, P["ZZ2"]): qd12,
            (0, P["LMX2"]): a * c2,
            (1, P["LMX2"]): qd1 * c2,
            (0, P["LMY2"]): -a * s2,
            (1, P["LMY2"]): -qd1 * s2,
        }

    def remainder(self, state):
        """Return R_i(q, qd) = -dE_i/dq (Eq. 8, 9): only joint 2, on whose angle the inertia depends, has one."""
        c2, s2 = np.cos(state.q[..., 1, :]), np.sin(state.q[..., 1, :])
        b = state.qd[..., 0, :] * (state.qd[..., 0, :] + state.qd[..., 1, :])
        return {(1, P["LMX2"]): b * s2, (1, P["LMY2"]): b * c2}

    def energy(self, state):
        """Return h_i(q, qd) (Eq. 10), with the corrected h_4."""
        c2, s2 = np.cos(state.q[..., 1, :]), np.sin(state.q[..., 1, :])
        qd1 = state.qd[..., 0, :]
        qd12 = qd1 + state.qd[..., 1, :]
        b = qd1 * qd12
        return {
            (0, P["ZZR1"]): 0.5 * qd1 * qd1,
            (0, P["ZZ2"]): 0.5 * qd12 * qd12,
            (0, P["LMX2"]): b * c2,
            (0, P["LMY2"]): -b * s2,
        }


def matrix(columns, rows, parameters):
    """Return the columns as a dense array, shape (time, row, parameter)."""
    dense = np.zeros((STATES.shape[-1], rows, len(parameters)))
    for (row, of), signal in columns.items():
        dense[:, row, of if isinstance(of, int) else parameters.index(of.name)] = signal
    return dense


def state(q, qd, qdd):
    return State(q, qd, lambda _: qdd)


AT = state(*STATES)


def rate(columns):
    """Return d/dt of columns along the random states, by a complex step: exact to rounding, with no difference taken."""
    q, qd, qdd = STATES
    ahead = state(q + 1j * EPS * qd, qd + 1j * EPS * qdd, None)
    return {address: np.imag(signal) / EPS for address, signal in columns(ahead).items()}


def defects(block):
    """Return by how much the two identities between the five column functions fail at the random states."""
    names = [p.name for p in block.parameters(2)]
    D = matrix(block.explicit(AT), 2, names)
    implicit = matrix(rate(block.momentum), 2, names) + matrix(block.remainder(AT), 2, names)
    power = matrix(rate(block.energy), 1, names) + matrix(block.dissipation(AT), 1, names)
    return np.abs(D - implicit).max(), np.abs(np.einsum("jk,kjp->kp", AT.qd, D) - power[:, 0]).max()


def mujoco_defect(basis, robot, truth):
    """Return by how much D X differs from MuJoCo's inverse dynamics plus the friction law."""
    q, qd, qdd = (x.T for x in STATES)
    tau = inverse_dynamics(robot, q, qd, qdd) + coulomb_torque(robot, qd)
    D = matrix(basis.explicit(AT), 2, list(basis.names))
    return np.abs(D @ truth - tau).max()


@pytest.mark.parametrize("block", [TREE, ScaraLinks(), ViscousFriction(), CoulombFriction()], ids=lambda b: type(b).__name__)
def test_explicit_is_rate_of_momentum_plus_remainder_and_power_is_rate_of_energy_plus_dissipation(block):
    assert max(defects(block)) < 1e-10  # signals up to 1e2, rounding 1e-14


@pytest.mark.parametrize("function", FUNCTIONS)
def test_the_scara_is_a_tree_in_the_letters_of_the_paper(function):
    """Against the closed form of section 7.1, whatever the length of link 1."""
    form = Basis(2, (ScaraLinks(), ViscousFriction(), CoulombFriction()))
    closed = getattr(form, function)(AT)
    arm = RobotModel("scara").basis
    for basis in (scara(), arm):
        found = getattr(basis, function)(AT)
        assert {(row, basis.names[k]) for row, k in found} >= {(row, form.names[k]) for row, k in closed}
        for (row, k), column in found.items():
            mine = closed.get((row, form.names.index(basis.names[k])), 0.0)
            np.testing.assert_allclose(column, mine + 0 * column, rtol=1e-9, atol=1e-9)


def test_explicit_times_truth_is_mujocos_inverse_dynamics(robot, truth):
    assert scara().names == tuple(PAPER_ORDER)
    assert mujoco_defect(scara(), robot, truth) < 1e-10


def test_momentum_columns_give_the_mass_matrix_times_velocity(truth):
    """An independent route to the momenta: M(q) qd with the textbook's M."""
    q, qd, _ = STATES
    ZZR1, _, _, ZZ2, LMX2, LMY2, _, _ = truth
    coupled = LMX2 * np.cos(q[1]) - LMY2 * np.sin(q[1])
    p2 = (ZZ2 + coupled) * qd[0] + ZZ2 * qd[1]
    p1 = (ZZR1 + ZZ2 + 2 * coupled) * qd[0] + (ZZ2 + coupled) * qd[1]
    momenta = matrix(scara().momentum(AT), 2, PAPER_ORDER) @ truth
    np.testing.assert_allclose(momenta, np.stack([p1, p2], axis=-1), atol=1e-12)


@dataclass(frozen=True)
class Mutant(AbstractBlock):
    """The SCARA's links and friction with one column function changed."""

    function: str
    change: Callable

    def _columns(self, function, state):
        columns = named(function, state)
        return self.change(columns, state.qd) if function == self.function else columns

    def parameters(self, n):
        return scara().parameters

    def explicit(self, state):
        return self._columns("explicit", state)

    def momentum(self, state):
        return self._columns("momentum", state)

    def remainder(self, state):
        return self._columns("remainder", state)

    def energy(self, state):
        return self._columns("energy", state)

    def dissipation(self, state):
        return self._columns("dissipation", state)


def named(function, state):
    """Return columns of the SCARA by their parameters, as blocks have them."""
    return {(row, scara().parameters[k]): x for (row, k), x in getattr(scara(), function)(state).items()}


def every_column():
    """Return (function, address) of each column of the SCARA."""
    return [(f, address) for f in FUNCTIONS for address in named(f, AT)]


def caught(block, robot, truth):
    """Return whether one of the three identities fails visibly."""
    return max(*defects(block), mujoco_defect(Basis(2, (block,)), robot, truth)) > 1e-6


def test_the_unchanged_basis_is_no_mutant(robot, truth):
    assert not caught(Mutant("energy", lambda columns, qd: columns), robot, truth)


def test_the_papers_printed_h4_is_caught(robot, truth):
    """1/2 (qd1^2 + qd2^2), as section 7.1 prints it, contradicts Eq. 10."""
    printed = Mutant("energy", lambda columns, qd: {**columns, (0, ZZ2): 0.5 * (qd[0] ** 2 + qd[1] ** 2)})
    assert caught(printed, robot, truth)


@pytest.mark.parametrize(("function", "address"), every_column())
def test_a_wrong_sign_is_caught(function, address, robot, truth):
    assert caught(Mutant(function, lambda columns, qd: {**columns, address: -columns[address]}), robot, truth)


@pytest.mark.parametrize(("function", "address"), every_column())
def test_a_missing_column_is_caught(function, address, robot, truth):
    missing = Mutant(function, lambda columns, qd: {a: x for a, x in columns.items() if a != address})
    assert caught(missing, robot, truth)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_swapped_columns_are_caught(function, robot, truth):
    columns = named(function, AT)
    for a, b in combinations(columns, 2):
        if a[0] == b[0] and not np.array_equal(columns[a], columns[b]):
            assert caught(Mutant(function, lambda c, qd, a=a, b=b: {**c, a: c[b], b: c[a]}), robot, truth), (a, b)


def test_a_block_adds_its_parameters_behind_the_papers_order():
    @dataclass(frozen=True)
    class Drag(AbstractFriction):
        symbol: ClassVar[str] = "Fq"
        unit: ClassVar[str] = "N m s^2/rad^2"

        def force(self, q, qd):
            return qd * np.abs(qd)

    basis = scara() + Drag()
    assert basis.names == (*PAPER_ORDER, "Fq1", "Fq2")
    assert basis.units[-1] == "N m s^2/rad^2"
    assert max(defects(Drag())) < 1e-10
