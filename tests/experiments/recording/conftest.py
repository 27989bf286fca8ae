"""Reading recordings back."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
import rerun_cli
from rerun.chunk import RrdReader

from idbench.experiments.identification.request import Request
from idbench.experiments.identification.scenario_run import ScenarioRun
from idbench.experiments.recording.identification_recording import RunRecording
from idbench.sim.scenario.scenario_file import from_dict

SCENARIO = {
    "name": "short",
    "trajectory": {"kind": "random", "moves": 6, "rest": 3.0},
    "drive": {"kind": "switched", "pwm": 1000.0, "bandwidth": 150.0, "dead_time": 0.0},
    "encoder": {"kind": "incremental", "lines": 16384},
    "ripple": {"cogging": 1.0},
}


class Recorded:
    """A run, and the files of its recording."""

    def __init__(self, folder, audience=None, window=(4.0, 4.1)):
        made = RunRecording(from_dict(SCENARIO), audience, window)
        self.ran, self.folder = ScenarioRun(from_dict(SCENARIO), Request(), watch=made.watch), folder
        self.streams = made.finish(self.ran)
        for name, stream in self.streams:
            stream.write(folder / name)

    def column(self, entity, component="Scalars:scalars", file="recording.rrd"):
        return column(self.folder / file, entity, component)


@pytest.fixture(scope="session")
def reading():
    """Give what reads and makes recordings."""
    return SimpleNamespace(Recorded=Recorded, SCENARIO=SCENARIO, column=column, entities=entities, verify=require_verified)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    rr.set_strict_mode(True)
    return Recorded(tmp_path_factory.mktemp("recorded"))


def column(path, entity, component="Scalars:scalars", timeline="sim_time"):
    """Return times and values of an entity, in order of time."""
    chunks = RrdReader(path).stream().filter(content=entity, has_timeline=timeline).to_chunks()
    batches = [b for b in (chunk.to_record_batch() for chunk in chunks) if component in b.schema.names]
    assert batches, f"{path} has no {component} of {entity}"
    ns = np.concatenate([b.column(timeline).cast(pa.int64()).to_numpy(zero_copy_only=False) for b in batches])
    rows = [row for b in batches for row in b.column(component).to_pylist()]
    order = np.argsort(ns, kind="stable")
    if rows and isinstance(rows[0][0], str):
        return ns[order], [rows[k][0] for k in order]
    return ns[order], np.array(rows, dtype=float).reshape(len(rows), -1)[order]


def entities(path):
    """Return the entities of a file."""
    return {c.entity_path.strip("/") for c in RrdReader(path).store().schema().component_columns()}


def require_verified(path):
    """Let the viewer's own check judge a file."""
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
