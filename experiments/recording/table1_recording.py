"""The recording of Table 1: the motion, and a layer for each chain."""

from idbench.experiments.identification.fit import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.request import Request
from idbench.experiments.paper.table1 import Table1
from idbench.experiments.paper.table1_text import markdown
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.folder import BASE
from idbench.experiments.recording.identification_recording import layer, recording_id
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.stream import Stream
from idbench.sim.scenario.scenario_file import to_toml


def record_table1(table: Table1, audience: Audience | None = None) -> list[tuple[str, Stream]]:
    """Return the streams of the recording of `table`, by the name of their file."""
    log, reference, scenario = table.log, table.reference, table.scenario
    base = Base(
        recording_id(scenario.name, to_toml(scenario).encode()), table.robot, log.fs, ("measured",), reference.qd, audience
    )
    base.stream.describe(scenario=to_toml(scenario), seed=str(scenario.seed), fs_hz=f"{log.fs:g}")
    planned = {"q/planned": reference.q, "qd/planned": reference.qd, "qdd/planned": reference.qdd}
    base.replay(log, planned, reference.qd)
    base.end(log.q)
    base.finish(markdown(table))
    streams = [(BASE, base.stream)]
    for chain in table.chains:
        request = Request(chain=chain, estimator="OLS", trim=scenario.quintic().rest)
        result = fit(request, Logs((log,), truth=table.truth))
        known = set().union(*(stream.paths for _, stream in streams))
        streams.append(layer(base.stream.name, result, table.robot.joints, known, audience))
    return streams
