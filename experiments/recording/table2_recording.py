"""The recording of Table 2: the twin's signals, its errors by both processings, and what each imperfection does alone."""

import numpy as np
import rerun as rr

from idbench.experiments.paper.table2 import PAPER, Table2
from idbench.experiments.recording.chart import NARROW, SYMBOLS, Chart
from idbench.experiments.recording.identification_recording import ROLES, RunRecording
from idbench.experiments.recording.layouts import tabs
from idbench.experiments.recording.scales import listed, signed
from idbench.experiments.recording.stream import Stream
from idbench.experiments.recording.texts import about
from idbench.experiments.reports.estimates import markdown
from idbench.experiments.style import FORMS
from idbench.experiments.text import percent

BEND = 0.01
"""Error [%] up to which axes are linear."""

NOTABLE = 1.0
"""Error [%] from which on it is written in bold."""


def finish_table2(recording: RunRecording, table: Table2) -> list[tuple[str, Stream]]:
    """Add what only the end of a run gives to the first realization's recording; return its streams by file name."""
    run, stream = table.run, recording.base.stream
    streams = recording.end(run)
    _send_processings(stream, table)
    for form in next(iter(table.attribution.values())):
        _send_causes(stream, table, form)
    described = about(table.scenario.name, table.scenario.origin, ROLES)
    for name, text in (("table2", _markdown(table)), ("about", described)):
        stream.keep(name, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
    known = set().union(*(s.paths for _, s in streams))
    stream.arrange(tabs(known))
    return streams


def _send_processings(stream: Stream, table: Table2) -> None:
    """Send the error of every parameter by both processings, on one scale."""
    truth, names = list(table.truth.values()), list(table.truth)
    errors = {
        name: {form: one.estimates[form].error_percent(truth) for form, one in found.items()}
        for name, found in table.found.items()
    }
    x = signed("error [%]", *(error for found in errors.values() for error in found.values()), bend=BEND)
    for name, found in errors.items():
        chart = Chart(stream, f"processing/{name}", x, listed("", names), NARROW)
        for symbol, (form, error) in zip(SYMBOLS, found.items(), strict=False):
            chart.marks(form, error, np.arange(float(len(names))), FORMS[form], symbol)
            chart.list_entry(form, FORMS[form])


def _send_causes(stream: Stream, table: Table2, form: str) -> None:
    """Send the error of every parameter by each cause alone, as a table; large ones in bold."""
    rows = ([cause, *(_emphasized(e) for e in errors[form])] for cause, errors in table.attribution.items())
    text = markdown(f"Error [%] of each parameter by each cause alone, **{form}** model", list(table.truth), rows)
    stream.keep(f"attribution/{form}", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))


def _emphasized(error_percent: float) -> str:
    return f"**{percent(error_percent)}**" if abs(error_percent) > NOTABLE else percent(error_percent)


def _markdown(table: Table2) -> str:
    """Return the explicit and the power model's estimates beside the paper's."""
    lines = ["| | true | | paper | paper's steps | idbench |", "|---|---:|---|---:|---:|---:|"]
    for i, (name, true) in enumerate(table.truth.items()):
        for form in ("explicit", "power"):
            X = [found[form].estimates[form].X[i] for found in table.found.values()]
            head = f"{name} | {true:g}" if form == "explicit" else " | "
            lines.append(f"| {head} | {form} | {PAPER[form].estimate[i]:g} | {' | '.join(f'{x:.4g}' for x in X)} |")
    return "\n".join(lines)
