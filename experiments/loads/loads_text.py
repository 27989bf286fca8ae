"""Payloads and gains as text and as summaries."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from idbench.experiments.loads.known_load import negative_mass
from idbench.experiments.text import new_table, print_titled
from idbench.identify import IdentificationError
from idbench.identify.loads.drive_gains import VAGUE, GainEstimate
from idbench.identify.loads.loaded_robot import LETTERS
from idbench.identify.loads.payload import PayloadEstimate
from idbench.identify.parameters.bodies import pseudo_inertia
from idbench.identify.tables import concise

# Of LETTERS.
UNITS = (*["kg m^2"] * 6, *["kg m"] * 3, "kg")


def print_payloads(console: Console, found: Mapping[str, PayloadEstimate | str], link: str) -> None:
    """Print the payload as each way has it, and the body that agrees best with the first."""
    ways = {way: payload for way, payload in found.items() if isinstance(payload, PayloadEstimate)}
    grid = new_table("", ["unit", *ways])
    names = next(iter(ways.values())).names
    for i, name in enumerate(names):
        unit = UNITS[LETTERS.index(name)] if name in LETTERS else ""
        grid.add_row(name, unit, *(concise(float(p.X[i]), float(p.sigma[i])) for p in ways.values()))
    print_titled(console, f"payload, about the origin of the frame of {link}", grid, 2)
    for way, why in found.items():
        if isinstance(why, str):
            console.print(Text(f"{way}: no estimate: {why}"), soft_wrap=True)
    leading = next(iter(ways.values()))
    if leading.known:
        console.print(Text("known: " + ", ".join(f"{name} = {x:.5g}" for name, x in leading.known.items())))
    body = body_of(leading)
    if negative_mass(leading):
        return
    if "mass" in body:
        centre, inertia = (" ".join(f"{x:.4g}" for x in body[key]) for key in ("centre_of_mass", "principal_inertia"))
        words = (
            f"the nearest physically consistent body: {body['mass']:.5g} kg at {centre} m, principal inertias {inertia} kg m^2"
        )
        console.print(Text(words), soft_wrap=True)
    else:
        console.print(Text(body["why"]), soft_wrap=True)


def words_of_payload(payload: PayloadEstimate) -> str:
    """Return the mass with its standard error, and where it is, in words."""
    known = dict(zip(payload.names, zip(payload.X.tolist(), payload.sigma.tolist(), strict=True), strict=True))
    mass, sigma = known.get("ML", (payload.known.get("ML", np.nan), 0.0))
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


def payload_summary(found: Mapping[str, PayloadEstimate | str]) -> dict[str, Any]:
    """Summary of a payload."""
    ways = {way: payload for way, payload in found.items() if isinstance(payload, PayloadEstimate)}
    leading = next(iter(ways.values()))
    return {
        "parameters": list(leading.names),
        "known": dict(leading.known),
        "ways": {
            way: {"estimate": p.X.tolist(), "sigma": p.sigma.tolist(), "covariance": p.covariance.tolist()}
            for way, p in ways.items()
        },
        "failures": {way: why for way, why in found.items() if isinstance(why, str)},
        "body": body_of(leading),
    }


def print_gains(console: Console, found: GainEstimate, given: Sequence[float], joints: Sequence[str]) -> list[str]:
    """Print the gain of each joint; return warnings about those of which the payload says nothing."""
    grid = new_table("", ["read with", "gain", "%sigma", "change %"])
    for j, joint in enumerate(joints):
        gain, sigma = found.gains[j], found.sigma[j]
        cells = [
            f"{given[j]:.5g}",
            concise(gain, sigma),
            f"{100 * sigma / abs(gain):.2g}",
            f"{100 * (gain / given[j] - 1):+.2f}",
        ]
        grid.add_row(joint, *(cells if found.shown[j] else [cells[0], "refused", cells[2], ""]))
    print_titled(console, "gains of the drives: torque over what was logged", grid, 1)
    lost = [joint for joint, told in zip(joints, found.shown, strict=True) if not told]
    if not lost:
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
        "sigma": [float(s) if np.isfinite(s) else None for s in found.sigma],
    }
