"""Watching a run: what is handed on, and that nothing changes by it."""

import numpy as np
import pytest

from idbench.sim.engine.simulation import simulate
from idbench.sim.engine.watch import Watch
from idbench.sim.scenario.scenario_file import from_dict

MOTION = {"kind": "random", "moves": 1, "rest": 0.3}


def scenario(**settings):
    return from_dict({"name": "short", "trajectory": MOTION, **settings})


SWITCHED = {"kind": "switched", "pwm": 1000.0, "bandwidth": 150.0, "dead_time": 0.0, "duty_resolution": 0.0}

DRIVES = {
    "ideal": {"drive": {"kind": "ideal"}},
    "averaged": {"drive": {"kind": "averaged"}},
    "late": {"drive": {"kind": "averaged"}, "timing": {"delay": 0.0123}},
    "approach": {"drive": {"kind": "averaged"}, "start": [0.5, 0.5]},
    "fine": {"drive": {"kind": "averaged"}, "ripple": {"cogging": 1.0, "commutation": [0.02]}, "physics": {"step": 0.00025}},
    "fine and late": {
        "drive": {"kind": "averaged"},
        "ripple": {"cogging": 1.0},
        "physics": {"step": 0.00025},
        "timing": {"delay": 0.0123},
    },
    "switched": {"drive": SWITCHED, "ripple": {"cogging": 1.0}},
}


@pytest.mark.thorough
@pytest.mark.parametrize("every", [0.05, 0.37, np.inf])
@pytest.mark.parametrize("name", DRIVES)
def test_stretches_are_the_run_and_change_no_bit_of_it(name, every):
    described, heard = scenario(**DRIVES[name]), []
    alone, watched = simulate(described, [3, 4]), simulate(described, [3, 4], watch=Watch(heard.append, every))
    for part in ("q", "qd", "tau", "command"):
        np.testing.assert_array_equal(getattr(watched, part), getattr(alone, part))
        joined = np.concatenate([getattr(stretch, part) for stretch in heard])
        np.testing.assert_array_equal(joined, alone.__dict__[part][0])
    np.testing.assert_array_equal(np.concatenate([s.measured for s in heard]), alone.log.q[0])
    np.testing.assert_array_equal(np.concatenate([s.reference.q for s in heard]), alone.reference.q)
    assert [s.first for s in heard] == [0, *np.cumsum([len(s.q) for s in heard])[:-1]]
    if np.isfinite(every):
        assert len(heard) > 3
        assert {len(s.q) for s in heard[:-1]} == {round(every * 100)}
    else:
        assert len(heard) == 1


def test_it_is_heard_while_the_run_goes_on():
    times = []
    progress, heard = times.append, lambda stretch: times.append(f"samples from {stretch.first}")
    simulate(scenario(), watch=Watch(heard, 0.5), progress=progress)
    assert times.index("samples from 50") < next(k for k, t in enumerate(times) if isinstance(t, float) and t > 0.9)


@pytest.mark.parametrize("name", ["averaged", "late", "approach"])
def test_the_mean_current_is_the_mean_torque_over_the_torque_constant(name):
    """Without ripple: the motor's torque comes from the run, its current from the drive."""
    heard = []
    run = simulate(scenario(**DRIVES[name]), watch=Watch(heard.append))
    K = run.robots[0].motors.K
    np.testing.assert_allclose(heard[0].electric.current * K, run.tau[0], rtol=1e-12, atol=1e-12 * np.abs(run.tau).max())


def test_currents_that_hold_for_several_steps_are_told_for_each():
    """With ripple and fine steps the motors' torque differs from step to step, and the drive's current is a mean over some."""
    heard = []
    run = simulate(scenario(**DRIVES["fine"]), watch=Watch(heard.append, np.inf, (0.0, 9.0)))
    inner, K, V = heard[0].inner, run.robots[0].motors.K, run.robots[0].motors.V
    np.testing.assert_allclose(inner.tau.reshape(-1, 40, 2).mean(axis=1), run.tau[0], rtol=1e-9, atol=1e-9)
    per_sample = inner.electric.current.reshape(-1, 40, 2).mean(axis=1)
    np.testing.assert_allclose(heard[0].electric.current, per_sample, rtol=1e-9, atol=1e-9)
    assert np.abs(run.tau[0] - K * per_sample).max() > 0.1  # cogging needs no current
    coarse = []
    simulate(scenario(drive={"kind": "averaged"}), watch=Watch(coarse.append))
    # Ripple apart, voltages are those of the same motion with coarse steps: back-EMF and resistance, not L times a false rate.
    assert np.abs(heard[0].electric.voltage - coarse[0].electric.voltage).max() < 0.02 * V.max()


def test_the_mean_voltage_of_a_chopper_without_dead_time_is_its_duty_times_the_bus():
    """The voltage is computed from current and speed, the duty is what the loop asked for: two routes."""
    heard = []
    run = simulate(scenario(drive=SWITCHED), watch=Watch(heard.append, np.inf, (0.0, 10.0)))
    inner, V = heard[0].inner, run.robots[0].motors.V
    np.testing.assert_allclose(inner.electric.voltage, inner.electric.duty * V, atol=1e-9 * V.max())
    np.testing.assert_allclose(inner.t, np.arange(len(inner.t)) / 1000, atol=1e-12)
    np.testing.assert_allclose(inner.tau, inner.electric.current * run.robots[0].motors.K, rtol=1e-12, atol=1e-12)


def test_the_averaged_drive_holds_its_voltage_equation_from_sample_to_sample():
    """R i + L di/dt + K qd = v in the mean; at rest under no load all are zero."""
    heard = []
    run = simulate(scenario(**DRIVES["averaged"]), watch=Watch(heard.append))
    electric, m = heard[0].electric, run.robots[0].motors
    slow = np.gradient(electric.current, 0.01, axis=0)  # coarse: inductance makes less than a hundredth of the voltage
    mean_speed = np.diff(run.q[0], axis=0) / 0.01
    told = (m.R * electric.current + m.L * slow)[:-1] + m.K * mean_speed
    assert np.abs(electric.voltage[:-1] - told).max() < 0.02 * np.abs(told).max()


def test_limits_are_told_where_more_is_asked_than_there_is():
    free, heard = simulate(scenario(drive={"kind": "averaged"})), []
    K = free.robots[0].motors.K
    most = 0.9 * np.abs(free.command[0]).max(axis=0) / K
    run = simulate(scenario(drive={"kind": "averaged", "current_limit": most.tolist()}), watch=Watch(heard.append))
    limited = heard[0].electric.limited > 0
    np.testing.assert_array_equal(limited, np.abs(run.command[0]) > most * K)
    assert limited.any()
    assert not limited.all()


def test_a_drive_without_currents_tells_none():
    heard = []
    simulate(scenario(), watch=Watch(heard.append, 0.5, (0.0, 1.0)))
    assert all(stretch.electric is None and stretch.inner is None for stretch in heard)


def test_the_window_is_on_the_time_of_the_log():
    """Also when the arm is brought to its start before the log begins."""
    heard = []
    simulate(scenario(drive=SWITCHED, start=[0.5, 0.5]), watch=Watch(heard.append, 0.1, (0.25, 0.45)))
    t = np.concatenate([s.inner.t for s in heard if s.inner])
    np.testing.assert_allclose(t, 0.25 + np.arange(200) / 1000, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("drive", [SWITCHED, SWITCHED | {"dead_time": 2e-6}, SWITCHED | {"modulation": "unipolar"}])
def test_between_the_edges_the_current_is_that_of_the_period(drive):
    """It begins where the period before ends, its mean is that of the period, and so is that of the voltage."""
    heard, h = [], 1e-3
    simulate(scenario(drive=drive), watch=Watch(heard.append, np.inf, (0.5, 0.6)))
    inner = heard[0].inner
    t, current, voltage = (np.moveaxis(x, 0, -1) for x in inner.edges)
    assert (np.diff(t) >= -1e-15).all()
    np.testing.assert_allclose(t[..., -1], h, rtol=1e-12)
    np.testing.assert_allclose(current[1:, :, 0], current[:-1, :, -1], atol=1e-9)
    parts = t.shape[-1] // 3
    a, b, c = (current.reshape(*t.shape[:2], parts, 3)[..., k] for k in range(3))
    dt = np.diff(t.reshape(*t.shape[:2], parts, 3)[..., [0, 2]])[..., 0]
    mean = np.sum(dt * (a + 4 * b + c) / 6, axis=-1) / h  # Simpson's rule: exponentials over a quarter of L/R
    np.testing.assert_allclose(mean, inner.electric.current, rtol=1e-4, atol=1e-5)
    pulses = np.sum(dt * voltage.reshape(*t.shape[:2], parts, 3)[..., 0], axis=-1) / h
    np.testing.assert_allclose(pulses, inner.electric.voltage, rtol=1e-9, atol=1e-9)


def test_what_is_heard_of_the_log_is_what_comes_into_it():
    """Noise, gain, offset and converter included, from stretch to stretch."""
    torque = {"noise": [0.1], "gain_error": [0.02], "offset": [0.3], "resolution": [0.01]}
    heard, described = [], scenario(torque=torque, start=[0.5, 0.5])
    run = simulate(described, [5, 6], watch=Watch(heard.append, 0.37))
    np.testing.assert_array_equal(np.concatenate([stretch.logged for stretch in heard]), run.log.tau[0])
