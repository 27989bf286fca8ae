"""Plug-ins of the bench that return something else than promised are reported by name, before anything goes wrong with it."""

from dataclasses import replace

import numpy as np
import pytest

from idbench.identify import PluginError
from idbench.sim.controllers import AbstractController, AbstractLaw
from idbench.sim.encoders import AbstractEncoder, AbstractReader
from idbench.sim.engine.simulation import simulate
from idbench.sim.settings import settings


@settings
class Controller(AbstractController):
    """Starts what it is given."""

    made: object = None

    def start(self, task):
        return self.made


class Law(AbstractLaw):
    def __init__(self, do):
        self.do = do

    def command(self, k, q):
        return self.do(q)


@settings
class Encoder(AbstractEncoder):
    """Reads one joint of two."""

    def start(self, n, samples, fs, rngs):
        return Reader()


class Reader(AbstractReader):
    def read(self, k, q):
        return q[:, :1]


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"controller": Controller(None)}, r"plug-in Controller\.start returned None, expected an AbstractLaw"),
        ({"controller": Controller(Law(lambda q: None))}, r"plug-in Law\.command returned None, expected an array of numbers"),
        ({"controller": Controller(Law(lambda q: q[0]))}, r"Law\.command returned an array of float64, shape \(2,\), expected"),
        ({"controller": Controller(Law(lambda q: q.nothing))}, r"raised AttributeError: .*test_bench_plugins\.py, line"),
        ({"encoder": Encoder()}, r"plug-in Reader\.read returned an array of float64, shape \(1, 1\), expected .*\(1, 2\)"),
    ],
    ids=["start", "None", "shape", "raises", "encoder"],
)
def test_the_plugin_is_named(short, part, message):
    with pytest.raises(PluginError, match=message):
        simulate(replace(short, **part))


def test_a_command_that_is_not_finite_is_blamed_on_the_controller(short):
    run = simulate(replace(short, controller=Controller(Law(lambda q: np.full_like(q, np.nan)))), throw=False)
    assert list(run.failures) == [0]
    assert run.failures[0] == "the controller gives no finite torque (seed 0)"
