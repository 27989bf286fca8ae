"""`idbench servo --hold`: of all joints, or of one."""

import pytest

from idbench.experiments.cli.options.jobs import IdentifyServo
from idbench.experiments.errors import ExperimentError
from idbench.experiments.servo.job import held_of


def test_a_joint_has_what_is_held_for_it_before_what_is_held_for_all():
    held = held_of(IdentifyServo(hold=("wrist.roll.a=0.7", "a=0.5", "Ia=0.02")), ["elbow", "wrist.roll"])
    assert held == {"elbow": {"a": 0.5, "Ia": 0.02}, "wrist.roll": {"a": 0.7, "Ia": 0.02}}


@pytest.mark.parametrize(
    ("text", "message"),
    [("elbow.kt=0.5", "no parameter 'kt'"), ("wrist.a=0.5", "no such joint; joints are elbow")],
    ids=["letter", "joint"],
)
def test_unknown_names_are_refused(text, message):
    with pytest.raises(ExperimentError, match=message):
        held_of(IdentifyServo(hold=(text,)), ["elbow"])
