"""What a file of a log holds: columns that have names."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.errors import LogError, SettingError

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # [s]
POSITIONS = {"rad": 1.0, "deg": np.pi / 180, "mrad": 1e-3, "rev": 2 * np.pi, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Units of positions in rad and m, by name."""

ACCELERATIONS = {f"{unit}/s^2": size for unit, size in POSITIONS.items()}  # [rad/s^2, m/s^2]
VELOCITIES = {f"{unit}/s": size for unit, size in POSITIONS.items()} | {"rpm": 2 * np.pi / 60}  # [rad/s, m/s]
TORQUES = {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3, "N cm": 1e-2, "N": 1.0, "kN": 1e3, "A": 1.0, "mA": 1e-3}
TORQUES |= {"%": 1e-2, "permille": 1e-3, "V": 1.0, "1": 1.0}
"""Those that are no torques need a gain beside them; a model may be in volts."""

UNITS: Mapping[str, Mapping[str, float]] = {
    "t": TIMES,
    "q": POSITIONS,
    "qd": VELOCITIES,
    "qdd": ACCELERATIONS,
    "tau": TORQUES,
    "temperature": {"degC": 1.0},
    "command": POSITIONS,
    "forward": TORQUES,
    "velocity": VELOCITIES,
    "on": {"1": 1.0},
    "voltage": {"V": 1.0, "mV": 1e-3},
}
"""Units of each quantity of a log, that of SI first."""

SI = {quantity: next(iter(units)) for quantity, units in UNITS.items()}
"""Units that are taken where a file states none; those of slides are m and N, which are of the same size."""

NEED_GAIN = {"A": "A", "mA": "A", "%": "rated value", "permille": "rated value"}
"""Units of efforts that a gain makes torques [N m] of, N m/A or N m at 100 %, and those in which such efforts are read."""

OF_A_TURN = {"q": "count", "command": "count", "qd": "count/s"}  # Units of quantities whose size is said, counts a turn
OF_RATED = ("%", "permille")  # Units of efforts whose size may be said: the rated torque [N m]


def factor(quantity: str, unit: str) -> float:
    """Factor from values in a unit to SI.

    A unit may have a size, count:131072 (a turn), permille:2.4 (N m rated), and its own value at zero, count:131072@4194304.

    Raises
    ------
    SettingError
        If it is none of this quantity, or its size or zero is no number.
    """
    known, (name, size, _) = UNITS[quantity], _parts(unit)
    plain = _plain(name)
    if plain == (counts := OF_A_TURN.get(quantity)):
        if not size:
            example = f"{counts}:131072, and perhaps the count at zero, {counts}:131072@4194304"
            raise SettingError(f"unit {unit!r} of {quantity} needs the counts of a turn: {example}")
        return 2 * np.pi / size
    found = next((name for name in known if _plain(name) == plain), None)
    if found is None:
        more = [f"{counts}:COUNTS_OF_A_TURN"] if counts else []
        raise SettingError(f"unit {unit!r} of {quantity} is unknown; known: {', '.join([*known, *more])}")
    if size and found not in OF_RATED:
        raise SettingError(f"unit {unit!r} of {quantity}: {found} has no size; leave :{size:g} out")
    return known[found] * (size or 1.0)


def zero(unit: str) -> float:
    """What a unit's values are at zero, as in count:131072@4194304; 0 where it does not say."""
    return _parts(unit)[2]


def _parts(unit: str) -> tuple[str, float, float]:
    """Name, size (0 if none) and zero of a unit."""
    name, _, at = unit.partition("@")
    name, mark, size = name.partition(":")
    try:
        found = name, float(size or 0), float(at or 0)
    except ValueError:
        raise SettingError(f"unit {unit!r}: after : and @ are numbers, as in count:131072@4194304") from None
    if not np.isfinite(found[1:]).all() or found[1] < 0 or (mark and not found[1]):
        raise SettingError(f"unit {unit!r}: its size must be above 0, and its zero finite")
    return found


def needs_gain(unit: str) -> bool:
    """True if an effort in this unit is no torque."""
    name, size, _ = _parts(unit)
    return not size and _plain(name) in map(_plain, NEED_GAIN)


def gain_wanted(unit: str) -> str:
    """Question for the gain of efforts in a unit."""
    return f"tau is in {unit}, no torque: say its gain, --gain N m per {read_unit(unit)} of each joint, gears included"


def in_volts(unit: str) -> bool:
    """True if an effort in this unit is in volts, and so is a model of it."""
    return _plain(_parts(unit)[0]) == "V"


def read_unit(unit: str) -> str:
    """Unit in which efforts are that need a gain: mA are read as A."""
    return next(read for name, read in NEED_GAIN.items() if _plain(name) == _plain(_parts(unit)[0]))


def named_unit(quantity: str, column: str) -> str:
    """Return the unit that the name of a column ends with, as "q1 [deg]" or tau1_mNm does; empty if it has none."""
    found = re.search(r"[\[(]([^\])]+)[\])]\s*$|_([A-Za-z]+)$", column)
    text = _plain(next((part for part in found.groups() if part), "")) if found else ""
    return next((name for name in UNITS[quantity] if text != "1" and text and _plain(name) == text), "")


def _plain(unit: str) -> str:
    """Return a unit without what people write differently: N m, Nm and N*m are one."""
    short = {"degrees": "deg", "degree": "deg", "seconds": "s", "sec": "s", "msec": "ms", "amps": "A", "ampere": "A"}
    short |= {"percent": "%", "‰": "permille", "counts": "count", "ticks": "count", "tick": "count", "inc": "count"}
    short |= {"counts/s": "count/s", "revs": "rev", "turns": "rev", "r/min": "rpm", "volt": "V", "volts": "V"}
    text = re.sub(r"[\s*·._-]", "", unit.strip()).replace("°", "deg").replace("µ", "u").replace("μ", "u")
    text = re.sub(r"(?<=[a-zA-Z])ps$", "/s", text) if text in ("radps", "degps", "mps") else text
    return short.get(text.lower(), text)


COPIES = 3  # How often the values of a log are in memory at once while it is read and turned into SI


def require_room(path: Path, what: str, size: int) -> None:
    """Raise LogError if the values of a file, of so many bytes, are more than this process can hold."""
    if (needed := 1e-9 * COPIES * size) > (room := memory()):
        takes = f"reading them takes {needed:.3g} GB, and there are {room:.3g} GB"
        raise LogError(f"{path} says that it holds {what}: {takes}: cut the log")


def memory() -> float:
    """Return the memory that this process may have [GB]: of the machine, or its limit; infinity where nobody says."""
    try:
        found = 1e-9 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        found = float("inf")
    try:
        import resource
    except ImportError:  # not on Windows
        return found
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return found if limit == resource.RLIM_INFINITY else min(found, 1e-9 * limit)


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns of a file by their names, as they are in it."""

    columns: Mapping[str, Array]
    """A column may be of several entries, as arrays of NumPy and lists of Parquet are, shape (row,) or (row, entry)."""
    torque: bytes | None = None
    """What the file itself says of its torque, as idbench writes it."""
    named: bool = True
    """Whether the names are those of the file, and not numbers of its columns."""
    entries: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Names of the entries of a column, where the file has them (joints of a JointState)."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Columns that hold no numbers, and what they do hold."""
    said: str = ""
    """What of the file was passed over."""

    @property
    def rows(self) -> int:
        """Number of rows of the longest column."""
        return max((len(column) for column in self.columns.values()), default=0)

    def require(self, name: str, path: Path) -> Array:
        """Return a column; raise LogError that lists those of the file if it has none of this name, or of words."""
        if name in self.words:
            raise LogError(f"{path}: column {name} holds {self.words[name]}")
        if name not in self.columns:
            known = ", ".join(list(self.columns)[:40]) or "none"
            raise LogError(f"{path} has no column {name!r}; its columns: {known}")
        return self.columns[name]
