"""A log as a picture: its motion, torques, spectra and clock."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from idbench.experiments.identification.logs import LogFacts
from idbench.experiments.text import JOINTS
from idbench.identify import Array
from idbench.identify.signals.spectra import welch

POINTS = 4000  # Largest number of points of a curve: more are invisible


def figure_of(facts: LogFacts) -> Figure:
    """Return positions, velocities and torques over time, spectra of the torques, and the steps of the clock."""
    figure = Figure(figsize=(11, 9), layout="constrained")
    grid = figure.add_gridspec(4, 2, height_ratios=(1, 1, 1, 1))
    log, step = facts.log, max(1, facts.log.samples // POINTS)
    panels = [figure.add_subplot(grid[row, :]) for row in range(3)]
    shown = (("q [rad]", log.q), ("qd [rad/s]", facts.velocities), ("torque [N m]", log.tau))
    for panel, (name, values) in zip(panels, shown, strict=True):
        for j, joint in enumerate(facts.columns.names):
            panel.plot(log.t[::step], values[::step, j], color=_color(j), lw=0.8, label=joint)
        panel.set_ylabel(name)
    panels[-1].set_xlabel("time [s]")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=8, frameon=False)
    spectra, clock = figure.add_subplot(grid[3, 0]), figure.add_subplot(grid[3, 1])
    f, power = welch(log.tau.T, log.fs, min(log.samples, round(4 * log.fs)))
    for j in range(log.n):
        spectra.loglog(f[1:], np.sqrt(power[j, 1:]), color=_color(j), lw=0.8)
    spectra.set_xlabel("frequency [Hz]")
    spectra.set_ylabel("torque [N m/$\\sqrt{Hz}$]")
    _clock(clock, facts)
    return figure


def _clock(panel: Axes, facts: LogFacts) -> None:
    """Draw the time steps of the file, and of the clock that was found."""
    t, clock = facts.columns.t, facts.repaired.clock
    panel.plot(t[1:], 1e3 * np.diff(t), ".", ms=2, color="0.6", label="steps of the file")
    panel.plot(clock.t[1:], 1e3 * np.diff(clock.t), ".", ms=2, color="tab:blue", label="steps that count")
    panel.set_xlabel("time [s]")
    panel.set_ylabel("time step [ms]")
    panel.set_ylim(bottom=0)
    panel.legend(frameon=False, markerscale=4)


def _color(j: int) -> Array:
    return np.array(JOINTS[j % len(JOINTS)]) / 255
