"""Texts in recordings."""

from collections.abc import Iterator, Sequence

from experiments.identification.identified import Identified
from experiments.identification.warnings import FLAGS, doubtful, used
from identify import Array, Estimate


def judged(found: Identified, estimate: Estimate) -> Array:
    """Return the errors [%] where the truth is known, %sigma where it is not."""
    return estimate.relative_sigma_percent if found.truth is None else estimate.error_percent(list(found.truth.values()))


def estimates_table(found: Identified) -> str:
    """Return estimates, with error or sigma, as a markdown table."""
    forms = list(found.estimates)
    what = "sigma" if found.truth is None else "error"
    lines = [f"Estimate and {what}, chain **{found.chain}**, {found.estimator}\n"]
    lines += [f"| | true | {' | '.join(forms)} |", "|---|---:|" + "---:|" * len(forms)]
    for i, name in enumerate(found.basis.names):
        true = "" if found.truth is None else f"{list(found.truth.values())[i]:g}"
        lines.append(f"| {i + 1} {name} | {true} | {' | '.join(_cells(found, i))} |")
    conds = " | ".join(f"{e.condition_number:.1f}" for e in found.estimates.values())
    return "\n".join([*lines, f"| Cond(W) | | {conds} |"])


def short_table(found: Identified) -> str:
    """Return the estimates of the models alone, beside the truth if it is known, as a markdown table."""
    known, marks = found.truth is not None, doubtful(found)
    lines = [
        f"Chain **{found.chain}**, {found.estimator}\n",
        f"|{' | true' if known else ''} | {' | '.join(found.estimates)} |",
    ]
    lines.append("|---|" + "---:|" * (len(found.estimates) + known))
    for i, name in enumerate(found.basis.names):
        true = f" {list(found.truth.values())[i]:g} |" if found.truth is not None else ""
        cells = (f"{e.X[i]:.4g}{''.join(marks[form][i]).strip()}" for form, e in found.estimates.items())
        lines.append(f"| {name} |{true} {' | '.join(cells)} |")
    return "\n".join([*lines, "", "; ".join(f"`{flag}` {FLAGS[flag]}" for flag in used(marks))])


def noise_table(found: Identified, joints: Sequence[str]) -> str:
    """Return the noise found in the log, joint by joint, as a markdown table."""
    lines = [
        "Noise found in the log, rms\n",
        "| | torque [N m] | position [rad] | encoder step [rad] |",
        "|---|---:|---:|---:|",
    ]
    for joint, *values in zip(joints, *(found.noise[name] for name in ("torque", "position", "encoder_step")), strict=True):
        lines.append(f"| {joint} | {' | '.join('' if x is None else f'{x:.2g}' for x in values)} |")
    return "\n".join(lines)


def _cells(found: Identified, i: int) -> Iterator[str]:
    for estimate in found.estimates.values():
        aside = f"{estimate.best_sigma[i]:.2g}" if found.truth is None else f"{judged(found, estimate)[i]:+.2g} %"
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
