"""What is wrong with a fit of a servo: one parameter for each mistake, tried one by one, and proved on parts left out."""

from collections.abc import Mapping

import numpy as np

from idbench.identify.arrays import TINY
from idbench.identify.judge.suspect import Suspect
from idbench.identify.servo.choice import LEVEL, p_value, residuals_by_state
from idbench.identify.servo.fit import CLUSTERS, ServoFit
from idbench.identify.servo.left_out import cross_validate, stretches
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

OF_SCALE = ("gain_error", "bias")  # Of these, those that mean nothing where torques have no scale

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


def mistake_of(fit: ServoFit) -> Suspect | None:
    """The mistake that explains most of a fit's residuals; None if there is none to explain, or none is proved.

    Each is searched for from where the fit is, in coarse steps. The best is fitted with all other parameters, and proved if
    parts of the log that a fit did not use are then predicted better, by Wilcoxon's signed-rank test. Gains and offsets count
    where torques have a scale with them: without one, any gain goes with some torque constant.
    """
    if residuals_by_state(fit)[0].error <= EXPLAINED * fit.loop.step / 4:
        return None
    tried = [name for name in MISTAKES if name not in fit.free and not fit.p.get(name) and (name != "Fo" or fit.excitation.off)]
    known = {name: x for name, x in fit.p.items() if name not in fit.free and name not in tried}
    stages = Stages(fit.loop.runs, known, fit.p, cut=False)
    glances = stages.fit_with_extra(fit.free, fit.p, tried, GLANCES)
    likely = sorted(tried, key=lambda name: glances[name].cost)[:LIKELY]
    found = stages.fit_with_extra(fit.free, fit.p, likely, ROUNDS)
    best, *others = sorted(likely, key=lambda name: found[name].cost)
    names = tuple(name for name in SERVO_PARAMETERS if name in {*fit.free, best})
    other = stages.fit_fine(fit.friction, names, found[best].p, fit.contrasts)
    c, parts = 3 * fit.scale, stretches(fit.found, fit.loop, CLUSTERS * len(names))
    before, after = (cross_validate(x.found, x.loop, c, parts).costs for x in (fit, other))
    errors = float(np.sqrt(before.mean())), float(np.sqrt(after.mean()))
    p = p_value(before, after, len(tried))
    if errors[1] > (1 - GAINED) * errors[0] or p >= LEVEL or other.scale > REMAINING * fit.excitation.range:
        return None
    if best in OF_SCALE and not stages.fit_fine(fit.friction, names, other.p).scaled:
        return None
    least = AS_WELL * (glances[""].cost - found[best].cost)
    alike = tuple((MISTAKES[name], 0) for name in others if glances[""].cost - found[name].cost > least)
    size, sigma = other.p[best], other.standard_errors[best]
    t = abs(size) / max(sigma, TINY)
    unit = SERVO_PARAMETERS[best].unit
    evidence = (glances[""].cost - found[best].cost) / fit.scale**2
    return Suspect(MISTAKES[best], "loop", 0, (size,), (sigma,), unit, p, t, alike, errors, evidence)
