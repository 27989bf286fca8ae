"""What was wrong without a word: it is refused, or told with what to do."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from idbench.experiments.cli import main
from idbench.experiments.identification.friction_laws import FrictionLaws
from idbench.identify import ESTIMATORS, AbstractEstimator, Estimate, MotionLog
from idbench.identify.data.jumps import jumps
from idbench.identify.files.log_file import read_log, write_log
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.payload import Payload
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario_file import load
from idbench.sim.trajectories import RandomMoves

HELD = "--torque", "held", "--torque-delay", "0"
SCARA = "--robot", "scara", "--model", "explicit", "--no-rerun"


def test_the_order_of_laws_does_not_matter():
    one, other = (
        FrictionLaws.of(texts, ("a", "b")) for texts in (("standard", "b=standard+load"), ("b=standard+load", "standard"))
    )
    assert one.names == other.names == (("viscous", "coulomb"), ("viscous", "coulomb", "load"))


@pytest.mark.thorough
def test_a_study_compares_laws_of_friction(tmp_path, monkeypatch, capsys):
    """Both are in table, summary and report; typical errors are of the parameters that both have."""
    monkeypatch.chdir(tmp_path)
    text = 'name = "laws"\nquestion = "Which law?"\nscenario = "ideal"\nseeds = 12\nmodels = ["explicit"]\n'
    text += 'friction = ["standard", "standard+stribeck:0.1"]\n[settings.trajectory]\nkind = "random"\nmoves = 3\n'
    text += '[[axes]]\nfield = "torque.noise"\nvalues = [0.01, 0.1]\n'
    (tmp_path / "laws.toml").write_text(text)
    assert main(["study", "laws.toml", "--no-rerun", "--out", "out"]) == 0
    printed = capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    found = {cell["settings"]["friction laws"] for cell in summary["cells"]}
    assert found == {"standard", "standard+stribeck:0.1"}
    assert len(summary["cells"]) == 4
    assert "standard+stribeck:0.1" in printed
    assert "nan" not in printed
    assert "explicit (standard)" in summary["answer"]
    assert "best or not significantly worse in 2 of 2 settings" in summary["answer"]
    assert "standard+stribeck:0.1" in (tmp_path / "out" / "report.html").read_text()
    assert main(["run", "--from", "out", "--index", "0", "--method", "1", "--no-rerun", "--out", "again"]) == 0
    assert "Fst1" in capsys.readouterr().out


def pair(mass=2.0):
    """Return a log of a PUMA without and one with a payload."""
    arm = load("arm")
    moves = RandomMoves(moves=10, velocity=(2.0,), durations=(0.8, 1.6))
    scenario = replace(arm, robot="puma560", fs=250.0, trajectory=moves, torque=TorqueMeasurement(noise=(0.02,)))
    held = Payload(mass=mass, position=(0.03, -0.02, 0.15), inertia=0.012)
    return [simulate(replace(scenario, payload=load_, seed=k)).alone() for k, load_ in enumerate((Payload(), held))]


@pytest.fixture(scope="module")
def payload(tmp_path_factory):
    folder = tmp_path_factory.mktemp("payload")
    empty, full = pair()
    for name, log, scale in (
        ("empty", empty, 1), ("full", full, 1), ("empty-neg", empty, -1), ("full-neg", full, -1), ("full-kilo", full, 1000),
    ):  # fmt: skip
        write_log(MotionLog(log.fs, log.q, scale * log.tau, log.torque), folder / f"{name}.parquet")
    swapped = [0, 2, 1, 3, 4, 5]
    write_log(MotionLog(full.fs, full.q[:, swapped], full.tau[:, swapped], full.torque), folder / "full-other.parquet")
    (folder / "copy.parquet").write_bytes((folder / "full.parquet").read_bytes())
    return folder


WAY = "--robot", "puma560", "--estimator", "WLS"


def unhurried(err):
    """Return what was complained of, without the progress that a busy machine shows."""
    return "".join(line for line in err.splitlines(keepends=True) if not re.fullmatch(r"judging: .*, \d+ s\n?", line))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("loaded", "unloaded", "more", "words"),
    [
        ("full", "empty", [], ["empty.parquet: good", "full.parquet: good"]),
        ("full", "empty", ["--mass", "2"], ["full.parquet: good"]),
        ("empty", "full", [], ["below zero", "exchanged"]),
        ("full-neg", "empty-neg", [], ["wrong sign", "below zero"]),
        ("full-neg", "empty", [], ["full-neg.parquet: friction drives"]),
        ("full-kilo", "empty", [], ["full-kilo.parquet: the torques are", "are they in N m?", "poor"]),
        ("full-other", "empty", [], ["full-other.parquet: poor", "Check in this order: the gains"]),
        ("full", "empty", ["--mass", "3"], ["--mass: ML = 3 is stated, the logs show", "sigma away", "poor"]),
    ],
)
def test_a_payload_has_a_verdict(payload, idbench, loaded, unloaded, more, words):
    logs = payload / f"{loaded}.parquet", "--unloaded", payload / f"{unloaded}.parquet"
    code, out, err = idbench("payload", *logs, *WAY, *more)
    assert (code, unhurried(err)) == (0, "")
    for word in words:
        assert word in out, word
    assert ("warning: " in out or "Check these first" in out) == (words[0] not in ("empty.parquet: good", "full.parquet: good"))
    assert ("the nearest physically consistent body" in out) == ("below zero" not in out)


@pytest.mark.thorough
def test_logs_of_one_name_are_judged_each(payload, idbench, tmp_path):
    """Every run has a log.parquet; the verdict is that of the worst, and what cannot be is poor."""
    for name in ("empty", "full"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "log.parquet").write_bytes((payload / f"{name}.parquet").read_bytes())
    for loaded, unloaded, word in (("full", "empty", "good"), ("empty", "full", "poor")):
        logs = f"{loaded}/log.parquet", "--unloaded", f"{unloaded}/log.parquet"
        code, out, err = idbench("payload", *logs, *WAY, "--out", loaded + "-found")
        assert (code, unhurried(err)) == (0, "")
        assert f"Result: {word}" in out
        judged = json.loads((tmp_path / f"{loaded}-found" / "summary.json").read_text())["judgement"]
        assert (judged["verdict"], set(judged["logs"])) == (word, {"full/log.parquet", "empty/log.parquet"})


@pytest.mark.thorough
def test_a_payload_is_saved_before_it_is_judged(payload, idbench, tmp_path, monkeypatch):
    def broken(*args):
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr("idbench.experiments.loads.known_load.LoadJudgement.warnings", broken)
    code, out, err = idbench("payload", payload / "full.parquet", "--unloaded", payload / "empty.parquet", *WAY, "--out", "f")
    assert (code, "the verdict: " in err, "consistent body" in out) == (2, True, True)
    assert (tmp_path / "f" / "summary.json").is_file()
    assert (tmp_path / "f" / "fault.txt").is_file()


@pytest.mark.thorough
def test_one_log_counts_once(payload, complaint):
    logs = [str(payload / f"{name}.parquet") for name in ("full", "copy")]
    line = complaint("payload", *logs, "--unloaded", str(payload / "empty.parquet"), *WAY)
    assert "copy.parquet holds the same samples as" in line
    assert "holds the same samples as" in complaint("identify", *logs, "--robot", "puma560")
    assert "is given twice" in complaint("payload", logs[0], "--unloaded", logs[0], *WAY)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("loaded", "unloaded", "message"),
    [
        ("empty", "full", "come out below zero: are the logs without and with the payload exchanged"),
        ("full-neg", "empty-neg", "do their currents have the wrong sign"),
    ],
)
def test_gains_of_exchanged_logs_are_refused(payload, complaint, loaded, unloaded, message):
    logs = str(payload / f"{loaded}.parquet"), "--unloaded", str(payload / f"{unloaded}.parquet")
    assert message in complaint("gains", *logs, "--robot", "puma560", "--mass", "2")


@pytest.mark.thorough
def test_gains_are_of_what_was_logged_whatever_they_are_read_with(payload, idbench, tmp_path):
    """Logs in N m, read with a gain of 2: torque over what was logged is 1."""
    logs = payload / "full.parquet", "--unloaded", payload / "empty.parquet"
    code, out, _ = idbench("gains", *logs, "--robot", "puma560", "--mass", "2", "--gain", "2", "--out", "found")
    assert code == 0
    found = json.loads((tmp_path / "found" / "summary.json").read_text())
    shown = [gain for gain in found["gains"] if gain is not None]
    assert shown == pytest.approx([1.0] * len(shown), rel=0.02)
    assert found["read_with"] == [2.0] * 6
    assert "full.parquet: good" in out


@pytest.fixture
def scara_csv(log, tmp_path):
    """A log of the SCARA in CSV, to be changed."""

    def write(q=lambda q: q, tau=lambda tau: tau):
        write_log(MotionLog(log.fs, q(log.q.copy()), tau(log.tau.copy()), log.torque), tmp_path / "log.csv")
        return tmp_path / "log.csv"

    return write


def test_a_joint_that_is_masked_throughout_is_not_explained(idbench, scara_csv):
    """Joint 2 creeps below the speed that is asked for: of it nothing is explained, and that is said."""
    path, left = scara_csv(lambda q: q * [1, 1e-3]), ("--without", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")
    _, out, _ = idbench("identify", path, *SCARA, *HELD, "--estimator", "WLS", "--mask-speed", "0.1", *left)
    assert "no torque" in out
    assert "no torque of joint2 is left to explain" in out


def test_a_layout_that_is_used_is_named_and_joints_that_hardly_move_are_told(idbench, scara_csv):
    path = scara_csv(lambda q: q)
    (path.parent / "log.toml").write_text('[t]\ncolumns = "t"\n[q]\ncolumns = "q*"\nunit = "deg"\n[tau]\ncolumns = "tau*"\n')
    _, out, err = idbench("identify", path, *SCARA, *HELD, "--estimator", "WLS")
    assert "columns are what" in out + err
    assert "it hardly moves" in out + err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("outlier", ["joint2 jumps by 3 rad at sample 1533", "and back: a wild sample"]),
        ("slip", ["joint2 jumps by 0.5 rad at sample 1533", "did its encoder slip", "Identify samples 0 to 1532"]),
    ],
)
def test_positions_that_jump_are_named_and_nothing_is_advised(idbench, scara_csv, change, words):
    def jump(q):
        if change == "outlier":
            q[1533, 1] += 3.0
        else:
            q[1533:, 1] += 0.5
        return q

    _, out, err = idbench("identify", scara_csv(jump), *SCARA, *HELD, "--estimator", "WLS")
    for word in words:
        assert word in out + err
    assert "a log with jumps gets no further advice" in out + err
    for advice in ("the worst joint's error falls", "are they in N m", "are units, signs"):
        assert advice not in out


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["ideal", "arm", "quantization", "ripple", "brisk"])
def test_no_motion_of_a_robot_jumps(name):
    log = simulate(replace(load(name), trajectory=RandomMoves(moves=6))).alone()
    assert not jumps(log.q, log.fs)


COUNT = 2 * np.pi / 4096


@pytest.mark.parametrize(
    "quiet",
    [
        lambda t: np.where((t > 12.33) & (t < 12.36) | (t > 30), COUNT, 0.0),
        lambda t: np.floor(t / 2) * COUNT,
        lambda t: np.round(0.3 * np.sin(2 * np.pi * t / 40) / COUNT) * COUNT,
        lambda t: np.round(np.clip(t - 20, 0, 1) * 0.5 / 0.01) * 0.01,
    ],
    ids=["flickers", "creeps", "slow", "coarse"],
)
def test_a_quiet_joint_does_not_jump(quiet):
    t = np.arange(4000) / 100
    other = np.round(np.sin(2 * np.pi * 0.3 * t) / COUNT) * COUNT
    assert not jumps(np.stack([quiet(t), other], axis=1), 100.0)
    slipped = quiet(t) + np.where(t > 15, 0.5, 0.0)
    assert [(jump.joint, jump.sample) for jump in jumps(np.stack([slipped, other], axis=1), 100.0)] == [(0, 1501)]


class Vandal(AbstractEstimator):
    """Writes into what it is given."""

    needs = frozenset({"rows"})

    def solve(self, problem):
        W = problem.rows.W
        W *= 3
        return Estimate.judge(problem, np.linalg.lstsq(W, problem.rows.Y)[0])


class Ending(AbstractEstimator):
    """Ends the process."""

    def solve(self, problem):
        raise SystemExit(0)


class Base(AbstractEstimator):
    """Raises what is no Exception."""

    def solve(self, problem):
        raise GeneratorExit("why")


class Needy(AbstractEstimator):
    """Needs what there is not."""

    needs = "everything"

    def solve(self, problem):
        return Estimate.judge(problem, np.zeros(len(problem.names)))


class Complex(AbstractEstimator):
    """Gives complex numbers."""

    def solve(self, problem):
        return Estimate.judge(problem, np.full(len(problem.names), 1 + 1j))


@pytest.mark.parametrize(
    ("plugin", "words"),
    [
        (Vandal, "raised ValueError: output array is read-only"),
        (Ending, "raised SystemExit: 0"),
        (Base, "raised GeneratorExit: why"),
        (Needy, "needs is 'everything', expected a frozenset of"),
        (Complex, "Estimate.judge is given X of complex128"),
    ],
)
def test_plugins_that_spoil_or_end_are_named(plugin, words, complaint, logs, monkeypatch):
    """Their code counts as another package's."""
    monkeypatch.setattr(plugin, "__module__", "elsewhere")
    monkeypatch.setitem(ESTIMATORS._builtin, "strange", plugin)
    line = complaint("identify", str(logs / "first.parquet"), "--robot", "puma560", "--estimator", "strange")
    assert words in line


def test_a_check_that_ends_is_an_answer(monkeypatch, capsys):
    monkeypatch.setitem(ESTIMATORS._builtin, "strange", Ending)
    assert main(["check", "estimators/strange"]) == 2
    assert "SystemExit" in capsys.readouterr().out


def test_rows_are_read_only(logs):
    from idbench.identify import ExplicitModel, Problem, idbench_chain, scara
    from idbench.sim.engine.run import ideal_log
    from idbench.sim.robot.robot import Robot

    robot = Robot.load("scara")
    problem = Problem(
        (ideal_log(robot, load("brisk").trajectory.sample(robot, 100.0)),), scara(), ExplicitModel(), idbench_chain()
    )
    for values in (problem.rows.W, problem.rows.Y, problem.factors.R):
        with pytest.raises(ValueError, match="read-only"):
            values[...] = 0
    assert read_log(logs / "first.parquet").q.flags.writeable is False
