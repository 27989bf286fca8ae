"""One run of a study, made again by itself."""

from collections.abc import Mapping
from typing import Any

from idbench.experiments.errors import StudyError
from idbench.experiments.study.shard import run_shard
from idbench.experiments.study.store import Store


def compare_again(store: Store, run: int) -> tuple[list[dict[str, Any]], bool]:
    """Return the rows of a run, made again alone, and whether the study has it already.

    Raises
    ------
    StudyError
        If there is no such run, or the study has other bits for it.
    """
    store.study.scenario_of(run)
    made, known = run_shard(store.study, range(run, run + 1)).rows, store.rows_of(run)
    for here, there in zip(made, known, strict=bool(known)):
        other = [f"{name} {there[name]!r}, now {here.get(name)!r}" for name in there if not _same(here, there, name)]
        if other:
            what = f"{there['chain']}, {there['estimator']}, {there['model']}"
            raise StudyError(f"run {run} of {store.folder} is not reproduced ({what}): {'; '.join(other[:3])}")
    return made, bool(known)


def _same(here: Mapping[str, Any], there: Mapping[str, Any], name: str) -> bool:
    return bool(here.get(name) == there[name] or (here.get(name) != here.get(name) and there[name] != there[name]))
