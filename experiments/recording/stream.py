"""Writing arrays to a rerun recording, a file, a viewer or both: columns, of which a watched run sends twenty a second."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import Chunk, RrdReader

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.audience import Audience
from idbench.experiments.text import Color
from idbench.identify import Array

NANOSECONDS = 1_000_000_000  # In a second: the unit of rerun's times

SHOWN, POSES = 62.5, 31.25
"""Frequencies [Hz] above which curves, and poses of the arms, are thinned out: a minute on a screen has no more points."""


def shown(first: int, count: int, fs: float, most: float = SHOWN) -> np.typing.NDArray[np.bool_]:
    """Mask of the recorded samples among `count` from number `first` on, at a sampling frequency `fs` [Hz]."""
    return (first + np.arange(count)) % max(1, int(fs / most)) == 0


def part(name: str) -> str:
    """Return a name as part of an entity's path, in which slashes, spaces and the like mean something."""
    return re.sub(r"[^\w.-]+", "_", name)


def parts(names: Sequence[str]) -> list[str]:
    """Return names as parts of paths, each another one."""
    found = [part(name) for name in names]
    return [name if name not in found[:k] else f"{name}.{k + 1}" for k, name in enumerate(found)]


Times = Sequence[rr.TimeColumn]


def time_columns(t: Array, fs: float) -> list[rr.TimeColumn]:
    """Return the timelines sim_time (exact to 1 ns) and sample of the instants `t` [s]."""
    return [seconds(t), rr.TimeColumn("sample", sequence=np.rint(t * fs).astype(np.int64))]


def seconds(t: Array) -> rr.TimeColumn:
    """Return the timeline sim_time alone, exact to 1 ns, for what lies between samples."""
    return rr.TimeColumn("sim_time", duration=np.rint(t * NANOSECONDS).astype(np.int64).astype("timedelta64[ns]"))


(_SCALARS,) = rr.Scalars.columns(scalars=[0.0])
_TRANSLATION, _QUATERNION = rr.Transform3D.columns(translation=[[0.0, 0.0, 0.0]], quaternion=[[0.0, 0.0, 0.0, 1.0]])


def scalars(values: Array) -> list[rr.ComponentColumn]:
    """Return curves of shape (time, curve) or (time,)."""
    offsets = np.arange(0, values.size + 1, values.shape[1] if values.ndim > 1 else 1, dtype=np.int32)
    return [rr.ComponentColumn(_SCALARS.descriptor, rr.components.ScalarBatch(values.ravel()), offsets=offsets)]


def poses(translation: Array, quaternion: Array) -> list[rr.ComponentColumn]:
    """Return poses: positions [m], shape (time, 3), and orientations x y z w, shape (time, 4)."""
    return [
        rr.ComponentColumn(_TRANSLATION.descriptor, rr.components.Translation3DBatch(translation)),
        rr.ComponentColumn(_QUATERNION.descriptor, rr.components.RotationQuatBatch(quaternion)),
    ]


APPLICATION = "idbench"

SIZES = "rms"  # Where the sizes of curves are kept: rms/SMALLEST_LARGEST/PATH


class Stream:
    """A recording, or a layer of one.

    What goes to the file is kept in memory until it is written whole: a viewer that has gone, or a full disk, then costs
    nothing but itself. Chunks are made once and sent to both.

    Layers of the same `name` belong to one recording; a `layer` adds to one that is there already.
    """

    def __init__(self, name: str, audience: Audience | None = None, *, layer: bool = False) -> None:
        self.name = name
        self.paths = set[str]()
        self._audience = audience
        self._draft = False
        self._drafted = set[str]()
        self._squares = dict[str, tuple[int, Array]]()
        self._file = self._recording(layer)
        self._bytes = rr.binary_stream(self._file)
        self._live = None
        if audience and audience.watching:
            self._live = self._recording(layer)
            self._live.set_sinks(rr.GrpcSink(audience.url))

    def _recording(self, layer: bool) -> rr.RecordingStream:
        made = rr.RecordingStream(APPLICATION, recording_id=self.name, send_properties=not layer)
        made.set_log_time_enabled(False)
        return made

    @property
    def shown(self) -> set[str]:
        """Entities that who watches has, those of drafts included."""
        return self.paths | self._drafted

    def _note(self, path: str) -> None:
        (self._drafted if self._draft else self.paths).add(path)

    @property
    def _targets(self) -> list[rr.RecordingStream]:
        return [recording for recording in (None if self._draft else self._file, self._live) if recording]

    @contextmanager
    def draft(self) -> Iterator[None]:
        """Show what is sent in the block to who watches, and keep nothing of it: it will be sent again."""
        self._draft = True
        try:
            yield
        finally:
            self._draft = False

    def send(self, path: str, times: Times, columns: Iterable[rr.ComponentColumn]) -> None:
        """Send columns of an entity."""
        self.add(Chunk.from_columns(path, times, columns), path)

    def add(self, chunk: Chunk, path: str) -> None:
        """Send a chunk of the entity `path`."""
        self._note(path)
        for recording in self._targets:
            rr.send_chunks(chunk, recording=recording)

    def keep(self, path: str, *things: rr.AsComponents) -> None:
        """Send what holds at all times."""
        self._note(path)
        for thing in things:
            for recording in self._targets:
                recording.log(path, thing, static=True)

    def page(self, path: str, text: str) -> None:
        """Send a text in Markdown."""
        self.keep(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))

    def style(self, path: str, names: Sequence[str], colors: Sequence[Color], width: float = 1.5) -> None:
        """Announce an entity of curves."""
        self.keep(path, rr.SeriesLines(names=names, colors=colors, widths=[width] * len(names)))

    def curves(self, path: str, times: Times, values: Array) -> None:
        """Send values of shape (time, curve) or (time,)."""
        self.send(path, times, scalars(values))
        if not self._draft:
            count, squares = self._squares.get(path, (0, np.zeros(())))
            self._squares[path] = count + len(values), squares + np.nansum(np.square(values), axis=0)

    def keep_sizes(self) -> None:
        """Send the rms of the curves so far, as names of entities: layouts see names alone, and an axis may read only 0."""
        for path, (count, squares) in self._squares.items():
            if not path.startswith("truth/"):
                rms = np.sqrt(squares / max(count, 1))
                self.keep(f"{SIZES}/{compact(rms.min())}_{compact(rms.max())}/{path}", rr.TextDocument(path))

    def curve(self, path: str, times: Times, values: Array, name: str, color: Color, width: float) -> None:
        """Announce one curve, once, and send values of shape (time,)."""
        if path not in (self._drafted if self._draft else self.paths):
            self.style(path, [name], [color], width)
        self.curves(path, times, values)

    def copy(self, path: Path) -> None:
        """Send what another file of the recording holds."""
        reader = RrdReader(path)
        for entry in reader.recordings():
            for recording in self._targets:
                rr.send_chunks(reader.stream(store=entry), recording=recording)

    def describe(self, **properties: str) -> None:
        """Send properties of the whole recording."""
        for recording in self._targets:
            recording.send_property("run", rr.AnyValues(drop_untyped_nones=True, **properties))

    def arrange(self, blueprint: rrb.Blueprint) -> None:
        """Send a layout: that which the file opens with; to be called once, as every layout takes its room in the file."""
        self._file.send_blueprint(blueprint, make_active=False, make_default=True)
        self.show(blueprint)

    def open_with(self, blueprint: rrb.Blueprint) -> None:
        """Send the layout of a file that is opened alone: browsers take no other than an active one."""
        self._file.send_blueprint(blueprint, make_active=True, make_default=True)

    def show(self, blueprint: rrb.Blueprint) -> None:
        """Send a layout to who watches."""
        if self._live:
            self._live.send_blueprint(blueprint, make_active=True, make_default=True)

    def breathe(self, seconds: float) -> None:
        """Let the viewer catch up, at the pace that it asked for; `seconds` is where the recording has come to."""
        if self._live and self._audience and not self._audience.reached(self._live, seconds):
            self._leave(self._audience)

    def write(self, path: Path) -> None:
        """Write the recording to a file; raise ResultsError if it cannot be written."""
        try:
            path.write_bytes(self._bytes.read() or b"")
        except OSError as error:
            raise ResultsError(f"cannot write the recording {path.name}: {error.strerror}") from error

    def close(self) -> None:
        """Let the viewer have what is still on its way: to be called last, as viewers may be slow, or hang."""
        if self._live and self._audience:
            self._audience.reached(self._live, None)
            self._leave(self._audience)

    def _leave(self, audience: Audience) -> None:
        if self._live:
            audience.leave(self._live)
            self._live = None


def compact(x: float) -> str:
    """Return a number to two digits, of letters that paths may have."""
    return f"{x:.2g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
