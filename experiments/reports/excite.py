"""The report of a designed motion: one HTML file that needs no other."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from idbench.experiments.excite.excited import BINDING, Excited
from idbench.experiments.excite.limit_use import FS
from idbench.experiments.reports.excite_printed import lines
from idbench.experiments.reports.html import rendered, svg
from idbench.experiments.style import JOINTS
from idbench.experiments.text import number, percentage
from idbench.sim.limits.motion_limits import looser
from idbench.sim.scenario.scenario_file import to_toml

PLOTTED = 100.0
"""Frequency [Hz] of curves."""


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
        rows=list(_rows(found)),
        earlier=found.earlier is not None,
        command=command,
        toml=to_toml(found.scenario),
    )


def _rows(found: Excited) -> list[list[str]]:
    d = found.design
    others = [x for x in (found.median, found.best, found.earlier) if x is not None]
    return [
        [
            name,
            number(d.X[i]),
            f"{found.sigma[i]:.2g}",
            percentage(100 * found.sigma[i] / abs(d.X[i])) if d.X[i] else "",
            *(f"{x[i]:.2g}" if np.isfinite(x[i]) else "" for x in others),
        ]
        for i, name in enumerate(d.robot_model.basis.names)
    ]


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
    shown = {
        "position": (motion.q - d.limits.middle) / d.limits.sizes[0],
        "velocity": motion.qd / d.limits.velocity,
    }
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
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=8, frameon=False)
    return svg(figure)


def _told_figure(found: Excited) -> str:
    """Return which stretch of the motion tells how much of which parameter."""
    names, shares = found.design.robot_model.basis.names, 100 * found.shares
    figure = Figure(figsize=(11, 0.13 * len(names) + 1.1), layout="constrained")
    panel = figure.subplots()
    d = found.design
    image = panel.imshow(
        shares.T, aspect="auto", cmap="viridis", vmin=0, extent=(0, d.duration, len(names) - 0.5, -0.5), interpolation="nearest"
    )
    panel.set_yticks(np.arange(len(names)), names, fontsize=6)
    panel.set_xlabel("time [s]")
    panel.grid(visible=False)
    figure.colorbar(image, label="% of the information")
    return svg(figure)
