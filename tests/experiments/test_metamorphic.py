"""Names and the order of joints are a matter of taste: with others every number is the same, only elsewhere."""

import json
import re

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.identify.estimators.settle import SETTLED
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot

LEFT = """<body name="{0}" pos="0 .2 .1"><joint name="{0}" axis="0 1 0" damping=".3" frictionloss=".4" armature=".02"/>
  <geom type="capsule" size=".05 .1" pos=".1 0 .1"/><body pos=".3 0 .1"><joint name="{1}" axis="1 0 0" damping=".1"
  frictionloss=".2"/><geom type="box" size=".1 .05 .04" pos=".1 .02 0"/></body></body>"""
RIGHT = """<body name="{0}" pos="0 -.2 .1"><joint name="{0}" axis=".1 1 0" damping=".2" frictionloss=".1" armature=".01"/>
  <geom type="box" size=".1 .03 .06" pos=".1 0 .05"/></body>"""
TRUNK = """<mujoco><worldbody><body><joint name="{0}" axis="0 0 1" damping=".5" frictionloss=".6"/><geom size=".1"/>{1}{2}
  </body></worldbody></mujoco>"""

NAMES = {"trunk": "2", "upper": "Fv1", "lower": "joint 1", "other": "tau"}
"""What joints are called, and what else they may be called."""

WAYS = {
    "default": [],
    "rotors": ["--armature", "all", "--estimator", "ML"],
    "stribeck": ["--friction", "standard+stribeck", "--model", "explicit"],
    "auto": ["--friction", "auto", "--model", "explicit", "--estimator", "WLS"],
    "one joint": ["--friction", "{upper}=standard+load", "--model", "explicit", "--add", "offset"],
}


@pytest.fixture(scope="module")
def both(tmp_path_factory, series):
    """A robot and its log; and the same one with its branches the other way round, and other names."""
    folder = tmp_path_factory.mktemp("both")
    a, b = NAMES, NAMES.values()
    trunk, upper, lower, other = b
    (folder / "one.xml").write_text(TRUNK.format("trunk", LEFT.format("upper", "lower"), RIGHT.format("other")))
    (folder / "two.xml").write_text(TRUNK.format(trunk, RIGHT.format(other), LEFT.format(upper, lower)))
    robot, rng = Robot.load(str(folder / "one.xml")), np.random.default_rng(3)
    t = np.arange(0, 20, 0.01)
    motion = series(rng, t, (np.full(4, -2.0), np.full(4, 2.0)), np.full(4, 2.5))
    tau = inverse_dynamics(robot, *motion) + coulomb_torque(robot, motion[1])
    tau += 0.02 * np.sqrt(np.mean(tau**2, axis=0)) * rng.standard_normal(tau.shape)
    q = motion[0] + 1e-5 * rng.standard_normal(tau.shape)
    for name, order in (("one", [0, 1, 2, 3]), ("two", [0, 3, 1, 2])):
        heads = ",".join(["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(4))])
        np.savetxt(
            folder / f"{name}.csv", np.column_stack([t, q[:, order], tau[:, order]]), delimiter=",", header=heads, comments=""
        )
    assert list(a) == list(robot.joints)
    return folder


def found(folder, name, way, out, capsys):
    """Return the summary of an identification, with the joint's name in the place of its number in each parameter's name."""
    called = dict.fromkeys(NAMES) if name == "one" else NAMES
    words = [word.format(**{key: value or key for key, value in called.items()}) for word in WAYS[way]]
    path = folder / f"{name}.xml"
    code = main(["identify", str(folder / f"{name}.csv"), "--robot", str(path), "--torque", "instantaneous", "--no-rerun",
                 "--out", str(out / name), *words])  # fmt: skip
    assert not code, capsys.readouterr().err
    names = {value or key: key for key, value in called.items()}
    joints = [names[joint] for joint in Robot.load(str(path)).joints]
    summary = json.loads((out / name / "summary.json").read_text())
    renamed = [re.sub(r"(\d+)$", lambda m: f"_{joints[int(m[1]) - 1]}", p) for p in summary["parameters"]]
    return summary, renamed, joints


@pytest.mark.thorough
@pytest.mark.parametrize("way", WAYS)
def test_names_and_order_change_no_number(both, way, tmp_path, capsys):
    """To a thousandth of sigma; ML to a fiftieth, at which its iterations stop.

    Shapes of friction iterate until a step is below a thousandth (`SETTLED`): the two may stop on either side of the minimum.
    """
    near = {"rotors": 0.02, "stribeck": 2 * SETTLED}.get(way, 1e-3)
    (one, names, joints), (two, others, order) = (found(both, name, way, tmp_path, capsys) for name in ("one", "two"))
    assert set(names) == set(others)
    places = [others.index(name) for name in names]
    at = [order.index(joint) for joint in joints]
    for model, mine in one["models"].items():
        its = two["models"][model]
        sigma = np.array(mine["sigma"])
        assert np.abs((np.array(its["estimate"])[places] - mine["estimate"]) / sigma).max() < near, model
        np.testing.assert_allclose(np.array(its["sigma"])[places], sigma, rtol=near)
    mine, its = (each["validation"]["models"]["explicit"]["torque_error_rms"] for each in (one, two))
    np.testing.assert_allclose(np.array(its)[at], mine, rtol=near)
