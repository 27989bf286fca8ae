"""Colours and names that are the same in every view."""

JOINTS = ([31, 119, 180], [255, 127, 14])
"""Colours of the joints' curves: those of the SCARA's links."""

MEASURED = [150, 150, 150]
"""Grey: what was measured."""

FORMS = {
    "explicit": [44, 160, 44],
    "implicit": [148, 103, 189],
    "power": [214, 39, 40],
    "energy": [140, 86, 75],
}
"""Colours of the models."""


def joint_colors(n: int) -> list[list[int]]:
    """Return a colour for each of `n` joints."""
    return [JOINTS[j % len(JOINTS)] for j in range(n)]


def lighter(color: list[int], times: int) -> list[int]:
    """Return `color` moved halfway to white, that many times: one model's rows are shades of its colour."""
    return [round(255 - (255 - c) / 2**times) for c in color]
