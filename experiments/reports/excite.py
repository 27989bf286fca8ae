"""The report of a designed motion: one HTML file that needs no other."""

from math import isfinite

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from rich.console import Console
from rich.text import Text

from idbench.experiments.excite.excited import BINDING, Excited
from idbench.experiments.excite.job import MotionSequence
from idbench.experiments.excite.limit_use import FS
from idbench.experiments.reports.drawn import svg
from idbench.experiments.reports.figures import rendered
from idbench.experiments.text import JOINTS, WORTHLESS, new_table, number, percentage, print_titled
from idbench.identify import brisk_shares
from idbench.sim.limits.motion_limits import looser
from idbench.sim.scenario.scenario_file import to_toml


def print_excited(console: Console, found: Excited) -> None:
    """Print the predicted sigma of every parameter beside random motions, and how limits are used."""
    _print_sigmas(console, found)
    _print_limits(console, found)
    for line in lines(found):
        console.print(Text(line), soft_wrap=True)


def lines(found: Excited) -> list[str]:
    """Lines on a motion beside its tables."""
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


def _print_sigmas(console: Console, found: Excited) -> None:
    d = found.design
    title = f"{d.robot_model.robot.name}: {d.kind}, {d.duration:g} s" + (f" x {d.repeat}" if d.repeat > 1 else "")
    heads = ["X", "sigma", "%sigma", "of brisk\ntorque %", "random\nmedian", "random\nbest"]
    grid = new_table("", [*heads, *(["earlier\nlogs"] if found.earlier is not None else [])])
    brisk = 100 * brisk_shares(d.robot_model.tree, d.robot_model.basis, d.X, found.sigma)
    for i, name in enumerate(d.robot_model.basis.names):
        share = 100 * found.sigma[i] / abs(d.X[i]) if d.X[i] else np.inf
        percent = (percentage(share) or f">{WORTHLESS:g}") if d.X[i] else "-"
        own = [number(d.X[i]), f"{found.sigma[i]:.2g}", percent, f"{brisk[i]:.2g}"]
        known = (x[i] for x in (found.median, found.best, found.earlier) if x is not None)
        grid.add_row(name, *own, *(f"{x:.2g}" if isfinite(x) else "-" for x in known))
    print_titled(console, f"{title}: predicted sigma", grid)


def _print_limits(console: Console, found: Excited) -> None:
    largest = found.use.largest
    of = {"torque": f"torque, of\n{found.design.asked.torque_share:.0%}"}
    grid = new_table("", [of.get(name, name.replace(" ", "\n", 1)) for name in largest])
    for j, joint in enumerate(found.use.joints):
        grid.add_row(joint, *(f"{100 * share[j]:.0f} %{'!' if share[j] > BINDING else ' '}" for share in largest.values()))
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


PLOTTED = 100.0  # Frequency [Hz] of curves


def report(found: Excited, command: str) -> str:
    """Return the page: what the motion tells, how it moves, what holds it back, and the command that made it."""
    d = found.design
    return rendered(
        "idbench.experiments.reports",
        "excite.html.j2",
        title=f"A motion for {d.robot_model.robot.name}",
        design=d,
        headline=lines(found)[0],
        notes=[*lines(found)[1:], *looser(d.robot_model.robot, d.asked)],
        sigmas=_sigma_figure(found),
        motion=_motion_figure(found),
        told=_told_figure(found),
        kinds=list(found.use.largest),
        limits=[
            (joint, [(f"{100 * share[j]:.0f} %", share[j] > BINDING) for share in found.use.largest.values()])
            for j, joint in enumerate(found.use.joints)
        ],
        rows=_rows(found),
        earlier=found.earlier is not None,
        command=command,
        toml=to_toml(found.scenario),
    )


def _rows(found: Excited) -> list[list[str]]:
    X = found.design.X
    rows = []
    for i, name in enumerate(found.design.robot_model.basis.names):
        share = percentage(100 * found.sigma[i] / abs(X[i])) if X[i] else ""
        others = (f"{x[i]:.2g}" if isfinite(x[i]) else "" for x in (found.median, found.best, found.earlier) if x is not None)
        rows.append([name, number(X[i]), f"{found.sigma[i]:.2g}", share, *others])
    return rows


def _sigma_figure(found: Excited) -> str:
    """Return sigmas over those of the median random motion, parameter by parameter."""
    names = found.design.robot_model.basis.names
    figure = Figure(figsize=(11, 3.2), layout="constrained")
    panel, at = figure.subplots(), np.arange(len(names))
    if found.random:
        spread = np.sort(found.sigmas[1:] / found.median, axis=0)
        panel.fill_between(at, spread[0], spread[-1], color="0.85", step="mid", label="all random motions")
        panel.plot(at, found.best / found.median, ".", color="0.45", label="the best random motion")
        panel.axhline(1.0, color="0.45", lw=0.8)
    base = found.median if found.random else found.sigma
    panel.plot(at, found.sigma / base, "o", ms=4, color="tab:blue", label="this motion")
    if found.earlier is not None:
        known = np.where(np.isfinite(found.earlier), found.earlier, np.nan)
        panel.plot(at, known / base, "x", ms=4, color="tab:orange", label="earlier logs alone")
    panel.set_yscale("log")
    panel.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    panel.yaxis.set_minor_formatter(FuncFormatter(lambda y, _: f"{y:g}" if f"{y:e}"[0] in "235" else ""))
    panel.set_xticks(at, names, rotation=90)
    panel.set_ylabel("sigma relative to the\nmedian random motion")
    panel.legend(ncols=4, loc="upper center", bbox_to_anchor=(0.5, 1.16), frameon=False)
    return svg(figure)


def _motion_figure(found: Excited) -> str:
    """Return positions, velocities and torques of all joints, as shares of their limits."""
    d, step = found.design, max(1, round(FS / PLOTTED))
    motion = d.trajectory(found.c, 1).motion(d.robot_model.robot).sample(FS)
    shown = {"position": (motion.q - d.limits.middle) / d.limits.sizes[0], "velocity": motion.qd / d.limits.velocity}
    there = shown | {name: share for name, share in found.use.shares.items() if name == "torque"}
    figure = Figure(figsize=(11, 1.7 * len(there) + 0.4), layout="constrained")
    panels = list(np.atleast_1d(figure.subplots(len(there), 1, sharex=True)))
    t = np.arange(len(motion.q))[::step] / FS
    for panel, (name, values) in zip(panels, there.items(), strict=True):
        for j, joint in enumerate(found.use.joints):
            shade = np.array(JOINTS[j % len(JOINTS)]) / 255
            panel.plot(t, 100 * values[::step, j], color=shade, lw=1.0, label=joint)
        panel.set_ylabel(f"{name}\n[% of limit]")
    panels[-1].set_xlabel("time [s]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=8, frameon=False)
    return svg(figure)


def _told_figure(found: Excited) -> str:
    """Picture of the information of each stretch of the motion about each parameter."""
    names, shares = found.design.robot_model.basis.names, 100 * found.shares
    figure = Figure(figsize=(11, 0.13 * len(names) + 1.1), layout="constrained")
    panel = figure.subplots()
    extent = (0, found.design.duration, len(names) - 0.5, -0.5)
    image = panel.imshow(shares.T, aspect="auto", cmap="viridis", vmin=0, extent=extent, interpolation="nearest")
    panel.set_yticks(np.arange(len(names)), names, fontsize=6)
    panel.set_xlabel("time [s]")
    panel.grid(visible=False)
    figure.colorbar(image, label="% of the information")
    return svg(figure)
