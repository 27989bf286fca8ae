"""From what is asked of a motion to what a search minimises."""

from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from idbench.experiments.errors import ExperimentError
from idbench.identify import Array, FirLowPass, NoiseLevels
from idbench.identify.design.information import Information
from idbench.identify.design.plan import Plan
from idbench.identify.noise.linearization import slopes
from idbench.identify.parameters.base_parameters import random_states

if TYPE_CHECKING:
    from idbench.experiments.excite.design import Design

STATES, LEAST = 12.0, 8.0  # States for each period of the highest frequency, and least states a second
MANY = 400  # Most periods of the highest frequency: slopes of more take hours
FINER = 4  # Instants at which limits are kept, for each state
POSTURES = 200  # Random postures over which inertia is averaged
PASS = FirLowPass().cutoff  # End of the pass band of the rows [Hz]


def plan_for(design: "Design") -> Plan:
    """Return what the search minimises; raise ExperimentError if the motion is too short for the parameters."""
    _require_enough(design)
    moves = max(1, round(design.duration * design.frequency))
    if moves > MANY:
        raise ExperimentError(f"{moves} periods of {design.frequency:g} Hz are more than {MANY}: give a shorter --duration")
    count = moves * ceil(max(LEAST, STATES * design.frequency) * design.duration / moves)  # where moves begin, jerk peaks
    rate = count / design.duration
    grids = (np.arange(count) + 0.5) / rate, np.arange(FINER * count) / (FINER * rate)
    states, instants = (design.excitation.shapes(np.asarray(t), design.duration, design.frequency) for t in grids)
    noise = design.first_criterion.noise
    return Plan(
        information=_information(design, rate, noise),
        criterion=design.first_criterion,
        limits=design.limits,
        states=states,
        instants=instants,
        X=design.X,
        known=design.known if noise else np.zeros_like(design.known),
        prior_error=design.asked.prior_error,
        torque_share=design.asked.torque_share,
        repeat=design.repeat,
        home=design.home,
        obstacles=design.clearance.cost if design.clearance.checks else None,
    )


def _information(design: "Design", rate: float, noise: bool) -> Information:
    """Return the information of motions, with their noise, or as if all rows were alike."""
    basis = design.robot_model.basis
    fs = design.scenario.fs
    n = design.robot_model.robot.n
    levels = design.levels if noise else NoiseLevels(np.ones(n), np.zeros(n))
    return Information(basis, levels, _inertia(design), fs, rate, min(PASS, fs / 2))


def _inertia(design: "Design") -> Array:
    """Return M(q), on average over postures."""
    q, qd, qdd = random_states(design.robot_model.tree, POSTURES)
    return np.asarray(slopes(design.robot_model.basis, design.X, q, qd, qdd, qd).inertia.mean(axis=-1))


def _require_enough(design: "Design") -> None:
    p, rows = len(design.X), 2 * PASS * design.duration * design.robot_model.robot.n
    if rows < p:
        raise ExperimentError(
            f"{design.duration:g} s make {rows:.0f} rows behind a filter at {PASS:g} Hz, fewer than the {p} parameters: "
            f"give a --duration of at least {ceil(max(4 * p / rows * design.duration, 3 / design.frequency))} s"
        )
