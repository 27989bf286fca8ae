"""What the columns of a log are: a small file, log.toml, that stands beside it."""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.data.motion_log import TorqueChannel
from idbench.identify.errors import IdentificationError, LogError
from idbench.identify.files.table import SI, UNITS, factor, zero

QUANTITIES = tuple(UNITS)
"""What columns may be. Of servos: commanded positions, what is commanded beside them, whether torque is on, and the supply."""

UNLOGGED = ""  # Name of the column of a joint of which a quantity was not logged
SINGULAR = 1e-12  # Determinants below this are none
SLOWEST, FASTEST = 1e-3, 1e7  # Sampling frequencies [Hz] outside of which a slip is suspected
LAYOUT = "log.toml"  # Name of the file that says what all logs of its folder hold


@dataclass(frozen=True)
class Source:
    """Where a quantity of a log is."""

    columns: tuple[str, ...] = ()
    """Names of its columns, joint by joint, empty of a joint that was not logged; or one that stands for several: a column of
    several entries, or a name with a * in the place of numbers or names."""
    unit: str = ""
    """Theirs."""
    file: str = ""
    """The file that holds them, from where the layout is; by default that of the log. A name with a * is that of several, a
    joint each."""
    t: str = ""
    """Column of that file with its own times, in the unit of t; by default those of the log."""
    fs: float | None = None
    """Sampling frequency [Hz] where there are no times."""

    @property
    def logged(self) -> tuple[str, ...]:
        """Names of the columns that there are."""
        return tuple(name for name in self.columns if name != UNLOGGED)

    def names(self, columns: Sequence[str]) -> list[str]:
        """Return the columns of a file that it stands for."""
        every = (
            [pattern] if pattern in columns or "*" not in pattern else [name for name, _ in matching(pattern, columns)]
            for pattern in self.logged
        )
        return [name for each in every for name in each]

    def scale(self, quantity: str) -> float:
        """Factor from its values to SI."""
        return factor(quantity, self.unit or SI[quantity])

    def in_si(self, quantity: str, values: Array) -> Array:
        """Return values in SI."""
        return (values - zero(self.unit)) * self.scale(quantity)


@dataclass(frozen=True)
class LogLayout:
    """Which columns of a log's files are times, positions, velocities and torques, and in which units."""

    t: Source = Source(("t",))  # frozen
    """Where times are."""
    q: Source = Source(("q*",))  # frozen
    """Where positions are."""
    tau: Source = Source(("tau*",))  # frozen
    """Where torques are."""
    qd: Source = Source()  # frozen
    """Velocities; without columns if there are none."""
    qdd: Source = Source()  # frozen
    """Accelerations, of samples that are by themselves."""
    samples: bool = False
    """Whether rows are samples by themselves, with q, qd and qdd: times do not count."""
    joints: tuple[str, ...] = ()
    """Names of the joints, in the order of the columns."""
    torque: TorqueChannel | None = None
    """What the torque means."""
    gain: tuple[float, ...] = ()
    """Torque over what is logged, in the unit of tau, joint by joint, or one for all."""
    rows: Mapping[str, float] = field(default_factory=dict)
    """Only rows in which these columns have these values: an episode."""
    temperature: Source = Source()  # frozen
    """Temperatures of the joints, or of all; without columns if there are none."""
    command: Source = Source()  # frozen
    """Commanded positions of servos."""
    forward: Source = Source()  # frozen
    """What is commanded beside: duty, torque or current."""
    velocity: Source = Source()  # frozen
    """Commanded velocities of servos."""
    on: Source = Source()  # frozen
    """Above 0.5 where torque is on."""
    voltage: Source = Source()  # frozen
    """Supply [V]."""
    motors: tuple[tuple[float, ...], ...] = ()
    """Of a log of motors: motor positions = matrix times joint positions; torques are turned by its dual."""

    @classmethod
    def beside(cls, log: Path) -> tuple[Self, Path] | None:
        """Return the layout that stands beside a log, under its name or as log.toml, and its path; None if there is none."""
        for path in (own_layout(log), log.parent / LAYOUT):
            if path.is_dir() and path.name == LAYOUT:
                what = "a folder, where a file says what the columns of logs are"
                raise LogError(f"{path} is {what}: rename it, or put them elsewhere")
            if path.is_file() and path != log and (path.name == LAYOUT or _is_layout(path)):
                return cls.read(path), path
        return None

    @property
    def files(self) -> tuple[str, ...]:
        """Files that it names."""
        return tuple(source.file for source in (getattr(self, name) for name in QUANTITIES) if source.file)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the layout of a file; raise LogError that names what is unknown or wrong in it."""
        try:
            return cls._of(tomllib.loads(path.read_text(encoding="utf-8")))
        except OSError as error:
            raise LogError(f"cannot read {path}: {error.strerror or error}") from error
        except (ValueError, TypeError, RecursionError) as error:  # ours are ValueErrors, too
            raise LogError(f"{path}: {error}") from error

    @classmethod
    def _of(cls, stated: dict[str, Any]) -> Self:
        _require_known("", stated, (*QUANTITIES, "joints", "torque", "rows", "file", "motors", "samples"))
        file = str(stated.get("file", ""))
        sources = {name: _source(name, stated[name], file) for name in QUANTITIES if name in stated}
        motors = dict(stated.get("motors", {}))
        _require_known("motors", motors, ("matrix",))
        torque = dict(stated.get("torque", {}))
        _require_known("torque", torque, ("meaning", "delay", "gain", "delay_sigma", "period", "lags"))
        gain = torque.pop("gain", [])
        gains = tuple(map(float, gain if isinstance(gain, list) else [gain]))
        channel = TorqueChannel(**torque) if "meaning" in torque else None
        if torque and channel is None:
            raise LogError("[torque] states a delay and no meaning: held, instantaneous or averaged")
        rows = stated.get("rows", {})
        if not isinstance(rows, dict):
            raise LogError(f"rows = {rows!r} must be a table: [rows], then lines such as episode_index = 3")
        rows = {str(k): float(v) for k, v in rows.items()}
        matrix = tuple(tuple(map(float, row)) for row in motors.get("matrix", ()))
        joints = stated.get("joints", [])
        if not isinstance(joints, list) or not all(isinstance(name, str) and name for name in joints):
            raise LogError(f'joints = {joints!r:.60} must be names in quotes, such as joints = ["1", "2"]')
        if twice := sorted({name for name in joints if joints.count(name) > 1}):
            raise LogError(f"joints = {joints!r:.60}: {', '.join(twice)} is given twice; each joint has a name of its own")
        is_square = all(len(row) == len(matrix) for row in matrix)
        if matrix and (not is_square or abs(np.linalg.det(np.array(matrix))) < SINGULAR):
            raise LogError(f"[motors]: matrix = {[list(row) for row in matrix]} must be square and have an inverse")
        if (t := sources.get("t")) is not None and not t.columns and not t.fs:
            sources["t"] = replace(t, columns=("t",))
        samples = bool(stated.get("samples", False))
        if samples:
            sources.setdefault("q", Source())
        return cls(**sources, samples=samples, joints=tuple(joints), torque=channel, gain=gains, rows=rows, motors=matrix)

    def where(self, quantity: str, source: Source) -> Self:
        """Return the layout with another source of a quantity: t, q, qd or tau."""
        return replace(self, **{quantity: source})  # type: ignore[arg-type]  # of one of these names

    def words(self, path: Path) -> str:
        """Sentence on where each quantity and its unit are from."""
        each = [
            f"{name} from {', '.join(source.columns[:3])}{', ...' * (len(source.columns) > 3)} in {source.unit or SI[name]}"
            for name in QUANTITIES
            if (source := getattr(self, name)).columns
        ]
        return f"columns are what {path} says: {'; '.join(each)}"

    @property
    def text(self) -> str:
        """The layout as the text of a file."""
        lines = [f"joints = {json.dumps(list(self.joints), ensure_ascii=False)}"] if self.joints else []
        lines += ["samples = true  # rows by themselves"] if self.samples else []
        for name in QUANTITIES:
            source: Source = getattr(self, name)
            if name == "q" and not source.columns:
                lines += ["", "[q]", f"columns = []  # {'they are 0' if self.samples else 'velocities are integrated'}"]
            elif source != Source():
                lines += ["", f"[{name}]", *_lines(source, SI[name])]
        lines += ["", "[torque]"]
        if self.torque:
            lines += [f'meaning = "{self.torque.meaning}"', f"delay = {self.torque.delay!r}"]
            lines += [f"period = {self.torque.period!r}"] if self.torque.period else []
            lines += [f"lags = {list(self.torque.lags)}"] if self.torque.lags else []
        else:
            lines += ['# meaning = "held"  # or "instantaneous", "averaged": see docs/your-own-log.md', "# delay = 0.0  # [s]"]
        unit = self.tau.unit or SI["tau"]
        lines += [f"gain = {list(self.gain)}"] if self.gain else [f"# gain = [1.0]  # N m per {unit}, of all joints or of each"]
        if self.motors:
            lines += ["", "[motors]", f"matrix = {[list(row) for row in self.motors]}"]
        if self.rows:
            lines += ["", "[rows]", *(f"{json.dumps(name)} = {value!r}" for name, value in self.rows.items())]
        return "\n".join(lines).strip() + "\n"


@dataclass(frozen=True)
class Asked:
    """What is said of a log's columns beside its own words: it changes what it names, and nothing else."""

    layout: LogLayout | None = None
    """A layout in the place of that beside the log."""
    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the columns of t, q, qd, qdd or tau."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Their units."""
    rows: Mapping[str, float] = field(default_factory=dict)
    """Only rows in which these columns have these values."""
    gain: tuple[float, ...] = ()
    """Torque over what is logged."""
    samples: bool = False
    """Whether rows are samples by themselves."""

    def __post_init__(self) -> None:
        for quantity, unit in self.units.items():
            factor(quantity, unit)

    def over(self, layout: LogLayout) -> LogLayout:
        """Return a layout with what is said here."""
        for name, columns in self.columns.items():
            layout = layout.where(name, replace(getattr(layout, name), columns=columns))
        for name, unit in self.units.items():
            layout = layout.where(name, replace(getattr(layout, name), unit=unit))
        samples = self.samples or layout.samples
        return replace(layout, gain=self.gain or layout.gain, rows={**layout.rows, **self.rows}, samples=samples)


def own_layout(log: Path) -> Path:
    """Path of the file that says what one log alone holds, whether it is there or not."""
    return (log.with_suffix("") if log.suffix.lower() == ".gz" else log).with_suffix(".toml")


def matching(pattern: str, names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the names that a pattern with a * stands for, and what is in its place: by number, or in the order of the file."""
    before, _, after = pattern.partition("*")
    # q* is q1 and q_elbow, not qd1.
    star = r"(\d+|[\W_].*)" if before[-1:].isalnum() else "(.+?)"
    matches = [re.fullmatch(re.escape(before) + star + re.escape(after), name) for name in names]
    found = [(match.string, match[1].strip(" _-./[]()")) for match in matches if match]
    numbered = [re.fullmatch(r"\D*(\d+)\D*", inner) for _, inner in found]
    if found and all(numbered):
        order = sorted(range(len(found)), key=lambda i: int(numbered[i][1]))  # type: ignore[index]  # all are matches
        return [found[i] for i in order]
    return found


def _is_layout(path: Path) -> bool:
    """True if a file beside a log says what its columns are: a robot or a scenario may have the same name."""
    try:
        return bool({"t", "q", "qd", "tau", "torque", "rows"} & set(tomllib.loads(path.read_text(encoding="utf-8"))))
    except (OSError, ValueError, RecursionError):
        return True  # it is complained of


def _source(name: str, stated: Any, file: str) -> Source:
    if isinstance(stated, (str, list)):
        stated = {"columns": stated}
    if not isinstance(stated, dict):
        raise LogError(f"{name} = {stated!r} must name columns, or be a table [{name}]")
    _require_known(name, stated, tuple(f.name for f in fields(Source)))
    columns = stated.get("columns", [])
    names = tuple(map(str, [columns] if isinstance(columns, (str, int)) else columns))
    unit, file, t = str(stated.get("unit", "")), str(stated.get("file", file)), str(stated.get("t", ""))
    found = Source(names, unit, file, t, None if (fs := stated.get("fs")) is None else float(fs))
    if found.fs is not None and not SLOWEST <= found.fs <= FASTEST:
        raise LogError(f"[{name}]: fs = {found.fs:g} must be between {SLOWEST:g} and {FASTEST:g} Hz: samples a second")
    try:
        found.scale(name)
    except IdentificationError as error:
        raise LogError(f"[{name}]: {error}") from error
    return found


def _require_known(where: str, stated: Mapping[str, Any], known: Sequence[str]) -> None:
    if wrong := [key for key in stated if key not in known]:
        place = f" in [{where}]" if where else ""
        raise LogError(f"{', '.join(wrong)}{place} is unknown; known: {', '.join(known)}")


def _lines(source: Source, si: str) -> list[str]:
    """Return the lines of a table of a layout's text."""
    columns = source.columns[0] if len(source.columns) == 1 else list(source.columns)
    lines = [f"columns = {json.dumps(columns, ensure_ascii=False)}"] if source.columns else []
    lines += [f'unit = "{source.unit or si}"']
    lines += [f"{name} = {json.dumps(value)}" for name in ("file", "t", "fs") if (value := getattr(source, name))]
    return lines
