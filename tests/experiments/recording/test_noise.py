"""The tab `noise`: spectra beside those predicted, and the smoothed motion of maximum likelihood."""

import json

import numpy as np
import pytest
import rerun.blueprint as rrb

from idbench.experiments.cli import main
from idbench.experiments.recording.folder import files, known
from idbench.experiments.recording.run_layouts import noise
from idbench.experiments.recording.views import Shelf

STEP = 2 * np.pi / (4 * 4096)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the results of an ML identification of a 14-bit log."""
    out = tmp_path_factory.mktemp("smoothed")
    words = "--robot", "scara", "--model", "explicit", "--estimator", "ML-delay"
    assert main(["run", "quantization", "--no-rerun", "--out", str(out / "run")]) == 0
    assert main(["identify", str(out / "run" / "log.parquet"), *words, "--out", str(out / "found")]) == 0
    return out / "found"


@pytest.mark.thorough
@pytest.mark.parametrize(("joint", "most"), [("joint1", 0.6), ("joint2", 1.2)])
def test_measured_positions_are_off_by_counts_and_the_band_is_narrower(folder, joint, most, reading):
    """A count is off by 0.29 steps; a moving joint is known better, the heavy one by far."""
    layer = folder / "recording.idbench-ML-delay.rrd"
    _, off = reading.column(layer, f"identify/idbench-ML-delay/measured_less_smoothed/q/{joint}")
    _, variance = reading.column(layer, f"identify/idbench-ML-delay/smoothed_band/q/{joint}", "Measurements:variances")
    assert np.sqrt(np.mean(off**2)) == pytest.approx(STEP / np.sqrt(12), rel=0.3)
    assert np.median(np.sqrt(variance)) < most * STEP / np.sqrt(12)
    _, q = reading.column(layer, f"identify/idbench-ML-delay/smoothed/q/{joint}", "Measurements:values")
    assert np.ptp(q) > 1


def test_it_stands_in_the_tab_beside_the_spectra(folder):
    there = views(noise(Shelf(known(files(folder))[1])))
    shown = [path for view in there if isinstance(view.contents, list) for path in view.contents]
    for part in ("measured_less_smoothed/qd/joint2", "smoothed_band/q/joint1"):
        assert f"+ /identify/idbench-ML-delay/{part}" in shown
    assert "/identify/idbench-ML-delay/spectrum/joint2" in [view.origin for view in there]


def views(part):
    """Return the views of a container, those of the containers in it included."""
    if not isinstance(part, rrb.Container):
        return [part]
    return [view for inner in part.contents for view in views(inner)]


def test_the_delay_that_is_found_is_kept(folder):
    found = json.loads((folder / "summary.json").read_text())["found_delay"]
    assert abs(found["delay"]) < 5 * found["sigma"] < 1e-4
