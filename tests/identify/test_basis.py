"""The column functions against the identities that tie them together, the paper's closed forms, and MuJoCo."""

from dataclasses import dataclass
from typing import ClassVar

import exact_scara
import numpy as np
import pytest
from builders import at, defects, matrix

from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import AbstractFriction, CoulombFriction, TreeLinks, ViscousFriction, scara
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics

STATES = np.random.default_rng(5).uniform(-3, 3, (3, 2, 300))
"""q, qd, qdd of 300 random instants, shape (joint, time) each."""

PAPER_ORDER = ("ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")

(TREE,) = (block for block in scara().blocks if isinstance(block, TreeLinks))


def paper_order(basis, function, rows=2):
    """Return the columns of a function, shape (time, row, parameter), in the order of the paper."""
    columns = matrix(getattr(basis, function)(at(*STATES)), rows, basis.names, STATES.shape[-1])
    return columns[..., [basis.names.index(name) for name in PAPER_ORDER]]


@pytest.mark.parametrize("block", [TREE, ViscousFriction(), CoulombFriction()], ids=lambda b: type(b).__name__)
def test_explicit_is_rate_of_momentum_plus_remainder_and_power_is_rate_of_energy_plus_dissipation(block):
    assert max(defects(block, [p.name for p in block.parameters(2)], *STATES)) < 1e-10  # signals up to 1e2, rounding 1e-14


@pytest.mark.parametrize("basis", [scara(), RobotModel("scara").basis], ids=["paper", "robot"])
def test_the_scara_is_a_tree_in_the_letters_of_the_paper(basis):
    """Torques (Eq. 51), momenta M qd and energies qd' M qd / 2 of each parameter alone, whatever the length of link 1.

    The identities above then leave one remainder and one dissipation. The energy of ZZ2 is 1/2 (qd1 + qd2)^2; the paper
    prints 1/2 (qd1^2 + qd2^2), with which neither Eq. 10 nor its own explicit columns agree.
    """
    q, qd, qdd = (x.T for x in STATES)
    explicit, momentum, energy = (paper_order(basis, function) for function in ("explicit", "momentum", "energy"))
    for k, X in enumerate(np.eye(8)):
        momenta = exact_scara.momentum(X, q, qd)
        np.testing.assert_allclose(explicit[..., k], exact_scara.torque(X, q, qd, qdd), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(momentum[..., k], momenta, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(energy[:, 0, k], np.sum(qd * momenta, axis=1) / 2, rtol=1e-9, atol=1e-9)
    power = np.sum(qd * explicit[..., PAPER_ORDER.index("ZZ2")], axis=1)
    assert np.abs(power - np.sum(qd * qdd, axis=1)).max() > 1  # what the printed energy would ask for


def test_explicit_times_truth_is_mujocos_inverse_dynamics(robot, truth):
    assert scara().names == PAPER_ORDER
    q, qd, qdd = (x.T for x in STATES)
    tau = inverse_dynamics(robot, q, qd, qdd) + coulomb_torque(robot, qd)
    np.testing.assert_allclose(paper_order(scara(), "explicit") @ truth, tau, atol=1e-10)


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
    assert max(defects(Drag(), ["Fq1", "Fq2"], *STATES)) < 1e-10
