"""Operations of the models' columns, counted against closed forms."""

import pytest

from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import scara
from idbench.identify.basis.friction.laws import CoulombFriction, ViscousFriction
from idbench.identify.basis.operations import operations


def test_one_joint_with_friction_costs_nothing_but_its_power():
    """A rotor and its friction: tau = Ia qdd + Fv qd + Fs sign(qd), no operation; power: qd^2, and |qd| for nothing."""
    basis = RobotModel("pendulum").basis
    joint = basis.of([p for p in basis.parameters if p.symbol in ("Fv", "Fs")])
    assert operations(joint, "explicit").total == 0
    assert operations(joint, "power").total == 1


def test_scara_costs_what_its_closed_form_does():
    """Power (Eq. 23): h1 = qd1^2 / 2, h2 = (qd1 + qd2)^2 / 2, h3 and h4 = qd1 (qd1 + qd2) cos q2, sin q2."""
    found = operations(scara(), "power")
    assert found.functions == 2
    assert found.additions == 1
    assert found.differentiated == 4
    explicit, implicit = (operations(scara(), model) for model in ("explicit", "implicit"))
    assert implicit.total < explicit.total
    assert explicit.differentiated == 0


@pytest.mark.parametrize("robot", ["puma560", "panda"])
def test_power_costs_a_third_of_the_explicit_model_on_many_joints(robot):
    explicit, implicit, power = (operations(RobotModel(robot).basis, model) for model in ("explicit", "implicit", "power"))
    assert power.total < 0.4 * explicit.total
    assert explicit.total < implicit.total + implicit.differentiated


def test_every_law_can_be_counted():
    """Laws call functions of NumPy on symbols."""
    laws = Parameters(friction=("standard+stribeck+arctan+load",))
    plain, more = (operations(RobotModel("panda", asked).basis, "explicit") for asked in (Parameters(), laws))
    assert more.total > plain.total
    assert ViscousFriction().symbol != CoulombFriction().symbol
