"""What is wrong with a fit of a servo: one parameter for each mistake, tried one by one, and proved on parts left out."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from idbench.identify.servo.choice import LEVEL, p_value, residuals_by_state
from idbench.identify.servo.fit import CLUSTERS, ServoFit
from idbench.identify.servo.left_out import left_out, stretches
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.servo.stages import Stages

MISTAKES: Mapping[str, str] = {
    "gain_error": "gain",
    "scale_error": "scale",
    "zero": "zero",
    "lag": "lag",
    "lead": "lead",
    "dead_band": "dead_band",
    "bias": "offset",
    "Fo": "friction",
}
"""Parameters of which each is a mistake that people make, or a part of a loop that they do not know of, and its cause."""

EXPLAINED = 3.0  # Residual over what rounding leaves, up to which there is nothing to explain: clocks of cheap servos jitter

GAINED = 0.6
"""Share of the error of parts left out that a mistake must explain. Gains, zeros and scales that were set wrongly explained 0.9
to 0.99 on simulated benches; what is no mistake of the table, such as low-passed positions, explained 0.2 to 0.5 as one."""

REMAINING = 0.01
"""Residual, as a share of the range of the motion, that may be left with a mistake: beyond, something else is wrong."""

GLANCES = 5  # Rounds of a search that tells which mistakes are likely
LIKELY = 3  # Mistakes that are searched for further
ROUNDS = 25  # Rounds of these: of a gain that is half of what it is, the first five led elsewhere
AS_WELL = 0.8  # Share of what the best mistake explains from which on another one is named beside it


@dataclass(frozen=True)
class ServoMistake:
    """A mistake that explains residuals of a joint."""

    letter: str
    """The parameter that it is."""
    size: float
    """Its value."""
    sigma: float
    """Its standard error."""
    p: float
    """Probability of so much by chance, of all tests."""
    alternatives: tuple[str, ...]
    """Other mistakes that explain nearly as much."""
    errors: tuple[float, float]
    """Rms of the residuals of parts left out, without and with it, large ones counting less [rad]."""


def mistake_of(fit: ServoFit) -> ServoMistake | None:
    """Return the mistake that explains most of a fit's residuals; None if there is none to explain, or none is proved.

    Each is searched for from where the fit is, in coarse steps. The best is fitted with all other parameters, and proved if
    parts of the log that a fit did not use are then predicted better, by Wilcoxon's signed-rank test.
    """
    if residuals_by_state(fit)[0].error <= EXPLAINED * fit.loop.step / 4:
        return None
    tried = [name for name in MISTAKES if name not in fit.free and not fit.p.get(name) and (name != "Fo" or fit.excitation.off)]
    known = {name: x for name, x in fit.p.items() if name not in fit.free and name not in tried}
    stages = Stages(fit.loop.runs, known, fit.p, cut=False)
    glances = stages.fit_with_extra(fit.free, fit.p, tried, GLANCES)
    likely = sorted(tried, key=lambda name: glances[name].cost)[:LIKELY]
    found = stages.fit_with_extra(fit.free, fit.p, likely, ROUNDS)
    order = sorted(likely, key=lambda name: found[name].cost)
    names = tuple(name for name in SERVO_PARAMETERS if name in {*fit.free, order[0]})
    other = stages.fit_fine(fit.friction, names, found[order[0]].p, fit.contrasts)
    c, parts = 3 * fit.scale, stretches(fit.found, fit.loop, CLUSTERS * len(names))
    before, after = (left_out(x.found, x.loop, c, parts).costs for x in (fit, other))
    errors = float(np.sqrt(before.mean())), float(np.sqrt(after.mean()))
    p = p_value(before, after, len(tried))
    if errors[1] > (1 - GAINED) * errors[0] or p >= LEVEL or other.scale > REMAINING * fit.excitation.range:
        return None
    explained = {name: glances[""].cost - found[name].cost for name in order}
    alike = tuple(name for name in order[1:] if explained[name] > AS_WELL * explained[order[0]])
    return ServoMistake(order[0], other.p[order[0]], other.standard_errors[order[0]], p, alike, errors)
