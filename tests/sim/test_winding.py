"""A winding behind an H-bridge against closed forms, a dense integration, and itself in batches."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from idbench.sim.drives import SwitchedDrive
from idbench.sim.drives import switched_drive as switched
from idbench.sim.drives.passages import ExactPassages, TabulatedPassages
from idbench.sim.drives.pwm import Modulator, pieces
from idbench.sim.drives.winding import Winding, pass_period
from idbench.sim.robot.robot import Robot

V, R, L, T = 160.0, 3.0, 0.012, 2e-4
INDEX = np.linspace(-0.96, 0.96, 49)


def winding(shape):
    return Winding(*(np.full(shape, x) for x in (V, R, L)))


def settled(modulation, m, e, dead_time=0.0):
    """Return the current at the start of a period that repeats itself, by the periods before it."""
    modulator, i = Modulator(modulation, T, dead_time), np.zeros_like(m)
    for _ in range(400):  # 20 time constants L/R
        i = pass_period(i, m, e, winding(m.shape), modulator).i
    return i, modulator


def through(i, m, e, modulator, points=4000):
    """Return the current at many instants of a period, piece by piece, each by its exponential."""
    cut = pieces(modulator, m)
    t, found, now = np.linspace(0, T, points), [], i
    for dt, level in zip(cut.duration, cut.forward, strict=True):
        goal = (level * V - e) / R
        found.append(goal + (now - goal) * np.exp(-np.linspace(0, 1, points // 8)[:, None] * dt * R / L))
        now = found[-1][-1]
    return np.concatenate(found), t


FORMS = {
    "unipolar": lambda m: V * abs(m) * (1 - abs(m)) * T / (2 * L),
    "sign_magnitude": lambda m: V * abs(m) * (1 - abs(m)) * T / L,
    "bipolar": lambda m: 2 * V * (1 + m) / 2 * (1 - m) / 2 * T / L,
}


@pytest.mark.parametrize("modulation", FORMS)
def test_current_ripple_is_that_of_the_closed_form(modulation):
    """Peak to peak within 2 % wherever the formula exceeds 5 % of its maximum; they neglect the resistance."""
    expected = FORMS[modulation](INDEX)
    # A motor that turns so fast that its back-EMF leaves the mean current at 10 A: away from zero, as the formulas are.
    e = INDEX * V - R * 10.0
    i, modulator = settled(modulation, INDEX, e)
    current, _ = through(i, INDEX, e, modulator)
    counted = expected > 0.05 * expected.max()
    np.testing.assert_allclose(np.ptp(current, axis=0)[counted], expected[counted], rtol=0.02)


@pytest.mark.parametrize("modulation", FORMS)
def test_rms_of_the_ripple_is_that_of_a_triangle(modulation):
    """A triangle's rms is its peak-to-peak value over 2 sqrt(3); unipolar pulses are two equal triangles a period."""
    m = np.array([0.3, 0.5, -0.4])
    e = m * V - R * 10.0
    i, modulator = settled(modulation, m, e)
    cut, now, squares = pieces(modulator, m), i, 0.0
    for dt, level in zip(cut.duration, cut.forward, strict=True):
        goal = (level * V - e) / R
        t = np.linspace(0, 1, 2001)[:, None] * dt
        ripple = goal + (now - goal) * np.exp(-t * R / L) - 10.0
        squares = squares + np.trapezoid(ripple**2, t, axis=0)
        now = ripple[-1] + 10.0
    np.testing.assert_allclose(np.sqrt(squares / T), FORMS[modulation](m) / (2 * np.sqrt(3)), rtol=0.02)


@pytest.mark.parametrize("modulation", FORMS)
def test_the_mean_current_is_that_of_the_mean_voltage(modulation):
    """A settled period: charge = (m V - e) T / R to 1e-6, since stored flux repeats itself."""
    e = INDEX * V - R * 10.0
    i, modulator = settled(modulation, INDEX, e)
    passage = pass_period(i, INDEX, e, winding(INDEX.shape), modulator)
    np.testing.assert_allclose(passage.charge / T, 10.0, rtol=1e-6)


@pytest.mark.parametrize("dead_time", [0.0, 1e-6])
@pytest.mark.parametrize("modulation", FORMS)
def test_charge_energy_and_current_are_those_of_a_dense_integration(modulation, dead_time):
    """Currents far from and through zero, motoring and braking; LSODA between edges, with diodes that block at zero."""
    rng = np.random.default_rng(3)
    i = np.concatenate([rng.uniform(-8, 8, 20), rng.uniform(-0.3, 0.3, 20), [0.0, 0.0]])
    m, e = rng.uniform(-0.9, 0.9, i.size), rng.uniform(-40, 40, i.size)
    modulator = Modulator(modulation, T, dead_time)
    passage = pass_period(i, m, e, winding(i.shape), modulator)
    for k in range(i.size):
        end, charge, energy = dense(i[k], m[k : k + 1], e[k], modulator)
        np.testing.assert_allclose(passage.i[k], end, atol=1e-9 + 1e-7)
        np.testing.assert_allclose(passage.charge[k], charge, atol=1e-6 * T * 8)
        np.testing.assert_allclose(passage.electrical[k], energy, atol=1e-6 * T * 8 * V)


def dense(i, m, e, modulator):
    """Integrate piece by piece: the voltage follows the sign of the current; at zero it stays unless a voltage drives it."""
    cut, charge, energy, now = pieces(modulator, m), 0.0, 0.0, i
    for duration, forward, backward in zip(cut.duration[:, 0], cut.forward[:, 0] * V, cut.backward[:, 0] * V, strict=True):
        dt = duration
        while dt > 1e-15:
            if now == 0.0 and forward <= e <= backward and forward != backward:
                break
            sign = np.sign(now) or (1.0 if forward > e else -1.0)
            v = forward if sign > 0 else backward

            def rate(t, y, v=v):
                return [(v - R * y[0] - e) / L, y[0], v * y[0]]

            def zero(t, y, sign=sign):
                return y[0] + sign * 1e-300

            zero.terminal, zero.direction = forward != backward, -sign
            found = solve_ivp(rate, (0, dt), [now, 0.0, 0.0], rtol=1e-11, atol=1e-14, events=zero, method="DOP853")
            charge, energy = charge + found.y[1, -1], energy + found.y[2, -1]
            now, dt = (0.0, dt - found.t[-1]) if found.status == 1 else (found.y[0, -1], 0.0)
    return now, charge, energy


def test_dead_time_takes_voltage_from_the_current_it_meets():
    """2 V t_d f for either modulation of two legs, against the sign of the current."""
    m, e = np.array([0.2, 0.2]), np.array([0.2 * V - 30, 0.2 * V + 30])  # 10 A and -10 A
    for modulation in ("unipolar", "bipolar"):
        i, modulator = settled(modulation, m, e, dead_time=1e-6)
        charge = pass_period(i, m, e, winding(m.shape), modulator).charge
        np.testing.assert_allclose(charge / T * R + e - m * V, [-2 * V * 1e-6 / T, 2 * V * 1e-6 / T], rtol=1e-6)


def test_a_window_of_a_batch_gives_the_same_bits(rng):
    """Alone, in pairs, all together, in another order."""
    i = np.concatenate([rng.uniform(-5, 5, 40), rng.uniform(-0.2, 0.2, 24)]).reshape(32, 2)
    m, e = rng.uniform(-0.9, 0.9, i.shape), rng.uniform(-30, 30, i.shape)
    modulator = Modulator("unipolar", T, 1e-6)
    together = pass_period(i, m, e, winding(i.shape), modulator)
    for rows in ([0], [31, 4], list(range(31, -1, -1))):
        alone = pass_period(i[rows], m[rows], e[rows], winding((len(rows), 2)), modulator)
        for part, whole in zip(alone, together, strict=True):
            np.testing.assert_array_equal(part, whole[rows])


@pytest.mark.parametrize("modulation", ["unipolar", "bipolar", "sign_magnitude"])
def test_one_winding_at_a_time_has_the_bits_of_all_together(modulation, monkeypatch):
    """Through reversals of the current and dead times, with commands and speeds drawn at random."""
    robot, rng = Robot.load("scara"), np.random.default_rng(4)
    drive = SwitchedDrive(modulation=modulation)
    demands, speeds = rng.uniform(-8, 8, (60, 2, 2)) * [1.0, 0.1], rng.uniform(-4, 4, (60, 5, 2, 2))
    done = []
    for few in (0, 8):
        monkeypatch.setattr(switched, "FEW", few)
        amplifier = drive.start(robot, 2, 2e-4)
        steps = zip(demands, speeds, strict=True)
        done.append([(amplifier.step(u, w, 5), *amplifier.trace, amplifier.copper) for u, w in steps])
    for together, alone in zip(*done, strict=True):
        for x, y in zip(together, alone, strict=True):
            np.testing.assert_array_equal(x, y)
    assert any((trace[3] * trace[4] < 0).any() for trace in done[0])  # currents do reverse


@pytest.mark.parametrize("modulation", ["unipolar", "bipolar", "sign_magnitude"])
def test_the_table_has_the_passages_that_are_computed(modulation):
    """To rounding, of coefficients that are differences of currents up to V/R."""
    rng, shape, h = np.random.default_rng(5), (40, 2), 2e-4
    winding = Winding(*(np.broadcast_to(x, shape).copy() for x in ([100.0, 60.0], [1.5, 3.0], [2e-3, 5e-3])))
    modulator = Modulator(modulation, h, 520e-9)
    for _ in range(5):
        i, e = rng.uniform(-1, 1, shape) * rng.choice([0.01, 1.0, 20.0], shape), rng.uniform(-30, 30, shape)
        m = rng.integers(-480, 481, shape) * 0.002
        kinds = ExactPassages(winding, modulator), TabulatedPassages(winding, modulator, 0.002)
        made = [kind.through(i, m, e) for kind in kinds]
        for exact, tabulated in zip(*made, strict=True):
            np.testing.assert_allclose(tabulated, exact, atol=1e-12 * max(1.0, np.abs(exact).max()))
