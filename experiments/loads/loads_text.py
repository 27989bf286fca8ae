"""Payloads and gains as tables, lines and summaries."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from idbench.experiments.document import Listing
from idbench.experiments.loads.known_load import negative_mass
from idbench.experiments.results.writing import finite
from idbench.identify import Array, IdentificationError
from idbench.identify.basis.tree_links import KINDS
from idbench.identify.loads.drive_gains import VAGUE, GainEstimate
from idbench.identify.loads.loaded_robot import LETTERS
from idbench.identify.loads.payload import PayloadEstimate
from idbench.identify.parameters.bodies import pseudo_inertia
from idbench.identify.tables import concise

UNITS = {x: unit for x, (_, unit) in zip(LETTERS, KINDS.values(), strict=True)}
"""Units of the parameters of a payload."""


def payload_table(way: str, p: PayloadEstimate, link: str) -> Listing:
    """Table of the payload."""
    each = zip(p.names, p.X.tolist(), p.sigma.tolist(), strict=True)
    rows = tuple((name, UNITS.get(name, ""), concise(x, sigma)) for name, x, sigma in each)
    return Listing(f"payload, about the origin of the frame of {link}", ("", "unit", way), rows, 2)


def payload_lines(leading: PayloadEstimate) -> Iterator[str]:
    """Yield what was known, and the body that agrees best."""
    if leading.known:
        yield "known: " + ", ".join(f"{name} = {x:.5g}" for name, x in leading.known.items())
    if negative_mass(leading):
        return
    body = body_of(leading)
    if "mass" not in body:
        yield body["why"]
        return
    centre, inertia = (" ".join(f"{x:.4g}" for x in body[key]) for key in ("centre_of_mass", "principal_inertia"))
    yield f"the nearest physically consistent body: {body['mass']:.5g} kg at {centre} m, principal inertias {inertia} kg m^2"


def words_of_payload(payload: PayloadEstimate) -> str:
    """Return the mass with its standard error, and where it is, in words."""
    known = dict(zip(payload.names, zip(payload.X.tolist(), payload.sigma.tolist(), strict=True), strict=True))
    mass, sigma = known.get("ML", (payload.known.get("ML", np.nan), 0.0))
    if abs(mass) < 2 * sigma:
        return f"no payload that exceeds its sigma: {concise(mass, sigma)} kg"
    body = body_of(payload)
    centre = f" at ({', '.join(f'{x:.3f}' for x in body['centre_of_mass'])}) m" if "mass" in body else ""
    return f"payload of {concise(mass, sigma)} kg{'' if negative_mass(payload) else centre}"


def body_of(payload: PayloadEstimate) -> dict[str, Any]:
    """Return mass, centre of mass and inertia of the body that agrees best with an estimate; why, if that is not known."""
    try:
        x = payload.consistent()
    except (IdentificationError, np.linalg.LinAlgError) as error:
        return {"why": str(error)}
    S, mass = pseudo_inertia(x), float(x[-1])
    centre = x[6:9] / mass
    second = S[:3, :3] - mass * np.outer(centre, centre)
    about = np.trace(second) * np.eye(3) - second
    return {
        "mass": mass,
        "centre_of_mass": centre.tolist(),
        "inertia_about_it": about.tolist(),
        "principal_inertia": np.linalg.eigvalsh(about).tolist(),
        "parameters": dict(zip(LETTERS, map(float, x), strict=True)),
    }


def payload_summary(way: str, p: PayloadEstimate) -> dict[str, Any]:
    """Summary of a payload."""
    each = zip(p.names, p.X.tolist(), p.sigma.tolist(), strict=True)
    named = {name: {"value": x, "sigma": sigma, "unit": UNITS.get(name, "")} for name, x, sigma in each}
    values = {"estimate": p.X.tolist(), "sigma": p.sigma.tolist(), "covariance": p.covariance.tolist()}
    return {
        "parameters": list(p.names),
        "known": dict(p.known),
        "ways": {way: {"parameters": named, **values}},
        "body": body_of(p),
    }


def gains_table(found: GainEstimate, given: Sequence[float], joints: Sequence[str]) -> Listing:
    """Table of the gain of each joint."""
    rows = list[tuple[str, ...]]()
    for joint, read, gain, sigma, shown in zip(joints, given, found.gains, found.sigma, found.shown, strict=True):
        change = f"{100 * (gain / read - 1):+.2f}" if shown else ""
        value = concise(gain, sigma) if shown else "refused"
        rows.append((joint, f"{read:.5g}", value, f"{100 * sigma / abs(gain):.2g}", change))
    heads = ("", "read with", "gain", "%sigma", "change %")
    return Listing("gains of the drives: torque over what was logged", heads, tuple(rows))


def words_of_gains(found: GainEstimate, given: Array, joints: Sequence[str]) -> str:
    """Return the gain that changes most, in words."""
    change = np.where(found.shown, np.abs(found.gains / given - 1), -1.0)
    j = int(change.argmax())
    if not found.shown[j]:
        return "the payload shows no gain"
    gain = concise(float(found.gains[j]), float(found.sigma[j]))
    return f"gains change by up to {100 * change[j]:.2g} % ({joints[j]}: {gain}, read with {given[j]:.4g})"


def doubts_of_gains(found: GainEstimate, joints: Sequence[str]) -> list[str]:
    """Warnings about gains of which the payload says nothing."""
    if not (lost := [joint for joint, shown in zip(joints, found.shown, strict=True) if not shown]):
        return []
    return [
        f"the payload says nothing of the gain of {', '.join(lost)}: sigma above {100 * VAGUE:g} % of it; hold the payload "
        "away from the axis, move so that gravity turns about it, or take a heavier one"
    ]


def gains_summary(found: GainEstimate, given: Sequence[float], joints: Sequence[str]) -> dict[str, Any]:
    """Summary of gains; those that the payload says nothing of are null."""
    return {
        "joints": list(joints),
        "read_with": list(map(float, given)),
        "gains": [float(g) if told else None for g, told in zip(found.gains, found.shown, strict=True)],
        "sigma": [finite(s) for s in found.sigma],
    }
