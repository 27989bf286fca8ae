"""The recording is read back and compared with the arrays that went in."""

import subprocess
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
import rerun_cli
from rerun.chunk import RrdReader

from experiments.errors import ResultsError
from experiments.recording.table1 import record_table1
from sim.scene import motion


@pytest.fixture(scope="module")
def path(table1, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "recording.rrd"
    rr.set_strict_mode(True)
    record_table1(path, table1)
    return path


def column(path, entity, component):
    """Return times [ns], sample numbers and values of an entity, in order of time."""
    batches = [
        chunk.to_record_batch()
        for chunk in RrdReader(path).stream().filter(content=entity, has_timeline="sim_time").to_chunks()
    ]
    batches = [batch for batch in batches if component in batch.schema.names]
    ns = np.concatenate([b.column("sim_time").cast(pa.int64()).to_numpy(zero_copy_only=False) for b in batches])
    sample = np.concatenate([b.column("sample").to_numpy(zero_copy_only=False) for b in batches])
    values = np.concatenate([np.array(b.column(component).to_pylist(), dtype=float).reshape(len(b), -1) for b in batches])
    order = np.argsort(ns)
    return ns[order], sample[order], values[order]


@pytest.mark.parametrize("name", ["q", "qd", "tau"])
def test_signals_and_times_are_exact(path, name, table1):
    expected = {"q": table1.log.q, "qd": table1.reference.qd, "tau": table1.log.tau}[name]
    ns, sample, values = column(path, f"/joint/{name}", "Scalars:scalars")
    np.testing.assert_array_equal(ns, np.arange(4600) * 10_000_000)
    np.testing.assert_array_equal(sample, np.arange(4600))
    np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("chain", ["paper", "idbench"])
@pytest.mark.parametrize(("form", "rows"), [("explicit", 2), ("implicit", 2), ("power", 1)])
def test_measured_predicted_and_residual_are_those_of_the_estimate(path, chain, form, rows, table1):
    estimate = table1.estimates[chain][form]
    for row in range(rows):
        mine = estimate.system.group == row
        ns, _, both = column(path, f"/identify/{chain}/{form}/signal/row{row + 1}", "Scalars:scalars")
        np.testing.assert_array_equal(both, np.stack([estimate.system.Y, estimate.predicted], axis=-1)[mine])
        np.testing.assert_allclose(ns, estimate.system.time[mine] * 1e9, atol=1)
        _, _, residual = column(path, f"/identify/{chain}/{form}/residual/row{row + 1}", "Scalars:scalars")
        np.testing.assert_array_equal(residual[:, 0], estimate.residual[mine])


def test_the_arm_moves_as_mujoco_moves_it(path, table1):
    moving = motion(table1.robot, table1.log.q)
    for body in ("link1", "link2"):
        _, _, position = column(path, f"/world/{body}", "Transform3D:translation")
        np.testing.assert_allclose(position, moving.positions[body], atol=1e-6)  # rerun keeps 32 bits of a pose


def test_it_holds_a_table_bars_and_a_blueprint(path):
    reader = RrdReader(path)
    assert len(reader.recordings()) == 1
    assert len(reader.blueprints()) == 1
    summary = str(reader.store().summary())
    for entity in (
        "/report",
        "/error/paper/power",
        "/error/idbench/explicit",
        "/world/link1/link1_beam",
        "/world/path_of_tool",
    ):
        assert entity in summary


def test_the_viewers_own_check_passes(path):
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_path_that_cannot_be_written_is_told(tmp_path, table1):
    with pytest.raises(ResultsError, match="cannot write the recording"):
        record_table1(tmp_path / "nowhere" / "recording.rrd", table1)
