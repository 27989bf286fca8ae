"""Results that are complete: shown and saved, all of them, before anything that only shows them."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from idbench.experiments.cli.command import command_of
from idbench.experiments.errors import ExperimentError
from idbench.experiments.inputs import files_of
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import Page
from idbench.experiments.results.writing import Read, require_free, write_summary
from idbench.sim.scenario.scenario import Scenario
from idbench.sim.scenario.scenario_file import to_toml

Files = Mapping[str, Callable[[Path], object]]
"""What writes the files of an experiment, by their names."""


def folder_of(options: Any, out: Path, experiment: str = "") -> ResultsFolder:
    """The checked folder of the results of a command, or of one of its experiments."""
    command, read = command_of(options, absolute=True), files_of(options)
    folder = ResultsFolder(out, experiment or options.called, command, options.force, read)
    folder.check()
    return folder


def require_targets(paths: Sequence[Path], endings: Collection[str], *, force: bool, read: Read = ()) -> None:
    """Raise ExperimentError if further files that are asked for cannot be written there; before the work, not after it."""
    for path in paths:
        if path.suffix not in endings:
            raise ExperimentError(f"--write {path}: its name must end with {', '.join(endings)}")
        require_free(path, "--write", force=force, read=read)


@contextmanager
def saved(page: Page, folder: ResultsFolder, summary: dict[str, Any], files: Files, hint: str) -> Iterator[Attempts]:
    """Show what is printed, save the results, and give what tries their views in the block; then say where they are.

    `summary` becomes summary.json; `hint` says how to go on, behind the name of the folder.
    """
    page.found |= summary | {"folder": str(folder.out)}
    if changes := folder.changes(summary):
        page.print(changes, soft_wrap=True)
    page.show()
    with folder.complete() as hidden:
        for name, write in files.items():
            write(hidden / name)
        write_summary(hidden / "summary.json", summary)
    page.end()
    with Attempts(f"what was found is printed, and in {folder.out}", folder) as attempts:
        yield attempts
        page.print(f"written to {folder.out}{hint}", soft_wrap=True)


def save_summary(page: Page, folder: ResultsFolder | None) -> None:
    """Write what was found so far, in the place of earlier results of the same folder."""
    if folder is not None:
        with folder.complete() as hidden:
            write_summary(hidden / "summary.json", page.found)


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario as TOML."""
    path.write_text(to_toml(scenario), encoding="utf-8", errors="backslashreplace")
