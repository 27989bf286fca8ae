"""The recording of a comparison: several runs laid over each other, estimates and what differs beside them."""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

import numpy as np
import pyarrow as pa
import rerun as rr
from rerun.chunk import Chunk, RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.identification.fitting import fit
from idbench.experiments.identification.logs import Logs
from idbench.experiments.identification.method import Method
from idbench.experiments.identification.request import Request
from idbench.experiments.paper.table1 import Table1, table1_markdown
from idbench.experiments.paper.table2 import Table2
from idbench.experiments.recording.audience import Audience
from idbench.experiments.recording.chart import send_keys
from idbench.experiments.recording.compared import Compared, difference, differences, estimates, named_runs, shift_of
from idbench.experiments.recording.folder import BASE, INNER, files
from idbench.experiments.recording.identification_layer import Layer
from idbench.experiments.recording.identification_recording import RunRecording, recording_id
from idbench.experiments.recording.lanes import about
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.motion_layer import Base
from idbench.experiments.recording.stream import NANOSECONDS, SIZES, Stream, part, seconds
from idbench.experiments.text import FORM_WIDTHS, FORMS, GREY, joint_colors, lighter, model_color
from idbench.sim.scenario.scenario_file import to_toml


def record_table1(table: Table1, audience: Audience | None = None) -> list[tuple[str, Stream]]:
    """Return the streams of the recording of `table`, by the name of their file."""
    log, reference, scenario = table.log, table.reference, table.scenario
    name = recording_id(scenario.name, to_toml(scenario).encode())
    base = Base(name, table.robot, log.fs, ("measured",), reference.qd, audience)
    base.stream.describe(scenario=to_toml(scenario), seed=str(scenario.seed), fs_hz=f"{log.fs:g}")
    base.replay(log, {"q/planned": reference.q, "qd/planned": reference.qd, "qdd/planned": reference.qdd}, reference.qd)
    base.arm.trace(log.q)
    base.finish(table1_markdown(table))
    streams = [(BASE, base.stream)]
    for chain in table.chains:
        request = Request(method=Method.named(chain, "OLS").trimmed(scenario.quintic().rest))
        result = fit(request, Logs((log,), truth=table.truth))
        known = set().union(*(stream.paths for _, stream in streams))
        streams.append(Layer(base.stream.name, result, table.robot.joints, known, audience).send())
    return streams


def finish_table2(recording: RunRecording, table: Table2) -> list[tuple[str, Stream]]:
    """Add what only the end of a run gives to the first realization's recording; return its streams by file name."""
    streams = recording.end(table.run)
    recording.base.finish(about(table.scenario.name, table.scenario.origin))
    return streams


SIGNALS = ("q/measured", "qd/true", "torque/log")  # Of the second run and of those after it, what is laid over the first one's


def compare(folders: Sequence[Path], tab: str, out: Path) -> None:
    """Write one recording of several results folders, that opens with the layout `tab`.

    Raises
    ------
    ExperimentError
        If they cannot be compared, or the recording has no such layout.
    """
    first, *others = runs = named_runs(folders)
    stream = Stream(f"comparison-{'-'.join(part(folder.name) for folder in folders)}")
    notes = [differences(runs)]
    _copy(stream, first, 0, 0.0)
    for number, run in enumerate(others, 1):
        shift = shift_of(first.log, run.log)
        moved = f"{run.name} is moved by {shift:+.4g} s to lie over {first.name}." if shift else ""
        apart = f"{run.name} and {first.name} do not make the same motion: they are shown as they are, without differences."
        notes.append(apart if shift is None else moved)
        _copy(stream, run, number, shift or 0.0)
        if shift is not None:
            _send_differences(stream, first, run, shift)
    stream.page("comparison", "\n\n".join([estimates(runs), *notes]))
    stream.keep_sizes()
    stream.arrange(tabs(stream.paths, tab))
    stream.write(out)


def _copy(stream: Stream, run: Compared, number: int, shift: float) -> None:
    """Send what a run's recording holds: all of the first one's; of others signals and identifications, by the run's name."""
    if not (paths := files(run.folder)):
        raise ResultsError(f"there is no recording in {run.folder}: run it without --no-rerun")
    labels = [path for path in paths if path.name not in (BASE, INNER)]
    copied = set[str]()
    for reader in map(RrdReader, reversed(paths)):
        chunks = [chunk for entry in reader.recordings() for chunk in reader.stream(store=entry).to_chunks()]
        for chunk in chunks:
            if (place := _place(chunk.entity_path.strip("/"), run.name, number, len(labels) > 1)) is not None:
                stream.add(_moved(chunk, shift).with_entity_path(f"/{place}"), place)
                copied.add(place)
    _restyle(stream, run, number, copied)


def _place(path: str, name: str, number: int, several: bool) -> str | None:
    """New path of a run's entity; None if it is left out."""
    head, *rest = path.split("/")
    if head == SIZES:
        of = _place("/".join(rest[1:]), name, number, several)
        return of and "/".join([head, rest[0], of])
    if head in ("identify", "legend") and rest and rest[0] != "joints":
        return "/".join([head, f"{part(name)}-{rest[0]}" if several else part(name), *rest[1:]])
    if not number:
        return None if head.startswith("__") else path
    return f"versus/{number}/{path}" if path in SIGNALS else None


def _moved(chunk: Chunk, shift: float) -> Chunk:
    if not shift or chunk.is_static:
        return chunk
    batch = chunk.to_record_batch()
    k = batch.schema.get_field_index("sim_time")
    field = batch.schema.field(k)
    moved = pa.compute.add(batch.column(k).cast(pa.int64()), round(shift * NANOSECONDS)).cast(field.type)
    (found,) = Chunk.from_record_batch(batch.set_column(k, field, moved))
    return found


def _restyle(stream: Stream, run: Compared, number: int, copied: AbstractSet[str]) -> None:
    """Give the curves of a run colours and names of its own; the second one's lie thin over the first one's."""
    for path in sorted(copied):
        match path.split("/"):
            case [head, *_, kind] if head == "versus" or path in SIGNALS:
                fade, width = (2, 1.2) if head == "versus" else (0, 4.0)
                names = [f"{kind} {j + 1}, {run.name}" for j in range(run.log.n)]
                stream.style(path, names, [lighter(color, fade) for color in joint_colors(run.log.n)], width)
            case ["identify", _, *_, "lines" | "marks" | "segments" | "legend", name] if _model(name, run):
                stream.keep(path, rr.LineStrips2D.from_fields(colors=[model_color(_model(name, run), number)]))
            case ["identify", _, model, "predicted" | "residual", _]:
                width = FORM_WIDTHS.get(model, 1.5) / (1 + number)
                stream.style(path, [f"{model}, {run.name}"], [model_color(model, number)], width)
            case ["identify", _, model, "estimate", _]:
                style = rr.Measurements.from_fields(names=[f"{model}, {run.name}"], colors=[model_color(model, number)])
                stream.keep(path, style)
            case ["legend", method] if method != "joints":
                models = {model: model_color(model, number) for model in FORMS if model in run.summary["models"]}
                send_keys(stream, path, {f"{method}:": GREY, **models})


def _model(name: str, run: Compared) -> str:
    """Return the model that a line of a chart belongs to, empty if it is no model's."""
    return next((model for model in run.summary["models"] if model in name.split("_")), "")


def _send_differences(stream: Stream, first: Compared, run: Compared, shift: float) -> None:
    t, found = difference(first.log, run.log, shift)
    for name, values in found.items():
        path = f"difference/{name}/{part(run.name)}"
        stream.style(path, [f"{name}{j + 1}, {run.name} - {first.name}" for j in range(run.log.n)], joint_colors(run.log.n))
        stream.curves(path, [seconds(np.asarray(t))], values)
