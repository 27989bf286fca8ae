"""Layouts: what is looked at together, one a purpose, made of the views for which a recording has something to show."""

from collections.abc import Callable, Iterable, Sequence
from collections.abc import Set as AbstractSet

import rerun.blueprint as rrb

PARAMETER_UNITS = {"Fv": "N m s/rad", "Fs": "N m", "ZZ": "kg m²", "LM": "kg m²"}
"""Units of parameters, by how their names begin."""

MOST = 3
"""Entities in a view up to which a legend has room; the colours are the same everywhere."""

JOINT_STATES = "green slides, amber turns, red stands, pink saturated"
MASK_STATES = "green used, amber in part, red masked"

Part = rrb.Container | rrb.View | None


class Shelf:
    """The entities of a recording, by what they are.

    Parameters
    ----------
    paths : set of str
        All entities.
    """

    def __init__(self, paths: AbstractSet[str]) -> None:
        self.paths = sorted(path.strip("/") for path in paths)

    def of(self, *patterns: str) -> list[str]:
        """Return the entities that match one of the patterns, in which * stands for one part of a path."""
        return [path for pattern in patterns for path in self.paths if _matches(path.split("/"), pattern.split("/"))]

    def by_method(self, pattern: str) -> list[str]:
        """Return, of the entities that match, the first of every method: what other models show is the same."""
        return list({path.split("/")[1]: path for path in reversed(self.of(pattern))}.values())

    @property
    def methods(self) -> list[str]:
        """Identifications, as they are called."""
        return list(dict.fromkeys(path.split("/")[1] for path in self.of("identify/*/report")))

    def last(self, pattern: str) -> list[str]:
        """Return what the last parts of the matching entities are, each once."""
        return list(dict.fromkeys(path.rsplit("/", 1)[-1] for path in self.of(pattern)))


def _matches(path: Sequence[str], pattern: Sequence[str]) -> bool:
    return len(path) == len(pattern) and all(p in ("*", part) for part, p in zip(path, pattern, strict=True))


def plot(shelf: Shelf, name: str, *patterns: str, legend: bool = True) -> Part:
    """Return a view of curves over time, its time axis that of all others; none if there is nothing to show."""
    found = shelf.of(*patterns)
    if not found:
        return None
    return rrb.TimeSeriesView(
        name=name,
        contents=_contents(found),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend and len(found) <= MOST),
    )


def lanes(shelf: Shelf, name: str, *patterns: str) -> Part:
    """Return a view of states over time, if there are any."""
    found = shelf.of(*patterns)
    return rrb.StateTimelineView(name=name, contents=_contents(found)) if found else None


def bars(shelf: Shelf, name: str, *patterns: str) -> Part:
    """Return a view of bars, if there are any."""
    found = shelf.of(*patterns)
    hidden = rrb.PlotLegend(visible=False)  # it would be paths; the colours are those of the models
    return rrb.BarChartView(name=name, contents=_contents(found), plot_legend=hidden) if found else None


def text(shelf: Shelf, *patterns: str) -> Part:
    """Return the texts, one behind the other, if there are any."""
    found = [rrb.TextDocumentView(origin=f"/{path}", name=_title(path)) for path in shelf.of(*patterns)]
    return rrb.Tabs(*found, active_tab=len(found) - 1) if len(found) > 1 else next(iter(found), None)


def _title(path: str) -> str:
    return path.split("/")[1] if path.startswith("identify/") else path


def arm(shelf: Shelf) -> Part:
    """Return the arm, if it is drawn."""
    return rrb.Spatial3DView(origin="/world", name="arm") if "world" in shelf.paths else None


def _contents(paths: Iterable[str]) -> list[str]:
    return [f"+ /{path}" for path in paths]


def column(*parts: Part, shares: Sequence[float] | None = None) -> Part:
    """Return the parts that there are, one above the other; none if there are none."""
    there = [(part, share) for part, share in zip(parts, shares or [1.0] * len(parts), strict=True) if part is not None]
    return rrb.Vertical(*(p for p, _ in there), row_shares=[s for _, s in there]) if there else None


def side_by_side(name: str, *parts: Part, shares: Sequence[float]) -> Part:
    """Return the parts that there are, side by side, under a name; none if there are none."""
    there = [(part, share) for part, share in zip(parts, shares, strict=True) if part is not None]
    if not there:
        return None
    return rrb.Horizontal(*(p for p, _ in there), column_shares=[s for _, s in there], name=name)


def grid(name: str, parts: Sequence[Part], columns: int) -> Part:
    """Return the parts that there are in a grid."""
    there = [part for part in parts if part is not None]
    return rrb.Grid(*there, grid_columns=columns, name=name) if there else None


def overview(shelf: Shelf) -> Part:
    """Return where to begin: the arm, the motion, torques measured and predicted, what is left over, parameters."""
    rows = _rows(shelf)
    measured = [shelf.of(f"identify/*/*/measured/{row}")[0] for row in rows]  # models that share rows share their torque
    fits = [
        plot(shelf, f"{row} [{_unit(row)}]", one, f"identify/*/*/predicted/{row}")
        for row, one in zip(rows, measured, strict=True)
    ]
    motion = column(
        plot(shelf, "q [rad]", "q/planned", "q/true", legend=False) or plot(shelf, "q [rad]", "q/measured"),
        plot(shelf, "qd [rad/s]", "qd/planned", "qd/true", legend=False),
        plot(shelf, "torque in the log [N m]", "torque/log") or plot(shelf, "torque commanded [N m]", "torque/command"),
        None if rows else plot(shelf, "tracking error [rad]", "error/tracking"),
        None if rows else plot(shelf, "torque, true - commanded [N m]", "torque/disturbance"),
        lanes(shelf, JOINT_STATES, "state/*"),
    )
    left = column(arm(shelf), text(shelf, "identify/*/estimates") or text(shelf, "about"), shares=[5, 4])
    return side_by_side("overview", left, motion, column(*fits), column(*_residuals(shelf, rows)), shares=[7, 7, 5, 5])


def friction(shelf: Shelf) -> Part:
    """Return residuals over velocity and position, where friction and cogging show, and the friction parameters."""
    joints = shelf.last("identify/*/*/over_velocity/*")
    if not joints:
        return None
    over_velocity = [
        bars(shelf, f"residual {j} [N m] over qd [rad/s]", *shelf.by_method(f"identify/*/*/over_velocity/{j}")) for j in joints
    ]
    over_position = [
        bars(shelf, f"residual {j} [N m] over q [rad]", *shelf.by_method(f"identify/*/*/over_position/{j}")) for j in joints
    ]
    time = column(
        plot(shelf, "qd [rad/s]", "qd/true") or plot(shelf, "qd [rad/s]", *shelf.by_method("identify/*/qd/filtered")),
        *_residuals(shelf, joints),
        lanes(shelf, JOINT_STATES, "state/*"),
        lanes(shelf, MASK_STATES, "identify/*/mask/*"),
        shares=[1.0, *[1.0] * len(joints), _height(shelf, "state/*"), _height(shelf, "identify/*/mask/*")],
    )
    names = [name for name in shelf.last("identify/*/*/estimate/*") if name.startswith("F")]
    estimates = column(*(_estimate(shelf, name) for name in names))
    return side_by_side("friction", column(*over_velocity), column(*over_position), time, estimates, shares=[5, 5, 6, 4])


def drive(shelf: Shelf) -> Part:
    """Return what the drives were asked for and did, at every sample and inside the loop."""
    if not shelf.of("drive/*"):
        return None
    samples = column(
        plot(shelf, "current [A], asked for and true", "drive/reference", "drive/current", legend=False),
        plot(shelf, "voltage [V]", "drive/voltage"),
        plot(shelf, "duty, share of the bus voltage", "drive/duty"),
        plot(shelf, "torque, true - commanded [N m]", "torque/disturbance"),
        lanes(shelf, JOINT_STATES, "state/*"),
    )
    inside = column(
        plot(shelf, "inside the loop: current [A], asked for and true", "inner/reference", "inner/current", legend=False),
        plot(shelf, "inside the loop: voltage [V]", "inner/voltage"),
        plot(shelf, "inside the loop: duty, share of the bus voltage", "inner/duty"),
        plot(shelf, "inside the loop: torque [N m]", "inner/torque"),
    )
    return side_by_side("drive", samples, inside, shares=[1, 1])


def filters(shelf: Shelf) -> Part:
    """Return the motion before and after the filters, and spectra of what is left over."""
    rows = shelf.last("identify/*/*/spectrum/*")
    motion = [
        plot(shelf, "encoder error [rad]", "error/encoder"),
        plot(shelf, "q [rad], measured and filtered", "q/measured", "identify/*/q/filtered", legend=False),
        *(
            plot(shelf, f"{x} [{unit}], measured, filtered{' and true' if shelf.of(f'{x}/true') else ''}",
                 f"identify/*/{x}/measured", f"identify/*/{x}/filtered", f"{x}/true", legend=False)
            for x, unit in (("qd", "rad/s"), ("qdd", "rad/s²"))
        ),
    ]  # fmt: skip
    spectra = [
        bars(shelf, f"residual {r} [dB over 10 µ{_unit(r).replace(' ', '')}/√Hz] over f [Hz]",
             "identify/*/cutoff/*", *shelf.by_method(f"identify/*/*/spectrum/{r}"))
        for r in rows
    ]  # fmt: skip
    return side_by_side("filters", column(*motion), column(*spectra), shares=[1, 1]) if rows else None


def excitation(shelf: Shelf) -> Part:
    """Return the columns of W, and how well they tell the parameters apart."""
    rows = shelf.last("identify/*/*/columns/*")
    W = [plot(shelf, f"columns of W, {row}, to unit length", *shelf.of(f"identify/*/*/columns/{row}")[:1]) for row in rows]
    values = column(
        *(
            bars(shelf, f"singular values of W, decades above the least, {method}", f"identify/{method}/*/singular_values")
            for method in shelf.methods
        )
    )
    return grid("excitation", [*W, values], 2) if rows else None


def parameters(shelf: Shelf) -> Part:
    """Return how every estimate comes about, with its sigma, and the truth."""
    views = [_estimate(shelf, name) for name in shelf.last("identify/*/*/estimate/*")]
    judged = [
        bars(shelf, f"{what} [%] of each parameter, {method}", f"identify/{method}/*/{kind}")
        for method in shelf.methods
        for what, kind in (("error", "error"), ("sigma", "relative_sigma"))
    ]
    left = column(text(shelf, "identify/*/report"), *judged, shares=[3.0, *[2.0] * len(judged)])
    return side_by_side("parameters", left, grid("estimates", views, 2), shares=[2, 3]) if views else None


def _height(shelf: Shelf, pattern: str) -> float:
    """Return how much room lanes need, in that of a plot."""
    return 0.45 + 0.28 * len(shelf.of(pattern))


def _residuals(shelf: Shelf, rows: Sequence[str]) -> list[Part]:
    return [plot(shelf, f"residual {row} [{_unit(row)}]", f"identify/*/*/residual/{row}") for row in rows]


def _rows(shelf: Shelf) -> list[str]:
    return sorted(shelf.last("identify/*/*/residual/*"), key=lambda row: row == "power")


def _unit(row: str) -> str:
    return "W" if row == "power" else "N m"


def _estimate(shelf: Shelf, name: str) -> Part:
    unit = next((f" [{unit}]" for start, unit in PARAMETER_UNITS.items() if name.startswith(start)), "")
    return plot(shelf, name + unit, f"identify/*/*/estimate/{name}", f"truth/{name}", legend=False)


LAYOUTS: dict[str, Callable[[Shelf], Part]] = {
    "overview": overview,
    "friction": friction,
    "drive": drive,
    "filters": filters,
    "excitation": excitation,
    "parameters": parameters,
}
"""Layouts by what they are for; the first is what a recording opens with."""


def tabs(paths: AbstractSet[str], active: str = "", first: tuple[str, Part] = ("", None)) -> rrb.Blueprint:
    """Return all layouts for which a recording with these entities has something to show, in tabs; `active` is in front."""
    shelf = Shelf(paths)
    made = {name: part for name, part in [first, *((n, make(shelf)) for n, make in LAYOUTS.items())] if part is not None}
    time = rrb.TimePanel(state="collapsed", timeline="sim_time")
    number = list(made).index(active) if active in made else 0
    return rrb.Blueprint(rrb.Tabs(*made.values(), active_tab=number), time, collapse_panels=True)
