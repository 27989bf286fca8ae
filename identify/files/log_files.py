"""The columns of a log's files, by their layout, in SI units."""

import json
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.log_columns import LogColumns
from idbench.identify.data.motion_log import TorqueChannel
from idbench.identify.errors import LogError
from idbench.identify.files.formats import read_table
from idbench.identify.files.layout import UNLOGGED, LogLayout, Source, matching
from idbench.identify.files.table import LogTable, gain_wanted, needs_gain

CLOCKS = 1e6  # Times [s] beyond this are those of a calendar: logs count from their beginning
MIN_GAIN, MAX_GAIN = 1e-9, 1e9  # Sizes of gains beyond which they are slips


@dataclass(frozen=True, eq=False)
class LogFiles:
    """The files of a log, read once each."""

    log: Path
    """The log."""
    folder: Path
    """Where its other files are."""
    layout: LogLayout
    """What its columns are."""
    tables: dict[Path, LogTable] = field(default_factory=dict)
    """What files hold; those that are read are added."""

    @property
    def columns(self) -> LogColumns:
        """What they hold."""
        layout = self.layout
        self.require_once()
        kinds = [name for name in ("q", "qd", "qdd", "tau") if name == "tau" or getattr(layout, name).columns]
        if "q" not in kinds and "qd" not in kinds:
            raise LogError(f"{self.log}: a layout must name columns of q, or of qd, which are then integrated")
        found = {name: self.of(name, getattr(layout, name)) for name in kinds}
        names = layout.joints or next((joints for _, joints in found.values() if joints), ())
        every = {name: self.ordered(name, *of, names) for name, of in found.items()}
        tau, qd, qdd = every["tau"], every.get("qd"), every.get("qdd")
        if layout.samples:
            q, qd, qdd = (every.get(name, np.zeros_like(tau)) for name in ("q", "qd", "qdd"))
            every["q"] = q
        elif "q" not in every:
            every["q"], qd = self._integrated(every["qd"]), None
        q = every["q"]
        if q.shape[1] != tau.shape[1]:
            held = [f"column {name} holds {what}" for table in self.tables.values() for name, what in table.words.items()]
            why = "; ".join(held[:3]) or "one of each a joint"
            raise LogError(f"{self.log}: positions of {q.shape[1]} joints and torques of {tau.shape[1]}: {why}")
        if wrong := next((name for name in ("qd", "qdd") if name in every and every[name].shape != every["q"].shape), None):
            raise LogError(f"{self.log}: {wrong} is of {every[wrong].shape[1]} joints, positions of {q.shape[1]}: one of each")
        if names and len(names) != q.shape[1]:
            raise LogError(f"{self.log}: {len(names)} names of joints, {q.shape[1]} columns of positions")
        t, t_tau = self.times(layout.q if layout.q.columns else layout.qd, len(q)), self.times(layout.tau, len(tau))
        other = t_tau.shape != t.shape or not np.array_equal(t, t_tau)
        since = min((times[0] for times in (t, t_tau) if len(times)), default=0.0)
        start = since if other or abs(since) > CLOCKS else 0.0  # since 1970
        missing = self._missing(tau)
        tau = np.where(np.isin(np.arange(tau.shape[1]), missing), 0.0, tau)
        channel = layout.torque or self._stated()
        gain = np.broadcast_to(self._gain(tau.shape[1]), tau.shape[1:])
        q, tau, qd, qdd = self._of_joints(q, tau * gain, qd, qdd)
        warm = self.of("temperature", layout.temperature)[0] if layout.temperature.columns else None
        gains = tuple(map(float, gain))
        own_times = t_tau - start if other else None
        integrated, qdd = "q" not in kinds and not layout.samples, qdd if layout.samples else None
        return LogColumns(t - start, q, tau, channel, names, qd, qdd, own_times, warm, gains, missing, integrated)

    def _integrated(self, qd: Array) -> Array:
        """Return positions of velocities, from 0: q(k+1) = q(k) + (qd(k) + qd(k+1)) (t(k+1) - t(k)) / 2."""
        steps = np.diff(self.times(self.layout.qd, len(qd)))[:, None]
        return np.concatenate([np.zeros((1, qd.shape[1])), np.cumsum((qd[1:] + qd[:-1]) * steps / 2, axis=0)])

    def _missing(self, tau: Array) -> tuple[int, ...]:
        """Return the joints without any torque."""
        none = np.flatnonzero(np.isnan(tau).all(axis=0))
        if len(none) == tau.shape[1]:
            raise LogError(f"{self.log}: no torque of it has a value")
        if len(none) and self.layout.motors:
            raise LogError(f"{self.log}: torques of some motors are not there, of which those of joints are made ([motors])")
        return tuple(map(int, none))

    def _of_joints(
        self, q: Array, tau: Array, qd: Array | None, qdd: Array | None
    ) -> tuple[Array, Array, Array | None, Array | None]:
        """Return positions, torques, velocities and accelerations of joints, where those of motors were logged."""
        if not self.layout.motors:
            return q, tau, qd, qdd
        M = np.array(self.layout.motors)
        if len(M) != q.shape[1]:
            raise LogError(f"{self.log}: the matrix of [motors] has {len(M)} rows, the log {q.shape[1]} motors")
        back = np.linalg.inv(M).T
        return q @ back, tau @ M, None if qd is None else qd @ back, None if qdd is None else qdd @ back

    def ordered(self, quantity: str, values: Array, joints: tuple[str, ...], names: tuple[str, ...]) -> Array:
        """Return columns in the order of the joints' names, where they have names themselves."""
        if not joints or joints == names:
            return values
        if set(joints) != set(names):
            raise LogError(f"{self.log}: columns of {quantity} are of {', '.join(joints)}, where joints are {', '.join(names)}")
        return values[:, [joints.index(name) for name in names]]

    def _gain(self, n: int) -> Array:
        gain = self.layout.gain
        if needs_gain(self.layout.tau.unit) and not gain:
            raise LogError(f"{self.log}: {gain_wanted(self.layout.tau.unit)}; or as gain = [...] in [torque] of its log.toml")
        if gain and len(gain) not in (1, n):
            raise LogError(f"{self.log}: {len(gain)} gains for {n} joints: give one, or one per joint")
        if wrong := [x for x in gain if not MIN_GAIN <= abs(x) <= MAX_GAIN]:
            raise LogError(
                f"{self.log}: a gain of {wrong[0]:g} makes no torque: give N m a unit of tau for each joint (--gain, or "
                f"gain in [torque] of its log.toml), {MIN_GAIN:g} to {MAX_GAIN:g} in size, negative if the sign is reversed"
            )
        return np.array(gain or (1.0,))

    def _stated(self) -> TorqueChannel | None:
        """Statements of the file about its torques."""
        path = self.path_of(self.layout.tau)
        if (stated := self._table(path).torque) is None:
            return None
        try:
            known = json.loads(stated)
            more = {name: known[name] for name in ("delay_sigma", "period", "lags") if name in known}
            return TorqueChannel(known["meaning"], known["delay"], known["gain"], **more)
        except (ValueError, KeyError, TypeError) as error:
            words = stated.decode(errors="replace")
            raise LogError(f"{path} states {words!r} of its torque, which makes no torque channel") from error

    def path_of(self, source: Source) -> Path:
        """The file of a source; the first of those of a joint each."""
        if "*" in source.file:
            names = matching(source.file, sorted(path.name for path in self.folder.iterdir()))
            return self.folder / names[0][0] if names else self.log
        return self.folder / source.file if source.file else self.log

    def _table(self, path: Path) -> LogTable:
        if path not in self.tables:
            self.tables[path] = read_table(path)
        return self.tables[path]

    def _rows(self, path: Path) -> slice | Array:
        """Rows of a file that belong to the log."""
        kept = None
        for name, value in self.layout.rows.items():
            if path != self.log and name not in self._table(path).columns:
                continue  # a second file may be of one run alone
            column = self._table(path).require(name, path)
            kept = (column == value) if kept is None else kept & (column == value)
            if not kept.any():
                raise LogError(f"{path}: {name} is {value!r} in no row; it goes from {column.min()!s} to {column.max()!s}")
        return slice(None) if kept is None else kept

    def of(self, quantity: str, source: Source) -> tuple[Array, tuple[str, ...]]:
        """Return the columns of a quantity in SI, shape (time, joint), and the names of joints that they have."""
        if "*" in source.file:
            return self._of_files(quantity, source)
        path, columns, joints = self.path_of(source), list[Array](), list[str]()
        table = self._table(path)
        for pattern in source.columns:
            if pattern == UNLOGGED:
                columns.append(np.full(table.rows, np.nan))
                continue
            if pattern in table.columns or "*" not in pattern:
                column = table.require(pattern, path)
                columns += _singly(column)
                joints += table.entries.get(pattern, ())
                continue
            inside = matching(pattern, list(table.columns))
            if not inside:
                raise LogError(f"{path} has no columns {pattern}; its columns: {', '.join(list(table.columns)[:40])}")
            columns += [column for name, _ in inside for column in _singly(table.columns[name])]
            joints += [place for _, place in inside if not re.fullmatch(r"\d+", place)]
        if len({len(column) for column in columns}) != 1:
            raise LogError(f"{path}: columns {', '.join(source.columns)} of {quantity} differ in length")
        values = source.in_si(quantity, np.stack(columns, axis=-1)[self._rows(path)])
        return values, tuple(joints) if len(joints) == len(columns) else ()

    def _of_files(self, quantity: str, source: Source) -> tuple[Array, tuple[str, ...]]:
        """Return the columns of a quantity from files of a joint each, in the order of their numbers."""
        found = matching(source.file, sorted(path.name for path in self.folder.iterdir()))
        if not found:
            raise LogError(f"{self.folder} has no files {source.file}, of which {quantity} is")
        each = [self.of(quantity, replace(source, file=name))[0] for name, _ in found]
        if len({x.shape for x in each}) > 1:
            raise LogError(f"files {source.file} differ in the number of their rows: {', '.join(str(len(x)) for x in each)}")
        t = [self._table(self.folder / name).columns.get(x) for name, _ in found for x in self.layout.t.columns[:1]]
        if not all(x is None or t[0] is None or np.array_equal(x, t[0]) for x in t):
            raise LogError(f"files {source.file} have times of their own: put them on one clock first")
        places = tuple(place for _, place in found)
        return np.concatenate(each, axis=1), () if any(re.fullmatch(r"\d+", place) for place in places) else places

    def require_once(self) -> None:
        """Raise LogError if a column is named for two quantities or joints."""
        used = dict[tuple[Path, str], str]()
        for quantity in ("t", "q", "qd", "tau", "temperature"):
            source: Source = getattr(self.layout, quantity)
            path = self.path_of(source)
            names = list(self._table(path).columns) if source.columns else []
            for name in source.names(names):
                if other := used.get((path, name)):
                    of = f"twice as {quantity}" if other == quantity else f"as {other} and as {quantity}"
                    raise LogError(
                        f"{path}: column {name!r} is named {of}: a column holds one quantity of one joint; correct the "
                        f"columns in its log.toml, or with --columns {quantity}=...; its columns: {', '.join(names[:40])}"
                    )
                used[path, name] = quantity

    def times(self, source: Source, count: int) -> Array:
        """Return the times of a quantity [s]."""
        clock = self.layout.t
        if self.layout.samples:
            return np.arange(float(count))
        path = self.path_of(source) if source.t else self.path_of(clock)
        if not source.t and clock.fs:
            return np.arange(count) / clock.fs
        name = source.t or (clock.columns[0] if clock.columns else "t")
        t = self._table(path).require(name, path)[self._rows(path)] * clock.scale("t")
        if len(t) != count:
            raise LogError(f"{path}: {len(t)} times for {count} samples")
        return t


def _singly(column: Array) -> list[Array]:
    """Return the entries of a column as columns."""
    return [column] if column.ndim == 1 else list(column.T)
