"""Held-out logs as text."""

from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.judgement.held_out import WORDS, HeldOut
from idbench.experiments.judgement.judgement import Unjudged
from idbench.experiments.reports.estimates import all_units
from idbench.experiments.text import error_percentage, new_table, percentage, print_titled
from idbench.identify import Array
from idbench.identify.judge.torque_interval import LEVEL, MOST


def print_held_out(console: Console, one: HeldOut | Unjudged, whole: Sequence[str], *, verbose: bool = False) -> None:
    """Print how well `whole` models predict the torques of a held-out log, and what the simulated robot does on it.

    `verbose`: intervals and the verdict on each model, too.
    """
    if isinstance(one, Unjudged):
        console.print(Text(f"not judged on {one.title}: {one.why}\n"), soft_wrap=True)
        return
    torques = {model: validation for model, validation in one.torques.items() if model in whole} or one.torques
    joints = one.fit.robot_model.robot.joints
    simulated = any(one.position_error(model) is not None for model in torques)
    torque, position = all_units(one.fit.robot_model)
    what = (f"rms [{torque}]", "%", *((f"position [{position}]",) * simulated))
    heads = [f"{model}\n{each}" if len(torques) > 1 else each for model in torques for each in what]
    grid, first = new_table("", [*heads, "noise %, at most"]), next(iter(torques.values()))
    for j, joint in enumerate(joints):
        noise = percentage(first.percent_of_level(first.noise)[j])
        grid.add_row(joint, *(cell for model in torques for cell in _held_out_cells(one, model, j)[: len(what)]), noise)
    title = f"torque error{'' if one.log.poses else ' while moving'}{', position error of the simulated robot' * simulated}"
    print_titled(console, f"{one.title}: {title}", grid)
    for model in (model for model, v in one.verdicts.items() if model in torques and v.unsimulated):
        console.print(Text(f"{model}: not simulated: {one.verdicts[model].unsimulated}"), soft_wrap=True)
    worst = one.verdicts[one.fit.leading].word
    for model, verdict in one.verdicts.items():
        if model not in torques and WORDS.index(verdict.word) > WORDS.index(worst):
            off = error_percentage(float(np.nanmax(one.torques[model].percent)))
            console.print(Text(f"{model}: {verdict.word}, torque errors of at most {off}"), soft_wrap=True)
    for words in _details_of(one, first.standing) if verbose else ():
        console.print(Text(words), soft_wrap=True)
    console.print()


def _details_of(one: HeldOut, standing: Array) -> Iterator[str]:
    """Yield intervals, errors at rest, and the verdict on each model."""
    best = one.fit.leading
    if (within := one.within_interval(best)) is not None and one.fit.torque_intervals[best] is not None:
        yield _interval_words(one, best, *within)
    joints = one.fit.robot_model.robot.joints
    each = zip(joints, standing, (one.fit.robot_model.units(j)[0] for j in range(len(joints))), strict=True)
    if apart := [f"{joint} {rms:.2g} {unit}" for joint, rms, unit in each if isfinite(rms)]:
        yield f"at rest and reversing, where friction is not determined: {', '.join(apart)}"
    for (word, reasons), (model, *others) in one.alike.items():
        same = f" ({', '.join(others)}: the same)" if others else ""
        yield f"{model}: {word}: {reasons}{same}"
    for model, why in one.fit.failures.items():
        yield f"{model}: not judged: {why}"


def _interval_words(one: HeldOut, model: str, inside: Array, outside: float) -> str:
    """Share of held-out torques within the fit's intervals, and share of the motion outside of the fit, in words."""
    interval, joints = one.fit.torque_intervals[model], one.fit.robot_model.robot.joints
    assert interval is not None
    half = " ".join(f"{x:.2g}" if isfinite(x) else "-" for x in interval.half)
    force, _ = all_units(one.fit.robot_model)
    share = np.nan_to_num(inside, nan=1.0)
    worst = f", of {joints[int(share.argmin())]} {100 * share.min():.0f} %" if len(joints) > 1 else ""
    expected = 2 * (1 - MOST) * len(joints)  # of speeds and torques
    words = (
        f"{100 * LEVEL:.0f} % intervals of the torque up to {interval.band:g} Hz, +- {half} {force}: they contain "
        f"{100 * np.nanmean(inside):.0f} %{worst}"
    )
    beyond = f"{100 * outside:.0f} % of the motion is outside the fitted speeds and torques, where no interval holds"
    return f"{words}; {beyond}" if outside > 2 * expected else words


def _held_out_cells(one: HeldOut, model: str, j: int) -> tuple[str, str, str]:
    validation, off = one.torques[model], one.position_error(model)
    if not isfinite(validation.rms[j]):
        return "", "", ""
    return f"{validation.rms[j]:.2g}", percentage(validation.percent[j]), "" if off is None else f"{off[j]:.1e}"
