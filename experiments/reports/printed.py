"""Identifications, and held-out logs, as text."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest
from math import isfinite, log2, pi
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from idbench.experiments.identification.causes import words_of_diagnosis
from idbench.experiments.identification.fit import Fit
from idbench.experiments.identification.iterations import words_of_iterations
from idbench.experiments.judgement.held_out import WORDS, HeldOut
from idbench.experiments.judgement.judgement import Unjudged
from idbench.experiments.judgement.remedies import NEGLIGIBLE, SURE
from idbench.experiments.reports.estimates import EstimatesTable, all_units, differing, explained, words_of_uncertainty
from idbench.experiments.text import error_percentage, new_table, percentage, print_titled
from idbench.identify import Array, AsLogged, TorqueChannel
from idbench.identify.judge.torque_interval import LEVEL, MOST
from idbench.identify.tables import concise

ONE_BELOW_THE_OTHER = 16
"""Parameters up to which each has a line of its own; more stand beside each other, as far as the screen is wide."""


def print_fit(console: Console, fit: Fit, title: str, whole: tuple[str, ...], *, verbose: bool = False) -> None:
    """Print the estimates: value with standard error, unit and %sigma, or truth and error where that is known.

    Models that are not among the `whole` ones have a line each; `verbose`: with Cond(W), rows, noise, correlations, iterations.
    """
    table = EstimatesTable(fit, whole)
    method = fit.request.method
    is_known = fit.truth is not None
    of = f"{whole[0]} model, " if len(whole) == 1 else ""
    grid = _grid(table, console.width, complete=verbose or is_known)
    print_titled(console, f"{title}: {of}{method.estimator_name}, chain {method.chain_name}", grid, 2 + is_known)
    if table.legend:
        console.print(Text(table.legend))
    complete = len(whole) > 1 and (verbose or is_known)
    for words in (*differing(fit, whole), *_told(fit), *(_details(fit, complete) if verbose else ())):
        console.print(Text(words), soft_wrap=True)
    if len(fit.logs.fitted) > 1 and fit.torque_errors:
        _print_logs(console, fit)
    console.print()


def _grid(table: EstimatesTable, width: int, *, complete: bool) -> Table:
    """Return the table of the parameters, and of the fit as a whole if it shall be complete."""
    heads, rows = [f"{first}\n{second}" for first, second in table.heads], list(table.rows())
    if len(table.estimates) == 1:
        if table.fit.truth is not None:
            return _beside(["", "unit", "true", "value", "%e", "%sigma"], rows, width)
        return _beside(["", "value", "unit", "%sigma"], [[name, x, unit, share] for name, unit, x, share in rows], width)
    grid = new_table("", heads)
    for cells in rows:
        grid.add_row(*cells)
    if complete:
        grid.add_section()
        for cells in table.whole():
            grid.add_row(*cells)
    return grid


def _beside(heads: list[str], rows: list[list[str]], width: int) -> Table:
    """Return a table of few columns, in parts beside each other where it is long and there is room."""
    each = sum(2 + max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads)))
    parts = max(1, (width + 2) // each) if len(rows) > ONE_BELOW_THE_OTHER else 1
    grid, count = new_table("", heads[1:]), -(-len(rows) // parts)
    for _ in range(1, parts):
        grid.add_column("", no_wrap=True)
        for heading in heads[1:]:
            grid.add_column(heading, justify="right", no_wrap=True)
    for beside in zip_longest(*(rows[k : k + count] for k in range(0, len(rows), count)), fillvalue=()):
        grid.add_row(*(Text(cell, _style(cells)) for cells in beside for cell in cells))
    return grid


def _style(cells: Sequence[str]) -> str:
    """Style of a parameter: red if impossible or far off, grey below one sigma."""
    if any(cell.endswith(("!", "*")) for cell in cells):
        return "red"
    share = cells[-1].rstrip("? ")
    return "dim" if not share or share.startswith(">") or float(share) > 100 else ""


def _told(fit: Fit) -> Iterator[str]:
    """Yield what a reader of the estimates must know: models that failed, torque and delay, what was held or masked."""
    for model, why in fit.failures.items():
        yield f"{model}: no estimate: {why}"
    channel = fit.logs.fitted[0].torque
    ignored = f", which chain {fit.request.method.chain_name} ignores: it takes it as logged"
    logged = isinstance(fit.processing.alignment, AsLogged)
    asked = fit.robot_model.asked
    if asked.hold or asked.tie:
        yield "; ".join(f"{what}: {', '.join(words)}" for what, words in (("held", asked.hold), ("tied", asked.tie)) if words)
    if not fit.logs.fitted[0].poses:
        is_early = channel.delay < -NEGLIGIBLE / fit.logs.fitted[0].fs and not channel.lags
        early = f" (it is logged {1e3 * -channel.delay:.4g} ms after it acts)" if is_early else ""
        found = ", estimated from the log" if np.any(channel.delay_sigma) else ""
        yield f"torque: {channel.meaning}, delay {_delay(channel)}{early}{found}{ignored if logged else ''}"
    if fit.delay is not None:
        delay, sigma = (1e3 * x for x in fit.delay)
        words = f"delay found with the parameters: {delay:.4g} ms, sigma {sigma:.2g} ms"
        if abs(delay - 1e3 * channel.delay) > SURE * sigma:
            words += f"; what follows judges them at {1e3 * channel.delay:.4g} ms: give --torque-delay {1e-3 * delay:.4g}"
        yield words
    yield from _rotors(fit)
    yield from words_of_iterations(fit)
    if fit.request.mask_reach:
        joints, speeds = fit.robot_model.robot.joints, fit.masked_speeds
        wide = [j for j, reach in enumerate(fit.request.mask_reach) if reach]
        each = ", ".join(f"{joints[j]} up to {speeds[j]:.2g} {fit.robot_model.units(j)[1]}/s" for j in wide)
        yield f"slow motion is masked, because the rest predicts held-out stretches better without it: {each} (--mask-speed)"
    if fit.request.smooth:
        sizes = " ".join(f"{x:.2g}" for x in fit.request.smooth)
        force, _ = all_units(fit.robot_model)
        yield f"smooth functions of velocity beside these laws, of a size that the log decides: {sizes} {force}"
    if asked.prior:
        share = fit.request.share or fit.robot_model.roughly_known.share
        near = f"; links near the file's, to {100 * share:.0f} % as the log decides" if fit.request.share and share else ""
        yield f"roughly known: {', '.join(asked.prior)}{near}"


def _delay(channel: TorqueChannel) -> str:
    """Return a delay, or that of each joint, with its standard error if it has one."""
    lags = channel.lags or (0.0,)
    sigma = np.broadcast_to(channel.delay_sigma, len(lags))
    return f"{', '.join(concise(1e3 * (channel.delay + lag), 1e3 * s) for lag, s in zip(lags, sigma, strict=True))} ms"


def _details(fit: Fit, complete: bool) -> Iterator[str]:
    """Yield how each model fits unless its table is `complete`, rates, noise, what limits the standard errors, mistakes."""
    for model, estimate in fit.estimates.items() if not complete else ():
        share = explained(fit.explained[model])
        yield f"{model}: Cond(W) {estimate.condition_number:.1f}, {estimate.row_count} rows, explains {share} of the torques"
    if fit.rates:
        yield str(fit.rates)
    channel = fit.logs.fitted[0].torque
    if channel.delay_sigma:
        without = [name for name, estimate in fit.estimates.items() if not estimate.knows_delay]
        but = f", but for {', '.join(without)}" if without else ""
        of_delay = ", ".join(f"{1e3 * x:.2g}" for x in np.atleast_1d(channel.delay_sigma))
        yield f"the standard errors contain that of the delay, {of_delay} ms{but}"
    yield _noise(fit)
    yield from words_of_uncertainty(fit)
    yield words_of_diagnosis(fit.diagnosis)
    for model, why in fit.left_out.items():
        yield f"{model}: reversals are left out, as ML does: {why}"


def _print_logs(console: Console, fit: Fit) -> None:
    """Print the torque error of the first estimate, log by log."""
    model, errors = next(iter(fit.torque_errors.items()))
    grid = new_table("", fit.robot_model.robot.joints)
    for k in range(len(fit.logs.fitted)):
        grid.add_row(fit.logs.name(k), *(f"{x:.2g}" if isfinite(x) else "" for x in errors[k]))
    force, _ = all_units(fit.robot_model)
    print_titled(console, f"residual of the {model} model in each log while joints move: rms [{force}]", grid)


def _rotors(fit: Fit) -> Iterator[str]:
    """Yield why no joint has the inertia of a rotor, if none has."""
    if fit.logs.fitted[0].poses:
        return
    asked, filed = fit.robot_model.asked.armature, bool(fit.robot_model.robot.model.dof_armature.any())
    if asked == "none":
        words = "no armature is identified and reversals are not masked, as where torques are measured at the links"
        yield f"{words} (--armature none)" + ("" if filed else "; the robot's file has none either")
    elif fit.robot_model.rotors_assumed:
        yield (
            f"rotor inertias are identified, because a {Path(fit.robot_model.name).suffix[1:].upper()} cannot state any "
            "(torques measured at the links: --armature none)"
        )
    elif asked in ("auto", "file") and not filed:
        yield (
            "no armature is identified, because the file has none; behind gears rotors often have more inertia than links: "
            "--armature all"
        )


def _noise(fit: Fit) -> str:
    """Return the noise of a log in words, joint by joint."""
    torque, position = (" ".join("?" if x is None else f"{x:.2g}" for x in fit.noise[kind]) for kind in ("torque", "position"))
    force, length = all_units(fit.robot_model)
    words = f"white noise of the log: torque {torque} {force}, position {position} {length}"
    if not any(steps := fit.noise["encoder_step"]):
        return words
    each = zip(steps, fit.robot_model.tree.joints, strict=True)
    bits = " ".join("-" if joint.kind == "slide" else f"{log2(2 * pi / step):.1f}" if step else "?" for step, joint in each)
    return f"{words}; encoder steps {' '.join(f'{x:.3g}' if x else '?' for x in steps)} {length} ({bits} bits)"


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
            console.print(Text(f"{model}: {verdict.word}, torques within {off}"), soft_wrap=True)
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
