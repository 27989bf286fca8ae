"""The recording of Table 2: the twin's signals, its errors by both processings, and what each imperfection does alone."""

import numpy as np
import rerun as rr

from experiments.paper.table2 import PAPER, Table2
from experiments.recording.columns import part
from experiments.recording.identification_recording import ROLES, RunRecording
from experiments.recording.layouts import tabs
from experiments.recording.stream import Stream
from experiments.recording.style import FORMS
from experiments.recording.texts import about
from identify import Array

FLOOR = 0.01
"""Error [%] at which the bars begin; every unit of their height is a decade more."""


def finish_table2(recording: RunRecording, table: Table2) -> list[tuple[str, Stream]]:
    """Add what only the end of a run gives to the first realization's recording; return its streams by file name."""
    run, stream = table.run, recording.base.stream
    streams = recording.end(run)
    truth = list(table.truth.values())
    for name, found in table.found.items():
        for form, one in found.items():
            _send(stream, f"processing/{name}/{form}", one.estimates[form].error_percent(truth), form)
    for k, (name, alone) in enumerate(table.attribution.items()):
        # Entities are shown in the order of their names.
        at = f"attribution/{k:02}_{part(name.replace('%', 'percent'))}"
        for form, error in alone.items():
            _send(stream, f"{at}/{form}", error, form)
    stream.keep("table2", rr.TextDocument(_markdown(table), media_type=rr.MediaType.MARKDOWN))
    stream.keep(
        "about", rr.TextDocument(about(table.scenario.name, table.scenario.origin, ROLES), media_type=rr.MediaType.MARKDOWN)
    )
    known = set().union(*(s.paths for _, s in streams))
    stream.arrange(tabs(known))
    return streams


def _send(stream: Stream, path: str, error_percent: Array, form: str) -> None:
    """Send bars of how many decades errors are above FLOOR, with their sign; those of the models stand side by side."""
    heights = np.sign(error_percent) * np.log10(1 + np.abs(error_percent) / FLOOR)
    stream.grouped_bars(path, heights, list(FORMS).index(form), len(FORMS), FORMS[form])


def _markdown(table: Table2) -> str:
    """Return the explicit and the power model's estimates beside the paper's, and how to read the bars."""
    lines = ["| | true | | paper | paper's steps | idbench |", "|---|---:|---|---:|---:|---:|"]
    for i, (name, true) in enumerate(table.truth.items()):
        for form in ("explicit", "power"):
            X = [found[form].estimates[form].X[i] for found in table.found.values()]
            head = f"{i + 1} {name} | {true:g}" if form == "explicit" else " | "
            lines.append(f"| {head} | {form} | {PAPER[form].estimate[i]:g} | {' | '.join(f'{x:.4g}' for x in X)} |")
    return "\n".join([*lines, f"\nBars: error of parameters 1 to 8 in decades above {FLOOR} %; 4 is 100 %."])
