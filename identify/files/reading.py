"""Logs of any file, in SI units."""

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
from idbench.identify.files.guess import FEWEST, guess, kind_of
from idbench.identify.files.guess_units import with_units
from idbench.identify.files.layout import LAYOUT, UNLOGGED, Asked, LogLayout, Source, matching, own_layout
from idbench.identify.files.table import SI, LogTable, needs_gain


def standard_layout(path: Path, table: LogTable) -> LogLayout | None:
    """Return the layout of a file whose columns are called as idbench calls them, all in SI units; None if they are not."""
    names = [*table.columns, *table.words]
    own = "q" if any(re.fullmatch(r"q(\d+|_.+)", name) for name in names) else "qd"  # velocities alone are integrated
    n = sum(bool(re.fullmatch(rf"{own}\d+", name)) for name in names)
    of_both = {name[1:] for name in names if name.startswith("q_")} & {name[3:] for name in names if name.startswith("tau_")}
    mixed = [name for name in names if n and name.removeprefix("tau").removeprefix("q") in of_both]
    if mixed:
        numbered = next(name for name in names if re.fullmatch(r"q\d+", name))
        raise LogError(
            f"{path} numbers some joints ({numbered}) and names others ({', '.join(mixed)}): call all columns by numbers, "
            "q1, q2, ..., or all by the names of their joints, or say what they are with --columns"
        )
    joints = () if n else tuple(name.removeprefix(f"{own}_") for name in names if name.startswith(f"{own}_"))
    ends = [f"_{joint}" for joint in joints] or [str(j + 1) for j in range(max(n, 1))]
    needed = ["t", *(f"{own}{end}" for end in ends), *(f"tau{end}" for end in ends)]
    present = [name for name in names if re.fullmatch(rf"t|({own}|tau)_.+" if joints else rf"t|({own}|tau)\d+", name)]
    missing, unexpected = [x for x in needed if x not in present], [x for x in present if x not in needed]
    torques = tuple(name if name in present else UNLOGGED for name in (f"tau{end}" for end in ends))
    others = [name for name in names if name not in present and kind_of(name) == "tau"]
    if any(torques) and not others and not unexpected:  # rows of joints without a torque are left out
        missing = [name for name in missing if not name.startswith("tau")]
    if missing or unexpected:
        return None
    qd = tuple(f"qd{end}" for end in ends)
    qdd = tuple(f"qdd{end}" for end in ends)
    velocities, accelerations = (Source(x) if set(x) <= set(table.columns) else Source() for x in (qd, qdd))
    q, tau = Source(tuple(f"q{end}" for end in ends) if own == "q" else ()), Source(torques)
    warm = tuple(f"temperature{end}" for end in ends)
    every = warm if set(warm) <= set(table.columns) else ("temperature",) if "temperature" in table.columns else ()
    return LogLayout(Source(("t",)), q, tau, velocities, accelerations, joints=joints, temperature=Source(every))


CLOCKS = 1e6  # Times [s] beyond this are those of a calendar: logs count from their beginning
MIN_GAIN, MAX_GAIN = 1e-9, 1e9  # Sizes of gains beyond which they are slips
LAYOUT_FILE = ".toml"  # What the name of a layout ends with, which may be given in the place of a log


@dataclass(frozen=True, eq=False)
class Understood:
    """What is understood of a log, and by whose words."""

    files: "LogFiles"
    """Its files and their layout."""
    doubts: tuple[str, ...] = ()
    """What should be looked at."""
    sure: bool = True
    """Whether doubts are none that must be settled: the columns' names are those of idbench, or a layout says all."""
    said: str = ""
    """Which file says what the columns are; empty if that was the log itself."""

    @property
    def passed_over(self) -> list[str]:
        """What of the files that were read was passed over."""
        return [table.said for table in self.files.tables.values() if table.said]

    def columns(self) -> LogColumns:
        """What the log holds; raise LogError that asks for what is not known."""
        if self.doubts and not self.sure:
            log, words = self.files.log, "; ".join(self.doubts)
            raise LogError(f"{log}: {words}; or correct a layout: idbench log {log} --write makes {own_layout(log)}")
        columns = self.files.columns
        said = [*([self.said] if self.said else []), *self.passed_over]
        said += ["a model in volts: read V where N m stands; Fs is kS, Fv kV"] * (self.files.layout.tau.unit.upper() == "V")
        return replace(columns, said="; ".join(said))


def understood(path: Path, asked: Asked = Asked(), *, anew: bool = False) -> Understood:  # noqa: B008  # frozen
    """Return what is understood of a log: by the layout beside it (not `anew`), by names of idbench's, or a guess.

    Raises
    ------
    LogError
        If it cannot be read, or nothing in it looks like positions and torques.
    """
    path = Path(path)
    if path.suffix.lower() == LAYOUT_FILE:
        layout = asked.layout or LogLayout.read(path)
        files = [source.file for source in (layout.q, layout.t, layout.tau) if source.file]
        if not files:
            raise LogError(f'{path} names no file of the log: add a line such as file = "run.csv" before the tables')
        return Understood(LogFiles(path.parent / files[0], path.parent, asked.over(layout)), said=layout.words(path))
    if asked.layout:
        return Understood(LogFiles(path, path.parent, asked.over(asked.layout)))
    found, tables = None if anew else LogLayout.beside(path), dict[Path, LogTable]()
    if not found or found[1].name == LAYOUT:
        tables = {path: read_table(path)}
        found = None if tables[path].torque is not None else found  # what idbench wrote is no log of that folder's recorder
    if found:
        return Understood(LogFiles(path, found[1].parent, asked.over(found[0]), tables), said=found[0].words(found[1]))
    table = tables[path]
    if standard := standard_layout(path, table):
        layout = asked.over(standard)
        looks = with_units(layout, table, asked)[1] if table.rows >= FEWEST and not table.words else []
        return Understood(LogFiles(path, path.parent, layout, tables), tuple(looks))
    layout, doubts = guess(path, table, asked)
    sources = ((name, getattr(layout, name)) for name in ("t", "q", "qd", "tau"))
    words = "; ".join(f"{name} [{of.unit or SI[name]}] = {', '.join(of.columns)}" for name, of in sources if of.columns)
    return Understood(LogFiles(path, path.parent, layout, tables), tuple(doubts), False, f"columns by their names: {words}")


def read_columns(path: Path, asked: Asked = Asked()) -> LogColumns:  # noqa: B008  # frozen
    """Return times, positions, torques and velocities of a log, whatever its times.

    Parameters
    ----------
    path : Path
        The log: CSV or other text, Parquet, NumPy, Matlab, a ROS bag; or a layout that names its files.
    asked : Asked, optional
        What is said of its columns; all else is as `log.toml` beside it says, or as columns are called: t, q1, q2, ..., tau1,
        tau2, ... in SI units (q_elbow, tau_elbow where joints have names), and qd1, qd2, ... if there are; or other names that
        leave no doubt.

    Raises
    ------
    LogError
        If it cannot be read, lacks a column, or leaves a doubt that nobody has settled.
    """
    return understood(path, asked).columns()


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
        self._require_once()
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
        q, tau, qd = self._of_joints(q, tau * gain, qd)
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

    def _of_joints(self, q: Array, tau: Array, qd: Array | None) -> tuple[Array, Array, Array | None]:
        """Return positions, torques and velocities of joints, where those of motors were logged."""
        if not self.layout.motors:
            return q, tau, qd
        M = np.array(self.layout.motors)
        if len(M) != q.shape[1]:
            raise LogError(f"{self.log}: the matrix of [motors] has {len(M)} rows, the log {q.shape[1]} motors")
        back = np.linalg.inv(M).T
        return q @ back, tau @ M, None if qd is None else qd @ back

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
            unit = self.layout.tau.unit
            raise LogError(
                f"{self.log}: tau is in {unit}, no torque: give the gain of each joint in N m/{unit} with --gain, or as "
                "gain = [...] in [torque] of its log.toml"
            )
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
        path = self._path(self.layout.tau)
        if (stated := self._table(path).torque) is None:
            return None
        try:
            known = json.loads(stated)
            more = {name: known[name] for name in ("delay_sigma", "period", "lags") if name in known}
            return TorqueChannel(known["meaning"], known["delay"], known["gain"], **more)
        except (ValueError, KeyError, TypeError) as error:
            words = stated.decode(errors="replace")
            raise LogError(f"{path} states {words!r} of its torque, which makes no torque channel") from error

    def _path(self, source: Source) -> Path:
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
        path, columns, joints = self._path(source), list[Array](), list[str]()
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

    def _require_once(self) -> None:
        """Raise LogError if a column is named for two quantities or joints."""
        used = dict[tuple[Path, str], str]()
        for quantity in ("t", "q", "qd", "tau", "temperature"):
            source: Source = getattr(self.layout, quantity)
            path = self._path(source)
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
        path = self._path(source) if source.t else self._path(clock)
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
