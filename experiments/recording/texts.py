"""Texts in recordings."""

from collections.abc import Iterator, Sequence

from experiments.identification.fit import Fit
from experiments.identification.warnings import FLAGS, doubtful, used
from identify import Array, Estimate


def judged(fit: Fit, estimate: Estimate) -> Array:
    """Return the errors [%] where the truth is known, %sigma where it is not."""
    return estimate.relative_sigma_percent if fit.truth is None else estimate.error_percent(list(fit.truth.values()))


def estimates_table(fit: Fit) -> str:
    """Return estimates, with error or sigma, as a markdown table."""
    forms = list(fit.estimates)
    what = "sigma" if fit.truth is None else "error"
    lines = [f"Estimate and {what}, chain **{fit.request.chain}**, {fit.request.estimator}\n"]
    lines += [f"| | true | {' | '.join(forms)} |", "|---|---:|" + "---:|" * len(forms)]
    for i, name in enumerate(fit.basis.names):
        true = "" if fit.truth is None else f"{list(fit.truth.values())[i]:g}"
        lines.append(f"| {i + 1} {name} | {true} | {' | '.join(_cells(fit, i))} |")
    conds = " | ".join(f"{e.condition_number:.1f}" for e in fit.estimates.values())
    return "\n".join([*lines, f"| Cond(W) | | {conds} |"])


def short_table(fit: Fit) -> str:
    """Return the estimates of the models alone, beside the truth if it is known, as a markdown table."""
    known, marks = fit.truth is not None, doubtful(fit)
    lines = [
        f"Chain **{fit.request.chain}**, {fit.request.estimator}\n",
        f"|{' | true' if known else ''} | {' | '.join(fit.estimates)} |",
    ]
    lines.append("|---|" + "---:|" * (len(fit.estimates) + known))
    for i, name in enumerate(fit.basis.names):
        true = f" {list(fit.truth.values())[i]:g} |" if fit.truth is not None else ""
        cells = (f"{e.X[i]:.4g}{''.join(marks[form][i]).strip()}" for form, e in fit.estimates.items())
        lines.append(f"| {name} |{true} {' | '.join(cells)} |")
    return "\n".join([*lines, "", "; ".join(f"`{flag}` {FLAGS[flag]}" for flag in used(marks))])


def noise_table(fit: Fit, joints: Sequence[str]) -> str:
    """Return the noise found in the log, joint by joint, as a markdown table."""
    lines = [
        "Noise found in the log, rms\n",
        "| | torque [N m] | position [rad] | encoder step [rad] |",
        "|---|---:|---:|---:|",
    ]
    for joint, *values in zip(joints, *(fit.noise[name] for name in ("torque", "position", "encoder_step")), strict=True):
        lines.append(f"| {joint} | {' | '.join('' if x is None else f'{x:.2g}' for x in values)} |")
    return "\n".join(lines)


def _cells(fit: Fit, i: int) -> Iterator[str]:
    for estimate in fit.estimates.values():
        aside = f"{estimate.best_sigma[i]:.2g}" if fit.truth is None else f"{judged(fit, estimate)[i]:+.2g} %"
        yield f"{estimate.X[i]:.4g} ({aside})"


DRAWN = {
    "true": "where it is",
    "planned": "yellow wires where it was planned to be",
    "measured": "blue wires where its encoders see it",
}
"""How arms are drawn; the first of a recording is solid."""


def about(name: str, origin: str, roles: Sequence[str]) -> str:
    """Return what a recording shows, with the arms of these roles."""
    first = "where its encoders see it" if roles[0] == "measured" else DRAWN[roles[0]]
    arms = ", ".join([f"The arm is solid {first}", *(DRAWN[role] for role in roles[1:])])
    kinds = "Planned or asked for: broad and light. Measured or logged: thin and light. True: in the joint's own colour."
    return "\n\n".join(filter(None, [f"# {name}", origin, f"{arms}.", kinds]))
