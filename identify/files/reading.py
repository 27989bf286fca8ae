"""Logs of any file, in SI units."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from idbench.identify.data.log_columns import LogColumns
from idbench.identify.errors import LogError
from idbench.identify.files.formats import read_table
from idbench.identify.files.guess import guess, kind_of
from idbench.identify.files.guess_units import with_units
from idbench.identify.files.layout import LAYOUT, UNLOGGED, Asked, LogLayout, Source, own_layout
from idbench.identify.files.log_files import LogFiles
from idbench.identify.files.table import SI, LogTable, in_volts


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


LAYOUT_FILE = ".toml"  # What the name of a layout ends with, which may be given in the place of a log


@dataclass(frozen=True, eq=False)
class Understood:
    """What is understood of a log, and by whose words."""

    files: LogFiles
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
        self.files.require_once()  # what is wrong, before what is in doubt
        if self.doubts and not self.sure:
            log, words = self.files.log, "; ".join(self.doubts)
            raise LogError(f"{log}: {words}; or correct a layout: idbench log {log} --write makes {own_layout(log)}")
        columns = self.files.columns
        said = [*([self.said] if self.said else []), *self.passed_over]
        layout = self.files.layout
        absent = [name for name in ("q", "qd", "qdd") if layout.samples and not getattr(layout, name).columns]
        said += [f"no {', '.join(absent)}: taken as 0"] if absent else []
        said += ["a model in volts: read V where N m stands; Fs is kS, Fv kV"] * in_volts(self.files.layout.tau.unit)
        return replace(columns, said="; ".join(said))


def understood(path: Path, asked: Asked = Asked(), *, anew: bool = False) -> Understood:  # noqa: B008  # frozen
    """Layout of a log and its doubts: by the file beside it (not `anew`), by the names of idbench's columns, or a guess.

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
        made = LogFiles(path, path.parent, asked.over(layout))
        first = next(source for source in (layout.q, layout.t, layout.tau) if source.file)
        return Understood(replace(made, log=made.path_of(first)), said=made.layout.words(path))
    if asked.layout:
        return Understood(LogFiles(path, path.parent, asked.over(asked.layout)))
    found, tables = None if anew else LogLayout.beside(path), dict[Path, LogTable]()
    if not found or found[1].name == LAYOUT:
        tables = {path: read_table(path)}
        found = None if tables[path].torque is not None else found  # what idbench wrote is no log of that folder's recorder
    if found:
        layout = asked.over(found[0])
        return Understood(LogFiles(path, found[1].parent, layout, tables), said=layout.words(found[1]))
    table = tables[path]
    if not {"q", "tau"} & set(asked.columns) and (standard := standard_layout(path, table)):
        layout = asked.over(standard)
        looks = with_units(layout, table, asked)[1] if not table.words else []
        return Understood(LogFiles(path, path.parent, layout, tables), tuple(looks))
    layout, doubts = guess(path, table, asked)
    sources = ((name, getattr(layout, name)) for name in ("t", "q", "qd", "qdd", "tau"))
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
