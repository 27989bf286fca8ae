"""A log of MuJoCo's own simulation of a file, as a user writes it, gives back the file."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from idbench.experiments.identification.job import identified
from idbench.experiments.requests.jobs import IdentifyRequest
from idbench.experiments.requests.shared import ColumnOptions

ARM = """<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="{}"/>
<default><joint damping="0.7" armature="0.05" frictionloss="0.3" range="-3 3"/></default><worldbody>
<body><joint name="a" axis="0 1 0"/><inertial pos="0 0 .2" mass="3" diaginertia=".08 .07 .02"/>
<body pos="0 0 .4"><joint name="b" axis="1 0 0"/><inertial pos=".05 0 .15" mass="2" diaginertia=".03 .03 .01"/>
<body pos="0 0 .3"><joint name="c" axis="0 1 0"/><inertial pos="0 .03 .1" mass="1" diaginertia=".01 .01 .01"/>
</body></body></body></worldbody><actuator>
<position joint="a" kp="900" kv="90"/><position joint="b" kp="600" kv="60"/><position joint="c" kp="300" kv="30"/>
</actuator></mujoco>"""

PAGE = Path(__file__).parents[2] / "docs" / "simulated.md"


def script():
    """Return the script of the page."""
    text = PAGE.read_text()
    return text.partition("```python\n")[2].partition("```")[0]


def logged(folder, integrator="implicitfast"):
    """Return file and log, by the page's own script."""
    (folder / "arm.xml").write_text(ARM.format(integrator))
    exec(compile(script(), "docs/simulated.md", "exec"), {"__name__": "__main__"})  # the page's own
    return folder / "arm.xml", folder / "log.csv"


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("integrator", ["implicitfast", "implicit"])
def test_the_page_s_script_gives_back_the_file(tmp_path, monkeypatch, integrator, stated):
    """By the file's own values, which the simulation had; kv h, up to 0.18, is more than three times the armature."""
    monkeypatch.chdir(tmp_path)
    robot, log = logged(tmp_path, integrator)
    asked = IdentifyRequest(
        log=(log,),
        robot=str(robot),
        torque=None if stated else "instantaneous",
        reading=ColumnOptions(simulated=stated),
        model="explicit",
    )
    fit = identified(asked)
    assert sum("MuJoCo's simulation of the robot's file" in note for note in fit.logs.notes) == 1
    estimate, truth = fit.estimates["explicit"], fit.robot_model.truth(fit.robot_model.robot)
    off = np.abs(estimate.X - list(truth.values()))
    carried = (
        np.linalg.norm(fit.problem.factors.R[..., :-1], axis=(0, 1)) * off / np.linalg.norm(fit.problem.factors.R[..., -1])
    )
    assert (carried < 2e-3).all()  # of the torques, where kv h alone makes tenths
    own = [k for k, name in enumerate(estimate.names) if name.startswith("Ia")]
    assert off[own].max() < 0.03 * 0.05
    assert not fit.diagnosis


def test_a_log_of_another_robot_with_these_actuators_is_left_as_it_is(tmp_path, monkeypatch):
    """A real arm is not the simulation of its file: here one twice as heavy, whose torques have no kv h."""
    monkeypatch.chdir(tmp_path)
    robot, log = logged(tmp_path, "implicitfast")
    model = mujoco.MjModel.from_xml_path(str(robot))
    rows = np.genfromtxt(log, delimiter=",", names=True)
    q = np.stack([rows[f"q_{x}"] for x in "abc"], axis=1)
    h = model.opt.timestep
    qd = np.gradient(q, h, axis=0)
    qdd, data, tau = np.gradient(qd, h, axis=0), mujoco.MjData(model), []
    model.body_mass *= 2
    for k in range(len(q)):
        data.qpos, data.qvel, data.qacc = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse.copy())
    names = [f"{x}_{joint}" for x in ("q", "tau") for joint in "abc"]
    table = np.column_stack([np.arange(len(q)) * h, q, tau])
    np.savetxt(log, table, delimiter=",", header=",".join(["t", *names]), comments="")
    fit = identified(IdentifyRequest(log=(log,), robot=str(robot), torque="instantaneous", model="explicit"))
    assert not any("simulation" in note for note in fit.logs.notes)
