"""The rms of curves in the titles of plots, and what is said of logs."""

import numpy as np

from idbench.experiments.recording.columns import seconds
from idbench.experiments.recording.stream import Stream
from idbench.experiments.recording.views import Shelf
from idbench.experiments.text import of_each


def test_titles_have_the_rms_of_what_was_sent_in_pieces():
    """Of one curve sent in two pieces, and of two curves the largest."""
    stream, t = Stream("sizes"), np.arange(4) / 100
    for piece in (slice(0, 1), slice(1, 4)):
        stream.curves("torque/log", [seconds(t[piece])], np.array([3.0, 3.0, -3.0, 3.0])[piece])
    stream.curves("q/true", [seconds(t)], np.array([[1.0, 0.2]] * 4))
    stream.keep_sizes()
    shelf = Shelf(stream.paths)
    assert shelf.rms(["torque/log"]) == ", rms 3"
    assert shelf.rms(["q/true"]) == ", largest rms 1"
    assert shelf.rms(["qd/true"]) == ""
    assert shelf.paths == ["q/true", "torque/log"]


def test_what_is_said_of_several_logs_is_one_line():
    assert list(of_each([("a", "x"), ("b", "y"), ("c", "x")]).values()) == ["a, c: x", "b: y"]
