"""`--balancer`: a spring between two points, against MuJoCo's spatial tendon."""

import mujoco
import numpy as np
import pytest

from idbench.experiments.cli import main

ARM = """<mujoco><compiler angle="radian"/><worldbody>{anchor}<body pos="0 0 1">
<joint name="hip" axis="0 1 0" damping="1"/><geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/>{eye}
<body pos="0.5 0 0"><joint name="knee" axis="0 1 0" damping="0.5"/>
<geom type="capsule" fromto="0 0 0 0.4 0 0.1" size="0.04"/></body></body></worldbody>{tendon}</mujoco>"""

STIFFNESS, LENGTH = 2000.0, 0.3
"""Of the spring: [N/m], and without force [m]."""

NOISE = 0.2
"""Of the torques, rms [N m]."""

A, B = 0.15, 0.5
"""Distances of its ends from the axis of the hip [m]: one on the link, one below the axis."""

SPRUNG = ARM.format(
    anchor=f'<site name="low" pos="0 0 {1 - B}"/>',
    eye=f'<site name="eye" pos="{A} 0 0"/>',
    tendon=f'<tendon><spatial stiffness="{STIFFNESS}" springlength="{LENGTH}">'
    '<site site="low"/><site site="eye"/></spatial></tendon>',
)

OPTION = f"hip=a:{A},b:{B},zero:{np.pi / 2}"
"""Both ends are below the axis when the link is turned down."""


def written(folder, seed):
    """Write a log of the sprung arm: MuJoCo's inverse dynamics of a sum of sines."""
    model = mujoco.MjModel.from_xml_string(SPRUNG)
    data, rng, t = mujoco.MjData(model), np.random.default_rng(seed), np.arange(0, 20, 0.005)
    w, a, phase = rng.uniform(1, 5, (4, 1, 2)), rng.uniform(0.1, 0.4, (4, 1, 2)), rng.uniform(0, 6, (4, 1, 2))
    turned = w * t[:, None] + phase
    q, qd, qdd = (np.sum(x, axis=0) for x in (a * np.sin(turned), a * w * np.cos(turned), -a * w**2 * np.sin(turned)))
    tau = []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(q, qd, qdd, strict=True):
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse + NOISE * rng.standard_normal(2))
    path, head = folder / f"log{seed}.csv", "t,q1,q2,tau1,tau2"
    np.savetxt(path, np.column_stack([t, q, np.array(tau)]), delimiter=",", header=head, comments="")
    return str(path)


@pytest.mark.thorough
def test_the_spring_of_mujoco_is_found(tmp_path, ran):
    """Its F0 = k (|a - b| - length) and Kb = k are grouped: F0 - |a - b| Kb is minus k times the length."""
    (tmp_path / "arm.xml").write_text(ARM.format(anchor="", eye="", tendon=""))
    words = f"identify {written(tmp_path, 0)} --validate {written(tmp_path, 1)} --robot arm.xml --torque instantaneous"
    words += " --torque-delay 0 --friction viscous --model explicit --no-rerun --force --out found"
    found = [ran(words, options).summary for options in ("", f"--balancer {OPTION}")]
    (X, sigma), (plain, sprung) = (
        [found[1]["models"]["explicit"][x] for x in ("estimate", "sigma")],
        [each["validation"]["models"]["explicit"] for each in found],
    )
    k = found[1]["parameters"].index("F0R1")
    assert found[1]["made_of"]["F0R1"] == f"F01 - {B - A:g} Kb1"
    assert abs(X[k] + STIFFNESS * LENGTH) < 4 * sigma[k]
    assert sigma[k] < 0.01 * STIFFNESS * LENGTH
    assert sprung["torque_error_rms"][0] < 0.1 * plain["torque_error_rms"][0]
    assert sprung["unexplained_percent"][0] < 0.1
    # Simulated with the torques of the log, without those of the spring, which has no place in the file.
    assert max(sprung["position_error_rms"]) < 0.01


def test_a_joint_with_a_balancer_turns(capsys, tmp_path):
    (tmp_path / "slide.xml").write_text(ARM.format(anchor="", eye="", tendon="").replace('"hip"', '"hip" type="slide"'))
    assert main(["robot", str(tmp_path / "slide.xml"), "--balancer", "hip=a:0.2,b:0.8"]) == 2
    assert "hip slides" in capsys.readouterr().err
