"""The command that runs studies."""

import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from typing import TYPE_CHECKING

from idbench.experiments.cli.options.jobs import StudyCommand
from idbench.experiments.errors import StudyError
from idbench.experiments.program import program
from idbench.experiments.recording.audience import Audience
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import Page, runs_of
from idbench.experiments.study.job import LARGEST_SHARD, run_missing, runs_of_shard, store_of, worker_pool
from idbench.experiments.study.statistics import cells
from idbench.experiments.study.store import Store, arrays
from idbench.experiments.study.study_file import load_study, names

if TYPE_CHECKING:
    from idbench.experiments.recording.study_recording import StudyRecording


def study(options: StudyCommand) -> None:
    """Run a study, or list those that ship."""
    watching = options.watching
    if watching.pace is not None:
        raise StudyError(f"--pace {watching.pace:g}: a study has no one time that could pass; leave it out")
    page = Page(machine=options.json)
    if options.study is None and options.resume is None:
        width = max(map(len, names()))
        for name in names():
            page.out(f"{name:{width}}  {load_study(name).question}")
            page.found[name] = load_study(name).question
        page.close()
        return
    store = store_of(options, options.out, many=options.yes)
    folder = ResultsFolder(store.folder, "study", f"idbench study {store.study.name}", options.force)
    folder.check()
    runs, pooled = runs_of_shard(options, store), worker_pool(options, store)
    with watching.audience() as audience, closing(page), pooled as pool, store.held(), _kept(store):
        recording = _recording(store, audience) if watching.rerun else None
        receive = partial(_show, store, recording) if recording and audience else None
        if pool is not None:
            with runs_of(store.study.name, sum(len(r) for r in store.missing(runs))) as watch:
                run_missing(store, pool, runs, watch, receive)
        from idbench.experiments.study.study_results import write_results  # with figures: runs need none

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


@contextmanager
def _kept(store: Store) -> Iterator[None]:
    """Say what is kept and how to go on, if the block is interrupted."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        kept = store.study.size - sum(len(r) for r in store.missing(LARGEST_SHARD))
        message = f"{kept:,} of {store.study.size:,} runs are kept; go on with: {program()} study --resume {store.folder}"
        sys.stderr.write(f"\nidbench: {message}\n")
        raise
