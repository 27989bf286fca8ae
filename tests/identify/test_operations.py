"""Operations of the models' columns, counted against closed forms."""

import pytest

from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import BLOCKS, scara
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.operations import _Tape, operations


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


LAWS = [name for name in BLOCKS.builtin if isinstance(BLOCKS.create(name), AbstractFriction)]


@pytest.mark.parametrize("law", [name for name in LAWS if name not in ("viscous", "coulomb")])
def test_every_law_can_be_counted(law):
    """Laws call functions of NumPy on symbols, compare them, and take powers that are no whole numbers."""
    asked = Parameters(friction=(f"standard+{law}",))
    assert operations(RobotModel("scara", asked).basis, "explicit").functions >= 2


def test_equal_constants_and_symbols_are_not_the_same_value():
    """The third value of a tape times two, and the second times three, are two products."""
    tape = _Tape()
    values = [tape.value("input", f"x{k}") for k in range(4)]
    assert len({(values[3] * 2.0).number, (values[2] * 3.0).number, (values[2] * values[3]).number}) == 3
