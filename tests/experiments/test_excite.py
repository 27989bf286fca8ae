"""The command that designs motions: what it writes keeps its limits, beats random motions, and comes out again."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.excite.design import Design
from idbench.experiments.excite.excitation import EXCITATIONS
from idbench.experiments.excite.excited import STAGES, Excited
from idbench.experiments.results.writing import NAME as MANIFEST
from idbench.identify.design.plan import Plan
from idbench.sim.limits.clearance import Clearance
from idbench.sim.limits.motion_limits import MotionLimits, surroundings
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario_file import load

TORQUES = (68.0, 104.0, 46.0, 6.0, 5.2, 4.4)
"""Of the motors of the PUMA, smaller than they are [N m]: they hold motions back."""

SHORT = ["--duration", "4", "--no-rerun"]
DESIGN = "excite scara --duration 4 --no-rerun --out out"


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """Search a quarter as long: limits hold, and files are written, however far a search has come."""
    few = tuple(stage._replace(keep=1, steps=stage.steps // 4) for stage in STAGES)
    monkeypatch.setattr("idbench.experiments.excite.excited.STAGES", few)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("excite") / "scara"
    assert main(["excite", "scara", "--duration", "6", "--out", str(out)]) == 0
    return out


def table(out):
    lines = (out / "motion.csv").read_text().splitlines()
    assert lines[0].startswith("# part: 0 the way")
    return lines[1].split(","), np.loadtxt(lines[2:], delimiter=",")


def test_it_writes_all_that_a_lab_needs(written):
    files = {"motion.csv", "scenario.toml", "summary.json", "report.html", "recording.rrd"}
    assert ({x.name for x in written.iterdir()} - {MANIFEST}) == files
    summary = json.loads((written / "summary.json").read_text())
    assert summary["parameters"] == ["ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2"]
    assert summary["over_random_median"] < 0.62
    assert summary["over_random_best"] < 0.75
    page = (written / "report.html").read_text()
    assert "standard errors" in page
    assert "src=" not in page


def test_the_motion_starts_and_ends_at_rest_at_home_and_never_jumps(written):
    names, rows = table(written)
    assert names == ["t", "part", "q_joint1", "q_joint2", "qd_joint1", "qd_joint2", "qdd_joint1", "qdd_joint2"]
    t, part, q, qd, qdd = rows[:, 0], rows[:, 1], rows[:, 2:4], rows[:, 4:6], rows[:, 6:8]
    np.testing.assert_allclose(np.diff(t), 0.01, atol=1e-9)
    assert np.unique(part).tolist() == [0, 1, 2]
    assert (np.diff(part) >= 0).all()
    np.testing.assert_allclose(q[[0, -1]], 0.0, atol=1e-6)
    np.testing.assert_allclose(qd[[0, -1]], 0.0, atol=1e-6)
    np.testing.assert_allclose(np.gradient(q, 0.01, axis=0)[1:-1], qd[1:-1], atol=0.05)
    robot = Robot.load("scara")
    assert (np.abs(qd) <= robot.most("velocity")).all()
    assert (np.abs(qdd) <= robot.most("acceleration")).all()


def test_its_scenario_runs_and_its_errors_are_as_predicted(written, ran):
    """Of one run: errors within four of the sigmas that were predicted before it."""
    found = ran("run", written / "scenario.toml", "--out run --no-rerun").summary
    predicted = json.loads((written / "summary.json").read_text())
    off = np.subtract(found["models"]["explicit"]["estimate"], found["truth"])
    assert (np.abs(off) < 4 * np.array(predicted["sigma"])).all()


@pytest.mark.thorough
@pytest.mark.parametrize("kind", EXCITATIONS.builtin)
def test_limits_hold_at_a_thousand_hertz_by_mujocos_own_torques(kind):
    """Also with the parameters of the file off by 30 %: all of them larger, or each at random."""
    noisy = replace(load("arm"), torque=TorqueMeasurement(noise=(0.05,)))
    found = Excited.of(Design("puma560", noisy, kind, 4.0, 1.0, MotionLimits(torque=TORQUES)))
    robot, motion = Robot.load("puma560"), found.design.trajectory(found.c).plan(Robot.load("puma560")).sample(1000.0)
    assert (motion.q >= robot.ranges[:, 0]).all()
    assert (motion.q <= robot.ranges[:, 1]).all()
    for values, rate in ((motion.qd, "velocity"), (motion.qdd, "acceleration")):
        assert (np.abs(values) <= robot.most(rate) * (1 + 1e-6)).all()
    tau = inverse_dynamics(robot, motion.q, motion.qd, motion.qdd) + coulomb_torque(robot, motion.qd)
    limit = np.array(TORQUES)
    assert (np.abs(tau) <= 0.8 * limit * (1 + 1e-6)).all()
    assert found.use.largest["worst-case torque"].max() > 0.95
    rng, model = np.random.default_rng(0), robot.model
    for k in range(20):
        for field in ("body_mass", "body_inertia", "dof_armature", "dof_damping", "dof_frictionloss"):
            values = getattr(model, field)
            values *= 1.3 if k == 0 else rng.uniform(0.7, 1.3, values.shape)
        off = inverse_dynamics(robot, motion.q, motion.qd, motion.qdd) + coulomb_torque(robot, motion.qd)
        assert (np.abs(off) <= limit).all()
        robot = Robot.load("puma560")
        model = robot.model


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_motion(tmp_path, ran):
    motions = []
    for _ in range(2):
        ran(DESIGN, "--seed 3")
        motions.append((tmp_path / "out" / "motion.csv").read_bytes())
    assert motions[0] == motions[1]


def test_another_design_does_not_replace_the_first_unasked(written, complaint):
    line = complaint("excite", "scara", "--duration", "5", "--out", str(written))
    assert "holds the results of `uv run idbench excite scara --duration 6" in line
    assert "--force" in line


@pytest.mark.thorough
def test_what_the_page_says_to_do_next_works(tmp_path, ran):
    ran("excite scara", "--duration 4 --no-rerun")
    ran("run runs/excited-scara/scenario.toml --no-rerun")
    assert {x.name for x in (tmp_path / "runs").iterdir()} == {"excited-scara", "scara-excited"}


@pytest.mark.thorough
def test_a_slow_series_and_a_home_too_heavy(tmp_path, complaint):
    out = ["--no-rerun", "--out", str(tmp_path / "out")]
    assert main(["excite", "scara", "--duration", "20", "--frequency", "0.1", *out]) == 0
    limits = tmp_path / "limits.toml"
    limits.write_text("torque_share = 0.2")
    assert "at home, at rest, torque of joint" in complaint("excite", "panda", "--limits", str(limits), *out, "--force")


@pytest.mark.thorough
def test_an_earlier_log_is_used(written, ran):
    """What the log tells is added: sigmas are below those of the log, and below those of a motion without it."""
    ran("run", written / "scenario.toml", "--out run --no-rerun")
    out, _, summary = ran(DESIGN, "--log run/log.parquet")
    assert "earlier" in out
    assert (np.array(summary["sigma"]) < summary["earlier"]).all()
    alone = ran(DESIGN, "--force").summary
    assert (np.array(summary["sigma"]) < 0.9 * np.array(alone["sigma"])).all()


@pytest.mark.thorough
def test_what_is_weighed_comes_out_better(ran):
    plain, weighed = (ran(DESIGN, "--force", weights).summary for weights in ("", "--weigh ZZR1=20"))
    assert weighed["sigma"][0] < 0.8 * plain["sigma"][0]


@pytest.mark.thorough
def test_a_keep_out_box_is_kept_out_of(tmp_path, ran):
    """Of the box of the file, by MuJoCo's own distances at every sample of what is written."""
    limits = tmp_path / "limits.toml"
    limits.write_text('[[keep_out]]\nname = "post"\nlowest = [0.3, 0.35, 0]\nhighest = [0.45, 0.5, 1]\n')
    ran(DESIGN, "--seed 3 --limits limits.toml")
    _, rows = table(tmp_path / "out")
    robot = surroundings("scara", MotionLimits.read(limits))
    found = Clearance(robot, robot.ranges, 0.01)
    assert any("keep_out post" in found.names(pair) for pair in found.pairs)
    assert found.distances(rows[:, 2:4], 0.05).min() > 0.01 - 1e-6  # nine digits are written


@pytest.mark.thorough
def test_motions_follow_until_all_is_known(ran):
    out, _, summary = ran(DESIGN, "--until 0.18%")
    shares = [each["brisk_share"] for each in summary["rounds"]]
    assert shares == sorted(shares, reverse=True)
    assert shares[-1] < 0.0018 <= shares[-2]
    assert "motion 1" in out


@pytest.mark.thorough
def test_what_stays_unknown_is_told_and_nothing_is_lost(tmp_path, monkeypatch, ran):
    monkeypatch.setattr("idbench.experiments.excite.job.ROUNDS", 1)
    assert re.search("not reached after 1 motions: F[sv]2 still makes", ran(DESIGN, "--until 0.0001%").out)
    assert {"log1.parquet", "motion1.csv", "motion.csv"} < ({x.name for x in (tmp_path / "out").iterdir()} - {MANIFEST})


@pytest.mark.thorough
def test_ways_keep_the_limits_that_were_given(tmp_path, ran):
    (tmp_path / "limits.toml").write_text("velocity = 0.3\nacceleration = 2.0\nhome = [1.5, 1.5]\n")
    ran(DESIGN, "--limits limits.toml")
    _, rows = table(tmp_path / "out")
    np.testing.assert_allclose(rows[[0, -1], 2:4], 1.5)
    assert np.abs(rows[:, 4:6]).max() <= 0.3
    assert np.abs(rows[:, 6:8]).max() <= 2.0


@pytest.mark.thorough
def test_motors_stay_cool_however_often_a_motion_is_run():
    """Root mean squares of the torques of ten runs, by MuJoCo, without the rest at both ends."""
    noisy = replace(load("ideal"), torque=TorqueMeasurement(noise=(0.05,)))
    asked = MotionLimits(rms_torque=(15.0, 1.2))
    found = Excited.of(Design("scara", noisy, duration=4.0, asked=asked, repeat=10))
    robot = Robot.load("scara")
    motion = found.design.trajectory(found.c).plan(robot).sample(1000.0)
    tau = inverse_dynamics(robot, motion.q, motion.qd, motion.qdd) + coulomb_torque(robot, motion.qd)
    rms = np.sqrt(np.mean(tau[1000:-1000] ** 2, axis=0))
    assert (rms <= (15.0, 1.2)).all()
    assert (rms / (15.0, 1.2)).max() > 0.9


@pytest.mark.thorough
def test_ctrl_c_keeps_the_best_so_far(monkeypatch, ran):
    calls, value = [0], Plan.value

    def interrupted(self, c):
        calls[0] += 1
        if calls[0] == 200:
            raise KeyboardInterrupt
        return value(self, c)

    monkeypatch.setattr("idbench.experiments.excite.excited.STAGES", STAGES)
    monkeypatch.setattr(Plan, "value", interrupted)
    out, _, summary = ran(DESIGN)
    assert "interrupted: this is the best motion so far" in out
    assert summary["interrupted"] is True
