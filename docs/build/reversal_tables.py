"""The table of maximum likelihood through reversals."""

import json
from collections.abc import Iterator

from results import RESULTS, table

METHODS = ("GLS", "ML", "ML-reversals")
MOTIONS = {"series": "Fourier series", "moves": "moves with rests"}


def reversals() -> Iterator[str]:
    """Yield typical errors, bounds and coverage, a row a case."""
    found = json.loads((RESULTS / "reversals.json").read_text())
    head = ["motion", "noise", *METHODS, "bound", "through reversals", f"coverage: {METHODS[0]}", *METHODS[1:]]
    rows = (
        [
            MOTIONS[one["motion"]],
            f"{one['bits']} bits" + (f", {one['torque_noise']:g} N m" if one["torque_noise"] else ""),
            *(f"{one[name]['typical']:.2g}" for name in METHODS),
            *(f"{one[name]:.2g}" for name in ("bound", "bound through reversals")),
            *(f"{one[name]['coverage']:.0f}" for name in METHODS),
        ]
        for one in found
    )
    yield from table(head, rows)
