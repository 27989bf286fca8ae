"""Logs are read from recordings, ours and those of others."""

import numpy as np
import pytest
import rerun as rr

from idbench.experiments.recording.log_table import read_recording  # adds the format
from idbench.identify import LogError
from idbench.identify.files.reading import read_columns

T = np.arange(0, 2, 0.004)
Q = np.stack([np.sin(T), np.cos(2 * T)], axis=1)
JOINTS = ("elbow", "lift")


def test_scalars_of_others_are_a_log_whose_joints_have_names(tmp_path):
    stream = rr.RecordingStream("other")
    stream.save(tmp_path / "other.rrd")
    for t, q in zip(T, Q, strict=True):
        stream.set_time("time", duration=t)
        for j, joint in enumerate(JOINTS):
            stream.log(f"arm/{joint}/position", rr.Scalars(q[j]))
            stream.log(f"arm/{joint}/effort", rr.Scalars(3 * q[j]))
    stream.disconnect()
    columns = read_columns(tmp_path / "other.rrd")
    place = [columns.joints.index(f"arm/{joint}") for joint in JOINTS]
    np.testing.assert_allclose(columns.t, T, atol=1e-9)
    np.testing.assert_allclose(columns.q[:, place], Q)
    np.testing.assert_allclose(columns.tau[:, place], 3 * Q)


def test_a_recording_of_ours_is_the_log_that_it_shows(recorded):
    columns, log = read_columns(recorded.folder / "recording.rrd"), recorded.ran.run.alone()
    shown = np.searchsorted(log.t, columns.t - 1e-9)
    np.testing.assert_allclose(columns.q, log.q[shown], atol=1e-12)
    assert columns.tau.shape == columns.q.shape


def test_what_is_no_recording_is_told_in_one_line(tmp_path):
    (tmp_path / "x.rrd").write_bytes(b"no recording" * 20)
    with pytest.raises(LogError, match="cannot read the recording") as found:
        read_recording(tmp_path / "x.rrd")
    assert "\n" not in str(found.value)
