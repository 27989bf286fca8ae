"""Operations of the models' columns, counted against closed forms."""

import numpy as np
import pytest

from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import BLOCKS, scara
from idbench.identify.basis.joint_law import AbstractFriction
from idbench.identify.basis.operations import operations
from idbench.identify.basis.symbols import SymbolArray, flat
from idbench.identify.basis.tape import Tape
from idbench.identify.errors import SettingError


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
    assert found.derivatives == 4
    explicit, implicit = (operations(scara(), model) for model in ("explicit", "implicit"))
    assert implicit.total < explicit.total
    assert explicit.derivatives == 0


@pytest.mark.parametrize("robot", ["puma560", "panda"])
def test_power_costs_a_third_of_the_explicit_model_on_many_joints(robot):
    explicit, implicit, power = (operations(RobotModel(robot).basis, model) for model in ("explicit", "implicit", "power"))
    assert power.total < 0.4 * explicit.total
    assert explicit.total < implicit.total + implicit.derivatives


LAWS = [name for name in BLOCKS.builtin if isinstance(BLOCKS.create(name), AbstractFriction)]


@pytest.mark.parametrize("law", [name for name in LAWS if name not in ("viscous", "coulomb")])
def test_every_law_can_be_counted(law):
    """Laws call functions of NumPy on symbols, compare them, and take powers that are no whole numbers."""
    asked = Parameters(friction=(f"standard+{law}",))
    assert operations(RobotModel("scara", asked).basis, "explicit").functions >= 2


def test_equal_constants_and_symbols_are_not_the_same_value():
    """The third value of a tape times two, and the second times three, are two products."""
    tape = Tape()
    values = [tape.input("x", k) for k in range(4)]
    pairs = (values[3], 2.0), (values[2], 3.0), (values[2], values[3])
    products = [tape.apply("*", *pair) for pair in pairs]
    assert len({product.number for product in products}) == 3


def test_what_is_known_vanishes():
    tape = Tape()
    x = SymbolArray([tape.input("x", 0)])
    for none in (0 * x, x - x, 0.0 / (1 + x)):
        assert flat(none) == [0.0]
    for same in (1 * x, x + 0, x**1, 0 - (0 - x), np.where(True, x, 2 * x)):
        assert flat(same) == flat(x)
    assert flat(x * np.sign(x)) == flat(np.abs(x))
    assert flat(2 * (3 * x)) == flat(6 * x)
    with pytest.raises(SettingError, match=r"numpy.round cannot be written"):
        np.round(x)
