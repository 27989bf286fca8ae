"""Every operator keeps the sentence B tau = [c + s e] X true, looks no further than its halo, and honours the weights."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

from idbench.identify import (
    CentralDifference,
    FirLowPass,
    IirLowPass,
    LogError,
    Rows,
    Windows,
)
from idbench.identify.models import Equations
from idbench.identify.rows.operators import OPERATORS, Samples
from idbench.identify.rows.row_map import Grid

FS = 100.0
T = np.arange(1500) / FS
X = np.array([2.0, -0.7])
TRIM = 3.0


def sentence(y=None, weight=None, t=T):
    """A sentence of two rows that is true for X: y = c X_a + (d/dt e) X_b, with smooth signals known in closed form."""
    c = {(0, 0): np.cos(3 * t), (1, 0): np.sin(2 * t)}
    e = {(0, 1): np.sin(4 * t), (1, 1): np.cos(t), (1, 0): np.sin(t)}
    rate = {(0, 1): 4 * np.cos(4 * t), (1, 1): -np.sin(t), (1, 0): np.cos(t)}
    exact = np.stack([X[0] * c[0, 0] + X[1] * rate[0, 1], X[0] * (c[1, 0] + rate[1, 0]) + X[1] * rate[1, 1]])
    return equations(exact if y is None else y, c, e, np.ones((2, len(t))) if weight is None else weight, t)


def equations(y, c, e, weight, t=T):
    """Equations of two rows that take the torques of two joints as they are."""
    fs = 1 / (t[1] - t[0])
    signals = SimpleNamespace(
        fs=fs,
        s=lambda x: CentralDifference(6).derivative(x, fs),
        state=SimpleNamespace(q=np.zeros_like(y), part=lambda samples: samples),
        torque=SimpleNamespace(times=lambda _, joint: y[..., joint, :], average=lambda x: x, halo=lambda: 0.0),
        differentiator=CentralDifference(6),
        weight=weight,
    )

    def columns(samples):
        return tuple({place: x[..., samples] for place, x in each.items()} for each in (c, e))

    return Equations(signals, {(0, 0): 1.0, (1, 1): 1.0}, columns, ("a", "b"))


def at(operator, sentence):
    """Return the rows of equations, TRIM away from both ends."""
    grid = Grid.inside(sentence.y.shape[-1], sentence.signals.fs, TRIM, operator.step(sentence.signals.fs))
    return Rows.of(sentence, operator.map(sentence, sentence.weight, grid))


def precision(operator):
    """Share of the signal by which a row of a true sentence may be off.

    Simpson's rule over 0.1 s: (4/100)^4 / 180; sums of a modulating function of degree 6: 4e-8; the 6th-order difference:
    (4/100)^6 / 140. A recursive filter still remembers, to its 1 % twice, that the log begins and ends.
    """
    return 2e-4 if isinstance(operator, IirLowPass) else 1e-7


@pytest.fixture(params=OPERATORS.builtin)
def operator(request):
    return OPERATORS.create(request.param)


def test_a_true_sentence_stays_true(operator):
    found = at(operator, sentence())
    residual = found.Y - found.W @ X
    assert np.abs(residual).max() < precision(operator) * np.abs(found.Y).max()
    assert found.valid.all()
    assert found.W.shape == (len(found.Y), 2)


def test_the_mask_leaves_true_sentences_and_voids_what_sees_nothing(operator):
    """Nonsense at masked instants changes nothing, and rows with nothing else to see are void and zero."""
    weight = np.ones((2, len(T)))
    weight[0, 600:900] = 0
    nonsense = sentence().y.copy()
    nonsense[0, 600:900] = 1e3
    found = at(operator, sentence(nonsense, weight))
    residual = found.Y - found.W @ X
    assert np.abs(residual).max() < precision(operator) * np.abs(found.Y).max()
    middle = (found.group == 0) & (np.abs(found.time - 7.5) < 1.5 - operator.halo(FS))
    assert not found.valid[middle].any()
    assert found.valid[found.group == 1].all()
    assert not found.Y[~found.valid].any()
    assert not found.W[~found.valid].any()


def test_rows_look_no_further_than_the_halo(operator):
    """Samples outside the halo of a row, and of the differences of e, do not reach it."""
    change = np.zeros((2, len(T)))
    change[:, 1000] = 1.0
    before, after = (at(operator, sentence(sentence().y + d)) for d in (0 * change, change))
    reach = np.abs(before.time - T[1000]) > operator.halo(FS) + 1e-9
    changed = np.abs(after.Y - before.Y)
    assert changed[~reach].max() > 0
    remembered = 0.01 if isinstance(operator, IirLowPass) else 0.0  # a recursive filter settles, to 1 %
    assert changed[reach].max() <= remembered * changed.max()


def test_leading_axes_are_independent_runs_with_the_same_bits(operator, rng):
    y = rng.normal(size=(3, 2, len(T)))
    one, weight = sentence(), (rng.uniform(size=(3, 2, len(T))) > 0.02).astype(float)

    def spread(columns):
        return {address: np.broadcast_to(signal, (3, len(T))) for address, signal in columns.items()}

    together = at(operator, equations(y, *map(spread, one.columns(slice(None))), weight))
    for run in range(3):
        alone = at(operator, sentence(y[run], weight[run]))
        np.testing.assert_array_equal(together.Y[run], alone.Y)
        np.testing.assert_array_equal(together.W[run], alone.W)
        np.testing.assert_array_equal(together.valid[run], alone.valid)


def test_the_same_settings_give_the_same_rows_at_another_frequency(operator):
    if isinstance(operator, Samples):
        pytest.skip("a row of every sample")
    slow = at(operator, sentence())
    fast = at(operator, sentence(t=np.arange(15000) / 1000))
    assert slow.Y.shape == fast.Y.shape
    # IIR: the bilinear transform bends the pass band by (f/fs)^2; others: sampled kernels differ from their integrals.
    np.testing.assert_allclose(slow.Y, fast.Y, atol=5e-3 * np.abs(slow.Y).max())


@pytest.mark.parametrize("length", [0.1, 0.07])
def test_windows_are_integrals(length):
    """Even and odd numbers of intervals; each window begins where the last one ends."""
    found = at(Windows(length), sentence())
    rows = found.group == 0
    centre = found.time[rows]
    np.testing.assert_allclose(np.diff(centre), length, atol=1e-12)
    for i in (0, 17):
        exact = quad(lambda t: X[0] * np.cos(3 * t) + X[1] * 4 * np.cos(4 * t), centre[i] - length / 2, centre[i] + length / 2)[
            0
        ]
        assert found.Y[rows][i] == pytest.approx(exact, abs=1e-7)


def test_a_window_that_touches_a_masked_instant_is_void_and_its_neighbours_are_not():
    for length in (0.1, 0.07):
        weight = np.ones((2, len(T)))
        weight[:, 700] = 0
        found = at(Windows(length), sentence(weight=weight))
        touches = np.abs(found.time - T[700]) <= length / 2 + 1e-9
        np.testing.assert_array_equal(found.valid, ~touches)


def test_a_log_that_leaves_no_row_is_refused(operator):
    with pytest.raises(LogError, match=r"the log has 600 samples .* it needs at least 6"):
        at(operator, sentence(t=T[:600]))


def test_fir_computes_what_a_full_convolution_gives(rng):
    """An independent, slow route: filter everything, then keep one sample in n_d."""
    from scipy.signal import firwin

    y = rng.normal(size=(2, len(T)))
    found = at(FirLowPass(5.0, 5.0), sentence(y))
    full = np.stack([np.convolve(row, firwin(67, 5.0, fs=FS), mode="same") for row in y])
    np.testing.assert_allclose(found.Y.reshape(-1, 2).T, full[:, 300:1200:10], atol=1e-14)


@pytest.mark.parametrize("intervals", range(2, 13))
def test_windows_of_any_length_integrate_cubics_exactly(intervals):
    weights = Windows(intervals / FS).response(FS)
    t = np.arange(intervals + 1) / FS
    for power in range(4):
        assert weights @ t**power == pytest.approx(t[-1] ** (power + 1) / (power + 1), rel=1e-12)
