"""A leg under position loops: its file in plain MuJoCo is as good as its fit."""

import json

import mujoco
import numpy as np
import pytest

LEG = """<mujoco model="leg"><option timestep="5e-4" integrator="implicitfast"/>
<compiler angle="radian" autolimits="true"/><worldbody><body name="hip" pos="0 0 1">
<inertial pos="0 0.02 0" mass="0.6" diaginertia="6e-4 6e-4 6e-4"/><joint name="hip" axis="1 0 0" range="-1.2 1.2"/>
<body name="thigh" pos="0 0.08 0"><inertial pos="0 0 -0.05" mass="1.1" diaginertia="5e-3 5e-3 1e-3"/>
<joint name="thigh" axis="0 1 0" range="-2 2"/><body name="calf" pos="0 0 -0.21">
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="2e-3 2e-3 1e-4"/><joint name="calf" axis="0 1 0" range="-2.7 2.7"/>
</body></body></body></worldbody></mujoco>"""
JOINTS = ("hip", "thigh", "calf")
KP, KD, DELAY, H = 20.0, 1.5, 0.005, 2e-4
BIAS, OFFSET = np.array([-0.2, -0.115, 0.05]), np.array([-0.12, -0.12, -0.26])


def log(path, seed, seconds=12.0):
    """Write commands at 50 Hz and positions at 200 Hz of motors with rotors, friction and a constant torque, 5 ms late."""
    model, rng = mujoco.MjModel.from_xml_string(LEG), np.random.default_rng(seed)
    model.dof_armature[:], model.dof_damping[:], model.dof_frictionloss[:] = (0.012, 0.012, 0.025), 0.06, (0.12, 0.12, 0.15)
    model.opt.timestep, model.opt.integrator = H, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data, t = mujoco.MjData(model), np.arange(0, seconds, 0.02)
    size, rate, phase = rng.uniform(0.08, 0.3, (3, 3)), rng.uniform(0.3, 1.5, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    sent = np.array([0.0, 0.6, -1.2]) + np.sum(size * np.sin(2 * np.pi * rate * t[:, None, None] + phase), axis=-1)
    sent = np.repeat(sent + rng.normal(0, 0.03, sent.shape), round(0.02 / H), axis=0)
    data.qpos[:], rows = sent[0], []
    for k in range(len(sent)):
        if k % round(0.005 / H) == 0:
            rows.append((k * H, *(data.qpos - OFFSET + rng.normal(0, 2e-5, 3)), *(sent[k] - OFFSET)))
        late = sent[max(k - round(DELAY / H), 0)]
        data.qfrc_applied[:] = np.clip(KP * (late - data.qpos) - KD * data.qvel, -20, 20) + BIAS
        mujoco.mj_step(model, data)
    names = ",".join(["t", *(f"q_{joint}" for joint in JOINTS), *(f"command_{joint}" for joint in JOINTS)])
    np.savetxt(path, rows, "%.8g", ",", header=names, comments="")


@pytest.mark.thorough
def test_the_file_of_a_leg_is_as_good_as_its_fit(idbench, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "leg.xml").write_text(LEG)
    (tmp_path / "servo.toml").write_text(f'kind = "torque"\nkp = {KP}\nkd = {KD}\ntorque_limit = 20\n')
    for seed, name in enumerate(("a.csv", "b.csv", "val.csv")):
        log(tmp_path / name, seed)
    words = "servo a.csv b.csv --validate val.csv --robot leg.xml --servo servo.toml --friction load --write w.xml --out out"
    code, out, err = idbench(*words.split())
    assert code == 0, err
    result, step, *_ = out.splitlines()
    assert result.startswith("Result: good (")
    assert step == "next: use w.xml"
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    delays = [found["joints"][joint]["delay"]["value"] for joint in JOINTS]
    np.testing.assert_allclose(delays, DELAY, atol=5e-4)  # a step of the written file
    for joint, bias in zip(JOINTS, BIAS, strict=True):
        of_fit = found["position_error"]["held out"][joint][0]
        late = 2.5e-4 * 0.5  # delays are whole steps of the file: half a step, at half a rad/s
        assert found["mujoco_error"]["val.csv"][joint] < 1.15 * of_fit + late, joint
        assert found["joints"][joint]["bias"]["value"] == pytest.approx(bias, abs=0.1)
    model = mujoco.MjModel.from_xml_path("w.xml")
    np.testing.assert_allclose(model.actuator_biasprm[:, 0], [found["joints"][joint]["bias"]["value"] for joint in JOINTS])
