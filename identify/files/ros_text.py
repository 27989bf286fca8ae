"""Messages that ROS printed as text: `rostopic echo -p`, and `ros2 topic echo --csv`, which has no header."""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.files.table import LogTable

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|[-+.]*(nan|inf)", re.IGNORECASE)
STATE = ("position", "velocity", "effort")  # Fields of a JointState, after the names

Fields = dict[str, list[int]]
"""Places of the cells of each field."""


def ros_table(lines: Sequence[str]) -> LogTable | None:
    """Return time and fields of the joints of printed messages; None if the text is none.

    Joints are called as the messages say. Of messages that name others, such as those of a gripper on the same topic, those of
    most joints are taken.
    """
    rows = [line.strip().split(",") for line in lines if line.strip()]
    if len(rows) < 2:
        return None
    header = rows[0][0] == "%time"
    fields = _by_header(rows[0]) if header else _by_cells(max(rows, key=len))
    if fields is None or "name" not in fields:
        return None
    rows = rows[1:] if header else rows
    width = max(map(len, rows))
    fields = _widened(fields, width, len(lines[0].split(","))) if header else fields
    named = [tuple(row[k] for k in fields["name"]) if len(row) == width else () for row in rows]
    joints, places, said = of_most_joints(named)
    kept = [rows[k] for k in places]
    columns = {"t": _times(kept, fields)}
    for name, places in fields.items():
        if name not in ("name", "time", "ns") and len(places) == len(joints):
            columns[name] = np.array([[float(row[k] or "nan") for k in places] for row in kept])
    return LogTable(columns, entries={name: joints for name in columns if name != "t"}, said=said)


def _by_header(cells: Sequence[str]) -> Fields:
    """Places of fields that a header names, as field.position0 and field.actual.positions0."""
    fields: Fields = {"time": [0]}
    for k, cell in enumerate(cells):
        if cell == "field.header.stamp":
            fields["time"] = [k, 0]
        elif match := re.fullmatch(r"field\.(.*\D)(\d+)", cell):
            fields.setdefault("name" if match[1] in ("name", "joint_names") else match[1], []).append(k)
    return fields


def _widened(fields: Fields, width: int, of_header: int) -> Fields:
    """Places of fields in rows of more joints than the header has, which is that of the first message."""
    groups = [name for name in fields if name not in ("time", "ns")]
    n, first = len(fields["name"]), min(k for name in groups for k in fields[name])
    each, left = divmod(width - first, len(groups))
    if width == of_header or left or first + n * len(groups) != of_header:
        return fields
    places = (list(range(first + i * each, first + (i + 1) * each)) for i in range(len(groups)))
    return {"time": fields["time"], **dict(zip(groups, places, strict=True))}


def _by_cells(cells: Sequence[str]) -> Fields | None:
    """Places of the fields of a JointState without a header: s, ns, frame, names, and as many numbers of each of its fields."""
    n = next((k for k, cell in enumerate(cells[3:]) if NUMBER.fullmatch(cell)), 0)
    each, left = divmod(len(cells) - 3 - n, n) if n else (0, 1)
    if left or not 1 <= each <= len(STATE) or not all(re.fullmatch(r"\d+", cell) for cell in cells[:2]):
        return None
    names = STATE if each == len(STATE) else ("position", "velocity or effort")[:each]
    places = {name: list(range(3 + (k + 1) * n, 3 + (k + 2) * n)) for k, name in enumerate(names)}
    return {"time": [0], "ns": [1], "name": list(range(3, 3 + n)), **places}


def of_most_joints(named: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], list[int], str]:
    """Joints of the messages that name most of them, their places, and words about others, such as a gripper's."""
    most = max(Counter(named).items(), key=lambda one: (len(one[0]), one[1]))[0]
    kept = [k for k, names in enumerate(named) if names == most]
    others = len(named) - len(kept)
    return most, kept, f"{others} messages that do not name {', '.join(most)} are left out" if others else ""


def _times(rows: list[list[str]], fields: Fields) -> Array:
    """Times since the first message [s]: of headers, in ns or in s and ns, or of printing where headers have none."""
    if "ns" in fields:
        nanoseconds = [int(row[0]) * 10**9 + int(row[1]) for row in rows]
    else:
        column = next((k for k in fields["time"] if any(row[k] not in ("", "0") for row in rows)), 0)
        nanoseconds = [int(row[column]) for row in rows]
    return 1e-9 * np.array([x - nanoseconds[0] for x in nanoseconds], dtype=np.float64)
