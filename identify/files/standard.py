"""The layout of a file whose columns are called as idbench calls them: t, q1, q_elbow, qd1, tau1."""

import re
from pathlib import Path

from idbench.identify.errors import LogError
from idbench.identify.files.guess import kind_of
from idbench.identify.files.layout import UNLOGGED, LogLayout, Source
from idbench.identify.files.table import LogTable

SHOWN = 20  # Columns of a file that a message names


def standard_layout(path: Path, table: LogTable) -> LogLayout:
    """Return the layout of a file whose columns are called as idbench calls them; raise LogError if they are not."""
    names = [*table.columns, *table.words]
    _require_names(path, table)
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
        wrong = [f"{what} {', '.join(x)}" for what, x in (("missing:", missing), ("unexpected:", unexpected)) if x]
        raise LogError(
            f"{path} must have a header with the columns {', '.join(needed)}; {'; '.join(wrong)}; its columns: "
            f"{', '.join(names[:SHOWN])}; or say what they are in a file log.toml beside it: idbench log {path} --write "
            "makes one to start from"
        )
    qd = tuple(f"qd{end}" for end in ends)
    velocities = Source(qd) if set(qd) <= set(table.columns) else Source()
    q, tau = Source(tuple(f"q{end}" for end in ends) if own == "q" else ()), Source(torques)
    warm = tuple(f"temperature{end}" for end in ends)
    every = warm if set(warm) <= set(table.columns) else ("temperature",) if "temperature" in table.columns else ()
    return LogLayout(Source(("t",)), q, tau, velocities, joints, temperature=Source(every))


def _require_names(path: Path, table: LogTable) -> None:
    """Raise LogError if the columns of a file have no names."""
    if table.named:
        return
    joints = max(1, (len(table.columns) - 1) // 2)
    line = ",".join(["t", *(f"{x}{j + 1}" for x in ("q", "tau") for j in range(joints))])
    raise LogError(
        f"{path} has no header, its first line is numbers: put a line of names before it, such as {line}, or say what its "
        f"columns are in a file log.toml beside it: idbench log {path} --write makes one to start from"
    )
