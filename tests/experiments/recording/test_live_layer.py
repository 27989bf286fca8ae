"""Estimates that grow with the log: each is that of the rows so far, and nothing of them is kept."""

import numpy as np
import pytest
import rerun as rr

from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.recording.identification_layer import LiveIdentification
from idbench.experiments.recording.stream import Stream
from idbench.identify import MotionLog

JOINTS = ("joint1", "joint2")


@pytest.fixture
def grown(table1):
    """An identification that took in a log second by second, when it was made anew, and its stream."""
    stream, log = Stream("grown"), table1.log
    live = LiveIdentification(stream, RobotModel(), "idbench", log.torque, log.fs, JOINTS)
    anew = [live.grow(log.q[k : k + 100], log.tau[k : k + 100]) for k in range(0, 2000, 100)]
    return live, anew, stream


def test_the_last_estimate_is_that_of_the_log_so_far(grown, table1):
    live, anew, _ = grown
    assert not anew[0]  # a second at rest tells nothing
    samples = live.fit.logs.fitted[0].samples
    log = table1.log
    part = MotionLog(log.fs, log.q[:samples], log.tau[:samples], log.torque)
    expected = fit(Request(method=Method.named(estimator="WLS")), Logs((part,))).estimates
    for form, estimate in live.fit.estimates.items():
        np.testing.assert_array_equal(estimate.X, expected[form].X)


def test_it_is_made_anew_as_the_log_grows_by_a_tenth(grown):
    live, anew, _ = grown
    assert any(anew[-3:])
    assert live.fit.logs.fitted[0].samples > 2000 / 1.1 - 100


def test_nothing_of_it_is_kept(grown, tmp_path, reading):
    stream = grown[2]
    stream.keep("about", rr.TextDocument("kept"))
    stream.write(tmp_path / "kept.rrd")
    assert reading.entities(tmp_path / "kept.rrd") - {"__properties"} == {"about"}
    assert "identify/so-far/explicit/estimate/ZZR1" in stream.shown
    assert "identify/so-far/explicit/estimate/ZZR1" not in stream.paths


def test_a_fault_in_it_is_told_once_and_the_run_goes_on(table1, monkeypatch, capsys, tmp_path):
    def broken(request, logs):
        raise np.linalg.LinAlgError("on purpose")

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("idbench.experiments.recording.identification_layer.fit", broken)
    log = table1.log
    live = LiveIdentification(Stream("broken"), RobotModel(), "idbench", log.torque, log.fs, JOINTS)
    assert not any(live.grow(log.q[k : k + 500], log.tau[k : k + 500]) for k in range(0, 2000, 500))
    assert len(told := capsys.readouterr().err.splitlines()) == 1
    assert "LinAlgError: on purpose" in told[0]
    assert "the work goes on" in told[0]
