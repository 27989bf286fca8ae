"""The recording of a comparison: several runs laid over each other, with what differs said first."""

from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

import numpy as np
import pyarrow as pa
import rerun as rr
from rerun.chunk import Chunk, RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.chart import send_keys
from idbench.experiments.recording.columns import NANOSECONDS, part, seconds
from idbench.experiments.recording.compared import Compared, difference, differences, estimates, named_runs, shift_of
from idbench.experiments.recording.folder import BASE, INNER, files
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.stream import Stream
from idbench.experiments.style import FORM_WIDTHS, FORMS, GREY, joint_colors, lighter, model_color

SIGNALS = ("q/measured", "qd/true", "torque/log")
"""Of the second run and of those after it, what is laid over the first one's."""


def compare(folders: Sequence[Path], tab: str, out: Path) -> None:
    """Write one recording of several results folders, that opens with the layout `tab`.

    Raises
    ------
    ExperimentError
        If they cannot be compared, or the recording has no such layout.
    """
    runs, stream = named_runs(folders), Stream(f"comparison-{'-'.join(part(folder.name) for folder in folders)}")
    notes = [differences(runs)]
    for number, run in enumerate(runs):
        shift = shift_of(runs[0].log, run.log) if number else 0.0
        if number:
            notes.append(_note(runs[0], run, shift))
        _copy(stream, run, number, shift or 0.0)
        if number and shift is not None:
            _send_differences(stream, runs[0], run, shift)
    text = "\n\n".join([*notes, estimates(runs)])
    stream.keep("comparison", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
    stream.keep_sizes()
    stream.arrange(tabs(stream.paths, tab))
    stream.write(out)


def _note(first: Compared, run: Compared, shift: float | None) -> str:
    if shift is None:
        return f"{run.name} and {first.name} do not make the same motion: they are shown as they are, without differences."
    return f"{run.name} is moved by {shift:+.4g} s to lie over {first.name}." if shift else ""


def _copy(stream: Stream, run: Compared, number: int, shift: float) -> None:
    """Send what a run's recording holds: all of the first one's; of others signals and identifications, by the run's name."""
    paths = files(run.folder)
    if not paths:
        raise ResultsError(f"there is no recording in {run.folder}: run it without --no-rerun")
    labels = [path for path in paths if path.name not in (BASE, INNER)]
    copied = set[str]()
    for path in reversed(paths):
        for chunk in _chunks(path):
            place = _place(chunk.entity_path.strip("/"), run.name, number, len(labels) > 1)
            if place is not None:
                stream.add(_moved(chunk, shift).with_entity_path(f"/{place}"), place)
                copied.add(place)
    _restyle(stream, run, number, copied)


def _chunks(path: Path) -> Iterator[Chunk]:
    reader = RrdReader(path)
    for entry in reader.recordings():
        yield from reader.stream(store=entry).to_chunks()


def _place(path: str, name: str, number: int, several: bool) -> str | None:
    """Return where an entity of a run goes; None if it is left out."""
    head, *rest = path.split("/")
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
            case ["versus", _, *signal]:
                colors = [lighter(color, 2) for color in joint_colors(run.log.n)]
                names = [f"{signal[-1]} {j + 1}, {run.name}" for j in range(run.log.n)]
                stream.style(path, names, colors, 1.2)
            case [*signal] if path in SIGNALS:
                names = [f"{signal[-1]} {j + 1}, {run.name}" for j in range(run.log.n)]
                stream.style(path, names, joint_colors(run.log.n), 4.0)
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
        names = [f"{name}{j + 1}, {run.name} - {first.name}" for j in range(run.log.n)]
        stream.style(path, names, joint_colors(run.log.n))
        stream.curves(path, [seconds(np.asarray(t))], values)
