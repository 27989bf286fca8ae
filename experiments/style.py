"""Colours and names that are the same in every view."""

from collections.abc import Sequence

Color = Sequence[int]

JOINTS: tuple[Color, ...] = (
    (31, 119, 180),
    (255, 127, 14),
    (23, 190, 207),
    (227, 119, 194),
    (188, 189, 34),
    (140, 86, 75),
    (135, 150, 185),
)
"""Colours of the joints' curves, none of which is a model's; the first two are those of the SCARA's links."""

SIGMAS = 2.0
"""Half the width of intervals, in standard errors: 95 %."""

GREY: Color = (150, 150, 150)
"""What was measured, the truth, and marks."""

FORMS: dict[str, Color] = {
    "explicit": (44, 160, 44),
    "implicit": (148, 103, 189),
    "power": (214, 39, 40),
    "energy": (0, 110, 90),
}
"""Colours of the models."""

AGAIN: dict[str, tuple[Color, ...]] = {
    "explicit": ((190, 230, 120), (0, 150, 150)),
    "implicit": ((215, 190, 240), (90, 100, 230)),
    "power": ((250, 150, 150), (170, 20, 60)),
    "energy": ((120, 190, 170), (0, 70, 60)),
}
"""Colours of the models in a second and a third identification of a log."""

PLANNED: Color = (240, 200, 60)
MEASURED: Color = (90, 210, 220)
"""Colours of the planned arm and of that which the encoders see; the true arm has its own."""

STATES: dict[str, Color] = {
    "moves": (70, 130, 90),
    "reverses": (200, 150, 50),
    "rests": (150, 60, 60),
    "saturated": (230, 60, 200),
    "used": (70, 130, 90),
    "partly": (200, 150, 50),
    "masked": (150, 60, 60),
}
"""What a joint does, its drive at a limit, and what identification makes of the instant."""

FORM_WIDTHS = {"explicit": 3.5}
"""Widths of the curves of models, 1.5 unless given here: the implicit model's lie on those of the explicit one."""


def joint_colors(n: int) -> list[Color]:
    """Return a colour for each of `n` joints."""
    return [JOINTS[j % len(JOINTS)] for j in range(n)]


def model_color(form: str, identification: int = 0) -> Color:
    """Return the colour of a model in the first, second or third identification of a log; a fourth has that of the second."""
    if not identification or form not in AGAIN:
        return lighter(FORMS.get(form, GREY), identification)
    return AGAIN[form][(identification - 1) % len(AGAIN[form])]


def lighter(color: Color, times: int) -> list[int]:
    """Return `color` moved halfway to white, that many times."""
    return [round(255 - (255 - c) / 2**times) for c in color]


SHADES = {"planned": 2, "measured": 1, "log": 1, "command": 1, "reference": 1}
"""How much lighter than the joint's colour the curves of a kind are; the others have the colour itself."""

WIDTHS = {"planned": 4.0, "reference": 4.0, "command": 4.0, "log": 1.0}
"""Widths of the curves of a kind: what was wanted is a broad band behind what has come of it."""


def kind_colors(kind: str, n: int) -> list[list[int]]:
    """Return the colours of `n` joints' curves of a kind."""
    return [lighter(color, SHADES.get(kind, 0)) for color in joint_colors(n)]
