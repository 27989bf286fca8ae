"""Known parameters: held, not identified, in estimates, predictions, simulations and written files."""

import numpy as np
import pytest

import idbench
from idbench.experiments.identification.known import Known
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import State
from idbench.sim.engine.run import ideal_log
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics
from idbench.sim.robot.robot import Robot
from idbench.sim.trajectories import RandomMoves


@pytest.fixture(scope="module")
def run():
    return idbench.simulate("ripple", seed=2)


def of(*hold, robot="scara", **more):
    return RobotModel(robot, Parameters(hold=hold, **more))


def test_with_known_links_every_armature_is_a_parameter_of_its_own():
    """ZZR1 = ZZ1 + Ia1 + L^2 M2 becomes Ia1; links are as in the file."""
    robot_model = of("links=file")
    assert robot_model.basis.names == ("Ia1", "Fv1", "Fs1", "Fv2", "Fs2")  # joint 2 has no rotor
    assert of("links=file", armature="all").basis.names == ("Ia1", "Fv1", "Fs1", "Ia2", "Fv2", "Fs2")
    assert set(robot_model.held) >= {"ZZ1", "M2", "MX2"}


def test_what_is_known_makes_the_others_surer(run):
    free, held = (idbench.fit(run.log, "scara", model="explicit", hold=hold) for hold in ((), ("links=file",)))
    noise = [dict(zip(e.names, e.noise_sigma, strict=True)) for e in (one.fit.estimates["explicit"] for one in (free, held))]
    for name in ("Fv1", "Fs1", "Fv2", "Fs2"):  # levels of noise are found anew
        assert noise[1][name] <= 1.02 * noise[0][name]
    truth = RobotModel("scara", Parameters(hold=("links=file",))).truth(Robot.load("scara"))
    assert held.parameters["Ia1"].value == pytest.approx(truth["Ia1"], abs=4 * held.parameters["Ia1"].sigma)


SLOW = pytest.mark.thorough
MODELS = [*("explicit", "power"), *(pytest.param(name, marks=SLOW) for name in ("implicit", "energy", "integral"))]


@pytest.mark.parametrize("model", MODELS)
def test_all_models_give_the_truth_with_a_known_parameter(model):
    """Noise-free: the torque of what is held is taken away, in every model."""
    ideal = idbench.simulate("ideal", seed=1)
    fit = idbench.fit(ideal.log, "scara", model=model, hold=("Fs1=0.5", "Fv2=0.01", "LMY2=0.005"))
    assert not {"Fs1", "Fv2", "LMY2"} & set(fit.parameters)
    for name, parameter in fit.parameters.items():
        assert parameter.value == pytest.approx(ideal.truth[name], rel=1e-4)


def test_a_wrong_known_value_shows_in_the_others():
    """Held 0.1 N m too low, Coulomb friction of joint 1 goes into its viscous friction."""
    ideal = idbench.simulate("ideal", seed=1)
    fit = idbench.fit(ideal.log, "scara", model="explicit", hold=("Fs1=0.4",))
    assert fit.parameters["Fv1"].value > 1.2 * ideal.truth["Fv1"]


def test_predictions_and_written_files_contain_what_is_held(run, tmp_path):
    fit = idbench.fit(run.log, "scara", model="explicit", hold=("links=file", "Fs2=0.12"))
    fit.write(tmp_path / "arm.xml", tmp_path / "arm.py")
    written = Robot.load(str(tmp_path / "arm.xml"))
    q, qd, qdd = np.random.default_rng(0).uniform(-1, 1, (3, 20, 2))
    torque = inverse_dynamics(written, q, qd, qdd) + coulomb_torque(written, qd)
    np.testing.assert_allclose(fit.predict(q, qd, qdd), torque, rtol=1e-6, atol=1e-9)
    space = {}
    exec((tmp_path / "arm.py").read_text(), space)
    np.testing.assert_allclose(space["inverse_dynamics"](q, qd, qdd), torque, rtol=1e-6, atol=1e-9)
    assert written.model.dof_frictionloss[1] == pytest.approx(0.12)


def test_known_parameters_of_another_robot_by_their_kinds():
    robot_model = of("armatures=file", "friction=file", robot="panda")
    assert all(p.kind not in ("rotor inertia", "viscous friction", "Coulomb friction") for p in robot_model.basis.parameters)


def test_words_are_data():
    assert Known.of(("Ia3=0.1", "Fs2=file", "links=file")) == Known(("links",), {"Ia3": 0.1, "Fs2": None})


@pytest.fixture(scope="module")
def same_motors():
    """A log of a SCARA whose joints have the same friction."""

    def edit(spec):
        for joint in spec.joints:
            joint.damping = [[0.07], [0.0], [0.0]]
            joint.frictionloss = 0.3

    moves = RandomMoves(moves=12, durations=(1.0, 1.3), rest=1.0, seed=3)
    robot = Robot.load("scara", edit)
    return ideal_log(robot, moves.sample(robot, 100.0))


@pytest.mark.parametrize("model", [MODELS[0], *MODELS[2:]])
def test_what_is_tied_is_one_parameter(same_motors, model, tmp_path):
    fit = idbench.fit(same_motors, "scara", model=model, tie=("Fv2=Fv1", "Fs2=Fs1"))
    assert not {"Fv2", "Fs2"} & set(fit.parameters)
    assert fit.parameters["Fv1"].value == pytest.approx(0.07, rel=1e-3)
    assert fit.parameters["Fs1"].value == pytest.approx(0.3, rel=1e-3)
    fit.write(tmp_path / "arm.xml")
    written = Robot.load(str(tmp_path / "arm.xml")).model
    np.testing.assert_allclose(written.dof_damping, 0.07, rtol=1e-3)
    np.testing.assert_allclose(written.dof_frictionloss, 0.3, rtol=1e-3)


def test_a_tied_column_is_the_sum_of_both(rng):
    q, qd, qdd = rng.uniform(-1, 1, (3, 2, 20))
    state = State(q, qd, lambda _: qdd)
    tied = RobotModel("scara", Parameters(tie=("Fv2=Fv1",))).basis
    place = tied.names.index("Fv1")
    columns = {row: column for (row, at), column in tied.explicit(state).items() if at == place}
    np.testing.assert_array_equal(columns[0], qd[0])
    np.testing.assert_array_equal(columns[1], qd[1])
