"""Charts: what is drawn lies where its values are, between ticks that are round; titles of plots, and what is said of logs."""

import numpy as np
import pytest
from rerun.chunk import RrdReader

from idbench.experiments.recording.chart import HEIGHT, WIDE, Chart
from idbench.experiments.recording.scales import decades, linear, listed, named, signed
from idbench.experiments.recording.stream import Stream, seconds
from idbench.experiments.recording.views import Shelf
from idbench.experiments.text import TICKS, of_each


@pytest.mark.parametrize(
    ("scale", "values"),
    [
        (linear("x", [-3.0, 7.0]), [-3.0, 2.0, 7.0]),
        (decades("x", [1e-4, 1e3]), [1e-4, 10**-0.5, 1e3]),
        (signed("x", [-40.0, 30.0], bend=0.01), [-40.0, 0.0, 40.0]),
        (named("x", ["a", "b", "c"]), [0.0, 1.0, 2.0]),
    ],
)
def test_the_middle_of_a_scale_is_in_its_middle(scale, values):
    """The arithmetic mean of a linear one, the geometric one of decades, zero of a signed one."""
    low, middle, high = scale.at(values)
    assert 0 <= low < middle < high <= 1
    assert middle == pytest.approx(0.5, abs=1e-12)
    assert scale.holds(values).all()
    assert not scale.holds([1e9]).any()


def test_ticks_are_round_and_decades_are_powers_of_ten():
    assert list(linear("x", [-1.93, 2.1]).ticks) == [-2.0, -1.0, 0.0, 1.0, 2.0]
    assert list(decades("x", [3e-5, 2.3]).ticks.values()) == ["0.0001", "0.001", "0.01", "0.1", "1"]
    assert list(decades("x", [0.7, 1.9]).ticks.values()) == ["0.9", "1.2", "1.5", "1.8"]  # less than a decade: steps
    assert set(signed("x", [50.0], bend=0.01).ticks.values()) == {"-100", "-1", "0", "1", "100"}


@pytest.mark.parametrize("values", [[], [np.nan, np.inf], [0.0], [5.0, 5.0]])
def test_a_scale_of_nothing_or_of_one_value_has_a_length(values):
    for scale in (linear("x", values), decades("x", values), signed("x", values, bend=1.0)):
        assert scale.low < scale.high
        assert np.isfinite(scale.at([0.0, 1.0, 5.0])).all()


def test_a_list_is_read_from_the_top():
    assert list(listed("", ["first", "second"]).at([0, 1])) == [0.75, 0.25]


@pytest.fixture
def drawn(tmp_path):
    stream = Stream("drawn")
    chart = Chart(stream, "here", linear("x", [0.0, 10.0]), decades("y", [1.0, 100.0]))
    chart.dots("dots", np.array([5.0, np.nan, 20.0, 5.0]), np.array([10.0, 10.0, 10.0, 1e9]), (1, 2, 3))
    chart.line("curve", np.arange(5.0), np.array([1.0, 10.0, np.nan, 10.0, 100.0]), (1, 2, 3))
    chart.marks("marks", np.array([np.nan, 5.0]), np.array([10.0, 10.0]), (1, 2, 3), "square")
    chart.intervals("bars", np.array([1.0, np.nan]), np.array([2.0, 2.0]), np.array([10.0, 2.0]), (1, 2, 3), 1.0)
    stream.write(tmp_path / "drawn.rrd")

    def read(path, component):
        (chunk,) = RrdReader(tmp_path / "drawn.rrd").stream().filter(content=f"here/{path}").to_chunks()
        return chunk.to_record_batch().column(component).to_pylist()[0]

    return read


def test_what_has_no_number_or_lies_beyond_is_not_drawn(drawn):
    """A dot beyond the axes is none at their edge; a curve has a gap."""
    np.testing.assert_allclose(drawn("dots/dots", "Points2D:positions"), [[WIDE / 2, HEIGHT / 2]], atol=1e-6)
    assert [len(strip) for strip in drawn("lines/curve", "LineStrips2D:strips")] == [2, 2]
    assert len(drawn("segments/bars", "LineStrips2D:strips")) == 1
    (square,) = drawn("marks/marks", "LineStrips2D:strips")
    np.testing.assert_allclose(np.mean(square[:4], axis=0), [WIDE / 2, HEIGHT / 2], atol=1e-6)


def test_higher_values_are_higher_up(drawn):
    """A view's y points down."""
    first, second = drawn("lines/curve", "LineStrips2D:strips")
    assert first[0][1] > first[1][1] > second[1][1]


def test_a_curve_is_listed_beside_the_frame(drawn):
    assert drawn("legend/curve", "LineStrips2D:labels") == ["curve"]
    assert drawn("legend/curve", "LineStrips2D:strips")[0][0][0] > WIDE
    assert drawn("names", "LineStrips2D:labels") == ["x", "y"]


def test_every_axis_has_two_values_at_least_and_has_room_for_them(rng):
    for _ in range(300):
        low, far = rng.normal() * 10 ** rng.uniform(-6, 6), 10 ** rng.uniform(-6, 6)
        assert 2 <= len(linear("x", [low, low + far]).ticks) <= TICKS
        start = 10 ** rng.uniform(-8, 4)
        assert 2 <= len(decades("x", [start, start * 10 ** rng.uniform(0.02, 9)]).ticks) <= 8
        assert 2 <= len(signed("x", [10 ** rng.uniform(-3, 6)], bend=0.01).ticks) <= TICKS


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
