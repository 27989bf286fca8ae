"""The command that runs studies."""

import os
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from idbench.experiments.cli.options.study import Study
from idbench.experiments.cli.page import new_page, runs_of, shown
from idbench.experiments.errors import StudyError
from idbench.experiments.recording.audience import Audience
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.study.run_study import local_pool, run_missing
from idbench.experiments.study.statistics import cells
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study_file import load_study, names
from idbench.experiments.study.study_results import write_results

if TYPE_CHECKING:
    from idbench.experiments.recording.study_recording import StudyRecording

MANY = 100_000
"""Runs beyond which a study is taken for a slip unless --yes says otherwise: days of a machine."""

LARGEST_SHARD = 64


def study(options: Study) -> None:
    """Run a study, or list those that ship."""
    resume, watching, seeds = options.resume, options.watching, options.seeds
    shard, threads, workers, scheduler = options.shard, options.threads, options.workers, options.scheduler
    if watching.pace is not None:
        raise StudyError(f"--pace {watching.pace:g}: a study has no one time that could pass; leave it out")
    page = new_page(machine=options.json)
    if options.study is None and resume is None:
        width = max(map(len, names()))
        for name in names():
            page.out(f"{name:{width}}  {load_study(name).question}")
            page.found[name] = load_study(name).question
        page.close()
        return
    for name, value in (("seeds", seeds), ("shard", shard), ("threads", threads), ("workers", workers)):
        if value is not None and value < 1:
            raise StudyError(f"--{name} {value} must be at least 1")
    store = (
        _resumed(resume, options.study, options.out, seeds)
        if resume
        else _begun(str(options.study), options.out, seeds, options.yes)
    )
    folder = ResultsFolder(store.folder, "study", f"idbench study {store.study.name}", options.force)
    folder.check()
    width = workers or threads or os.cpu_count() or 1
    runs = shard or min(LARGEST_SHARD, ceil(store.study.size / (2 * width)))
    pooled = _pool(store, scheduler, workers, threads, width)
    with watching.audience() as audience, shown(page), pooled as pool, store.held(), _kept(store):
        recording = _recording(store, audience) if watching.rerun else None
        receive = partial(_show, store, recording) if recording and audience else None
        if pool is not None:
            with runs_of(store.study.name, sum(len(r) for r in store.missing(runs))) as watch:
                run_missing(store, pool, runs, watch, receive)
        write_results(page, store, folder, recording)


def _recording(store: Store, audience: Audience | None) -> "StudyRecording":
    """Return the recording of a study, with the runs that are finished already if somebody watches."""
    from idbench.experiments.recording.study_recording import StudyRecording

    recording = StudyRecording(store.study, store.folder, audience)
    if audience and store.shards():
        _show(store, recording)
    return recording


def _show(store: Store, recording: "StudyRecording", _: range = range(0)) -> None:
    """Show the runs that are finished to who watches, if it is time."""
    if recording.due:
        recording.show(cells(arrays(store.table()), store.study.varied, store.study.parameters))


def _begun(name: str, out: Path | None, seeds: int | None, yes: bool) -> Store:
    described = load_study(name) if seeds is None else load_study(name).with_seeds(seeds)
    if described.size > MANY and not yes:
        raise StudyError(f"{name} has {described.size:,} runs, more than {MANY:,}: if you mean it, add --yes")
    _ = described.points  # every combination is looked at before the first is run
    return Store.new(described, out or Path("runs") / described.name)


def _resumed(folder: Path, name: str | None, out: Path | None, seeds: int | None) -> Store:
    given = [f"--{what}" for what, value in (("out", out), ("seeds", seeds)) if value is not None]
    if name is not None or given:
        raise StudyError(
            f"--resume {folder} goes on with the study of that folder: leave out {', '.join(filter(None, [name, *given]))}"
        )
    return Store.open(folder)


def _pool(
    store: Store, scheduler: str | None, workers: int | None, threads: int | None, width: int
) -> AbstractContextManager[Any]:
    """Return where shards are computed; nowhere, if nothing is missing."""
    from idbench.experiments.study.cluster import cluster_pool

    given = [f"--{what}" for what, value in (("workers", workers), ("threads", threads)) if value is not None]
    if (scheduler and given) or len(given) > 1:
        raise StudyError(f"{', '.join(['--scheduler'] * bool(scheduler) + given)} name several places to run: give one")
    if next(store.missing(1), None) is None:
        return nullcontext()
    return cluster_pool(store.study, scheduler, width) if scheduler or workers else local_pool(store.study, width)


@contextmanager
def _kept(store: Store) -> Iterator[None]:
    """Say what is kept and how to go on, if the block is interrupted."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        kept = store.study.size - sum(len(r) for r in store.missing(LARGEST_SHARD))
        message = f"{kept:,} of {store.study.size:,} runs are kept; go on with: uv run idbench study --resume {store.folder}"
        sys.stderr.write(f"\nidbench: {message}\n")
        raise
