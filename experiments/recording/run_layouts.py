"""Layouts of runs and logs: what is looked at together, one a purpose."""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import groupby

from idbench.experiments.recording.chart import NARROW, SQUARE
from idbench.experiments.recording.views import (
    Part,
    Shelf,
    arm,
    charts,
    column,
    grid,
    keys,
    lanes,
    plot,
    side_by_side,
    tabbed,
    text,
    window,
)
from idbench.experiments.text import UNITS, with_unit
from idbench.identify import BLOCKS, scara
from idbench.identify.basis.tree_links import KINDS

DIGITS = "0123456789"

LANES = (0.5, 0.3)  # Height of a view of lanes, and of each lane in it, in heights of a plot: all lanes are in sight
ESTIMATES = 12  # Plots of estimates that have room beside each other
FEW = 3  # Kinds of row that have room one above the other

JOINT_STATES = "green moves, amber turns, red rests, pink at a limit"
MASK_STATES = "green used, amber partly, red masked"


def result(shelf: Shelf) -> Part:
    """First view: the arm and the verdict, torques measured and predicted, residuals; of many joints those that err most."""
    rows = [row for row in _rows(shelf) if _unit(row) == "N m" and row != "power"]
    if not rows:
        return None
    sizes = {row: shelf.largest(_first(shelf, "residual", row)) for row in rows}
    worst = sorted(sorted(rows, key=sizes.__getitem__, reverse=True)[:FEW], key=rows.index)
    fits, left = list[Part](), list[Part]()
    for row in worst:
        measured = shelf.of(f"identify/*/*/measured/{row}")[0]
        fits.append(plot(shelf, f"{row}: torque [N m]", measured, *_first(shelf, "predicted", row)))
        left.append(plot(shelf, f"{row}: residual [N m]", *_first(shelf, "residual", row)))
    beside = column(arm(shelf), text(shelf, "identify/*/estimates"), shares=[1, 1])
    return side_by_side("result", beside, column(*fits), column(*left), shares=[4, 5, 5])


def overview(shelf: Shelf) -> Part:
    """The arm, the motion, torques measured and predicted, residuals, parameters."""
    rows, states = _rows(shelf), lanes(shelf, JOINT_STATES, "state/*")
    motion = column(
        plot(shelf, "q [rad]", "q/planned", "q/true") or plot(shelf, "q [rad]", "q/measured"),
        plot(shelf, "qd [rad/s]", "qd/planned", "qd/true"),
        plot(shelf, "torque in the log [N m]", "torque/log") or plot(shelf, "torque commanded [N m]", "torque/command"),
        None if rows else plot(shelf, "tracking error [rad]", "error/tracking"),
        None if rows else plot(shelf, "torque, true - commanded [N m]", "torque/disturbance"),
        states,
        shares=[1, 1, 1, 1, 1, LANES[0] + LANES[1] * len(shelf.joints)],
    )
    left = column(arm(shelf), text(shelf, "identify/*/estimates") or text(shelf, "about"), shares=[5, 4])
    fits, residual_instants = column(*_fits(shelf, rows)), column(*residuals(shelf))
    return side_by_side("overview", left, motion, fits, residual_instants, shares=[7, 7, 5, 6])


def torques(shelf: Shelf) -> Part:
    """Return torques measured and predicted, and residuals, two joints in a row; of arms with many joints."""
    if len(rows := _rows(shelf)) <= FEW + 1:  # which the overview shows well
        return None
    pairs = zip(_fits(shelf, rows), residuals(shelf), strict=True)
    return grid("torques", [column(fit, left, shares=[3, 2]) for fit, left in pairs], 2)


def friction(shelf: Shelf) -> Part:
    """Return friction over velocity, residuals over velocity and position, where cogging shows, and the friction parameters."""
    joints = shelf.parts("identify/*/over_velocity/*/frame", -2)
    names = [name for name in sorted(shelf.parts("identify/*/*/estimate/*"), key=_order) if name.startswith("F")]
    if not joints:
        return None
    if len(joints) * len(shelf.methods) <= FEW:
        return _friction(shelf, "friction", joints, names)
    number = {joint: 1 + shelf.joints.index(joint) for joint in joints}
    pages = [_friction(shelf, joint, [joint], [x for x in names if _number(x) == number[joint]]) for joint in joints]
    return tabbed(pages, "friction")


def _friction(shelf: Shelf, name: str, joints: Sequence[str], names: Sequence[str]) -> Part:
    rows = [_frictions(shelf, joint, method) for joint in joints for method in shelf.methods]
    shown = grid("charts", [view for row in rows for view in row], max(map(len, rows)))
    return side_by_side(name, shown, column(*(_estimate(shelf, x) for x in names)), shares=[5, 1])


def _frictions(shelf: Shelf, joint: str, method: str) -> list[Part]:
    of = f" ({method})" if len(shelf.methods) > 1 else ""
    kinds = {
        "friction": "friction over velocity",
        "over_velocity": "residual over velocity",
        "over_position": "residual over position",
    }
    at, each = f"identify/{method}", kinds.items()
    return [view for kind, what in each for view in charts(shelf, f"{joint}: {what}{of}", f"{at}/{kind}/{joint}", NARROW)]


def drive(shelf: Shelf) -> Part:
    """View of the drives' commands and responses, at every sample and inside the loop."""
    if not shelf.of("drive/*"):
        return None
    samples = column(
        plot(shelf, "current [A], asked for and true", "drive/reference", "drive/current"),
        plot(shelf, "voltage and back-EMF [V]", "drive/voltage", "drive/emf"),
        plot(shelf, "duty, share of the bus voltage", "drive/duty"),
        None if shelf.of("torque/command") else plot(shelf, "position, commanded and true [rad]", "q/planned", "q/true"),
        plot(shelf, "rotor - link [rad], within the backlash", "gear/gap"),
        plot(shelf, "torque, true - commanded [N m]", "torque/disturbance"),
        plot(shelf, "torque commanded against it [N m]", "torque/rejection"),
        lanes(shelf, JOINT_STATES, "state/*"),
    )
    inside = column(
        window(shelf, "inside the loop: current [A], asked for, mean of each period", "inner/reference", "inner/current"),
        window(shelf, "current [A], between the edges of the pulses", "edges/current/*"),
        window(shelf, "voltage [V], the pulses", "edges/voltage/*") or window(shelf, "voltage [V]", "inner/voltage"),
        window(shelf, "inside the loop: duty, share of the bus voltage", "inner/duty"),
        window(shelf, "inside the loop: torque [N m]", "inner/torque"),
    )
    return side_by_side("drive", samples, inside, shares=[1, 1])


def filters(shelf: Shelf) -> Part:
    """Return the motion before and after the filters, masked instants, and spectra of the residuals."""
    if not (spectra := charts(shelf, "{1}: spectrum of the residual of {3}", "identify/*/spectrum/*")):
        return None
    motion = [
        plot(shelf, "encoder error [rad]", "error/encoder"),
        plot(shelf, "q [rad], measured and filtered", "q/measured", "identify/*/q/filtered"),
        *(
            plot(shelf, f"{x} [{unit}], measured, filtered{' and true' if shelf.of(f'{x}/true') else ''}",
                 f"identify/*/{x}/measured", f"identify/*/{x}/filtered", f"identify/*/smoothed/{x}/*", f"{x}/true")
            for x, unit in (("qd", "rad/s"), ("qdd", "rad/s²"))
        ),
        lanes(shelf, MASK_STATES, "identify/*/mask/*"),
    ]  # fmt: skip
    return side_by_side("filters", column(*motion), _in_grid("spectra", spectra), shares=[1, 1])


def noise(shelf: Shelf) -> Part:
    """Return the estimated noise, measured and predicted spectra of the residuals, and smoothed motions."""
    if not (spectra := charts(shelf, "{1}: spectrum of the residual of {3}", "identify/*/spectrum/*")):
        return None
    smoothed = [
        plot(shelf, f"{x} {r} [{unit}], measured - smoothed, and sigma of the smoothed one",
             f"identify/*/smoothed_band/{x}/{r}", f"identify/*/measured_less_smoothed/{x}/{r}")
        for r in shelf.parts("identify/*/smoothed_band/q/*") for x, unit in (("q", "rad"), ("qd", "rad/s"))
    ]  # fmt: skip
    parts = text(shelf, "identify/*/noise"), _in_grid("spectra", spectra), _in_grid("smoothed motion", smoothed)
    return side_by_side("noise", *parts, shares=[3, 6, 6])


def excitation(shelf: Shelf) -> Part:
    """Return the columns of W, and its singular values."""
    found = {row: shelf.of(f"identify/*/*/columns/{row}")[0] for row in shelf.parts("identify/*/*/columns/*")}
    W = [
        column(plot(shelf, f"columns of W, {row}, to unit length", path), keys(shelf, f"{path}/keys"), shares=[8, 1])
        for row, path in found.items()
    ]
    values = column(*charts(shelf, "{1}: singular values of W", "identify/*/singular_values", NARROW))
    return side_by_side("excitation", _in_grid("columns", W), values, shares=[2, 1]) if found else None


def iterations(shelf: Shelf) -> Part:
    """Return the way that the parameters take from round to round, of estimators that simulate or filter."""
    found = charts(shelf, "{4} ({3}, {1})", "identify/*/iterations/*/*", NARROW)
    return grid("iterations", found, 1 if len(found) == 1 else 2 if len(found) <= 2 * FEW else 3) if found else None


def parameters(shelf: Shelf) -> Part:
    """Return every parameter with its interval beside the truth, and how every estimate comes about."""
    found = charts(shelf, "{1}: {4}", "identify/*/parameters/*/*", SQUARE, 0.2)
    names = sorted(shelf.parts("identify/*/*/estimate/*"), key=_order)
    table, running = text(shelf, "identify/*/report"), _estimates(shelf, names) if names else None
    if not found:  # of a log that still grows
        return running
    if len(found) == len(shelf.methods):  # few parameters: everything beside each other
        return side_by_side("parameters", tabbed([grid("all", found, 1), table], "estimates"), running, shares=[1, 1])
    return tabbed([grid("all", found, 3 if len(found) <= 2 * FEW else 4), running, table], "parameters")


def _in_grid(name: str, parts: Sequence[Part]) -> Part:
    return grid(name, parts, 1 if len(parts) <= FEW else 2)


def _estimates(shelf: Shelf, names: Sequence[str]) -> Part:
    """Views of the iterations, of many parameters in a tab for each joint."""
    if len(names) <= ESTIMATES:
        return grid("estimates", [_estimate(shelf, name) for name in names], 2)
    by_joint = groupby(names, _number)  # names are in the order of their joints
    pages = [grid(f"joint {j}", [_estimate(shelf, name) for name in of_joint], 3) for j, of_joint in by_joint]
    return tabbed(pages, "over time")


def _estimate(shelf: Shelf, name: str) -> Part:
    title = with_unit(name, _known_units().get(_letters(name), ""))
    return plot(shelf, title, f"identify/*/*/estimate/{name}", f"truth/{name}")


def _fits(shelf: Shelf, rows: Sequence[str]) -> Iterator[Part]:
    for row in rows:  # models that share rows share their torque: the first is enough
        measured = shelf.of(f"identify/*/*/measured/{row}")[0]
        yield plot(shelf, f"{row} [{_unit(row)}]", measured, *_of_models(shelf, "predicted", row), legend=_many(shelf))


def residuals(shelf: Shelf) -> list[Part]:
    """Return the residuals of the models, a plot for each kind of row."""
    curves = {row: [*_of_models(shelf, "residual", row), *_of_models(shelf, "explained", row)] for row in _rows(shelf)}
    return [plot(shelf, f"residual {row} [{_unit(row)}]", *each, legend=_many(shelf)) for row, each in curves.items()]


def _many(shelf: Shelf) -> bool:
    """True if so many identifications lie over each other that a legend is needed to switch them."""
    return len(shelf.methods) > FEW


def _of_models(shelf: Shelf, kind: str, row: str) -> list[str]:
    """Return the curves of a row: of all models, or, of many identifications, of the first model of each."""
    return _first(shelf, kind, row) if _many(shelf) else shelf.of(f"identify/*/*/{kind}/{row}")


def _first(shelf: Shelf, kind: str, row: str) -> list[str]:
    """Return the curves of a row of the first model of each identification."""
    return [path for method in shelf.methods for path in shelf.of(f"identify/{method}/*/{kind}/{row}")[:1]]


def _rows(shelf: Shelf) -> list[str]:
    return sorted(shelf.parts("identify/*/*/residual/*"), key=lambda row: row.partition(" ")[0] in UNITS)


def _unit(row: str) -> str:
    return UNITS.get(row.partition(" ")[0], "N m")


def _letters(name: str) -> str:
    """Return the letters of a parameter, without the R of those that are grouped."""
    return name.rstrip(DIGITS).removesuffix("R")


def _number(name: str) -> int:
    """Return the number of the joint that ends a parameter's name, 0 without one: a recording holds names alone."""
    return int(name[len(name.rstrip(DIGITS)) :] or 0)


def _order(name: str) -> tuple[int, int]:
    """Sort key of parameters: their joint, and then inertias, first moments, rotor and friction."""
    letters = list(_known_units())
    return _number(name), letters.index(_letters(name)) if _letters(name) in letters else len(letters)


@cache
def _known_units() -> dict[str, str]:
    """Return the units of the parameters of links and of the blocks that are built in, by their letters."""
    of_blocks = [parameter for name in BLOCKS.builtin for parameter in BLOCKS.create(name).parameters(2)]
    every = (*of_blocks, *scara().parameters)
    return {x: unit for x, (_, unit) in KINDS.items()} | {_letters(p.name): p.unit for p in every}


RUN_LAYOUTS = (result, overview, torques, friction, drive, filters, noise, excitation, parameters, iterations)
"""Those of runs and logs, in the order of their tabs."""
