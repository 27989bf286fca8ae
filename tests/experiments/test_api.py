"""`import idbench`: a call gives what its command writes; results say what they are; wrong keys are refused by name."""

import inspect
import json
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest

import idbench
from idbench.experiments.api.keywords import in_python
from idbench.identify import ESTIMATORS, AbstractEstimator, AbstractFriction, Estimate, WeightedLeastSquares
from idbench.identify.files.log_file import write_log
from idbench.sim.controllers import AbstractController, AbstractLaw, Error, PDFeedforward
from idbench.sim.settings import Positive, settings
from idbench.sim.trajectories import RandomMoves


@dataclass(frozen=True)
class Ridge(AbstractEstimator):
    """Least squares with a penalty on the size of the parameters."""

    strength: float = 1e-6

    def solve(self, problem):
        W, Y = problem.rows.W, problem.rows.Y
        Wt = np.swapaxes(W, -1, -2)
        X = np.linalg.solve(Wt @ W + self.strength * np.eye(W.shape[-1]), Wt @ Y[..., None])
        return Estimate.judge(problem, X[..., 0])


NAMES = {"schema", "experiment", "log", "path", "folder", "warnings", "command", "version"}
"""What a summary has beside the result: names of files and what was printed."""


def as_json(made):
    """Return a summary as it is written, but for names of files and what was printed."""
    return {key: value for key, value in json.loads(json.dumps(made)).items() if key not in NAMES}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Two logs of a SCARA, as files."""
    folder = tmp_path_factory.mktemp("api")
    for seed, name in enumerate(("first", "second")):
        moves = RandomMoves(moves=8, durations=(0.6, 1.2), rest=0.3, seed=seed)
        write_log(
            idbench.simulate(replace(idbench.load_scenario("ripple"), trajectory=moves), seed).log, folder / f"{name}.parquet"
        )
    return folder


def test_a_fit_of_files_is_that_of_the_command(files, ran):
    words = "--model explicit --estimator WLS --no-rerun --out found --validate"
    out, _, summary = ran("identify", files / "first.parquet", words, files / "second.parquet")
    fit = idbench.fit(files / "first.parquet", validate=files / "second.parquet", model="explicit", estimator="WLS")
    assert as_json(fit.summary()) == as_json(summary)
    finding, why, step, *_ = out.splitlines()
    laws = step.removeprefix("next: --friction ").split()
    assert fit.verdict == f"{finding}; {why}; next: friction={json.dumps(laws)}"


def test_a_fit_of_logs_is_that_of_their_files(files):
    logs = [idbench.read_log(files / f"{name}.parquet") for name in ("first", "second")]
    one = idbench.fit(logs[0], "scara", validate=logs[1], model="power", estimator="OLS")
    two = idbench.fit(files / "first.parquet", "scara", validate=files / "second.parquet", model="power", estimator="OLS")
    np.testing.assert_array_equal(one.fit.estimates["power"].X, two.fit.estimates["power"].X)
    assert [each["models"] for each in one.summary()["validations"]] == [
        each["models"] for each in two.summary()["validations"]
    ]


def test_a_run_is_that_of_the_command(ran):
    written = ran("run ideal --out kept --no-rerun --estimator OLS").summary
    run = idbench.simulate("ideal")
    assert run.truth == dict(zip(written["parameters"], written["truth"], strict=True))
    fit = idbench.fit(run.log, run.robot, truth=run.truth, estimator="OLS")
    assert as_json(fit.fit.summary())["models"] == written["models"]


def test_a_study_is_that_of_the_command(tmp_path, ran):
    text = (
        'name = "short"\nquestion = "?"\nscenario = "quantization"\nseeds = 2\nmodels = ["explicit"]\nestimators = ["OLS"]\n'
        '[settings.trajectory]\nkind = "random"\nmoves = 6\n[[axes]]\nfield = "encoder.lines"\nvalues = [1024, 4096]\n'
    )
    (tmp_path / "short.toml").write_text(text)
    written, table = ran("study short.toml --no-rerun --out kept").summary, idbench.study("short.toml")
    assert written["conclusion"]["finding"].startswith("Result: ")
    assert repr(table).startswith(written.pop("conclusion")["finding"])
    assert as_json(table.summary() | {"seconds": 0}) == as_json(written | {"seconds": 0})
    assert "1024" in repr(table)
    own = idbench.study("short.toml", estimators=["WLS", Ridge(), Ridge(1e-3)])
    assert {names[1] for _, *names in own.typical_errors()} == {"WLS", "Ridge", "Ridge(0.001)"}


@pytest.mark.thorough
def test_tables_and_motions_are_those_of_their_commands(ran):
    assert as_json(idbench.table1().summary()) == as_json(ran("table1 --no-rerun --out t1").summary)
    written = ran("excite scara --duration 4 --seed 2 --no-rerun --out moved").summary
    assert as_json(idbench.design("scara", duration=4, seed=2).summary()) == as_json(written)


@pytest.mark.thorough
def test_payloads_gains_and_servos_are_those_of_their_commands(tmp_path, ran):
    loaded = idbench.load_scenario("payload")
    for name, scenario in (("with", loaded), ("without", replace(loaded, payload=type(loaded.payload)()))):
        write_log(idbench.simulate(scenario).log, tmp_path / f"{name}.parquet")
    words = f"with.parquet --unloaded without.parquet --robot {loaded.robot}"
    keys = {"unloaded": "without.parquet", "robot": loaded.robot}
    written = ran("payload", words, "--out payload").summary
    assert as_json(idbench.fit_payload("with.parquet", **keys).summary()) == as_json(written)
    written = ran("gains", words, f"--mass {loaded.payload.mass} --out gains").summary
    made = idbench.fit_gains("with.parquet", **keys, mass=loaded.payload.mass)
    assert as_json(made.summary()) == as_json(written)
    ran("run servo --no-rerun --out ran")
    robot = idbench.load_scenario("servo").robot
    written = ran(f"servo ran/log.parquet --robot {robot} --servo ran/servo.toml --no-rerun --out servo").summary
    made = as_json(idbench.fit_servos("ran/log.parquet", robot, "ran/servo.toml").summary())
    assert made == {key: x for key, x in as_json(written).items() if key not in ("robot", "friction")}


def test_numbers_have_units_and_errors_and_torques_are_predicted(files, robot):
    fit = idbench.fit(files / "first.parquet", model="explicit", estimator="WLS")
    estimate = fit.fit.estimates["explicit"]
    Fv1 = fit.parameters["Fv1"]
    assert (Fv1.value, Fv1.sigma, Fv1.unit) == (estimate.X[1], estimate.standard_errors[1], "N m s/rad")
    np.testing.assert_allclose(np.diagonal(fit.correlation), 1.0)
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 4, 5, 2))
    tau = fit.predict(q, qd, qdd)
    assert tau.shape == q.shape
    # Eq. 5: the same columns, sample by sample.
    X = dict(zip(estimate.names, estimate.X, strict=True))
    np.testing.assert_allclose(
        tau[..., 1],
        X["ZZ2"] * (qdd[..., 0] + qdd[..., 1])
        + X["LMX2"] * (qdd[..., 0] * np.cos(q[..., 1]) + qd[..., 0] ** 2 * np.sin(q[..., 1]))
        + X["LMY2"] * (qd[..., 0] ** 2 * np.cos(q[..., 1]) - qdd[..., 0] * np.sin(q[..., 1]))
        + X["Fv2"] * qd[..., 1]
        + X["Fs2"] * np.sign(qd[..., 1]),
        atol=1e-12,
    )
    score = fit.score(idbench.read_log(files / "second.parquet"))
    assert (score.percent < 10).all()
    assert "rms error" in repr(score)


def test_files_are_written_and_those_of_others_kept(files, tmp_path):
    fit = idbench.fit(files / "first.parquet", model="explicit", estimator="WLS")
    fit.write(tmp_path / "arm.py", tmp_path / "arm.json")
    fit.report(tmp_path / "report.html")
    assert {path.name for path in tmp_path.iterdir()} == {"arm.py", "arm.json", "report.html"}
    (tmp_path / "notes.py").write_text("mine")
    with pytest.raises(idbench.ExperimentError, match=r"notes\.py"):
        fit.write(tmp_path / "notes.py")
    assert (tmp_path / "notes.py").read_text() == "mine"


def test_joints_are_put_in_the_order_of_the_robot(files):
    log = idbench.read_log(files / "first.parquet")
    names = idbench.load_robot("scara").robot.joints
    turned = replace(log, q=log.q[:, ::-1], tau=log.tau[:, ::-1], joints=names[::-1])
    one, two = (idbench.fit(each, "scara", model="explicit", estimator="OLS") for each in (log, turned))
    np.testing.assert_array_equal(one.fit.estimates["explicit"].X, two.fit.estimates["explicit"].X)


def test_objects_keep_what_they_are():
    """Classes that are defined again, settings that are arrays: each object has a name of its own."""

    def made(factor):
        @dataclass(frozen=True)
        class Weighted(AbstractEstimator):
            factor_: float = factor

            def solve(self, problem):
                raise NotImplementedError

        return Weighted()

    first, second = made(1.0), made(1.0)
    names = [ESTIMATORS.name_of(each) for each in (first, second, first)]
    assert names[0] == names[2] != names[1]
    assert (ESTIMATORS.create(names[0]), ESTIMATORS.create(names[1])) == (first, second)
    assert ESTIMATORS.create(names[0]) is first
    with pytest.raises(idbench.IdentificationError, match="defined more than once"):
        idbench.fit(idbench.simulate("ideal").log, "scara", estimator="Weighted")


def test_a_delay_that_was_found_holds_for_held_out_logs():
    moves = RandomMoves(moves=8, durations=(0.6, 1.2), rest=0.3, seed=3)
    late = replace(idbench.load_scenario("delay"), trajectory=moves)
    log, other = (replace(idbench.simulate(replace(late, seed=k)).log) for k in (0, 1))
    undelayed = [replace(each, torque=replace(each.torque, delay=0.0)) for each in (log, other)]
    fit = idbench.fit(undelayed[0], "scara", model="explicit", estimator="WLS", torque_delay="estimate")
    brisk = idbench.simulate("brisk").log
    score = fit.score(replace(brisk, torque=replace(brisk.torque, delay=0.0)))
    assert np.isfinite(score.rms).all()
    with pytest.raises(idbench.ExperimentError, match="holds the motion that is identified"):
        fit.score(undelayed[0])


def test_laws_that_are_objects_are_summed():
    @dataclass(frozen=True)
    class Drag(AbstractFriction):
        symbol = "Fq"
        unit = "N m"
        power: float = 2.0

        def force(self, q, qd):
            return np.abs(qd) ** self.power * np.sign(qd)

    robot = idbench.load_robot("scara", friction=["standard", Drag(power=1.7)], add="offset")
    assert {"Fv1", "Fs1", "Fq1", "off1"} <= set(robot.basis.names)
    log = idbench.simulate("ideal").log
    fit = idbench.fit(log, robot, add=Drag(power=3.0), friction="standard", model="explicit", estimator="OLS")
    assert {"Fq1", "off1"} <= set(fit.parameters)


@pytest.mark.thorough
def test_a_study_in_a_folder_goes_on_there(tmp_path):
    keys = {"seeds": 2, "chains": ["idbench"], "models": ["explicit"], "estimators": ["OLS"], "out": tmp_path / "kept"}
    one, two = idbench.study("encoder", **keys), idbench.study("encoder", **keys)
    np.testing.assert_array_equal(one.rows["run"], two.rows["run"])
    with pytest.raises(idbench.ExperimentError, match="holds another study"):
        idbench.study("encoder", **{**keys, "seeds": 3})


def test_results_are_tables_in_a_notebook(files):
    log, robot = idbench.read_log(files / "first.parquet"), idbench.load_robot("scara")
    fit = idbench.fit(log, robot, model="explicit", estimator="WLS")
    score = fit.score(idbench.read_log(files / "second.parquet"))
    for shown in (log, robot, fit, score, fit.fit.estimates["explicit"]):
        assert shown._repr_html_().count("<tr>") > 2
        assert "object at 0x" not in repr(shown)
    assert repr(fit).startswith("Result: ")


def test_an_object_has_the_name_of_the_table_where_it_is_one():
    assert ESTIMATORS.name_of(WeightedLeastSquares()) == "WLS"
    assert ESTIMATORS.name_of(WeightedLeastSquares) == "WLS"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (lambda log, found: idbench.fit(log, truth=3), "give a mapping"),
        (lambda log, found: found.predict("a", "b", "c"), "arrays of numbers"),
        (lambda log, found: found.write(None), "give its name"),
        (lambda log, found: found.report(None), "give its name"),
        (lambda log, found: idbench.write_log(None, "a.csv"), "is no MotionLog"),
        (lambda log, found: idbench.load_scenario(3), "is no scenario"),
        (lambda log, found: idbench.simulate(3), "give its name"),
        (lambda log, found: idbench.fit(log, no_trials="yes"), "must be true or false"),
        (lambda log, found: idbench.fit(log, model={}), "must be"),
        (lambda log, found: idbench.read_log("a.csv", torque="held", robot=2.5), "give its name"),
        (lambda log, found: idbench.study("encoder", seeds=2, threads="two"), "valid integer"),
        (lambda log, found: idbench.study("encoder", seeds=2, out=3), "give its name"),
        (lambda log, found: idbench.study(idbench.load_scenario("ideal"), axes=[1]), "mapping of settings"),
        (lambda log, found: found.predict([0, 0], [0, 0], [0, 0], model=[None]), "no estimate of"),
        (lambda log, found: idbench.TorqueChannel(np.zeros(3)), "is unknown"),
    ],
)
def test_wrong_types_are_told_in_one_line(files, call, complaint):
    log = idbench.read_log(files / "first.parquet")
    with pytest.raises((idbench.ExperimentError, idbench.IdentificationError, idbench.BenchError), match=complaint) as found:
        call(log, idbench.fit(log, model="explicit", estimator="OLS"))
    assert "\n" not in str(found.value)


def test_tables_are_taken_where_the_command_line_has_pairs(files):
    held = idbench.load_robot("scara", hold={"Fs1": 0.25}).basis.held
    assert [float(np.asarray(x)) for x in held.values()] == [0.25]
    degrees = idbench.read_log(files / "first.parquet", units={"q": "deg"}).q
    np.testing.assert_allclose(degrees, np.pi / 180 * idbench.read_log(files / "first.parquet").q)


def test_it_lives_beside_folders_of_the_same_names(tmp_path):
    """A script whose project has packages of its own called models, sim, identify and experiments."""
    for name in ("models", "sim", "identify", "experiments"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"NAME = 'my {name}'\n")
    code = "import models, sim, identify, experiments, idbench\n"
    code += "fit = idbench.fit(idbench.simulate('ideal').log, 'scara', model='explicit', estimator='OLS')\n"
    code += "print(models.NAME, sim.NAME, identify.NAME, experiments.NAME, len(fit.parameters))"
    (tmp_path / "script.py").write_text(code)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == "my models my sim my identify my experiments 8\n", done.stderr


@pytest.mark.parametrize(
    ("option", "keyword"),
    [
        ("--friction standard 1=standard+cogging:36", 'friction=["standard", "1=standard+cogging:36"]'),
        ("--gain 1 1 0.9109 --torque-delay estimate", 'gain=[1, 1, 0.9109], torque_delay="estimate"'),
        ("--gain 1 1.15 or --gain 0.8697 1", "gain=[1, 1.15] or gain=[0.8697, 1]"),
        ("--write arm.urdf arm.py keeps the robot", 'fit.write("arm.urdf", "arm.py") keeps the robot'),
        ("for a simulation add --simulated", "for a simulation add simulated=True"),
        ("motion (idbench excite), or friction (--friction auto)", 'motion (idbench.design), or friction (friction="auto")'),
        ("--robot FILE names another", 'robot="FILE" names another'),
    ],
)
def test_the_next_step_is_in_keywords(option, keyword):
    assert in_python(option) == keyword


@pytest.mark.parametrize("call", [idbench.fit, idbench.load_robot, idbench.read_log, idbench.fit_servos, idbench.design])
def test_help_names_every_keyword(call):
    parameters = inspect.signature(call).parameters.values()
    assert len(parameters) > 8
    assert not [p for p in parameters if p.kind is p.VAR_KEYWORD]


@settings
class Stiff(AbstractController):
    """u = tau_nominal(q_ref) + M (w^2 e + 2 w de/dt)."""

    bandwidth: Positive = 20.0

    def start(self, task):
        return StiffLaw(task, self.bandwidth)


class StiffLaw(AbstractLaw):
    def __init__(self, task, w):
        self.ahead, self.kp, self.kd = task.feedforward, task.inertia * w**2, task.inertia * 2 * w
        self.error = Error(task.reference, task.nsim, 100.0)

    def command(self, k, q):
        e, rate = self.error.update(k, q)
        return self.ahead[k] + self.kp * e + self.kd * rate


def test_a_study_of_a_scenario_takes_a_controller_of_ones_own():
    """It is the built-in one with the same settings: so are its errors."""
    scenario = replace(idbench.load_scenario("quantization"), trajectory=RandomMoves(moves=5))
    asked = {"seeds": 2, "axes": {"controller.bandwidth": [10.0, 20.0]}, "models": ["explicit"], "estimators": ["OLS"]}
    own = idbench.study(replace(scenario, controller=Stiff()), **asked)
    built_in = idbench.study(replace(scenario, controller=PDFeedforward(20.0)), **asked)
    assert [cell.settings["controller.bandwidth"] for cell in own.cells] == [10.0, 20.0]
    for mine, theirs in zip(own.cells, built_in.cells, strict=True):
        np.testing.assert_allclose(mine.X, theirs.X, rtol=1e-6)
    assert repr(own).startswith("Result: ")


def test_the_truth_of_an_added_law_may_be_missing():
    run = idbench.simulate("ideal")
    fit = idbench.fit(run.log, run.robot, add="offset", truth=run.truth, model="explicit", estimator="OLS")
    assert (fit.parameters["off1"].truth, fit.parameters["Fs1"].truth) == (0.0, 0.5)
    with pytest.raises(idbench.ExperimentError, match="truth: Fs1 is missing"):
        idbench.fit(run.log, run.robot, truth={k: x for k, x in run.truth.items() if k != "Fs1"})
