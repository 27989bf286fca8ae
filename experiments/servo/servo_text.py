"""Servos as text."""

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from idbench.experiments.document import Listing
from idbench.experiments.judgement.held_out import FAIR, GOOD, WORDS
from idbench.experiments.servo.identification import unit_of
from idbench.experiments.text import error_percentage, number, of_each
from idbench.identify import Array
from idbench.identify.arrays import TINY
from idbench.identify.judge.suspect import Suspect
from idbench.identify.servo import ServoFit
from idbench.identify.servo.choice import ServoFrictionChoice, residuals_by_state
from idbench.identify.servo.fit import TORQUES
from idbench.identify.servo.mistakes import EXPLAINED, MISTAKES, REMAINING
from idbench.identify.servo.parameters import SERVO_PARAMETERS
from idbench.identify.tables import concise

STILL = 0.01  # Rms of a held-out motion, over the range of the fitted one, up to which a joint rests: a sine has 0.35
ALIKE = 1.5  # Error on held-out logs, over that on the fitted ones, up to which a model holds
COUNTS = 0.1  # Counts below which residuals are said in rad: where a log is not rounded

CONFOUNDED = 0.9
"""Correlation from which on two parameters are hardly told apart: the error of each is then 2.3 times what it is with the other
known."""

LAWS = {"duty": "a V duty - b qd", "torque": "a sat(kp (u - q) - kd qd)", "current": "a sat(kp (u - q) - kd qd), of a current"}
"""The law of each kind of loop, in words."""

MISTAKEN: Mapping[str, str] = {
    "gain_error": "the gain of the loop is {factor:.3g} times what is stated",
    "scale_error": "commands act as {factor:.4g} times what is logged: their unit, or a gear?",
    "zero": "the zeros of commands and positions are {size:.4g} rad apart",
    "lag": "commands are low-passed, by {size:.3g} s",
    "lead": "the loop sees velocities, as if its position were {size:.3g} s early",
    "dead_band": "the loop has a dead band of {size:.3g} rad",
    "bias": "there is a constant torque of {size:.3g} N m: gravity that the file lacks, a spring, a cable?",
    "Fo": "friction is larger while torque is off, by {size:.3g} N m",
}
"""What mistakes are, in words."""

LETTERS = {cause: letter for letter, cause in MISTAKES.items()}  # The parameter that each cause is


def servo_table(fits: Mapping[str, ServoFit], errors: Mapping[str, Mapping[str, Array]] = {}) -> Listing:
    """Table of the parameters with their standard errors, and mean errors of positions that follow from commands alone."""
    first = next(iter(fits.values()))
    rows = (
        (f"{name} [{unit_of(first.servo, name)}]", *(value_of(fit, name) for fit in fits.values()))
        for name in SERVO_PARAMETERS
        if any(name in fit.p for fit in fits.values())
    )
    off = ((f"error, {what} [rad]", *(f"{np.mean(of[joint]):.2g}" for joint in fits)) for what, of in errors.items())
    laws = dict.fromkeys(LAWS[fit.servo.kind] for fit in fits.values())
    title = f"servos: torque = {', or '.join(laws)}, friction and armature at the joint"
    return Listing(title, ("", *fits), (*rows, *off))


def value_of(fit: ServoFit, name: str) -> str:
    """A parameter with its standard error, and the factor that it is known up to beside that."""
    if name not in fit.p:
        return ""
    if name in fit.unscaled and name == "offset":
        return "no scale"
    sigma = fit.standard_errors.get(name)
    value = f"{number(fit.p[name])} held" if sigma is None else concise(fit.p[name], sigma)
    return "{} x {:.2g} to {:.2g}".format(value, *fit.factor) if name in fit.unscaled else value


def warnings_of(fits: Mapping[str, ServoFit | str], mistakes: Collection[str] = ()) -> list[str]:
    """Warnings, each once for all joints that it concerns; `mistakes` are joints of which one was proved."""
    every = ((joint, fit) for joint, fit in fits.items() if isinstance(fit, ServoFit))
    return list(of_each((joint, text) for joint, fit in every for text in _warnings(fit, joint in mistakes)).values())


def _warnings(fit: ServoFit, mistaken: bool) -> Iterator[str]:
    if spikes := sum(int((~run.read_well).sum()) for run in fit.loop.runs):
        what = f"{spikes} position samples are spikes" if spikes > 1 else "1 position sample is a spike"
        yield f"{what}, from which the joint came back at once: left out"
    if not fit.explained:
        yield (
            f"commands explain the motion to {fit.scale:.2g} rad only, of {fit.excitation.range:.2g} rad: are kp, gain and "
            "counts right, and does the joint move freely?"
        )
    elif not fit.scaled:
        named = ", ".join(name for name in TORQUES if name in fit.unscaled)
        low, high = fit.factor
        offset = ", and the offset not at all" if "offset" in fit.unscaled else ""
        why = "gravity is free as well" if "Mg" in fit.free else "the known load does not set their scale in these logs"
        way = "for torques log more motion, add a known mass to the robot's file, or give one of them (--hold a=0.5)"
        if mistaken:
            why, way = "something is wrong", "mend that first: it is named below"
        elif fit.scale > REMAINING * fit.excitation.range:
            why, way = "the model lacks something", "first find out what: kp, gain, zeros, units, torque that was off unlogged?"
        yield (
            f"{named} are known up to a common factor ({low:.2g} to {high:.2g}){offset}, because {why}. Positions are "
            f"predicted all the same; {way}"
        )
    if "backlash" in fit.free and fit.p["backlash"] < 2 * fit.standard_errors["backlash"]:
        yield f"backlash {value_of(fit, 'backlash')} is none that this log shows; play behind the encoder that it logs never is"
    kind = fit.servo.kind
    if kind == "duty" and not fit.excitation.off and "b" in fit.free:
        yield "torque is never off, so b is the sum of back-EMF and viscous friction, and Fv is 0"
    if kind == "duty" and "rate" not in fit.free:
        yield "no command is faster than the rate limit of the firmware, if there is one"


def confounded(fit: ServoFit) -> str:
    """Armature per delay with which the fit would change alike, if the log hardly tells them apart; empty if it does."""
    if not {"Ia", "delay"} <= set(fit.free):
        return ""
    Ia, delay = (fit.free.index(name) for name in ("Ia", "delay"))
    C = fit.covariance
    if C[delay, delay] <= 0 or abs(C[Ia, delay]) < CONFOUNDED * np.sqrt(C[Ia, Ia] * C[delay, delay]):
        return ""
    per_ms = 1e-3 * C[Ia, delay] / C[delay, delay]
    return f"Ia and delay are hardly told apart: {per_ms:+.2g} kg m^2 for each ms"


def verdict_lines(
    fits: Mapping[str, ServoFit],
    fitted: Mapping[str, Array],
    held_out: Mapping[str, Array],
    moved: Mapping[str, float],
    mistakes: Mapping[str, Suspect],
) -> list[tuple[str, str]]:
    """Lines, each after its verdict: on the worst joint, on each, how they do on held-out logs, and what they lack ("unsure").

    All by joint: mean errors of positions in the fitted and in the held-out logs [rad], shape (log,), rms of the motion of the
    held-out logs about its mean [rad], and what was proved to be wrong.
    """
    lines, word_of, worst = list[tuple[str, str]](), dict[str, str](), list[tuple[bool, int, float, str]]()
    for joint, fit in fits.items():
        word, why, more = _holds(fit, fitted[joint], held_out.get(joint), moved.get(joint, 0.0), joint in mistakes)
        lines.append((joint, f"{word}: {why}{more}" if joint in held_out else why))
        word_of[lines[-1][1]] = word
        share = float(np.mean(held_out.get(joint, 0.0))) / max(moved.get(joint, 0.0), TINY)
        moves = moved.get(joint, np.inf) > STILL * fit.excitation.range
        worst.append((moves, WORDS.index(word), share, f"Result: {word} ({joint}): {why}"))
    _, first, _, line = max(worst)
    words = [(joint, mistake_words(mistake, fits[joint])) for joint, mistake in mistakes.items()]
    alike = [(joint, text) for joint, fit in fits.items() if (text := confounded(fit))]
    lacks = [(joint, _lacks(fit)) for joint, fit in fits.items()]
    rest = [("unsure", line) for some in (words, alike, lacks) for line in of_each(some).values()]
    each = [(word_of[why], line) for why, line in of_each(lines).items()] if len(lines) > 1 else []
    return [(WORDS[first], line), *each, *rest]


def mistake_words(mistake: Suspect, fit: ServoFit) -> str:
    """Mistake, its probability, its rivals, and the proved remedy, in words."""
    letter = LETTERS[mistake.cause]
    what = MISTAKEN[letter].format(size=mistake.size[0], factor=1 + mistake.size[0])
    if letter == "lead" and fit.servo.kd and fit.servo.kind == "torque":
        kd = fit.servo.slope * mistake.size[0]
        what = f"kd is {abs(kd):.2g} N m s/rad too {'small' if kd > 0 else 'large'}"
    rivals = ", ".join(LETTERS[cause] for cause, _ in mistake.alternatives)
    others = f"; or {rivals}, which this log cannot distinguish" if rivals else ""
    before, after = mistake.held_out
    return (
        f"{what} (p = {mistake.p:.0g}){others}; with {remedy_of(mistake)} the error of parts that were not fitted "
        f"falls from {before:.2g} to {after:.2g} rad"
    )


def remedy_of(mistake: Suspect) -> str:
    """The option that mends a mistake."""
    return f"--find {LETTERS[mistake.cause]}"


def _holds(fit: ServoFit, fitted: Array, held_out: Array | None, moved: float, mistaken: bool) -> tuple[str, str, str]:
    """Verdict on a joint, why, and details."""
    if held_out is None:
        return "unsure", "no held-out log: name a second one", ""
    floor, ratio = fit.loop.step / 4, float(np.mean(held_out) / max(float(np.mean(fitted)), TINY))
    share = 100 * float(np.mean(held_out)) / max(moved, TINY)
    off = f"positions off by {error_percentage(share)} of the motion on other logs"
    best = "fair" if mistaken or not fit.explained else "good"
    exact = bool(np.mean(held_out) <= 2 * floor)
    word = best if exact or share <= GOOD else "fair" if share <= FAIR else "poor"
    if ratio > ALIKE and share > GOOD and not exact:
        return word, off, f", {ratio:.2g} times as much as on the fitted ones"
    return word, off, ""


def _lacks(fit: ServoFit) -> str:
    lacks, step = residuals_by_state(fit), fit.loop.step
    if lacks[0].error <= EXPLAINED * step / 4:  # what rounding leaves, on average
        return "its residuals are little more than the rounding of the encoder"
    in_counts = step > 0 and lacks[0].error < step / COUNTS
    sizes = [f"{lack.error / step:.2g} counts" if in_counts else f"{lack.error:.2g} rad" for lack in lacks]
    return f"mean residuals: {', '.join(f'{size} while {lack.when}' for size, lack in zip(sizes, lacks, strict=True))}"


def choice_table(joint: str, choice: ServoFrictionChoice) -> Listing:
    """Table of laws of friction compared by parts of the log that their fits did not see."""
    first, rows = next(iter(choice.errors)), []
    for law, error in choice.errors.items():
        name = f"{law} (chosen)" if law == choice.chosen else law
        rows.append((name, number(1e3 * error), f"{choice.p[law]:.2g}" if law in choice.p else ""))
    title = f"{joint}: laws of friction, by the error of parts of the log that their fits did not see"
    return Listing(title, ("law", "mrad", f"p, against {first}"), tuple(rows))
