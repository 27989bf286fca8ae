"""Layouts: what is looked at together, one a purpose, made of the views for which a recording has something to show."""

from collections.abc import Callable
from collections.abc import Set as AbstractSet

import rerun.blueprint as rrb

from idbench.experiments.errors import ResultsError
from idbench.experiments.recording.chart import NARROW
from idbench.experiments.recording.run_layouts import RUN_LAYOUTS, residuals, result
from idbench.experiments.recording.views import (
    ACROSS,
    Part,
    Shelf,
    arm,
    charts,
    column,
    grid,
    keys,
    plot,
    side_by_side,
    tabbed,
    text,
)

HIGHER = 26  # How much higher a layout is than the legend above it
FEW = 2  # Parameters of a study up to which two stand in a row
PAGE = 8  # Parameters of a study that are seen at once


def compare(shelf: Shelf) -> Part:
    """Return several runs over each other: what differs in them, how they move, and the differences."""
    if not shelf.of("comparison"):
        return None
    together = column(
        plot(shelf, "q [rad]", "q/measured", "versus/*/q/measured"),
        plot(shelf, "torque in the log [N m]", "torque/log", "versus/*/torque/log"),
        plot(shelf, "true velocity [rad/s]", "qd/true", "versus/*/qd/true"),
    )
    apart = column(
        plot(shelf, "difference of q [rad]", "difference/q/*"),
        plot(shelf, "difference of the torques in the log [N m]", "difference/tau/*"),
        *residuals(shelf),
    )
    return side_by_side("compare", text(shelf, "comparison"), together, apart, shares=[4, 5, 5])


def excited(shelf: Shelf) -> Part:
    """Return a designed motion: the arm, the motion, and limits in use."""
    if not shelf.of("q/designed"):
        return None
    limits = [
        plot(shelf, f"{path.partition('_')[2].replace('_', ' ')} [% of its limit]", f"limits/{path}")
        for path in sorted(shelf.parts("limits/*"))
    ]
    left = column(arm(shelf), text(shelf, "about"), shares=[5, 3])
    motion = plot(shelf, "q [rad]", "q/designed"), plot(shelf, "qd [rad/s]", "qd/designed")
    return side_by_side("excited", left, column(*motion, column(*limits), shares=[1, 1, 4]), shares=[1, 1])


def servos(shelf: Shelf) -> Part:
    """Return servos: commands, measured and simulated positions, and residuals."""
    if not (joints := shelf.parts("servo/*/residual", -2)):
        return None
    each = [
        column(
            plot(shelf, f"{joint} [rad]: commanded, measured, simulated", f"servo/{joint}/q/*", legend=True),
            plot(shelf, f"{joint}, measured - simulated [rad]", f"servo/{joint}/residual"),
            shares=[3, 2],
        )
        for joint in joints
    ]
    shown = grid("servos", each, 1 if len(each) <= FEW else 2)
    return side_by_side("servos", column(arm(shelf), text(shelf, "about"), shares=[4, 1]), shown, shares=[1, 2])


def study(shelf: Shelf) -> Part:
    """Return a study: errors over the values of each axis, all parameters together and one by one, and the answer."""
    pages = [_over_axis(shelf, axis) for axis in shelf.parts("study/*/typical/frame", 1)]
    sigmas = charts(shelf, "all errors over their sigma", "study/sigmas")
    answer = column(text(shelf, "answer"), *sigmas, shares=[5.0, *[2.0] * len(sigmas)])
    if not pages:  # nothing varies, or no run gave an estimate
        return answer
    return side_by_side("study", answer, pages[0] if len(pages) == 1 else tabbed(pages, "axes"), shares=[2, 5])


def _over_axis(shelf: Shelf, axis: str) -> Part:
    typical = charts(shelf, "typical error", f"study/{axis}/typical")
    each = charts(shelf, "{4}", f"study/{axis}/parameters/*/*", NARROW)
    pages = [each[k : k + PAGE] for k in range(0, len(each), PAGE)]
    grids = [grid(f"parameters {1 + PAGE * k} to {PAGE * k + len(page)}", page, 4) for k, page in enumerate(pages)]
    shown = tabbed(grids, "parameters") if len(pages) > 1 else grid("parameters", each, 2 if len(each) <= FEW else 4)
    return column(*typical, shown, shares=[2, 3], name=axis)


LAYOUTS: tuple[Callable[[Shelf], Part], ...] = (study, compare, excited, servos, *RUN_LAYOUTS)
"""Layouts, named after what they are for; a recording opens with the first for which it has something to show."""


def tabs(paths: AbstractSet[str], active: str = "") -> rrb.Blueprint:
    """Return all layouts for which a recording with these entities has something to show, in tabs; `active` is in front.

    Raises
    ------
    ResultsError
        If `active` is none of them.
    """
    shelf = Shelf(paths)
    made = {make.__name__: part for make in LAYOUTS if (part := make(shelf)) is not None}
    time = rrb.TimePanel(state="collapsed", timeline="sim_time")
    if active and active not in made:
        raise ResultsError(f"this recording has no tab {active!r}; it has {', '.join(made)}")
    number = list(made).index(active) if active else 0
    of = {name: "leading/*" if name == result.__name__ else "legend/*" for name in made}  # legends of what is shown
    high = -(-len(shelf.of("legend/*")) // ACROSS)  # rows of them
    pages = [column(keys(shelf, of[name]), part, shares=[high, HIGHER], name=name) or part for name, part in made.items()]
    return rrb.Blueprint(rrb.Tabs(*pages, active_tab=number), time, collapse_panels=True)
