"""Servos: samples that were not read well, parts left out, laws compared, and what a fit lacks."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
from builders import pendulum

from idbench.identify.servo import SERVO_FRICTIONS, JointLoad, Servo, ServoRun, identify_again, identify_servo
from idbench.identify.servo.choice import choose_friction, residuals_by_state
from idbench.identify.servo.closed_loop import ServoLoop, count_of
from idbench.identify.servo.mistakes import MISTAKES, mistake_of
from idbench.identify.servo.search import ServoSearch

SERVO = Servo(0.166, 16.0, supply=12.0, limit=0.97, counts=4096)
LAW = {"a": 0.6, "b": 1.2, "Ia": 0.02, "Fs": 0.1, "Fv": 0.02, "offset": 0.0, "delay": 0.02, "rate": 4.5}


def simulated(seed: int, load: JointLoad | None = None, **law: float) -> ServoRun:
    """Return a run of 14 s in counts, simulated finely from commands alone: of an arm with torque off twice, or of a load."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 14, 0.01)
    command = rng.uniform(-1.3, 1.3, 14)[t.astype(int)]
    on = ~(((t > 4) & (t < 5)) | ((t > 9) & (t < 10))) if load is None else None
    run = ServoRun(t, np.linspace(0, 1e-3, len(t)), command, load or pendulum(0.6, 0.12), SERVO, on)
    q = ServoLoop([replace(run, q=0 * t)], 2.5e-4).simulate(LAW | law)[0, 0]
    return replace(run, q=np.rint(q / SERVO.count) * SERVO.count)


@pytest.fixture(scope="module")
def run() -> ServoRun:
    return simulated(0)


@pytest.fixture(scope="module")
def fit(run):
    return identify_servo([run], "coulomb")


@pytest.mark.thorough
def test_spikes_of_the_bus_are_left_out(run, fit):
    places = np.array([130, 131, 700, 1111])
    q = run.q.copy()
    q[places] = -np.pi
    spoilt = replace(run, q=q)
    assert np.flatnonzero(~spoilt.read_well).tolist() == places.tolist()
    assert run.read_well.all()
    found = identify_servo([spoilt], "coulomb")
    for name, sigma in fit.standard_errors.items():
        assert abs(found.p[name] - fit.p[name]) < sigma, name
    assert found.errors([spoilt])[0] < 2 * fit.errors([run])[0]


def test_a_joint_that_rests_and_flickers_has_no_spikes():
    t = np.arange(0, 1, 0.01)
    q = SERVO.count * (np.arange(100) % 7 == 0)
    assert ServoRun(t, q, 0 * t, pendulum(0.6, 0.12), SERVO).read_well.all()


@pytest.mark.thorough
def test_a_fit_without_a_piece_is_that_of_the_others(fit):
    """The jackknife's step against the search without the piece, where it matters most."""
    runs, left = fit.loop.runs, fit.left_out
    assert len(left.costs) % len(runs) == 0
    worst = int(left.costs[: len(runs)].argmax())
    others = ServoLoop([x for k, x in enumerate(runs) if k != worst], fit.loop.h)
    without = ServoSearch(others, fit.free, fit.excitation.scales, 3 * fit.scale).best(fit.p, 10).p
    sigma = fit.standard_errors
    assert max(abs(without[name] - fit.p[name]) / sigma[name] for name in fit.free) < 3
    assert np.isfinite(left.covariance).all()
    assert (np.linalg.eigvalsh(left.covariance) > 0).all()


@pytest.mark.thorough
@pytest.mark.parametrize(("law", "expected"), [({}, {"coulomb"}), ({"Fl": 0.15}, {"load", "load-stribeck", "directional"})])
def test_the_law_that_the_log_needs_is_chosen(law, expected):
    choice = choose_friction([simulated(1, **law)])
    assert choice.chosen in expected
    assert set(choice.fits) == set(SERVO_FRICTIONS)


@pytest.mark.thorough
def test_a_law_that_is_compared_is_fitted_as_if_it_were_asked_for(run):
    """With a further parameter each law begins at the simpler one, whoever asks."""
    choice = choose_friction([run], ("lead",))
    assert choice.fits["load"].p == identify_servo([run], "load", ("lead",)).p


@pytest.mark.thorough
def test_a_fit_says_where_it_lacks(fit):
    """A brake that the model does not have, while torque is off."""
    braked = simulated(0, Fo=0.1)
    lacking = identify_servo([braked], "coulomb", held={"a": 0.6, "Fs": 0.1, "Fv": 0.02})
    assert residuals_by_state(lacking)[0].when == "torque is off"
    assert sum(lack.share for lack in residuals_by_state(lacking)) == pytest.approx(1.0, abs=0.03)
    assert residuals_by_state(lacking)[0].error > 2 * residuals_by_state(fit)[0].error


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [2, 5, 9])
def test_a_light_rotor_is_not_taken_for_a_late_command(seed):
    """With a link of a tenth of the torque, searches from the rows alone end without an armature, at twice the delay."""
    # So light a load may leave the scale open, not the delay.
    fit = identify_servo([simulated(seed, pendulum(0.1, 0.06))], "coulomb")
    assert abs(fit.p["delay"] - LAW["delay"]) < 3 * fit.standard_errors["delay"]
    assert fit.p["Ia"] / fit.p["a"] == pytest.approx(LAW["Ia"] / LAW["a"], rel=0.02)  # the other valley has no Ia
    assert fit.p["a"] == pytest.approx(LAW["a"], rel=0.06)  # a search of all parameters ended 11 % away


@pytest.mark.parametrize("name", ["a", pytest.param("Ia", marks=pytest.mark.thorough)])
def test_of_a_joint_without_a_load_one_parameter_sets_the_scale(name):
    none = np.array(0.0)
    run = simulated(3, JointLoad(none, none, none, none))
    bare = identify_servo([run], "coulomb")
    assert not bare.scaled
    assert bare.p["Fs"] / bare.p["a"] == pytest.approx(LAW["Fs"] / LAW["a"], rel=0.05)
    fit = identify_servo([run], "coulomb", held={name: LAW[name]})
    assert fit.scaled
    for other, true in {**LAW, "b": LAW["b"] + LAW["Fv"]}.items():
        if other in fit.standard_errors:
            assert abs(fit.p[other] - true) < 4 * fit.standard_errors[other] + 0.01 * abs(true), other


@pytest.mark.thorough
def test_a_parameter_of_a_further_law_may_be_known(run):
    fit = identify_servo([run], "load", held={"Fl": 0.0})
    assert fit.p["Fl"] == 0
    assert "Fl" not in fit.free
    assert fit.p["Fs"] == pytest.approx(LAW["Fs"], abs=4 * fit.standard_errors["Fs"])


@pytest.mark.thorough
def test_a_joint_of_which_the_load_does_not_set_the_scale_says_so():
    """A load of a fiftieth of the friction: half as much again of all torques moves the joint nearly alike."""
    run = simulated(3, pendulum(0.02, 0.03))
    fit = identify_servo([run], "coulomb")
    assert not fit.scaled
    assert fit.factor[0] < LAW["a"] / fit.p["a"] < fit.factor[1]
    assert identify_servo([run], "coulomb", held={"a": LAW["a"]}).p["Fs"] == pytest.approx(LAW["Fs"], rel=0.1)


def test_positions_at_rest_are_whole_counts_where_the_log_has_them(run):
    """What a joint does between counts at rest, no log in counts says."""
    assert count_of([run]) == SERVO.count
    assert count_of([replace(run, q=run.q + 0.3 * SERVO.count * np.sin(run.t))]) == 0
    plain, counted = (ServoLoop([run], 1e-3, count).simulate(LAW)[0, 0] / SERVO.count for count in (0.0, SERVO.count))
    whole = np.isclose(counted, np.rint(counted), rtol=0, atol=1e-9)
    rests = np.append(np.diff(plain) == 0, False)
    assert rests.mean() > 0.2
    assert whole[rests].mean() > 0.95  # but for a sample before or after a motion
    np.testing.assert_allclose(counted[~whole], plain[~whole])


@pytest.mark.thorough
def test_a_fit_again_keeps_its_parameters_and_what_is_held(run):
    fit = identify_servo([run], "coulomb", held={"Ia": 0.02})
    again = identify_again(fit, [run])
    assert again.free == fit.free
    assert again.p["Ia"] == 0.02
    for name, sigma in fit.standard_errors.items():
        assert abs(again.p[name] - fit.p[name]) < 2 * sigma, name


@pytest.mark.thorough
def test_gravity_that_the_file_lacks_needs_a_torque_that_is_known(run):
    """With gravity free, the known inertia alone sets the scale, and an armature makes up for that exactly."""
    assert not identify_servo([run], "coulomb", ("Mg",)).scaled
    fit = identify_servo([run], "coulomb", ("Mg",), {"a": LAW["a"]})
    assert abs(fit.p["Mg"]) < 4 * fit.standard_errors["Mg"]


@pytest.mark.thorough
def test_a_friction_next_to_nothing_sets_no_scale():
    assert not identify_servo([simulated(2, pendulum(0.1, 0.06))], "coulomb", held={"Fs": 1e-6}).scaled


@pytest.mark.thorough
def test_where_no_parameter_has_an_effect_no_other_valley_is_tried(fit):
    search = ServoSearch(fit.loop, fit.free, fit.excitation.scales, fit.scale)
    nothing = replace(fit.found.beginnings, K=np.zeros_like(fit.found.beginnings.K))
    still = replace(fit.found, sensitivity=np.zeros_like(fit.found.sensitivity), beginnings=nothing)
    assert search.axis_points(still) == [fit.p]


WRONG = {
    "gain_error": (lambda run: replace(run, servo=replace(SERVO, kp=8.0)), 1.0),
    "scale_error": (lambda run: replace(run, command=1.05 * run.command), 1 / 1.05 - 1),
    "zero": (lambda run: replace(run, command=run.command + 0.1), -0.1),
}
"""What is made wrong, and the size of the parameter that makes it right."""


@pytest.mark.thorough
@pytest.mark.parametrize("letter", WRONG)
def test_a_mistake_is_named_with_its_size(letter):
    spoil, size = WRONG[letter]
    found = mistake_of(identify_servo([spoil(simulated(0))], "coulomb"))
    assert found is not None
    assert found.cause == MISTAKES[letter]
    assert found.size[0] == pytest.approx(size, rel=0.05)
    assert found.held_out[1] < 0.2 * found.held_out[0]


def smoothed(run):
    """Return a run whose positions are low-passed before they are logged, as by a driver."""
    return replace(run, q=scipy.signal.lfilter([0.3], [1.0, -0.7], run.q, zi=[0.7 * run.q[0]])[0])


@pytest.mark.thorough
@pytest.mark.parametrize("run", [lambda: simulated(1), lambda: smoothed(simulated(0))], ids=["right", "smoothed"])
def test_what_is_no_mistake_of_the_table_is_not_named_as_one(run):
    assert mistake_of(identify_servo([run()], "coulomb")) is None


def test_a_log_that_begins_in_motion_is_judged_from_where_its_beginning_does_not_matter():
    """The same motion from its beginning, and from its middle on, where the target is on its way."""
    run = simulated(4)
    fit = identify_servo([run], "coulomb", held={name: x for name, x in LAW.items() if name not in ("offset", "delay")})
    moving = int(np.argmax(np.abs(np.gradient(run.q, run.t)) > 3.0)) + 5  # in the middle of a move
    parts = {name: x[moving:] for name in ("t", "q", "command", "on") if (x := getattr(run, name)) is not None}
    late = replace(run, **parts)
    assert 0 < np.argmax(fit.follows([late])[0]) < len(late.t) // 2
    assert fit.errors([late])[0] < 1.5 * fit.errors([run])[0] + SERVO.count / 4
    naive = np.abs(ServoLoop([late], fit.loop.h).simulate(fit.p)[0, 0] - late.q).mean()
    assert naive > 2 * fit.errors([late])[0]
