"""Layouts: what is looked at together, one a purpose, made of the views for which a recording has something to show."""

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from functools import cache

import rerun.blueprint as rrb

from experiments.errors import ResultsError
from experiments.recording.views import Part, Shelf, arm, bars, column, grid, lanes, plot, side_by_side, tabbed, text
from identify import BLOCKS
from identify.basis.body_regressor import KINDS

DIGITS = "0123456789"


def _letters(name: str) -> str:
    """Return the letters of a parameter, without the R of those that are grouped."""
    return name.rstrip(DIGITS).removesuffix("R")


def _number(name: str) -> int:
    """Return the number of the joint that ends a parameter's name, 0 without one: a recording holds names alone."""
    return int(name[len(name.rstrip(DIGITS)) :] or 0)


@cache
def _known_units() -> dict[str, str]:
    """Return the units of the parameters of links and of the blocks that are built in, by their letters."""
    blocks = [BLOCKS.create(name) for name in BLOCKS.builtin]
    each = [parameter for block in blocks for parameter in block.parameters(2)]
    return {x: unit for x, (_, unit) in KINDS.items()} | {_letters(p.name): p.unit for p in each}


ESTIMATES = 12
"""Plots of estimates that have room beside each other."""

TWO = 4
"""Spectra from which on two stand beside each other."""

CHARTS = 7
"""Charts of imperfections in a column."""

JOINT_STATES = "green slides, amber turns, red stands, pink saturated"
MASK_STATES = "green used, amber in part, red masked"


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
                 f"identify/*/{x}/measured", f"identify/*/{x}/filtered", f"identify/*/smoothed/{x}/*", f"{x}/true",
                 legend=False)
            for x, unit in (("qd", "rad/s"), ("qdd", "rad/s²"))
        ),
    ]  # fmt: skip
    spectra = [
        bars(shelf, f"residual {r} [dB over 10 µ{_unit(r).replace(' ', '')}/√Hz] over f [Hz]",
             "identify/*/cutoff/*", *shelf.by_method(f"identify/*/*/spectrum/{r}"))
        for r in rows
    ]  # fmt: skip
    return side_by_side("filters", column(*motion), column(*spectra), shares=[1, 1]) if rows else None


def noise(shelf: Shelf) -> Part:
    """Return the noise found, spectra of what the explicit model leaves over beside those predicted, and smoothed motions."""
    rows = shelf.last("identify/*/explicit/noise_torque/*")
    spectra = [
        bars(
            shelf,
            f"residual {r} [dB over 10 µNm/√Hz] over f [Hz]; predicted: torque noise orange, position noise blue",
            *shelf.by_method(f"identify/*/explicit/spectrum/{r}"),
            *shelf.by_method(f"identify/*/explicit/noise_torque/{r}"),
            *shelf.by_method(f"identify/*/explicit/noise_position/{r}"),
        )
        for r in rows
    ]
    smoothed = [
        plot(shelf, f"{x} {r} [{unit}], measured - smoothed, and sigma of the smoothed one",
             f"identify/*/smoothed_band/{x}/{r}", f"identify/*/measured_less_smoothed/{x}/{r}", legend=False)
        for r in shelf.last("identify/*/smoothed_band/q/*") for x, unit in (("q", "rad"), ("qd", "rad/s"))
    ]  # fmt: skip
    columns = 1 if len(rows) < TWO else 2
    parts = text(shelf, "identify/*/noise"), grid("spectra", spectra, columns), grid("smoothed motion", smoothed, columns)
    return side_by_side("noise", *parts, shares=[3, 6, 6]) if rows else None


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
    names = shelf.last("identify/*/*/estimate/*")
    judged = [
        bars(shelf, f"{what} [%] of each parameter, {method}", f"identify/{method}/*/{kind}")
        for method in shelf.methods
        for what, kind in (("error", "error"), ("sigma", "relative_sigma"))
    ]
    left = column(text(shelf, "identify/*/report"), *judged, shares=[3.0, *[2.0] * len(judged)])
    return side_by_side("parameters", left, _estimates(shelf, names) if names else None, shares=[2, 3]) if any(judged) else None


def _estimates(shelf: Shelf, names: Sequence[str]) -> Part:
    """Return how estimates come about, those of many parameters in a tab for each joint."""
    if len(names) <= ESTIMATES:
        return grid("estimates", [_estimate(shelf, name) for name in names], 2)
    by_joint: dict[int, list[str]] = {}
    for name in sorted(names, key=_number):
        by_joint.setdefault(_number(name), []).append(name)
    return tabbed([grid(f"joint {j}", [_estimate(shelf, name) for name in of_joint], 3) for j, of_joint in by_joint.items()])


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
    unit = _known_units().get(_letters(name), "").replace("^2", "²")
    return plot(shelf, f"{name} [{unit}]" if unit else name, f"identify/*/*/estimate/{name}", f"truth/{name}", legend=False)


def table2(shelf: Shelf) -> Part:
    """Return Table 2: the twin's errors by both processings, and what each imperfection does alone."""
    charts = [bars(shelf, name[3:].replace("_", " "), f"attribution/{name}/*") for name in shelf.parents("attribution/*/*")]
    columns = [column(*charts[k : k + CHARTS]) for k in range(0, len(charts), CHARTS)]
    signals = column(
        plot(shelf, "torque in the log [N m]", "torque/log"),
        plot(shelf, "torque, true - commanded [N m]", "torque/disturbance"),
        *(bars(shelf, f"processed as {name}", f"processing/{name}/*") for name in shelf.parents("processing/*/*")),
    )
    left = column(arm(shelf), text(shelf, "table2"), shares=[3, 5])
    return side_by_side("table2", left, signals, *columns, shares=[6, 5, *([6] * len(columns))]) if charts else None


def study(shelf: Shelf) -> Part:
    """Return a study: the error of every run, its distribution in units of sigma, and the answer."""
    names = shelf.parents("runs/*/*")
    points = grid("errors", [plot(shelf, f"error of {n} [%] over runs", f"runs/{n}/*", legend=False) for n in names], 2)
    sigmas = [bars(shelf, f"{model}: error / corrected sigma", f"sigmas/{model}") for model in shelf.last("sigmas/*")]
    answer = column(text(shelf, "answer"), *sigmas, shares=[4.0, *[1.0] * len(sigmas)])
    return side_by_side("study", answer, points, shares=[1, 2]) if names else None


LAYOUTS: dict[str, Callable[[Shelf], Part]] = {
    "study": study,
    "table2": table2,
    "overview": overview,
    "friction": friction,
    "drive": drive,
    "filters": filters,
    "noise": noise,
    "excitation": excitation,
    "parameters": parameters,
}
"""Layouts by what they are for; a recording opens with the first for which it has something to show."""


def tabs(paths: AbstractSet[str], active: str = "") -> rrb.Blueprint:
    """Return all layouts for which a recording with these entities has something to show, in tabs; `active` is in front.

    Raises
    ------
    ResultsError
        If `active` is none of them.
    """
    shelf = Shelf(paths)
    made = {name: part for name, make in LAYOUTS.items() if (part := make(shelf)) is not None}
    time = rrb.TimePanel(state="collapsed", timeline="run" if "study" in made else "sim_time")
    if active and active not in made:
        raise ResultsError(f"this recording has no tab {active!r}; it has {', '.join(made)}")
    number = list(made).index(active) if active else 0
    return rrb.Blueprint(rrb.Tabs(*made.values(), active_tab=number), time, collapse_panels=True)
