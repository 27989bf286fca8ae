"""Every estimator that the field uses, on closed loops whose truth is known."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy

from experiments.identification.identified import Identified
from experiments.identification.simulators import RobotPlant, ScenarioLoop
from experiments.identification.subject import Subject
from identify import (
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
from identify.estimators import (
    DirectInverse,
    InstrumentalVariables,
    IterativelyReweighted,
    RecursiveLeastSquares,
    TotalLeastSquares,
    UnscentedKalmanFilter,
)
from identify.signals.wild_samples import without_wild_samples
from sim.controllers import PDFeedforward
from sim.encoders import IncrementalEncoder
from sim.engine.simulation import simulate
from sim.scenario.measurement import TorqueMeasurement
from sim.scenario.scenario import Timing
from sim.scenario.scenario_file import load
from sim.trajectories import RandomMoves

MOVES = RandomMoves(moves=12, durations=(1.3, 1.3), rest=0.7, seed=1)
WIDE = replace(idbench_chain(), operator=replace(idbench_chain().operator, cutoff=20.0))
"""The chain with a band up to 20 Hz, which lets the noise of accelerations through."""


def loop_of(scenario, log, start=None):
    return Simulation(ScenarioLoop.of(Subject(), (scenario,), (log,)), RobotPlant(Subject()), start)


def closed(bits=None, runs=1, **parts):
    """Return a scenario, and the log of its runs."""
    encoder = {} if bits is None else {"encoder": IncrementalEncoder(lines=2 ** (bits - 2))}
    scenario = replace(load("ideal"), **({"trajectory": MOVES} | encoder | parts))
    log = simulate(scenario, range(runs)).log
    return scenario, log if runs > 1 else log.run((0,))


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


@pytest.mark.parametrize("name", ["IV", "DIDIM"])
def test_five_simulations_are_enough_from_inertias_that_are_half(name, sixteen, off, truth):
    """The first round's controller knows the robot, so that it follows the motion."""
    scenario, log = sixteen
    found = identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name), simulation=loop_of(scenario, log, off))
    assert found.simulations <= 5
    assert np.abs((found.X - truth) / found.best_sigma).max() < 4
    assert np.abs(found.X / truth - 1)[[0, 3, 4]].max() < 1e-3
    np.testing.assert_array_equal(found.path[0], off)


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


def test_total_least_squares_refuses_where_noise_hides_the_answer():
    """With ten bits up to 20 Hz columns of W are noise."""
    with pytest.raises(IdentificationError, match="total least squares has no answer"):
        identify(closed(10)[1], scara(), ExplicitModel(), WIDE, TotalLeastSquares())


def test_noise_in_W_does_not_matter_with_16_bits(sixteen):
    way = InstrumentalVariables()
    test = noise_in_rows(identify(sixteen[1], scara(), ExplicitModel(), estimator=way, simulation=loop_of(*sixteen)))
    assert not test.matters
    assert np.abs(test.off).max() < 0.1


@pytest.mark.parametrize("part", [{"controller": PDFeedforward(bandwidth=18.0)}, {"timing": Timing(delay=0.01)}])
def test_a_wrong_loop_makes_didim_wrong_and_iv_not(part, sixteen, truth):
    """Gains 44 % higher, or a sample of delay: instruments that are a little off leave no more than chance, four sigma."""
    scenario, log = sixteen
    problem = Problem((log,), scara(), ExplicitModel(), idbench_chain(), loop_of(replace(scenario, **part), log))
    iv, didim = (estimate(problem, way) for way in (InstrumentalVariables(), DirectInverse()))
    assert np.abs((iv.X - truth) / iv.corrected_sigma).max() < 4
    assert np.abs(iv.X / truth - 1).max() < 0.02
    assert np.abs((didim.X - truth) / didim.best_sigma).max() > 6
    assert np.abs(didim.X / truth - 1).max() > 5 * np.abs(iv.X / truth - 1).max()


def test_several_logs_with_a_loop_each_are_one_fit_and_looked_at_one_by_one(sixteen):
    """Two logs know more than each; each alone has the parameters and the sigma of both, and needs no loop."""
    scenario, log = sixteen
    second = replace(scenario, trajectory=replace(MOVES, seed=4, moves=6))
    both = (log, scenario), (simulate(second).alone(), second)
    whole, *alone = (
        Identified(tuple(log for log, _ in some), estimator="IV", models=("explicit",), loops=tuple(loop for _, loop in some))
        for some in (both, both[:1], both[1:])
    )
    sigma, *each = (found.estimates["explicit"].corrected_sigma for found in (whole, *alone))
    assert all((sigma < one).all() for one in each)
    seen = whole.on(1)
    np.testing.assert_array_equal(seen.estimates["explicit"].best_sigma, sigma)
    assert len(seen.problem.rows.time) == len(alone[1].problem.rows.time)


def test_every_estimator_finds_what_didim_finds_from_the_same_torques(sixteen, truth):
    """CLIE minimises what DIDIM has the fixed point of; their difference is below both sigmas."""
    scenario, log = closed(16, trajectory=replace(MOVES, moves=5))
    simulation = loop_of(scenario, log)
    input_error, direct = (
        identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name), simulation=simulation)
        for name in ("CLIE", "DIDIM")
    )
    assert np.abs((input_error.X - direct.X) / direct.best_sigma).max() < 2
    assert input_error.simulations % 9 == 1  # p + 1 a round, after one of DIDIM


@dataclass(frozen=True)
class Standing(AbstractLoop):
    """A loop that moves nothing, or fails."""

    log: MotionLog
    why: str = ""

    def repeat(self, X, *, informed=False):
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
        ScenarioLoop.of(Subject(), (scenario,), (log, log))


@pytest.mark.parametrize(("name", "message"), [("IV", "--loop"), ("CLOE", "--loop"), ("OE", "the caller gave no simulator")])
def test_what_an_estimator_needs_is_asked_for(name, message, log):
    with pytest.raises(IdentificationError, match=message):
        identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name))


@pytest.mark.parametrize("name", ["CLIE", "CLOE", "OE", "UKF"])
def test_what_compares_signals_takes_the_explicit_model(name, sixteen):
    with pytest.raises(IdentificationError, match="take --model explicit"):
        identify(sixteen[1], scara(), PowerModel(), estimator=ESTIMATORS.create(name), simulation=loop_of(*sixteen))


@pytest.fixture(scope="module")
def noisy():
    """Eight logs with torque noise, and the same with one sample in fifty off: torques by 50 N m, positions by a degree."""
    rng, log = np.random.default_rng(3), closed(16, 8, torque=TorqueMeasurement(noise=(0.05, 0.005)))[1]
    where = [rng.random(log.q.shape) < 0.02 for _ in range(2)]
    tau = log.tau + where[0] * rng.uniform(-50, 50, log.tau.shape) * [1.0, 0.1]
    return log, replace(log, tau=tau), replace(log, tau=tau, q=log.q + where[1] * rng.uniform(-0.017, 0.017, log.q.shape))


def test_wild_samples_cost_less_than_twice_the_error(noisy, truth):
    """Typical error of eight runs. Ordinary least squares breaks, and weighted as well."""

    def error(log, name):
        X = identify(log, scara(), ExplicitModel(), estimator=ESTIMATORS.create(name)).X
        return np.exp(np.mean(np.log(np.sqrt(np.mean((X / truth - 1) ** 2, axis=0)))))

    clean, *wild = noisy
    assert error(clean, "IRLS") < 1.3 * error(clean, "WLS")
    assert all(error(log, "IRLS") < 2 * error(clean, "WLS") for log in wild)
    assert all(error(log, "OLS") > 50 * error(clean, "OLS") for log in wild)


def test_irls_has_an_honest_sigma(noisy, truth):
    """Of eight runs with eight parameters, to a quarter; with wild samples it says more than is wrong, never less."""
    clean, wild, _ = (identify(log, scara(), ExplicitModel(), estimator=IterativelyReweighted()) for log in noisy)
    rms = [np.sqrt(np.mean(((found.X - truth) / found.best_sigma) ** 2)) for found in (clean, wild)]
    assert rms[0] == pytest.approx(1, abs=0.25)
    assert 0.4 < rms[1] < 1.1


def test_wild_samples_are_found_and_no_others(rng):
    t = np.arange(2000) / 100
    smooth = np.sin(2 * t) + 1e-4 * rng.standard_normal(t.shape)
    where = np.array([100, 101, 500, 900, 1500])
    spoilt = smooth.copy()
    spoilt[where] += [0.5, -0.4, 0.01, -0.02, 2.0]
    found, marked = without_wild_samples(spoilt, 1e-5)
    assert marked[where].all()
    assert marked.sum() <= len(where) + 2  # a neighbour or two of those that are side by side
    assert np.abs(found - smooth)[where].max() < 2e-3
    assert not without_wild_samples(smooth, 1e-5)[1].any()


def test_total_least_squares_is_that_of_the_textbook(rng):
    """Van Huffel and Vandewalle: X of the last right singular vector, where all columns and Y have the same noise."""
    from identify.estimators.total_least_squares import _solved

    A = rng.standard_normal((200, 4))
    R, S = np.linalg.qr(A, mode="r"), 200 * 0.01 * np.eye(4)
    v = np.linalg.svd(A)[2][-1]
    with pytest.raises(IdentificationError, match="no answer"):
        _solved(R, S)  # of random numbers there is none
    A[:, 3] = A[:, :3] @ [1.0, -2.0, 0.5] + 0.1 * rng.standard_normal(200)
    v = np.linalg.svd(A)[2][-1]
    np.testing.assert_allclose(_solved(np.linalg.qr(A, mode="r"), S)[0], -v[:3] / v[3], rtol=1e-9)
    exact = S.copy()
    exact[:3, :3] = 0.0  # no noise in W: least squares
    np.testing.assert_allclose(_solved(np.linalg.qr(A, mode="r"), exact)[0], np.linalg.lstsq(A[:, :3], A[:, 3])[0], rtol=1e-9)


def test_a_joint_that_stands_most_of_the_time_has_no_wild_samples():
    """One move of 1.3 s in 12 s, in counts of 12 bits: where it moves counts jump, as they must."""
    t = np.arange(1200) / 100
    s = np.clip((t - 5) / 1.3, 0, 1)
    step = 2 * np.pi / 2**12
    counts = np.round((10 * s**3 - 15 * s**4 + 6 * s**5) / step) * step
    assert without_wild_samples(counts, 1e-5)[1].sum() == 0


def test_endless_memory_is_weighted_least_squares_and_a_short_one_knows_less(sixteen):
    problem = Problem((sixteen[1],), scara(), ExplicitModel(), idbench_chain())
    every, endless, short = (
        estimate(problem, e) for e in (WeightedLeastSquares(), RecursiveLeastSquares(1e9), RecursiveLeastSquares(3.0))
    )
    np.testing.assert_allclose(endless.X, every.X, rtol=1e-3)
    assert (short.corrected_sigma > endless.corrected_sigma).all()


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


def test_the_scatter_of_correlated_residuals(rng):
    """Residuals that an autoregression makes, against its closed form."""
    from identify.estimators.residual_scatter import scatter
    from identify.estimators.row_products import Kinds, with_weights

    N, a = 4000, 0.9
    white = rng.standard_normal((60, N))
    e = scipy.signal.lfilter([1.0], [1.0, -a], white)
    W = np.ones((60, N, 1))
    found = with_weights(e, W, np.ones((60, N)))
    sigma = np.sqrt(scatter(found, Kinds(1, np.ones((60, N))), [(slice(0, N), 100.0)])[:, 0, 0])
    assert np.mean(sigma) == pytest.approx(1 / (1 - a) / np.sqrt(N), rel=0.15)
    # A second kind that repeats the first three instants later: its G does so, too, or the other way round.
    late = np.stack([e, np.roll(e, 3, axis=-1)], axis=-1).reshape(60, -1)
    for lag in (3, -3):
        g = rng.standard_normal(N)
        G = np.stack([g, np.roll(g, lag)], axis=-1).reshape(-1, 1)
        one = replace(found, G=np.broadcast_to(G, (60, 2 * N, 1)), residual=late)
        made = np.sum(late * G[:, 0], axis=-1)
        variance = scatter(one, Kinds(2, np.ones((60, 2 * N))), [(slice(0, 2 * N), 100.0)])[:, 0, 0].mean()
        assert np.sqrt(variance) == pytest.approx(np.sqrt(np.mean(made**2)), rel=0.3)
    assert found.sigma.mean() < 0.4 * sigma.mean()
