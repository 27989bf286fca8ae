"""Samples and commands on physics steps, against counting."""

import pytest

from idbench.sim.engine.clock import Clock


@pytest.mark.parametrize("delay", [0.0, 0.0004, 0.001, 0.0034, 0.0101, 0.03])
@pytest.mark.parametrize("per_sample", [1, 10, 50])
def test_steps_belong_to_what_the_times_say(delay, per_sample):
    h = 0.01 / per_sample
    clock = Clock(per_sample, h, delay)
    assert 0 <= clock.old < 1
    assert (clock.late + clock.old) * h == pytest.approx(delay, abs=1e-12)
    begun = [0.01 * k + delay for k in range(-9, 40)]
    for step in range(4 * per_sample + clock.late):
        end = (step + 1) * h
        newest = max(k for k, t in zip(range(-9, 40), begun, strict=True) if t < end - 1e-9)
        k, after = clock.command(step)
        assert k == newest
        assert after == step - k * per_sample - clock.late
        assert clock.sample(step) == (step // per_sample if step % per_sample == 0 else None)
        quiet = range(step + 1, step + clock.undisturbed(step))
        assert all(clock.sample(s) is None and clock.command(s)[1] > 0 for s in quiet)
        last = step + clock.undisturbed(step)
        assert clock.sample(last) is not None or clock.command(last)[1] == 0
