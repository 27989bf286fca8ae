"""Joints under MuJoCo's own position actuators, from commands and positions of a plain script."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from idbench.experiments.cli import main

LEG = """
<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="{integrator}"/><worldbody>
  <body pos="0 0 1"><joint name="hip" axis="1 0 0" range="-1.5 1.5" damping="0.5" frictionloss="0.1" armature="0.02"/>
    <inertial pos="0 0.05 -0.05" mass="1" diaginertia="0.002 0.002 0.002"/>
    <body pos="0 0.1 -0.05"><joint name="knee" axis="0 1 0" range="-1.5 1.5" damping="0.5" frictionloss="0.1" armature="0.02"/>
      <inertial pos="0 0 -0.15" mass="0.6" diaginertia="0.003 0.003 0.0005"/></body></body>
</worldbody><actuator>
  <position name="k" joint="knee" kp="30" kv="{kv}" forcerange="-20 20"/>
  <position name="h" joint="hip" kp="40" kv="{kv}" forcerange="-20 20"/>
</actuator></mujoco>
"""

TRUE = {"Ia": 0.02, "Fv": 0.5, "Fs": 0.1, "delay": 0.0, "offset": 0.0, "bias": 0.0}


def log_of(folder, name, seed, integrator="implicitfast", kv=0.6, seconds=12.0, hold=5):
    """Write a log of the leg as a script makes it: ctrl is set, qpos and ctrl are written down, then a step is made."""
    (folder / "leg.xml").write_text(LEG.format(integrator=integrator, kv=kv))
    model = mujoco.MjModel.from_xml_path(str(folder / "leg.xml"))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    f, size, phase = rng.uniform(0.2, 1.5, (2, 4)), rng.uniform(0.1, 0.3, (2, 4)), rng.uniform(0, 6, (2, 4))
    rows = []
    for k in range(round(seconds / model.opt.timestep)):
        if k % hold == 0:
            t = data.time
            steps = 0.3 * np.sign(np.sin(2 * np.pi * 0.4 * t + np.array([0.0, 1.0]))) * (t > seconds / 2)
            data.ctrl = np.sum(size * (np.sin(2 * np.pi * f * t + phase) - np.sin(phase)), axis=1) + steps
            rows.append([t, *data.qpos, *data.ctrl])
        mujoco.mj_step(model, data)
    # Actuators stand in another order than joints, and are called otherwise.
    np.savetxt(folder / name, rows, delimiter=",", header="t,q_hip,q_knee,ctrl_k,ctrl_h", comments="", fmt="%.9g")


def identified(*more):
    assert main(["servo", "a.csv", "b.csv", "--robot", "leg.xml", "--friction", "coulomb", "--no-rerun", *more]) == 0
    return json.loads(Path("out/summary.json").read_text())


@pytest.fixture(params=["implicitfast"])
def leg(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, seed in (("a.csv", 1), ("b.csv", 2)):
        log_of(tmp_path, name, seed, request.param)


@pytest.mark.thorough
@pytest.mark.parametrize("leg", ["Euler", "implicitfast"], indirect=True)
def test_the_file_of_a_simulation_is_found_from_commands_and_positions(leg):
    found = identified("--simulated", "--find", "a", "--out", "out", "--write", "found.xml")
    for joint, kp in (("hip", 40.0), ("knee", 30.0)):
        of = found["joints"][joint]
        assert of["kp"]["value"] == pytest.approx(kp, rel=0.01)
        for name, true in TRUE.items():
            if of[name]["value"] is None:  # the calf is so light that its load sets no scale of torques, nor of an offset
                assert (joint, name) == ("knee", "offset")
                continue
            # a hundredth of typical sizes beside: sigma of positions that are exact is next to nothing
            assert abs(of[name]["value"] - true) < 3 * of[name]["sigma"] + {"delay": 1e-4}.get(name, 0.01 * max(true, 0.1)), (
                joint,
                name,
            )
        assert found["mujoco_error"]["b.csv"][joint] < 2e-3
    assert all(": good" in line for line in found["verdict"][:1])


@pytest.mark.thorough
def test_without_the_steps_of_the_simulation_rotors_are_too_large(leg):
    """h kv / 2 by the implicit integrator and h Fv / 2: 1.1 g m^2; commands act half a step early."""
    plain, known = identified("--out", "out"), identified("--simulated", "--out", "out", "--force")
    more = [plain["joints"][joint]["Ia"]["value"] - known["joints"][joint]["Ia"]["value"] for joint in ("hip", "knee")]
    assert more == pytest.approx([0.0011, 0.0011], rel=0.4)
    late = [plain["joints"][joint]["delay"]["value"] - known["joints"][joint]["delay"]["value"] for joint in ("hip", "knee")]
    assert late == pytest.approx([-0.001, -0.001], abs=3e-4)


@pytest.mark.thorough
def test_equal_motors_have_one_value(leg):
    apart, tied = identified("--simulated", "--out", "out"), identified("--simulated", "--tie", "*", "--out", "out", "--force")
    for name in ("Ia", "Fs", "Fv", "delay"):
        one, other = (tied["joints"][joint][name] for joint in ("hip", "knee"))
        assert one == other
        values = [apart["joints"][joint][name]["value"] for joint in ("hip", "knee")]
        slack = 3 * max(apart["joints"][joint][name]["sigma"] for joint in ("hip", "knee"))
        assert min(values) - slack <= one["value"] <= max(values) + slack
    assert tied["joints"]["hip"]["offset"] != tied["joints"]["knee"]["offset"]


def test_a_tie_names_joints_that_are_there(leg, complaint):
    words = ["servo", "a.csv", "--robot", "leg.xml", "--tie"]
    assert "name two joints or more" in complaint(*words, "hip,ankle")
    assert "hip is tied already" in complaint(*words, "*", "h*,knee")


def test_a_motor_states_no_loop(tmp_path, complaint, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log_of(tmp_path, "a.csv", 1, seconds=1.0)
    text = Path("leg.xml").read_text()
    Path("motors.xml").write_text(
        text.replace('<position name="h" joint="hip" kp="40" kv="0.6" forcerange="-20 20"/>', '<motor name="h" joint="hip"/>')
    )
    said = complaint("servo", "a.csv", "--robot", "motors.xml")
    assert "no actuator that controls the position of hip" in said
    assert 'kind = "torque"' in said
