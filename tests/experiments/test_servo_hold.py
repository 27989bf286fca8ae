"""`idbench servo --hold`: of all joints, or of one."""

from idbench.experiments.cli.options.jobs import IdentifyServo
from idbench.experiments.servo.job import held_of


def test_a_joint_has_what_is_held_for_it_before_what_is_held_for_all():
    held = held_of(IdentifyServo(hold=("wrist.roll.a=0.7", "a=0.5", "Ia=0.02")), ["elbow", "wrist.roll"])
    assert held == {"elbow": {"a": 0.5, "Ia": 0.02}, "wrist.roll": {"a": 0.7, "Ia": 0.02}}
