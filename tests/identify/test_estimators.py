"""Every estimator that the field uses, on closed loops whose truth is known."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders import MOVES, closed

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.identification.simulators import RobotPlant, ScenarioLoop
from idbench.identify import (
    ESTIMATORS,
    AbstractLoop,
    ExplicitModel,
    IdentificationError,
    MotionLog,
    PowerModel,
    Problem,
    Simulated,
    Simulation,
    WeightedLeastSquares,
    estimate,
    idbench_chain,
    identify,
    noise_in_rows,
    scara,
)
from idbench.identify.estimators import (
    DirectInverse,
    InstrumentalVariables,
    RecursiveLeastSquares,
    UnscentedKalmanFilter,
)
from idbench.identify.signals.prefilters import NoPrefilter
from idbench.sim.controllers import PDFeedforward
from idbench.sim.encoders import IncrementalEncoder
from idbench.sim.engine.simulation import simulate
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.scenario.measurement import TorqueMeasurement
from idbench.sim.scenario.scenario import Timing
from idbench.sim.scenario.scenario_file import load

WIDE = replace(idbench_chain(), prefilter=NoPrefilter(), operator=replace(idbench_chain().operator, cutoff=20.0))
"""The chain with a band up to 20 Hz, which lets the noise of accelerations through."""


def loop_of(scenario, log, start=None):
    return Simulation(ScenarioLoop.of(RobotModel(), (scenario,), (log,)), RobotPlant(RobotModel()), start)


@pytest.fixture(scope="module")
def sixteen():
    return closed(16)


@pytest.fixture(scope="module")
def twelve():
    return closed(12)


@pytest.fixture(scope="module")
def off(truth):
    """The true parameters, inertias half of what they are."""
    return truth * [0.5, 1, 1, 0.5, 0.5, 0.5, 1, 1]


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["IV", "DIDIM"])
def test_five_simulations_are_enough_from_inertias_that_are_half(name, sixteen, off, truth):
    """The first round's controller knows the robot, so that it follows the motion."""
    scenario, log = sixteen
    found = identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name), simulation=loop_of(scenario, log, off))
    assert found.simulations <= 5
    assert np.abs((found.X - truth) / found.standard_errors).max() < 4
    assert np.abs(found.X / truth - 1)[[0, 3, 4]].max() < 1e-3
    np.testing.assert_array_equal(found.path[0], off)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "most"), [("IV", 3), ("DIDIM", 6)])
def test_six_joints_take_no_more_than_six(name, most):
    """Positions to 1.75e-5 rad, torques to 0.05 N m: errors are then those of the noise."""
    birdy = load("excited/puma560-birdy")
    scenario = replace(birdy, encoder=IncrementalEncoder(lines=2**22, noise=1.75e-5), torque=TorqueMeasurement(noise=0.05))
    robot_model, log = RobotModel("puma560"), simulate(scenario).alone()
    standard, grouping = standard_parameters(robot_model.robot), robot_model.grouping
    values = np.array([standard[name] for name in grouping.standard.names])
    inertia = np.array([re.fullmatch(r"([XYZ]{2}|Ia)\d", name) is not None for name in grouping.standard.names])
    truth, start = grouping.base(values), grouping.base(np.where(inertia, 0.5, 1.0) * values)
    simulation = Simulation(ScenarioLoop.of(robot_model, (scenario,), (log,)), start=start)
    found = identify(log, robot_model.basis, ExplicitModel(), estimator=ESTIMATORS.create(name), simulation=simulation)
    assert found.simulations <= most
    assert np.sqrt(np.mean(((start - truth) / found.standard_errors) ** 2)) > 10
    assert np.sqrt(np.mean(((found.X - truth) / found.standard_errors) ** 2)) < 2


@pytest.mark.thorough
def test_instrumental_variables_take_the_noise_out_of_W(twelve, truth):
    """12-bit counts up to 20 Hz: least squares loses inertia to the noise of its accelerations; scaled TLS gets most of it."""
    simulation = loop_of(*twelve)
    names = "WLS", "IV", "DIDIM", "TLS"
    found = {
        name: identify(twelve[1], scara(), ExplicitModel(), WIDE, ESTIMATORS.create(name), simulation=simulation)
        for name in names
    }
    error = {name: np.abs(one.X / truth - 1)[0] for name, one in found.items()}
    assert error["WLS"] > 0.1
    assert error["TLS"] < 0.5 * error["WLS"]
    assert max(error["IV"], error["DIDIM"]) < 0.1 * error["WLS"]
    test = noise_in_rows(found["IV"])
    assert test.matters
    assert test.off[0] < -3  # least squares finds too small an inertia


@pytest.mark.thorough
def test_noise_in_W_does_not_matter_with_16_bits(sixteen):
    way = InstrumentalVariables()
    test = noise_in_rows(identify(sixteen[1], scara(), ExplicitModel(), estimator=way, simulation=loop_of(*sixteen)))
    assert not test.matters
    assert np.abs(test.off).max() < 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("part", [{"controller": PDFeedforward(bandwidth=18.0)}, {"timing": Timing(delay=0.01)}])
def test_a_wrong_loop_makes_didim_wrong_and_iv_not(part, sixteen, truth):
    """Gains 44 % higher, or a sample of delay: instruments that are a little off leave no more than chance, four sigma."""
    scenario, log = sixteen
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain(), loop_of(replace(scenario, **part), log))
    iv, didim = (estimate(problem, way) for way in (InstrumentalVariables(), DirectInverse()))
    assert np.abs((iv.X - truth) / iv.calibrated_sigma).max() < 4
    assert np.abs(iv.X / truth - 1).max() < 0.02
    assert np.abs((didim.X - truth) / didim.standard_errors).max() > 6
    assert np.abs(didim.X / truth - 1).max() > 5 * np.abs(iv.X / truth - 1).max()


@pytest.mark.thorough
def test_several_logs_with_a_loop_each_are_one_fit_and_looked_at_one_by_one(sixteen):
    """Two logs know more than each; each alone has the parameters and the sigma of both, and needs no loop."""
    scenario, log = sixteen
    second = replace(scenario, trajectory=replace(MOVES, seed=4, moves=6))
    both = (log, scenario), (simulate(second).alone(), second)
    whole, *alone = (
        fit(
            Request(method=Method.named(estimator="IV"), models=("explicit",), loops=tuple(loop for _, loop in some)),
            Logs(tuple(log for log, _ in some)),
        )
        for some in (both, both[:1], both[1:])
    )
    sigma, *each = (found.estimates["explicit"].calibrated_sigma for found in (whole, *alone))
    assert all((sigma < one).all() for one in each)
    seen = whole.on(1)
    np.testing.assert_array_equal(seen.estimates["explicit"].standard_errors, whole.estimates["explicit"].standard_errors)
    assert len(seen.problem.rows.time) == len(alone[1].problem.rows.time)


@pytest.mark.thorough
def test_every_estimator_finds_what_didim_finds_from_the_same_torques(sixteen, truth):
    """CLIE minimises what DIDIM has the fixed point of; their difference is below both sigmas."""
    scenario, log = closed(16, trajectory=replace(MOVES, moves=5))
    simulation = loop_of(scenario, log)
    input_error, direct = (
        identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name), simulation=simulation)
        for name in ("CLIE", "DIDIM")
    )
    assert np.abs((input_error.X - direct.X) / direct.standard_errors).max() < 2
    assert input_error.simulations % 9 == 1  # p + 1 a round, after one of DIDIM


@dataclass(frozen=True)
class Standing(AbstractLoop):
    """A loop that moves nothing, or fails."""

    log: MotionLog
    why: str = ""

    def repeat(self, X, *, informed=False, exact=True):
        still = replace(self.log, q=np.zeros_like(self.log.q))
        return Simulated((still,), {(): self.why} if self.why else {})


@pytest.mark.parametrize(("why", "message"), [("joint1 runs away", "joint1 runs away"), ("", "joint 1 strays by")])
def test_a_loop_that_cannot_be_is_told(why, message, sixteen):
    with pytest.raises(IdentificationError, match=message):
        identify(
            sixteen[1], scara(), ExplicitModel(), estimator=DirectInverse(), simulation=Simulation(Standing(sixteen[1], why))
        )


def test_a_loop_of_another_motion_is_told(sixteen):
    scenario, log = sixteen
    other = loop_of(replace(scenario, trajectory=replace(MOVES, seed=2)), log)
    with pytest.raises(IdentificationError, match=r"the simulated motion of joint \d strays by"):
        identify(log, scara(), ExplicitModel(), estimator=InstrumentalVariables(), simulation=other)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"fs": 50.0}, "runs at 50 Hz, the log has 100 Hz"), ({"trajectory": replace(MOVES, moves=3)}, "it is of another motion")],
)
def test_a_loop_that_is_not_that_of_the_log_is_refused(change, message, sixteen):
    scenario, log = sixteen
    with pytest.raises(IdentificationError, match=message):
        loop_of(replace(scenario, **change), log)
    with pytest.raises(IdentificationError, match="1 loops are given for 2 logs"):
        ScenarioLoop.of(RobotModel(), (scenario,), (log, log))


@pytest.mark.parametrize("name", ["CLIE", "CLOE", "OE", "UKF"])
def test_what_compares_signals_takes_the_explicit_model(name, sixteen):
    with pytest.raises(IdentificationError, match="it has the explicit model alone"):
        identify(sixteen[1], scara(), PowerModel(), estimator=ESTIMATORS.create(name), simulation=loop_of(*sixteen))


def test_endless_memory_is_weighted_least_squares_and_a_short_one_knows_less(sixteen):
    problem = Problem((sixteen[1],), scara(), ExplicitModel(), idbench_chain())
    every, endless, short = (
        estimate(problem, e) for e in (WeightedLeastSquares(), RecursiveLeastSquares(1e9), RecursiveLeastSquares(3.0))
    )
    np.testing.assert_allclose(endless.X, every.X, rtol=1e-3)
    ratio = short.calibrated_sigma / endless.calibrated_sigma  # of single ones chance may leave more information at the end
    assert np.median(ratio) > 1.2
    assert ratio.min() > 0.8


@pytest.mark.thorough
def test_the_filter_finds_parameters_from_a_start_that_is_off(sixteen, truth):
    """15 % off, one pass."""
    start = truth * (1 + 0.15 * np.array([1, -1, 1, -1, 1, -1, 1, -1]))
    _, log = sixteen
    found = identify(log, scara(), ExplicitModel(), estimator=UnscentedKalmanFilter(), simulation=Simulation(start=start))
    assert np.abs(found.X / truth - 1)[[0, 3, 4]].max() < 0.005
    assert np.abs(found.X / truth - 1).max() < 0.1


def test_a_start_from_which_the_filter_diverges_is_told(sixteen):
    problem = Problem((sixteen[1],), scara(), ExplicitModel(), idbench_chain(), Simulation(start=np.full(8, 1e-9)))
    with pytest.raises(IdentificationError, match="diverges from this start"):
        estimate(problem, UnscentedKalmanFilter(1e-6))


@pytest.mark.parametrize("name", ESTIMATORS.builtin)
def test_messages_call_estimators_what_the_table_does(name):
    assert ESTIMATORS.create(name).called == name.split("-")[0]
