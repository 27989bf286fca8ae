"""What the columns of a file probably are, from their names and values: a layout to start from, not one to rely on."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from idbench.identify.errors import LogError
from idbench.identify.files.guess_units import FEWEST, with_units
from idbench.identify.files.layout import UNLOGGED, Asked, LogLayout, Source, matching
from idbench.identify.files.table import LogTable

WORDS = {
    "qdd": "qdd ddq qpp acc acceleration accelerations joint_acceleration",
    "t": "t time timestamp timestamps stamp stamps clock zeit sec secs seconds elapsed",
    "qd": "qd dq qp qdot vel velocity velocities velo speed speeds omega joint_velocity",
    "tau": "tau torque torques effort efforts eff trq current currents cur moment moments load amps tauj",
    "q": "q pos position positions angle angles theta state jpos encoder enc qj",
}
"""Words in the names of columns, by what they stand for; the first that is there holds."""

OTHERS = "cmd command commanded des desired ref reference target set setpoint goal error ext enable enabled"
"""Words of columns that are not what was measured."""

EPISODES = ("episode_index", "episode", "run", "trial")  # Columns that distinguish the runs of a file

MOST_BLOCKS = (3, 4, 5, 6, 7, 8)
"""Quantities of each joint that a file without names may have: positions, velocities, accelerations, torques, set points."""

ALIKE = 0.2  # Departure of a column from the derivative of another, as a share, up to which it is its velocity


class UnknownColumnsError(LogError):
    """Names of columns that look like no positions, or no torques."""

    def __init__(self, message: str, layout: LogLayout, columns: tuple[str, ...]) -> None:
        super().__init__(message)
        self.layout = layout
        """What could be said."""
        self.columns = columns
        """All columns of the file."""

    @property
    def start(self) -> str:
        """A layout to correct: what could be said, and all columns."""
        every = ", ".join(json.dumps(name, ensure_ascii=False) for name in self.columns)
        asked = [name for name in ("t", "q", "tau") if not getattr(self.layout, name).columns]
        lines = [f"[{name}]\ncolumns = []  # of: {every}" for name in asked]
        return "\n\n".join([self.layout.text.rstrip(), *lines]) + "\n"


def guess(path: Path, table: LogTable, asked: Asked = Asked()) -> tuple[LogLayout, list[str]]:  # noqa: B008  # frozen
    """Return the probable layout of a file's columns, with what is asked of them in it, and doubts that nobody has settled.

    Raises
    ------
    LogError
        If nothing in it looks like positions and torques.
    """
    told = {"q", "tau"} <= set(asked.columns)
    if table.rows < FEWEST and not told and not table.named:
        raise LogError(f"{path}: {_nameless(table)}")
    found = _by_names(table, asked) if table.named else LogLayout() if told else _by_values(path, table)
    found = asked.over(found)
    missing = [name for name in ("q", "tau") if not getattr(found, name).columns]
    if missing and not (missing == ["q"] and found.qd.columns):  # velocities alone: they are integrated
        what = " and ".join({"q": "positions", "tau": "torques or currents"}[name] for name in missing)
        columns, options = tuple(table.columns), " ".join(f"{name}=..." for name in missing)
        said = f"nothing in {path} looks like {what}; its columns: {', '.join(columns[:40])}; say which: --columns {options}"
        said += f"; {table.said}" if table.said else ""
        raise UnknownColumnsError(said, found, columns)
    free = not found.t.columns and not found.t.fs
    found = replace(found, samples=found.samples or (free and bool(found.qdd.columns)))
    doubts = [] if told or table.named else [_nameless(table)]
    if not asked.rows:
        episodes, more = _episodes(table)
        found, doubts = replace(found, rows={**found.rows, **episodes}), doubts + more
    doubts += _alike(table, found, asked)
    layout, more = with_units(found, table, asked)
    return layout, doubts + more


def _nameless(table: LogTable) -> str:
    joints = max(1, (len(table.columns) - 1) // 2)
    line = ",".join(["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(joints))])
    return f"it has no header, its first line is numbers: put a line of names before it, such as {line}"


def _episodes(table: LogTable) -> tuple[dict[str, float], list[str]]:
    """Condition that selects the first episode, where a file has several, and doubts."""
    for name, column in table.columns.items():
        if name.lower() in EPISODES and column.ndim == 1 and len(values := np.unique(column)) > 1:
            first = float(values[0])
            return {name: first}, [f"{len(values)} runs by {name}: say which, --rows {name}={first:g}"]
    return {}, []


def _alike(table: LogTable, found: LogLayout, asked: Asked) -> list[str]:
    """Return doubts about columns that could have been taken in the place of others."""
    groups, doubts, free = _groups(table), list[str](), not {"q", "tau"} <= set(asked.columns)
    motion = found.q if found.q.columns else found.qd
    every = list(table.columns)
    n, torques = (sum(_entries(table, x) for x in of.names(every)) + of.columns.count(UNLOGGED) for of in (motion, found.tau))
    if n != torques and free:
        what = "positions" if found.q.columns else "velocities"
        doubts.append(f"{n} columns of {what} and {torques} of torques: one of each a joint")
    place = {name: place for names in groups.values() for name, place in names}
    q, tau = ([place.get(name, "") for name in source.names(every)] for source in (motion, found.tau))
    q = list(found.joints) or q
    if free and n == torques == len(q) == len(tau) and set(q) != set(tau):  # columns of several entries have no places
        doubts.append(f"positions are of {', '.join(q)}, torques of {', '.join(tau)}: are these the same joints?")
    if free and all(place.isdigit() for place in q) and q and len(q) <= max(map(int, q)) - min(map(int, q)):
        doubts.append(f"positions are numbered {', '.join(q)}: are some missing?")
    rest = [name for (of, _), names in groups.items() for name, _ in names if of == "tau" and name not in found.tau.columns]
    if UNLOGGED in found.tau.columns and rest:
        doubts.append(f"some joints have no column of torques like {found.tau.logged[0]}: are they {', '.join(rest)}?")
    for kind in {"t", "q", "tau"} - set(asked.columns):
        chosen = set(getattr(found, kind).columns)
        for (of, _), names in groups.items():
            others = [name for name, _ in names]
            count = 1 if kind == "t" else sum(_entries(table, name) for name in others)
            if of == kind and not chosen & set(others) and count == (1 if kind == "t" else n):
                doubts.append(f"{kind}: {', '.join(sorted(chosen))} are taken; {', '.join(others)} could be meant, too")
    return doubts


def _by_names(table: LogTable, asked: Asked) -> LogLayout:
    """Return a layout by what columns are called, and which are asked for; the others go with these."""
    every, places = list(table.columns), list[str]()
    given = {kind: Source(columns).names(every) for kind, columns in asked.columns.items()}
    taken = {name for names in given.values() for name in names}
    groups = {key: left for key, names in _groups(table).items() if (left := [one for one in names if one[0] not in taken])}
    found, n = LogLayout(q=Source(), tau=Source()), 0
    for kind in ("t", "q", "tau", "qd", "qdd"):
        choices = {stem: names for (k, stem), names in groups.items() if k == kind}
        if kind in given:
            stars = [pair for pattern in asked.columns[kind] if "*" in pattern for pair in matching(pattern, every)]
            choices = {"": stars or [(name, place_of(name)) for name in given[kind]]}
        if kind == "t":
            times = [names[0][0] for names in choices.values() if names]
            found = replace(found, t=Source((times[0],)) if times else Source())
            continue
        counts = {stem: sum(_entries(table, name) for name, _ in names) for stem, names in choices.items()}
        best = next((stem for stem, count in counts.items() if count == n), None) if n else None
        if best is None and kind not in ("qd", "qdd") and counts:
            best = max(counts, key=lambda stem: counts[stem])
        if best is None:
            continue
        names = _sorted(choices[best], found.joints)
        n = n or counts[best]
        found = found.where(kind, Source(tuple(name for name, _ in names)))
        if kind == "q":
            places = [place for _, place in names]
            named = len(names) == n and not any(re.fullmatch(r"\d*", place) for place in places)
            joints = table.entries.get(names[0][0], ()) if len(names) == 1 else tuple(places) if named else ()
            found = replace(found, joints=joints)
        if kind == "tau" and len(names) < n and (of := {place: name for name, place in names}).keys() < set(places):
            found = found.where("tau", Source(tuple(of.get(place, UNLOGGED) for place in places)))
    return found


def place_of(name: str) -> str:
    """Joint, or its number, in a column's name; empty if it has none."""
    found = _parsed(name)
    return (found.place or found.number) if found else ""


def kind_of(name: str) -> str:
    """Quantity that a column's name stands for, of `WORDS`; empty if it looks like none of them."""
    found = _parsed(name)
    return found.kind if found else ""


class _Name(NamedTuple):
    """A column's name: what it stands for, by which word, what else is in it, its number, and all beside the word."""

    name: str
    kind: str
    word: str
    rest: str
    number: str
    place: str


def _groups(table: LogTable) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """Return columns that belong together, with the number or the name of their joint, by what they are and have in common.

    Where one joint has a name without a number (elbow), those of others (wrist_1) are names, too.
    """
    every = table.columns.items()
    parsed = [found for name, x in every if (found := _parsed(name)) and (x.ndim == 1 or found.kind != "t")]
    named = {(found.kind, found.word) for found in parsed if found.place and not found.number}
    groups: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for found in parsed:
        by_name = (found.kind, found.word) in named
        stem = found.word if by_name or not found.number else f"{found.word} {found.rest}"
        stem = stem if _entries(table, found.name) == 1 else found.name
        groups.setdefault((found.kind, stem), []).append((found.name, found.place if by_name else found.number))
    return groups


def _parsed(name: str) -> _Name | None:
    """Quantity and joint of a column's name; None if it is neither a joint's quantity nor a time."""
    bare = re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", name)
    tokens = re.findall(r"[a-z]+|\d+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", bare).lower())
    if set(tokens) & set(OTHERS.split()):
        return None
    for kind, words in WORDS.items():
        if hits := [token for token in tokens if token in words.split()]:
            number = next((token for token in reversed(tokens) if token.isdigit()), "")
            rest = [token for token in tokens if token not in hits and not token.isdigit()]
            place = re.sub(rf"(?i)^[\W_]*{hits[0]}[\W_]+|[\W_]+{hits[0]}[\W_]*$", "", bare)
            return _Name(name, kind, hits[0], " ".join(rest), number, place if place != bare else "")
    return None


def _entries(table: LogTable, name: str) -> int:
    return 1 if name not in table.columns or table.columns[name].ndim == 1 else int(table.columns[name].shape[1])


def _sorted(names: list[tuple[str, str]], joints: tuple[str, ...]) -> list[tuple[str, str]]:
    """Return columns by the number of their joint, or in the order of named joints, or in that of the file."""
    places = [place for _, place in names]
    if joints and set(places) == set(joints):
        return sorted(names, key=lambda pair: joints.index(pair[1]))
    numbered = all(place.isdigit() for place in places)
    return sorted(names, key=lambda pair: int(pair[1])) if numbered else names


def _by_values(path: Path, table: LogTable) -> LogLayout:
    """Return a layout of columns that have no names: time first if it increases, then as many of each quantity."""
    names = list(table.columns)
    timed = bool(np.mean(np.diff(table.columns[names[0]]) > 0) > 0.9)  # stamps may repeat
    rest = names[1:] if timed else names
    t = Source((names[0],)) if timed else Source(fs=0.0)
    for count in (count for count in MOST_BLOCKS if len(rest) % count == 0):
        n = len(rest) // count
        block = [tuple(rest[i * n : (i + 1) * n]) for i in range(count)]
        if count > 2 and _is_derivative(table, block[0], block[1]):
            efforts = 3 if count > 3 and _is_derivative(table, block[1], block[2]) else 2
            return LogLayout(t, Source(block[0]), Source(block[efforts]), Source(block[1]))
    if len(rest) % 2 == 0:
        n = len(rest) // 2
        return LogLayout(t, Source(tuple(rest[:n])), Source(tuple(rest[n:])))
    raise LogError(f"{path}: {len(names)} columns without names are no time, positions and torques of some joints: name them")


def _is_derivative(table: LogTable, q: tuple[str, ...], qd: tuple[str, ...]) -> bool:
    """True if most columns are the derivatives of others, up to a factor that they share."""
    slopes, fits = list[float](), list[bool]()
    for a, b in zip(q, qd, strict=True):
        width = max(1, min(len(table.columns[a]) // 50, 25))
        window, both = np.ones(width) / width, (np.gradient(table.columns[a]), table.columns[b])
        v, given = (np.convolve(np.nan_to_num(x), window, mode="valid") for x in both)
        if not np.any(v) or not np.any(given):
            continue
        slope = float(v @ given / (v @ v))
        slopes.append(slope)
        fits.append(float(np.linalg.norm(given - slope * v)) < 2 * ALIKE * float(np.linalg.norm(given)))
    return bool(fits) and 2 * sum(fits) > len(fits) and min(slopes) > 0
