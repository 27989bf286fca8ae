"""The recording of Table 1: a base, and a layer for each chain."""

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.comparison_recording import record_table1


@pytest.fixture(scope="module")
def folder(table1, tmp_path_factory):
    rr.set_strict_mode(True)
    folder = tmp_path_factory.mktemp("recording")
    for name, stream in record_table1(table1):
        stream.write(folder / name)
    return folder


@pytest.mark.parametrize("path", ["q/measured", "qd/planned", "torque/log"])
def test_signals_and_times_are_exact(folder, reading, path, table1):
    expected = {"q/measured": table1.log.q, "qd/planned": table1.reference.qd, "torque/log": table1.log.tau}[path]
    ns, values = reading.column(folder / "recording.rrd", path)
    np.testing.assert_array_equal(ns, np.arange(4600) * 10_000_000)
    np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("chain", ["paper", "paper_masked", "idbench"])
def test_every_chain_is_a_layer_with_the_estimates_of_the_table(folder, reading, chain, table1):
    file, at = folder / f"recording.{chain}-OLS.rrd", f"identify/{chain}-OLS"
    for form in ("explicit", "implicit", "power"):
        estimate = table1.estimates[chain][form]
        for group in range(estimate.rows.kinds):
            row = "power" if form == "power" else f"joint{group + 1}"
            _, residual = reading.column(file, f"{at}/{form}/residual/{row}")
            np.testing.assert_array_equal(
                residual[:, 0], estimate.residual[estimate.rows.valid & (estimate.rows.group == group)]
            )
    reading.verify(file)


def test_layers_belong_to_the_base(folder):
    files = sorted(folder.iterdir())
    chains = [f"recording.{name}-OLS.rrd" for name in ("idbench", "paper", "paper_masked")]
    assert [path.name for path in files] == [*chains, "recording.rrd"]
    assert len({RrdReader(path).recordings()[0].recording_id for path in files}) == 1


def test_a_path_that_cannot_be_written_is_told(tmp_path, table1):
    ((name, stream), *_) = record_table1(table1)
    with pytest.raises(ResultsError, match="cannot write the recording"):
        stream.write(tmp_path / "nowhere" / name)
