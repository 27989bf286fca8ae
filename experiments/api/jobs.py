"""The other jobs: studies, payloads, gains, servos, motions, the paper's tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.text import Text

from idbench.experiments.api.calls import PARTS, named, several
from idbench.experiments.api.keywords import with_keys
from idbench.experiments.api.results import path_of
from idbench.experiments.errors import ExperimentError, StudyError
from idbench.experiments.excite.excited import Excited
from idbench.experiments.excite.job import excited
from idbench.experiments.loads.job import LoadFit, gains_of, payload_of
from idbench.experiments.paper.job import table1_of
from idbench.experiments.paper.table1 import Table1
from idbench.experiments.paper.table2 import Table2
from idbench.experiments.requests import jobs
from idbench.experiments.requests.table import request_from
from idbench.experiments.results.page import runs_of, watched
from idbench.experiments.servo.job import ServosFit, servos_identified
from idbench.experiments.study.job import LARGEST_SHARD, run_missing, runs_of_shard, worker_pool
from idbench.experiments.study.ratios import study_conclusion
from idbench.experiments.study.statistics import Cell, cells
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study import Study
from idbench.experiments.study.study_file import load_study, study_from
from idbench.experiments.study.study_results import print_study, summary_of
from idbench.experiments.text import PRINTED, printed
from idbench.identify import BLOCKS
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import load, to_dict


@dataclass(frozen=True, eq=False)
class StudyTable:
    """The runs of a study, and what they say of every combination."""

    study: Study
    """The study."""
    rows: Mapping[str, npt.NDArray[Any]]
    """Every run and identification: columns by name, shape (rows,)."""
    cells: Sequence[Cell]
    """Errors and coverage of every combination and model."""
    seconds: Mapping[str, float]
    """Time of simulating and identifying [s]."""

    @classmethod
    def of(cls, store: Store) -> "StudyTable":
        """Return the table of the runs in a folder."""
        rows = arrays(store.table())
        return cls(store.study, rows, cells(rows, store.study.varied, store.study.parameters), store.seconds())

    def summary(self) -> dict[str, Any]:
        """The summary.json of `idbench study`."""
        return summary_of(self.study, self.cells, dict(self.seconds))

    def typical_errors(self) -> dict[tuple[Any, ...], float]:
        """Return the typical relative error of each combination, by its settings, chain, estimator and model."""
        return {(*cell.settings.values(), *cell.names): float(cell.typical) if cell.runs else np.nan for cell in self.cells}

    def _show(self, console: Console) -> None:
        console.print(Text(study_conclusion(self.study, self.cells, "").finding))
        print_study(console, self.study, self.cells)

    def __repr__(self) -> str:
        return printed(self._show)

    def _repr_html_(self) -> str:
        console = Console(file=StringIO(), width=PRINTED, record=True)
        self._show(console)
        return console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")


Files = str | Path | Sequence[str | Path]
"""Logs, by the names of their files."""


def study(
    name: str | Path | Study | Scenario,
    *,
    axes: Mapping[str, Sequence[Any]] | None = None,
    seeds: int | None = None,
    out: str | Path | None = None,
    threads: int | None = None,
    **parts: Any,
) -> StudyTable:
    """Return a study that was run: errors and coverage of every combination.

    Parameters
    ----------
    name : str, Path, Study or Scenario
        Name of a shipped study (`idbench study` lists them), its file (TOML), the study itself, or a scenario, whose parts may
        be of classes of your own; its motion is drawn anew in each run if its trajectory is random, else all runs share it.
    axes : mapping of str to sequence, optional
        Values of the settings of a scenario that vary, such as {"encoder.lines": [1024, 4096]}.
    seeds : int, optional
        Independent runs per combination, instead of the study's number.
    out : str or Path, optional
        Folder that keeps all runs; an interrupted study goes on there. By default nothing is kept.
    threads : int, optional
        Shards at a time; by default all processors.
    **parts
        models, chains, estimators, friction: names, objects or classes, instead of the study's.

    Raises
    ------
    StudyError, ExperimentError, BenchError
        If there is no such study, or it cannot be run.

    Examples
    --------
    >>> import idbench
    >>> table = idbench.study("encoder", seeds=2, chains=["idbench"], models=["explicit"], estimators=["OLS"])
    >>> table.study.size == len(table.rows["run"])
    True
    """
    tables = {f"{key}s": PARTS[key] for key in ("model", "chain", "estimator")} | {"friction": BLOCKS}
    if unknown := sorted(parts.keys() - tables.keys()):
        raise ExperimentError(f"study: unknown key {unknown[0]!r}; known: seeds, out, threads, {', '.join(tables)}")
    changed: dict[str, Any] = {key: tuple(map(tables[key].name_of, several(value))) for key, value in parts.items()}
    if seeds is not None:
        changed["seeds"] = seeds
    if not isinstance(axes, Mapping | None):
        raise ExperimentError(f"study: axes = {axes!r:.60}: give a mapping of settings to values")
    if isinstance(name, Scenario):
        each = [{"field": field, "values": list(several(values))} for field, values in (axes or {"fs": [name.fs]}).items()]
        motion = "drawn" if hasattr(name.trajectory, "seed") else "shared"
        head = {"name": name.name, "question": f"How accurate is the identification of {name.name}?", "motion": motion}
        described = study_from({**head, "scenario": to_dict(name), "axes": each}, "study")
    elif axes is not None:
        raise ExperimentError("study: axes are of a scenario; a study has its own")
    else:
        described = name if isinstance(name, Study) else load_study(str(path_of(name, "study")))
    described = replace(described, **changed)
    asked = request_from(jobs.StudyRequest, {"threads": threads}, "study")
    with TemporaryDirectory(prefix="idbench-") as folder:
        store = _store(described, Path(folder) / described.name if out is None else path_of(out, "study: out"))
        with store.held(), worker_pool(asked, store) as pool:
            if pool is not None:
                todo, shard = sum(map(len, store.missing(LARGEST_SHARD))), min(LARGEST_SHARD, runs_of_shard(asked, store))
                with watched(lambda: runs_of(described.name, todo), _unheard) as watch:
                    run_missing(store, pool, shard, watch)
        return StudyTable.of(store)


def _store(described: Study, out: Path) -> Store:
    """Return the folder of a study; that of the same study goes on."""
    if not (out / "study.toml").is_file():
        return Store.new(described, out)
    store = Store.open(out)
    if store.study.fingerprint != described.fingerprint:
        raise StudyError(f"{out} holds another study, or the same with other settings: choose another folder")
    return store


@with_keys(jobs.PayloadRequest)
def fit_payload(log: Files, unloaded: Files = (), **keys: Any) -> LoadFit:
    """The payload, as `idbench payload` identifies it; files of logs, and its options by keyword."""
    return payload_of(_asked(jobs.PayloadRequest, "fit_payload", keys, log=log, unloaded=unloaded))


@with_keys(jobs.GainsRequest)
def fit_gains(log: Files, unloaded: Files = (), **keys: Any) -> LoadFit:
    """Return the torque constants of the drives, as `idbench gains` finds them; files of logs, and its options by keyword."""
    return gains_of(_asked(jobs.GainsRequest, "fit_gains", keys, log=log, unloaded=unloaded))


@with_keys(jobs.ServoRequest)
def fit_servos(log: Files, robot: str | Path, servo: str | Path, **keys: Any) -> ServosFit:
    """Return servos, identified from commands and positions as `idbench servo` does; files, and its options by keyword."""
    return servos_identified(_asked(jobs.ServoRequest, "fit_servos", {**keys, "robot": robot, "servo": servo}, log=log))


@with_keys(jobs.ExciteRequest)
def design(robot: str | Path, **keys: Any) -> Excited:
    """Return an exciting trajectory within the robot's limits, as `idbench excite` designs it; its options by keyword."""
    return excited(_asked(jobs.ExciteRequest, "design", {**keys, "robot": robot}), _unheard)[0]


def table1(**keys: Any) -> Table1:
    """Return the paper's simulation comparison (Table 1); options of `idbench table1`: chain, seed, scenario."""
    return table1_of(_asked(jobs.Table1Request, "table1", keys, taken=("motions",)))


def table2(**keys: Any) -> Table2:
    """Return the paper's experiment on the virtual robot (Table 2); option: scenario."""
    return Table2(load(_asked(jobs.Table2Request, "table2", keys).scenario), _unheard)


def _unheard(*_: object) -> None:
    """Show no progress: `idbench.identify.telling.listening` hears it."""


def _asked(request: type[Any], where: str, keys: Mapping[str, Any], taken: Sequence[str] = (), **files: Any) -> Any:
    given = {name: each for name, value in files.items() if (each := several(value))}
    if wrong := [each for paths in given.values() for each in paths if not isinstance(each, str | Path)]:
        raise ExperimentError(f"{where}: {wrong[0]!r:.60} is no file: give the names of files")
    paths = {name: tuple(map(Path, each)) for name, each in given.items()}
    return request_from(request, named(keys) | paths, where, taken=taken)
