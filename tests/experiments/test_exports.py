"""Robots for simulators and for training: read by their own parsers, and by frameworks' interfaces."""

import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
import yaml
from noisy_logs import noisy_log

import idbench
from idbench.experiments.exports.ensemble import Ensemble
from idbench.experiments.exports.exports import EXPORTS
from idbench.experiments.identification.consistent_estimate import drawn_about
from idbench.identify.parameters.bodies import exist
from idbench.sim.errors import RobotError
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.mounting import PLAIN
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters
from idbench.sim.robot.written_xml import sdf_text, urdf_text

DRAKE = """
import sys, numpy as np
from pydrake.all import MultibodyForces, MultibodyPlant, Parser
path, motion = sys.argv[1], np.load("motion.npz")
plant = MultibodyPlant(0.0)
Parser(plant).AddModels(path)
if path.endswith("urdf"):
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
plant.mutable_gravity_field().set_gravity_vector(motion["gravity"])
plant.Finalize()
order = [plant.GetJointByName(str(name)).velocity_start() for name in motion["joints"]]
context, tau = plant.CreateDefaultContext(), []
for each in zip(motion["q"], motion["qd"], motion["qdd"]):
    q, qd, qdd = np.zeros((3, plant.num_velocities()))
    for whole, own in zip((q, qd, qdd), each):
        whole[order] = own
    plant.SetPositions(context, q)
    plant.SetVelocities(context, qd)
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    tau.append(plant.CalcInverseDynamics(context, qdd, forces)[order])
np.save("tau.npy", tau)
"""


@pytest.mark.thorough
@pytest.mark.parametrize("ending", ["sdf", "urdf"])
@pytest.mark.parametrize("name", ["scara", "puma560", "panda", "servo_arm"])
def test_drake_reads_links_rotors_and_damping(name, ending, tmp_path, rng):
    """Its torques are those of MuJoCo's inverse dynamics, which have no Coulomb friction either."""
    robot = Robot.load(name)
    tree, standard = kinematic_tree(robot), standard_parameters(robot)
    text = sdf_text(robot, tree, standard) if ending == "sdf" else urdf_text(name, robot, tree, standard, PLAIN)
    (tmp_path / f"arm.{ending}").write_text(text)
    q, qd, qdd = rng.normal(size=(3, 10, robot.n))
    np.savez(tmp_path / "motion.npz", q=q, qd=qd, qdd=qdd, gravity=tree.gravity, joints=robot.joints)
    command = [sys.executable, "-c", DRAKE, f"arm.{ending}"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    tau = inverse_dynamics(robot, q, qd, qdd)
    np.testing.assert_allclose(np.load(tmp_path / "tau.npy"), tau, atol=1e-12 * np.abs(tau).max())


@pytest.mark.parametrize("name", ["scara", "puma560", "panda"])
def test_a_urdf_keeps_its_rotors(name, tmp_path, rng):
    robot = Robot.load(name)
    tree, standard = kinematic_tree(robot), standard_parameters(robot)
    (tmp_path / "arm.urdf").write_text(urdf_text(name, robot, tree, standard, PLAIN))
    back = Robot.load(str(tmp_path / "arm.urdf"))
    np.testing.assert_allclose(back.model.dof_armature, robot.model.dof_armature)
    q, qd, qdd = rng.normal(size=(3, 10, robot.n))
    tau = inverse_dynamics(robot, q, qd, qdd)
    np.testing.assert_allclose(inverse_dynamics(back, q, qd, qdd), tau, atol=1e-5 * np.abs(tau).max())  # angles of a URDF
    again = urdf_text(str(tmp_path / "arm.urdf"), back, kinematic_tree(back), standard_parameters(back), PLAIN)
    assert again.count("drake:rotor_inertia") == np.count_nonzero(robot.model.dof_armature)


def test_a_gear_ratio_counts_twice(tmp_path):
    text = urdf_text("scara", robot := Robot.load("scara"), kinematic_tree(robot), standard_parameters(robot), PLAIN)
    (tmp_path / "arm.urdf").write_text(text.replace('gear_ratio value="1.0"', 'gear_ratio value="10"'))
    np.testing.assert_allclose(Robot.load(str(tmp_path / "arm.urdf")).model.dof_armature, 100 * robot.model.dof_armature)


@pytest.fixture(scope="module")
def found():
    """The SCARA as it was identified, with a held-out log."""
    logs = [noisy_log("scara", seed) for seed in (1, 2)]
    return idbench.fit(logs[0], "scara", validate=logs[1], model="explicit")


def test_drawn_robots_exist_and_scatter_as_the_estimate(found, rng):
    estimate, robot_model = found.fit.estimates["explicit"], found.fit.robot_model
    sigma = estimate.standard_errors
    deviations = rng.multivariate_normal(np.zeros(len(sigma)), estimate.covariance, 300)
    drawn = drawn_about(robot_model, estimate, deviations)
    assert all(exist(robot_model.grouping.standard.parameters, own) for own in drawn)
    base = np.array([robot_model.grouping.base(own) for own in drawn])
    np.testing.assert_allclose(base.std(axis=0), sigma, rtol=0.25)  # 300 draws, and none moved that exists
    np.testing.assert_allclose(base.mean(axis=0), estimate.X, atol=4 * sigma.max())


@pytest.mark.thorough
def test_ranges_and_robots_are_written_and_judged(found, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    notes = found.write("ranges.toml", "robots.ensemble")
    assert "free runs of 0.5 s" in notes[1]
    table = tomllib.loads((tmp_path / "ranges.toml").read_text())
    robots = sorted((tmp_path / "robots.ensemble").glob("*.xml"))
    assert len(robots) == 200
    damping = [mujoco.MjModel.from_xml_path(str(path)).dof_damping[0] for path in robots]
    told = table["joints"]["joint1"]["damping"]
    assert np.mean(damping) == pytest.approx(told["value"], abs=told["sigma"] / 3)  # of 200 draws, five times what is usual
    assert np.std(damping) == pytest.approx(told["sigma"], rel=0.25)
    np.testing.assert_allclose([robot["damping"][0] for robot in table["robots"]], damping, rtol=1e-6)
    (band,) = table["bands"]
    assert min(band["held"].values()) > 0.9  # of 95 %, over some 20 runs of a tenth of a second to its end
    for name in ("mjlab", "isaaclab", "playground"):
        compile((tmp_path / f"ranges_{name}.py").read_text(), name, "exec")
    with pytest.raises(idbench.experiments.results.writing.ResultsError, match="--force"):
        found.write("robots.ensemble")


@pytest.mark.thorough
def test_a_band_that_is_too_narrow_says_so(found):
    ensemble = Ensemble(found.fit, "explicit")
    ensemble.__dict__["calibrated"] = 1e-3
    (band,) = ensemble.bands
    assert "lacks something" in band.words(("joint1", "joint2"))


def test_actuators_are_the_robots(found, tmp_path):
    made = EXPORTS[".yaml"].render(found.fit, "explicit", tmp_path / "arm.yaml")
    table = yaml.safe_load(made.texts[tmp_path / "arm.yaml"])
    joint = table["joints"]["joint2"]
    np.testing.assert_allclose(joint["damping"], 0.01, atol=4 * joint["damping_sigma"])
    assert json.dumps(table)


@pytest.mark.parametrize("ending", [".xml", ".urdf", ".sdf"])
def test_a_written_robot_says_what_it_is_from(found, ending, tmp_path):
    """Whatever a log is called: two hyphens would end the comment."""
    fit = replace(found.fit, logs=replace(found.fit.logs, names=("a---b.csv",)))
    (text,) = EXPORTS[ending].render(fit, "explicit", tmp_path / f"arm{ending}").texts.values()
    ElementTree.fromstring(text)
    assert "identified from a- - -b.csv by GLS of the explicit model" in text


def test_what_a_reader_leaves_out_is_named_with_its_size():
    fit = idbench.fit(noisy_log("puma560", 1), "puma560", model="explicit").fit
    warnings = " ".join(EXPORTS[".sdf"].render(fit, "explicit", None).warnings)
    assert "rotors are left out by Gazebo" in warnings
    assert "Drake has no Coulomb friction" in warnings
    assert "%" in warnings


def test_what_is_not_asked_for_is_not_in_drawn_robots():
    """The file's Coulomb friction would count beside the viscous one that was identified in its place."""
    fit = idbench.fit(noisy_log("puma560", 1), "puma560", model="explicit", friction=("viscous",), armature="none").fit
    drawn = Ensemble(fit, "explicit")._drawn(2, 1.0, np.random.default_rng(0))
    for j in range(6):
        assert not drawn[f"Fs{j + 1}"].any()
        assert not drawn[f"Ia{j + 1}"].any()


def test_a_transmission_of_others_is_no_rotor(tmp_path):
    text = urdf_text("scara", robot := Robot.load("scara"), kinematic_tree(robot), standard_parameters(robot), PLAIN)
    (tmp_path / "arm.urdf").write_text(text.replace("<drake:gear", '<param value="abs12"/><drake:gear'))
    np.testing.assert_allclose(Robot.load(str(tmp_path / "arm.urdf")).model.dof_armature, robot.model.dof_armature)
    (tmp_path / "arm.urdf").write_text(text.replace('gear_ratio value="1.0"', 'gear_ratio value="one"'))
    with pytest.raises(RobotError, match="gear_ratio has the value 'one'"):
        Robot.load(str(tmp_path / "arm.urdf"))


@pytest.mark.thorough
def test_mujoco_sysid_takes_the_parameters(found, tmp_path):
    """It begins at the estimate, moves what the log shows alone, within 95 %, and writes it into the specification."""
    sysid = pytest.importorskip("mujoco.sysid")
    found.write(str(tmp_path / "arm.xml"), str(tmp_path / "sysid.py"))
    space = {}
    exec((tmp_path / "sysid.py").read_text(), space)
    params = space["parameters"]()
    free = {name for name in params.keys() if not params[name].frozen}  # noqa: SIM118
    assert free == {f"joint{j}_{what}" for j in (1, 2) for what in ("damping", "frictionloss")}
    low, high = params.get_bounds()
    params.update_from_vector((np.asarray(low) + np.asarray(high)) / 2 + 0.001)
    model = sysid.apply_param_modifiers(params, mujoco.MjSpec.from_file(str(tmp_path / "arm.xml")))
    base = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    np.testing.assert_allclose(model.dof_damping, base.dof_damping + 0.001, atol=1e-6)
    np.testing.assert_allclose(model.dof_frictionloss, base.dof_frictionloss + 0.001, atol=1e-6)


def test_a_map_of_cogging_is_that_of_the_joint(tmp_path, rng):
    """12 and 42 waves of known size on a motor, without a simulator: the map is their sum, within four of its sigma."""
    t = np.arange(0, 40, 0.005)
    q, qd, qdd = 3 * np.sin(0.7 * t) + t / 10, 2.1 * np.cos(0.7 * t) + 0.1, -1.47 * np.sin(0.7 * t)
    wave = lambda q: 0.012 * np.sin(12 * q) + 0.03 * np.cos(42 * q)  # noqa: E731
    tau = 1e-3 * qdd + 0.01 * qd + 0.02 * np.sign(qd) + wave(q) + 1e-4 * rng.standard_normal(len(t))
    (tmp_path / "motor.xml").write_text(MOTOR)
    log = idbench.MotionLog(200.0, q[:, None], tau[:, None], idbench.TorqueChannel("instantaneous"))
    found = idbench.fit(
        log, str(tmp_path / "motor.xml"), model="explicit", friction=("standard+cogging:12+cogging:42",), cutoff=40.0
    )
    found.write(str(tmp_path / "cogmap.csv"))
    header, *rows = (tmp_path / "cogmap.csv").read_text().splitlines()
    assert header == "joint,position,torque,sigma"
    at, torque, sigma = np.array([[float(x) for x in row.split(",")[1:]] for row in rows]).T
    assert np.all(np.abs(torque - wave(at)) < 4 * sigma + 1e-5)
    assert sigma.max() < 1e-3
    with pytest.raises(idbench.experiments.errors.ExperimentError, match="no joint has cogging"):
        idbench.fit(log, str(tmp_path / "motor.xml"), model="explicit").write(str(tmp_path / "other-cogmap.csv"))


MOTOR = """<mujoco><worldbody><body name="rotor"><joint name="spin" axis="0 0 1" armature="1e-5"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>"""
