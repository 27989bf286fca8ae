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
    begun = [0.01 * k + delay for k in range(40)]
    for step in range(4 * per_sample + clock.late):
        commanded = sum(int(t / h + 1e-9) < step for t in begun)  # in steps before this one
        assert clock.final(step) == min(commanded, step // per_sample)
