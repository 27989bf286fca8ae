"""Seven MJCF files with what such files may have: logs with other inertias, identified and written; truth by mj_inverse."""

from pathlib import Path

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.identify import MotionLog, TorqueChannel
from idbench.identify.files.log_file import write_log
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot

pytestmark = pytest.mark.thorough

FILES = {
    "ref and anchors": """<mujoco><compiler angle="degree"/><worldbody><body pos="0 0 .3" euler="0 20 10">
      <joint name="yaw" axis="0 1 2" pos=".1 0 .05" ref="30" range="-150 170"/><geom type="box" size=".1 .2 .1" pos=".1 .1 0"/>
      <body pos=".4 0 0"><joint name="pitch" axis="1 0 .3" pos="0 .1 0" ref="-20" range="-100 90"/>
      <geom type="capsule" size=".05 .2" pos=".1 0 .1"/><body pos=".2 .1 .1" euler="10 0 40"><joint name="roll" axis="0 0 1"
      range="-170 170"/><geom type="ellipsoid" size=".1 .06 .04" pos=".05 0 .02"/></body></body></body></worldbody></mujoco>""",
    "several joints a body": """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0" range="-.5 .5"/>
      <joint name="y" type="slide" axis="0 1 0" range="-.4 .6"/><joint name="turn" axis="0 0 1" range="-2 2"/>
      <geom type="box" size=".1 .1 .05"/><body pos="0 0 .1"><joint name="tilt" axis="1 0 0" range="-1 1"/>
      <joint name="nod" axis="0 1 0" range="-1 1"/><geom type="capsule" size=".04 .1" pos=".1 0 .1"/></body></body></worldbody>
      </mujoco>""",
    "springs": """<mujoco><worldbody><body><joint name="door" axis="0 0 1" range="-1 2" stiffness="30" springref="20"/>
      <geom type="box" size=".3 .02 .4" pos=".3 0 0"/><body pos=".6 0 0"><joint name="handle" axis="0 1 0" range="-1 1"
      stiffness="4"/><geom type="capsule" size=".02 .06" pos=".05 0 0" euler="0 90 0"/></body></body></worldbody></mujoco>""",
    "tilted gravity": """<mujoco><option gravity="3 -4 -8"/><worldbody><body><joint name="a" axis="0 0 1" range="-3 3"/>
      <geom size=".1" pos=".1 .02 0"/><body pos=".3 0 0"><joint name="b" axis="0 1 0" range="-2 2" armature=".05"/>
      <geom size=".08" pos=".1 0 .03"/><body pos=".3 0 0"><joint name="c" axis="0 1 0" range="-2 2"/>
      <inertial pos=".1 .02 .03" mass="1.5" fullinertia=".02 .03 .025 .002 -.001 .003"/></body></body></body></worldbody>
      </mujoco>""",
    "defaults and an include": """<mujoco><compiler angle="degree" eulerseq="zyx"/><default><joint damping=".4" axis="0 1 0"
      range="-120 120"/><default class="big"><geom type="box" size=".1 .05 .2" density="700"/></default></default><worldbody>
      <body euler="90 0 20"><joint name="first"/><geom class="big" pos="0 0 .1"/><body pos="0 0 .4"><joint name="second"/>
      <include file="arm.xml"/></body></body></worldbody></mujoco>""",
    "a body of a microgram": """<mujoco><worldbody><body><joint name="1" axis="0 0 1" range="-3 3"/>
      <geom size=".1" pos=".1 0 0"/><body pos=".3 0 0"><joint name="2" axis="0 1 0" range="-2 2"/>
      <geom size=".08" pos=".1 0 .02"/><body pos=".3 0 0">
      <joint name="3" axis="1 0 0" range="-2 2"/><geom size=".06" pos=".1 .02 0"/><body pos=".2 0 0">
      <inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/></body></body></body></body></worldbody></mujoco>""",
    "cart and pole": """<mujoco><worldbody><body pos="0 0 1"><joint name="rail" type="slide" axis="1 0 0" range="-1.8 1.8"/>
      <geom type="box" size=".2 .15 .1" mass="1"/><body><joint name="pole" axis="0 1 0" range="-3 3"/>
      <geom type="capsule" fromto="0 0 0 0 0 1" size=".045" mass=".1"/></body></body></worldbody></mujoco>""",
}
INCLUDED = '<mujocoinclude><geom class="big" pos="0.05 0 .2"/><site name="tip" pos="0 0 .4"/></mujocoinclude>'

FS, SECONDS, NOISE, COUNT = 250.0, 24.0, 0.01, 2 * np.pi / 2**17


class Real:
    """A robot whose masses differ from its file by up to 30 %, moving, with friction of a tenth of each torque."""

    def __init__(self, name, folder, series):
        self.path, rng = folder / "robot.xml", np.random.default_rng(len(name))
        self.path.write_text(FILES[name])
        (folder / "arm.xml").write_text(INCLUDED)
        self.robot_model = RobotModel(str(self.path))
        file = self.robot_model.robot
        ranges = np.where(np.isfinite(file.ranges), file.ranges, np.pi * np.array([-1, 1]))
        self.motion = series(rng, np.arange(0, SECONDS, 1 / FS), ranges.T, np.full(file.n, 2.0))
        level = np.sqrt(np.mean(inverse_dynamics(file, *self.motion) ** 2, axis=0))
        self.true = Robot.load(str(self.path), lambda spec: self._changed(spec, rng, level))
        tau = self.torques(self.true, *self.motion)
        noisy = tau + NOISE * np.sqrt(np.mean(tau**2, axis=0)) * rng.standard_normal(tau.shape)
        self.log = MotionLog(FS, COUNT * np.round(self.motion[0] / COUNT), noisy, TorqueChannel("instantaneous"))

    def _changed(self, spec, rng, level):
        for geom in spec.geoms:
            geom.density *= 1 + 0.3 * rng.uniform(-1, 1)
        for body in spec.bodies:
            body.mass *= 1 + 0.3 * rng.uniform(-1, 1)
        for joint, torque, speed in zip(spec.joints, level, np.sqrt(np.mean(self.motion[1] ** 2, axis=0)), strict=True):
            joint.frictionloss, joint.damping = 0.1 * torque, np.array([0.1 * torque / speed, 0, 0])

    @staticmethod
    def torques(robot, *state):
        return inverse_dynamics(robot, *state) + coulomb_torque(robot, state[1])

    @property
    def truth(self):
        return np.array(list(self.robot_model.truth(self.true).values()))


@pytest.fixture(scope="module", params=FILES)
def real(request, tmp_path_factory, series):
    return Real(request.param, tmp_path_factory.mktemp("zoo"), series)


def test_torques_are_explained_and_sigma_holds_the_truth(real):
    found = fit(Request(real.robot_model, models=("explicit",)), Logs((real.log,)))
    estimate = found.estimates["explicit"]
    assert found.explained["explicit"].min() > 0.999
    assert np.abs((estimate.X - real.truth) / estimate.standard_errors).max() < 4.5


WAYS = {
    "default": ["--write", "b.json", "d.xml"],
    "rotors": ["--armature", "all", "--model", "explicit", "--write", "d.xml"],
    "stribeck": ["--friction", "standard+stribeck", "--model", "explicit", "--write", "b.json"],
    "auto": ["--friction", "auto", "--model", "explicit", "--write", "b.json"],
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_ends_with_a_result_and_files_of_the_true_robot(real, way, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_log(real.log, tmp_path / "log.csv")
    words = ["identify", "log.csv", "--robot", str(real.path), "--torque", "instantaneous", "--no-rerun"]
    assert main([*words, *WAYS[way]]) == 0, capsys.readouterr().err
    assert "Result: good: torques within" in capsys.readouterr().out
    if not Path("d.xml").exists():
        return
    rng, n = np.random.default_rng(3), range(real.true.n)
    state = [np.stack([x[rng.integers(len(x), size=400), j] for j in n], axis=1) for x in real.motion]
    true = real.torques(real.true, *state)
    off = (real.torques(Robot.load("d.xml"), *state) - true) / np.sqrt(np.mean(true**2, axis=0))
    assert np.sqrt(np.mean(off**2)) < 0.003


COMMANDS = {
    "robot": [],
    "run": ["arm.toml", "--no-rerun", "--robot"],
    "excite": ["--no-rerun", "--duration", "4", "--velocity", "2", "--acceleration", "10", "--seed", "0"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_other_commands_take_it(real, command, few_moves, monkeypatch, capsys):
    monkeypatch.chdir(few_moves.parent)
    words = [command, str(real.path), *COMMANDS[command]] if command != "run" else [command, *COMMANDS[command], str(real.path)]
    assert main(words) == 0, capsys.readouterr().err
