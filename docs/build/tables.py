"""Tables of the pages, from the results of the studies that ship.

    uv run python docs/build/tables.py [FOLDER]

FOLDER has a folder of results for each study, as `idbench study NAME --out FOLDER/NAME` leaves them; without it the results
that were kept in docs/results are written into the pages anew. A test holds that pages and results agree.
"""

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import exp, log, log2
from pathlib import Path
from typing import Any

DOCS = Path(__file__).absolute().parent.parent
sys.path.insert(0, str(DOCS.parent))
RESULTS = DOCS / "results"
PAGES = ("answers.md", "estimators.md", "excitation.md", "noise.md", "table2.md")
KEPT = ("settings", "chain", "estimator", "model", "runs", "rmse_percent", "coverage", "paper_coverage", "bound_percent")
COMPARED = ("bias_percent", "bias_margin_percent", "failures", "simulations")
"""What is kept, too, of a cell of a study that compares estimators."""

"""What is kept of a cell."""

MARK = re.compile(r"<!-- table: ([\w-]+) -->\n.*?<!-- end -->", re.DOTALL)

Cell = dict[str, Any]
Column = tuple[str, str]

I, P = "idbench", "paper"
FOUR: Sequence[Column] = ((I, "explicit"), (I, "power"), (P, "explicit"), (P, "power"))
TWO: Sequence[Column] = ((I, "explicit"), (I, "power"))


def keep(folder: Path) -> None:
    """Keep of the results of studies what the pages need."""
    for path in sorted(folder.glob("*/summary.json")):
        summary = json.loads(path.read_text())
        if "attribution_percent" in summary:
            kept = {name: summary[name] for name in ("parameters", "attribution_percent")}
            (RESULTS / f"{path.parent.name}.json").write_text(json.dumps(kept, indent=1) + "\n")
            continue
        kept_of = (*KEPT, *COMPARED) if path.parent.name.startswith("estimators") else KEPT
        cells = [{key: _short(cell.get(key)) for key in kept_of if key in cell} for cell in summary["cells"]]
        text = "[\n" + ",\n".join(json.dumps(cell) for cell in cells) + "\n]\n"
        (RESULTS / f"{path.parent.name}.json").write_text(text)


def _short(value: Any) -> Any:
    """Return numbers to six digits: what is printed has two."""
    if isinstance(value, list):
        return [_short(x) for x in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def filled(text: str) -> str:
    """Return a page with its tables as the results have them."""
    return MARK.sub(lambda found: f"<!-- table: {found[1]} -->\n{''.join(TABLES[found[1]]())}<!-- end -->", text)


def cells(study: str) -> list[Cell]:
    """Return the cells of a study."""
    found: list[Cell] = json.loads((RESULTS / f"{study}.json").read_text())
    return found


def _by_settings(study: str) -> Iterator[tuple[dict[str, Any], dict[Column, Cell]]]:
    groups: dict[str, dict[Column, Cell]] = {}
    for cell in cells(study):
        groups.setdefault(json.dumps(cell["settings"], sort_keys=True), {})[cell["chain"], cell["model"]] = cell
    for settings, group in groups.items():
        yield json.loads(settings), group


def typical(cell: Cell) -> str:
    """Return the geometric mean of the rms errors, to two digits."""
    errors = [float(x) for x in cell["rmse_percent"] if x is not None]  # of what is zero in truth there is none
    mean = exp(sum(map(log, errors)) / len(errors))
    return f"{mean:.0f}" if mean >= 10 else f"{mean:#.2g}"


def coverage(cell: Cell, key: str = "coverage", digits: int = 0) -> str:
    """Return the mean share of truths within two sigma, with the lowest and the highest parameter's."""
    shares = [100 * float(x) for x in cell[key]]
    mean, low, high = (f"{x:.{digits}f}" for x in (sum(shares) / len(shares), min(shares), max(shares)))
    return mean if low == high else f"{mean} ({low}-{high})"


def _table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> Iterator[str]:
    yield f"\n| {' | '.join(head)} |\n|---|{'---:|' * (len(head) - 1)}\n"
    for row in rows:
        yield f"| {' | '.join(row)} |\n"
    yield "\n"


def _usual(study: str, name: str, label: Callable[[dict[str, Any]], str], columns: Sequence[Column]) -> Iterator[str]:
    """Yield typical errors and coverages of chains and models, a row a setting."""
    several = len({chain for chain, _ in columns}) > 1
    names = [f"{model}, {chain}" if several else model for chain, model in columns]
    head = [name, *names, f"coverage: {names[0]}", *names[1:]]
    rows = (
        [label(settings), *(typical(group[c]) for c in columns), *(coverage(group[c]) for c in columns)]
        for settings, group in _by_settings(study)
    )
    yield from _table(head, rows)


def _lines(settings: dict[str, Any]) -> str:
    lines = settings["encoder.lines"]
    return f"{lines:g} ({log2(4 * lines):g} bits)"


def _birdy(settings: dict[str, Any]) -> str:
    position = f"{settings['encoder.noise']:.3g}".replace("e-0", "e-").replace("0.000175", "1.75e-4")
    return f"{position}, {settings['torque.noise']:g}"


def _one(key: str, scale: float = 1.0) -> Callable[[dict[str, Any]], str]:
    return lambda settings: f"{float(f'{scale * settings[key]:.3g}'):g}"


def _sigma() -> Iterator[str]:
    def rows() -> Iterator[Sequence[str]]:
        for cell in cells("sigma"):
            noise = ", ".join(f"{x:g}" for x in json.loads(str(cell["settings"]["torque.noise"])))
            shares = (coverage(cell, key, 1) for key in ("coverage", "paper_coverage"))
            yield [noise, cell["estimator"], cell["model"], *shares]

    yield from _table(["torque noise [N m]", "estimator", "model", "corrected", "the paper's"], rows())


def _cutoffs() -> Iterator[str]:
    outer, inner = "chain.prefilter.cutoff", "chain.operator.cutoff"
    found = {(c["settings"][outer], c["settings"][inner]): typical(c) for c in cells("cutoffs") if c["model"] == "explicit"}
    operators = sorted({o for _, o in found})
    rows = ([f"{p:g}", *(found[p, o] for o in operators)] for p in sorted({p for p, _ in found}))
    yield from _table(["prefilter \\ decimation", *(f"{o:g}" for o in operators)], rows)


def _bound(study: str, name: str, label: Callable[[dict[str, Any]], str]) -> Callable[[], Iterator[str]]:
    methods = ("WLS", "GLS", "ML")

    def rows() -> Iterator[Sequence[str]]:
        groups: dict[str, dict[str, Cell]] = {}
        for cell in cells(study):
            if cell["model"] == "explicit":
                groups.setdefault(json.dumps(cell["settings"]), {})[cell["estimator"]] = cell
        for settings, group in groups.items():
            bound = typical({"rmse_percent": group["WLS"]["bound_percent"]})
            errors, shares = (typical(group[m]) for m in methods), (coverage(group[m]) for m in methods)
            yield [label(json.loads(settings)), *errors, bound, *shares]

    return lambda: _table([name, *methods, "bound", "coverage: WLS", "GLS", "ML"], rows())


NOISES = {"0.0": 0.0, "[0.01, 0.001]": 0.01, "[0.1, 0.01]": 0.1}
"""Torque noise of joint 1 in the study of estimators, as its cells have it."""


def _compared(chain: str) -> Callable[[], Iterator[str]]:
    """Return what makes the table of estimators behind a chain, over encoders and noises of the torque."""

    def rows() -> Iterator[Sequence[str]]:
        mine: dict[str, dict[tuple[float, float], Cell]] = {}
        for cell in cells("estimators"):
            if cell["chain"] == chain:
                key = log2(4 * cell["settings"]["encoder.lines"]), NOISES[str(cell["settings"]["torque.noise"])]
                mine.setdefault(cell["estimator"], {})[key] = cell
        bound = [typical({"rmse_percent": _some(mine.values(), key)["bound_percent"]}) for key in COLUMNS]
        yield ["bound", *bound, "", "", ""]
        for name, group in mine.items():
            solved = [cell for cell in group.values() if cell["runs"]]
            shares = [100 * x for cell in solved for x in cell["coverage"]]
            failed = sum(sum(cell["failures"].values()) for cell in group.values())
            every = failed + sum(cell["runs"] for cell in group.values())
            often = max((cell["simulations"] for cell in solved), default=0.0)
            errors = [typical(group[key]) if group[key]["runs"] else "-" for key in COLUMNS]
            yield [name, *errors, f"{sum(shares) / len(shares):.0f}", f"{failed} of {every}", f"{often:.0f}" if often else ""]

    heads = [f"{bits:.0f} bits, {noise:g} N m" for bits, noise in COLUMNS]
    return lambda: _table(["", *heads, "within 2 sigma [%]", "failed", "simulations"], rows())


COLUMNS = ((10, 0.01), (12, 0.01), (14, 0.01), (16, 0.0), (16, 0.01), (16, 0.1), (18, 0.0))
"""Encoder bits and torque noise that the tables of estimators have."""


def _some(groups: Iterable[dict[tuple[float, float], Cell]], key: tuple[float, float]) -> Cell:
    """Return the first cell of a setting that has an estimate: the bound is that of all."""
    return next(group[key] for group in groups if group[key]["runs"])


def _causes(form: str) -> Callable[[], Iterator[str]]:
    """Return what makes the table of Table 2's causes, of one model."""

    def table() -> Iterator[str]:
        from experiments.text import percent

        found = json.loads((RESULTS / "table2.json").read_text())
        causes = found["attribution_percent"].items()
        rows = ([cause, *(percent(error) for error in errors[form])] for cause, errors in causes)
        yield from _table(["", *found["parameters"]], rows)

    return table


CRITERIA = {
    "sigma": "mean ln sigma",
    "determinant": "ln det(W' C⁻¹ W)",
    "smallest": "s_min(W)",
    "random": "none: the median of 60 random motions",
    "birdy": "Cond(W' W) + 100 / s_min(W)",
    "condition": "Cond(W)",
}
ARMS = {"scara": "", "puma560": "-puma", "panda": "-panda"}


def _predicted(name: str, bits: str = "17") -> Cell:
    """Return what is predicted of a motion, as if it were a cell."""
    found = json.loads((RESULTS / "excitation-motions.json").read_text())[name]
    return {"condition": found["condition"], "rmse_percent": [x for x in found["sigma_percent"][bits] if x]}


def _of_motions(study: str) -> dict[str, Cell]:
    return {str(c["settings"]["trajectory"]).removeprefix("excited/"): c for c in cells(study) if c["model"] == "explicit"}


def _criteria() -> Iterator[str]:
    def rows() -> Iterator[Sequence[str]]:
        found = {arm: _of_motions(f"excitation-criteria{end}") for arm, end in ARMS.items()}
        for criterion, words in CRITERIA.items():
            row = [words]
            for arm, cells_of in found.items():
                name = f"{arm}-{criterion}"
                predicted = _predicted(name)
                row += [f"{predicted['condition']:.3g}", typical(predicted), typical(cells_of[name])]
            yield row

    heads = [f"{arm}: {what}" for arm in ARMS for what in ("Cond(W)", "predicted", "found")]
    yield from _table(["what is optimised", *heads], rows())


def _ranks() -> Iterator[str]:
    found = json.loads((RESULTS / "excitation-ranks.json").read_text())
    rows = (
        [CRITERIA[c], *(f"{found[arm][c][i]:.2f}" for arm in ARMS for i in (0, 1))] for c in CRITERIA if c in found["scara"]
    )
    heads = [f"{arm}: {what}" for arm in ARMS for what in ("rank correlation", "its pick")]
    yield from _table(["criterion", *heads], rows)


def _motions(study: str, name: str, labels: dict[str, str]) -> Callable[[], Iterator[str]]:
    """Return what makes the table of a study of motions."""

    def rows() -> Iterator[Sequence[str]]:
        found = _of_motions(study)
        for motion, label in labels.items():
            yield [label, typical(_predicted(motion)), typical(found[motion]), coverage(found[motion])]

    return lambda: _table([name, "predicted typical sigma [%]", "found typical error [%]", "coverage"], rows())


def _coarse() -> Iterator[str]:
    made = {"scara-sigma": "17 bits", "scara-12bits": "12 bits", "scara-slow": "17 bits, at most 2 rad/s"}
    found = {
        (c["settings"]["encoder.lines"], str(c["settings"]["trajectory"]).removeprefix("excited/")): c
        for c in cells("excitation-coarse")
    }
    lines = sorted({line for line, _ in found})
    rows = ([words, *(typical(found[line, motion]) for line in lines)] for motion, words in made.items())
    yield from _table(["designed for", *(f"{log2(4 * line):g} bits" for line in lines)], rows)


def _foretold() -> Iterator[str]:
    motions = json.loads((RESULTS / "excitation-motions.json").read_text())
    bits = {0.0: ("24", "none"), 1.384e-05: ("17", "17 bits"), 1.107e-04: ("14", "14 bits")}

    def rows() -> Iterator[Sequence[str]]:
        for level, (number, words) in bits.items():
            row = [words]
            for arm, end in (("scara", ""), ("puma560", "-puma")):
                study = cells(f"excitation-predicted{end}")
                each = {c["estimator"]: c for c in study if c["settings"]["encoder.noise"] == level}
                predicted = motions[f"{arm}-sigma"]["sigma_percent"][number]
                row += [f"{_ratio(each[method], predicted):.2f}" for method in ("GLS", "ML")]
            yield row

    heads = [f"{arm}, {method}" for arm in ("scara", "puma560") for method in ("GLS", "ML")]
    yield from _table(["noise of the positions", *heads], rows())


def _ratio(cell: Cell, predicted: Sequence[float | None]) -> float:
    """Return the geometric mean of errors over what was predicted."""
    pairs = [(e, p) for e, p in zip(cell["rmse_percent"], predicted, strict=True) if e and p]
    return exp(sum(log(e / p) for e, p in pairs) / len(pairs))


TABLES: dict[str, Callable[[], Iterator[str]]] = {
    "encoder": lambda: _usual("encoder", "lines (counts)", _lines, FOUR),
    "torque-noise": lambda: _usual("torque-noise", "rms [N m]", _one("torque.noise"), FOUR),
    "birdy": lambda: _usual("birdy", "position [rad], torque [N m]", _birdy, FOUR),
    "decimation": lambda: _usual("decimation", "cut-off [Hz]", _one("chain.operator.cutoff"), TWO),
    "sample-rate": lambda: _usual("sample-rate", "fs [Hz]", _one("fs"), TWO),
    "ripple": lambda: _usual("ripple", "cogging", _one("ripple.cogging"), TWO),
    "delay": lambda: _usual("delay", "delay [ms]", _one("timing.delay", 1e3), FOUR),
    "sigma": _sigma,
    "cutoffs": _cutoffs,
    "table2-explicit": _causes("explicit"),
    "table2-power": _causes("power"),
    "bound-encoder": _bound("bound-encoder", "lines (counts)", _lines),
    "bound-torque": _bound("bound-torque", "torque noise [N m]", _one("torque.noise")),
    "excitation-criteria": _criteria,
    "excitation-ranks": _ranks,
    "excitation-length": _motions(
        "excitation-length",
        "length [s]",
        {"scara-5s": "5", "scara-sigma": "10", "scara-20s": "20", "scara-40s": "40"},
    ),
    "excitation-frequency": _motions(
        "excitation-frequency",
        "up to [Hz]",
        {"scara-0p3Hz": "0.3", "scara-0p5Hz": "0.5", "scara-sigma": "1", "scara-1p5Hz": "1.5", "scara-2Hz": "2"},
    ),
    "excitation-kind": _motions(
        "excitation-kind", "kind", {"scara-sigma": "Fourier series", "scara-moves": "point-to-point moves"}
    ),
    "excitation-coarse": _coarse,
    "excitation-predicted": _foretold,
    "estimators-idbench": _compared("idbench"),
    "estimators-unfiltered": _compared("unfiltered"),
}

if __name__ == "__main__":
    RESULTS.mkdir(exist_ok=True)
    for place in sys.argv[1:]:
        keep(Path(place))
    for page in PAGES:
        (DOCS / page).write_text(filled((DOCS / page).read_text()))
