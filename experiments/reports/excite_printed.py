"""Designed motions as text."""

from math import isfinite

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.excite.excited import BINDING, Excited
from idbench.experiments.excite.sequence import MotionSequence
from idbench.experiments.text import WORTHLESS, new_table, number, percentage, print_titled
from idbench.identify import brisk_shares


def print_excited(console: Console, found: Excited) -> None:
    """Print the predicted sigma of every parameter beside random motions, and how limits are used."""
    d = found.design
    title = f"{d.robot_model.robot.name}: {d.kind}, {d.duration:g} s" + (f" x {d.repeat}" if d.repeat > 1 else "")
    _print_sigmas(console, found, title)
    _print_limits(console, found)
    for line in lines(found):
        console.print(Text(line), soft_wrap=True)


def lines(found: Excited) -> list[str]:
    """Return what is to be said of a motion beside its tables."""
    median, best = found.ratios
    count = f"{len(found.random)} random motions of equal length and limits"
    told = []
    if found.random:
        told.append(f"standard errors {_below(median)} those of a typical random motion, {_below(best)} the best of {count}")
    if len(found.random) < found.drawn:
        told.append(f"random motions: {found.drawn} drawn, {len(found.random)} within the limits")
    told.append(f"Cond(W) = {found.condition:.3g}, not a measure of quality")
    held = "; ".join(found.binding)
    told.append(f"active limits: {held}" if held else "no limit is active: a higher --frequency may excite more")
    if found.floor is not None:
        told.append(f"floor assumed at z = {found.floor:g} m")
    if found.unchecked:
        told.append(f"note: {found.unchecked}")
    if found.interrupted:
        told.append("interrupted: this is the best motion so far")
    return told


def _below(ratio: float) -> str:
    """Return a ratio of standard errors in words: 56 % below."""
    return f"{100 * (1 - ratio):.0f} % below" if ratio <= 1 else f"{100 * (ratio - 1):.0f} % above"


def _print_sigmas(console: Console, found: Excited, title: str) -> None:
    d = found.design
    heads = ["X", "sigma", "%sigma", "of brisk\ntorque %", "random\nmedian", "random\nbest"]
    grid = new_table("", [*heads, *(["earlier\nlogs"] if found.earlier is not None else [])])
    brisk = 100 * brisk_shares(d.robot_model.tree, d.robot_model.basis, d.X, found.sigma)
    for i, name in enumerate(d.robot_model.basis.names):
        share = 100 * found.sigma[i] / abs(d.X[i]) if d.X[i] else np.inf
        percent = (percentage(share) or f">{WORTHLESS:g}") if d.X[i] else "-"
        own = [number(d.X[i]), f"{found.sigma[i]:.2g}", percent, f"{brisk[i]:.2g}"]
        others = [_sigma(x[i]) for x in (found.median, found.best, found.earlier) if x is not None]
        grid.add_row(name, *own, *others)
    print_titled(console, f"{title}: predicted sigma", grid)


def _sigma(x: float) -> str:
    return f"{x:.2g}" if isfinite(x) else "-"


def _print_limits(console: Console, found: Excited) -> None:
    largest = found.use.largest
    of = {"torque": f"torque, of\n{found.design.asked.torque_share:.0%}"}
    grid = new_table("", [of.get(name, name.replace(" ", "\n", 1)) for name in largest])
    for j, joint in enumerate(found.use.joints):
        cells = (f"{100 * share[j]:.0f} %{'!' if share[j] > BINDING else ' '}" for share in largest.values())
        grid.add_row(joint, *cells)
    print_titled(console, "shares of the limits in use, checked at 1 kHz; ! marks active limits", grid)


def print_sequence(console: Console, sequence: MotionSequence) -> None:
    """Print what each motion left open."""
    grid = new_table("", ["weakest\nparameter", "its sigma, of\nbrisk torque %", "typical\nsigma, of first"])
    first = np.log(sequence.rounds[0].estimate.standard_errors).mean()
    for k, each in enumerate(sequence.rounds, 1):
        typical = np.exp(np.log(each.estimate.standard_errors).mean() - first)
        grid.add_row(f"motion {k}", each.weakest, f"{100 * each.share:.3g}", f"{typical:.2f}")
    print_titled(console, "motions one after the other, identified together", grid)
    last = sequence.rounds[-1]
    reached = f"every sigma makes less than {100 * sequence.wished:.4g} % of a brisk torque"
    why = "interrupted; go on with --log" if sequence.interrupted else "give a longer --duration, or less noise"
    short = f"not reached after {len(sequence.rounds)} motions: {last.weakest} still makes {last.share:.2%}; {why}"
    console.print(Text(reached if sequence.reached else short), soft_wrap=True)
