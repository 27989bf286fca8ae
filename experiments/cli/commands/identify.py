"""The command that identifies logs: request, logs, fit, judgement, printed and saved; then views, each of which may fail."""

from collections.abc import Mapping, Sequence
from contextlib import closing, nullcontext

from rich.text import Text

from idbench.experiments.cli.command import command_of, with_own_parts
from idbench.experiments.cli.commands.identify_views import Shown, require_layer, require_targets, view_all
from idbench.experiments.cli.options.jobs import Identify
from idbench.experiments.cli.saving import folder_of
from idbench.experiments.errors import ExperimentError, RequirementError
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.job import fit_of, loaded_logs, notes_of, request_of, summary_of
from idbench.experiments.identification.known import number_of
from idbench.experiments.identification.logs import delay_method
from idbench.experiments.identification.reading import DELAY_FOUND, file_of
from idbench.experiments.inputs import files_of
from idbench.experiments.judgement.judgement import Judgement, conclusion, judge
from idbench.experiments.judgement.remedies import checks
from idbench.experiments.note import noted
from idbench.experiments.reports.printed import print_fit, print_held_out
from idbench.experiments.results.attempts import Attempts
from idbench.experiments.results.folder import ResultsFolder
from idbench.experiments.results.page import Page, stages_of
from idbench.experiments.results.writing import write_summary
from idbench.identify.files.log_file import write_log


def identify(options: Identify) -> None:
    """Identify logs, judge the result, save and show it."""
    page, request, required = Page(machine=options.json), request_of(with_own_parts(options)), _required(options)
    command, log = command_of(options, out=True), file_of(options.log[0]).absolute()
    folder = folder_of(options, options.out) if options.out else None
    require_targets(options, request.robot_model, folder, files_of(options))
    require_layer(options, request.label, command)
    with closing(page), folder.held() if folder else nullcontext(), options.watching.audience() as audience:
        with stages_of("identifying"):
            result = fit_of(*loaded_logs(with_own_parts(options), request))
        whole_models = tuple(result.estimates)[: 1 if options.model is None else None]
        page.found |= {"experiment": "identify", "log": log.name, "path": str(log), **summary_of(result)}
        kept = f"the estimates are printed{f', and with the logs in {folder.out}' if folder else ''}"
        with Attempts(kept, folder) as attempts:
            try:
                changes = folder.changes(page.found) if folder else ""
                _save(folder, page, result)
                with stages_of("judging" if options.validate else "judging, by a fit of the rest"):
                    judgement = attempts.attempt("the verdict", lambda: judge(result))
                warnings = {} if judgement is None else _checked(judgement, options, attempts)
                answer = None if judgement is None else conclusion(judgement, warnings, options.write)
            except BaseException:  # whatever ends it, the estimates are worth keeping
                _show_fit(page, result, options, whole_models)
                raise
            if judgement is None or answer is None:
                _show_fit(page, result, options, whole_models)
                return
            answer.show(page)
            _show_fit(page, result, options, whole_models)
            for one in judgement.on:
                print_held_out(page, one, whole_models, verbose=options.verbose)
            page.found |= judgement.summary() | {"conclusion": answer.summary()}
            for one in judgement.failures:
                attempts.failed(one.title, one.why, one.traceback)
            page.warn(warnings)
            if changes:
                page.print(Text(changes), soft_wrap=True)
            attempts.attempt("summary.json", lambda: _save(folder, page))
            page.end()
            view_all(Shown(page, options, command, judgement, answer, warnings, folder, audience), attempts)
    if required and (short := judgement.short_of(required)):
        raise RequirementError(f"--require {options.require}: {short}")


def _required(options: Identify) -> float | None:
    """Share of torque errors that is required [%]."""
    percent = number_of((options.require or "").removesuffix("%"))
    if options.require is not None and not (percent and 0 < percent < float("inf")):
        raise ExperimentError(f"--require {options.require}: give a share of torque errors above 0, as in 2%")
    return percent


def _checked(judgement: Judgement, options: Identify, attempts: Attempts) -> Mapping[str, Sequence[str]]:
    """Warnings, in the order in which to check them."""
    with stages_of("checking"):
        delay = delay_method(options.torque_delay) is None
        return attempts.attempt("the checks", lambda: checks(judgement, delay=delay, trials=not options.no_trials)) or {}


def _show_fit(page: Page, result: Fit, options: Identify, whole: tuple[str, ...]) -> None:
    """Show the estimates."""
    print_fit(page, result, ", ".join(map(str, options.log)), whole, verbose=options.verbose)
    for note in (note for note in notes_of(result) if noted(note).about != DELAY_FOUND):
        page.print(Text(note), soft_wrap=True)
    page.show()


def _save(folder: ResultsFolder | None, page: Page, result: Fit | None = None) -> None:
    """Write the summary so far; of a new result with its logs, in the place of all earlier files."""
    if folder is None:
        return
    with folder.complete() if result else folder.more() as hidden:
        for k, log in enumerate(result.logs.fitted if result else ()):
            write_log(log, hidden / f"log{k + 1 if k else ''}.parquet")
        write_summary(hidden / "summary.json", page.found)
