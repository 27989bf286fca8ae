"""Makes the kept figures anew, each with its tables and pictures, and samples of them by which a test sees that they are stale.

    uv run python docs/build/remake.py [--samples | --stale] [NAME ...]

Names are those of docs/results; all by default, which takes hours. `--samples` computes the samples alone, `--stale` names
figures that were made with other sources. What is kept of each: the command, a digest of the sources that it depends on, and
the sample: of a study two runs of the first combination of settings, of Table 2 one of its causes.
"""

import hashlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

DOCS = Path(__file__).absolute().parent.parent
sys.path[:0] = [str(DOCS / "build"), str(DOCS.parent)]

from conclusion_tables import keep_conclusion  # noqa: E402
from results import RESULTS, keep, short  # noqa: E402

from idbench.identify import Array  # noqa: E402

MADE = RESULTS / "made.json"
RUNS = 2  # Of a sample: its numbers are compared with those of the same runs, not with the truth
ESTIMATORS, MODELS, LOGS = 2, 3, 2  # Of a sample, the first, of no more logs: others simulate for minutes
SOURCES = ("models", "sim", "identify", "experiments/study", "experiments/paper", "experiments/identification")

FAR, BELOW = 6.0, 20.0
"""Typical error of two runs over that of many, and below it: ln|x| of a normal error scatters by 1.1, parameters of a run go
together, and the rms of many is that of the worst of them."""

ALIKE = 0.01  # Of numbers of the same runs: another machine may round an encoder's count the other way, now and then

CAUSE = "cogging and commutation"  # Of Table 2, in its sample

SEEDS = {"models": 200}  # Runs of a combination, where they are more than the study's own
STUDIES = sorted(path.stem for path in (DOCS.parent / "experiments" / "studies").glob("*.toml"))

OTHERS = {
    "table2": "idbench table2",
    "table1-motions": "idbench table1 --motions 2000",
    "implicit-steps": "python tests/benchmarks/implicit_steps.py 100 docs/results/implicit-steps.json",
    "excitation-motions": "python docs/build/motions.py",
    "excitation-ranks": "python docs/build/motions.py",
    "reversals": "python tests/benchmarks/reversals.py 64 docs/results/reversals.json",
    "benchmark": "python tests/benchmarks/public_sets.py; python docs/build/benchmark_tables.py runs/benchmark",
    "benchmark-simulated": "python tests/benchmarks/public_sets.py; python docs/build/simulated_tables.py runs/simulated",
    "zoo": "python -m pytest -m thorough tests/experiments/test_zoo.py",
}
"""Kept figures that no study gives, and their commands."""


def commands() -> dict[str, str]:
    """Return the command of every kept figure."""
    kept = [name for name in STUDIES if (RESULTS / f"{name}.json").is_file() or name == "models"]
    of_studies = {name: f"idbench study {name}" + (f" --seeds {SEEDS[name]}" if name in SEEDS else "") for name in kept}
    return of_studies | OTHERS


def sample(name: str) -> dict[str, list[float]]:
    """Return the sample of a kept figure: errors [%] by what they are of; empty of one that has none."""
    if name == "table2":
        return dict(_of_table2())
    if name in OTHERS:
        return {}
    import idbench
    from idbench.experiments.study.study_file import load_study

    whole = load_study(name)
    axes = tuple(axis if axis.identification else _first(axis) for axis in whole.axes)
    models = [model for model in whole.models if whole.of_servos or whole.logs_of(model) <= LOGS]
    fewer = {"models": tuple(models[:MODELS]), "estimators": whole.estimators[:ESTIMATORS]}
    table = idbench.study(replace(whole, axes=axes, seeds=RUNS, **fewer))
    varied = [axis for axis in whole.axes if len(axis.points) > 1]
    first = {axis.field: float(axis.points[0]) if axis.numeric else axis.label(axis.points[0]) for axis in varied}
    errors = {
        _label(first | {key: cell.settings[key] for key in cell.settings if key in first}, *cell.names): 100
        * np.abs(cell.error).mean(axis=0)
        for cell in table.cells
        if cell.runs
    }
    return {label: short([float(x) if np.isfinite(x) else None for x in off]) for label, off in errors.items()}


def _first(axis: Any) -> Any:
    if axis.cases:
        return replace(axis, cases=dict([next(iter(axis.cases.items()))]))
    return replace(axis, values=axis.points[:1], lowest=None, highest=None, count=None)


def _label(settings: Mapping[str, Any], *names: str) -> str:
    return ", ".join([*(f"{key} {x}" for key, x in sorted(settings.items())), *names])


def _of_table2() -> Iterator[tuple[str, list[float]]]:
    from idbench.experiments.paper.attribution import COMPARED, imperfections
    from idbench.identify import WeightedLeastSquares, identify_each, scara
    from idbench.sim.engine.simulation import simulate
    from idbench.sim.robot.scara import scara_truth
    from idbench.sim.scenario.scenario_file import load

    one = next(cause for cause in imperfections(load("table2")) if cause.name == CAUSE)
    run = simulate(one.scenario)
    truth = list(scara_truth(run.robots[0]).values())
    for form, estimate in identify_each(run.alone(), scara(), COMPARED, one.chain, WeightedLeastSquares()).items():
        yield f"{CAUSE}, {form}", short([float(x) for x in estimate.error_percent(truth)])


def apart(name: str, found: Mapping[str, list[float]]) -> tuple[str, float] | None:
    """Return a sample that chance does not explain beside the kept figure, and its error over that; None if all agree."""
    if name == "table2":
        kept = json.loads((RESULTS / "table2.json").read_text())["attribution_percent"]
        every = {f"{cause}, {form}": errors for cause, of in kept.items() for form, errors in of.items()}
        above = below = 1.005  # Nothing is drawn: five digits are kept
    elif name in OTHERS or not (RESULTS / f"{name}.json").is_file():
        return None
    else:
        rows = [cell for cell in json.loads((RESULTS / f"{name}.json").read_text()) if "rmse_percent" in cell]
        every = {
            _label(cell["settings"], cell["chain"], cell["estimator"], cell["model"]): [x or 0.0 for x in cell["rmse_percent"]]
            for cell in rows
        }
        above, below = FAR, BELOW
    if every and not every.keys() & found.keys():
        return "no sample is of the kept figure, whose typical error", float("nan")
    for label, errors in found.items():
        if label in every and (both := [(a, b) for a, b in zip(errors, every[label], strict=True) if a and b]):
            ratio = float(np.exp(np.mean([np.log(abs(a / b)) for a, b in both])))
            if not 1 / below < ratio < above:
                return label, ratio
    return None


def changed(kept: Mapping[str, list[float]], found: Mapping[str, list[float]]) -> list[str]:
    """Return the samples that are not what is kept, to `ALIKE` of each number and of the typical one beside it."""
    every = {label: (kept.get(label, []), found.get(label, [])) for label in {**kept, **found}}
    return [label for label, (a, b) in every.items() if len(a) != len(b) or not _alike(np.array(a, float), np.array(b, float))]


def _alike(a: Array, b: Array) -> bool:
    unknown = np.isnan(a) & np.isnan(b)  # where the truth is 0
    return bool(((np.abs(a - b) <= ALIKE * (np.abs(a) + np.nanmedian(np.abs(a)))) | unknown).all())


def digest() -> str:
    """Return a digest of the sources that figures depend on."""
    found = hashlib.sha256()
    for place in SOURCES:
        for path in sorted((DOCS.parent / place).rglob("*")):
            if path.suffix in (".py", ".c", ".h", ".toml", ".xml") and path.is_file():
                found.update(path.read_bytes())
    return found.hexdigest()[:16]


def made() -> dict[str, dict[str, Any]]:
    """Return what is kept of how figures were made."""
    return json.loads(MADE.read_text()) if MADE.is_file() else {}


def whole(name: str) -> None:
    """Make a figure anew; of those that no command of idbench makes say the command."""
    from idbench.experiments.cli import main as idbench

    words = commands()[name].split()
    if words[0] != "idbench":
        print(f"{name}: run {commands()[name]}")
        return
    with TemporaryDirectory(prefix="idbench-") as folder:
        out = Path(folder) / name
        if idbench([*words[1:], "--out", str(out), "--no-rerun"]):
            sys.exit(f"{commands()[name]} failed")
        if name == "table1-motions":
            (RESULTS / f"{name}.json").write_text((out / "summary.json").read_text())
            return
        keep(Path(folder))
        keep_conclusion(Path(folder))


def main(names: list[str], remade: Callable[[str], None] | None) -> None:
    """Make figures and samples, and keep how they were made; a sample that differs from the kept one is said."""
    kept, sources = made(), digest()
    for name in names:
        if remade:
            remade(name)
        found = sample(name)
        if others := changed(kept.get(name, {}).get("sample", found), found):
            print(f"{name}: {len(others)} samples have changed, such as {others[0]}")
        kept[name] = {"command": commands()[name], "sources": sources, "sample": found}
        lines = (f" {json.dumps(key)}: {json.dumps(kept[key])}" for key in sorted(kept))
        MADE.write_text("{\n" + ",\n".join(lines) + "\n}\n")
        off = apart(name, found)
        print(f"{name}: {len(found)} samples{f', {off[0]} is {off[1]:.2g} times what is kept' if off else ''}", flush=True)


if __name__ == "__main__":
    asked = [word for word in sys.argv[1:] if not word.startswith("--")]
    if unknown := [name for name in asked if name not in commands()]:
        sys.exit(f"no kept figure {unknown[0]!r}; known: {', '.join(commands())}")
    if "--stale" in sys.argv:
        now = digest()
        print("\n".join(name for name, one in made().items() if one["sources"] != now) or "all are of these sources")
    else:
        main(asked or list(commands()), None if "--samples" in sys.argv else whole)
        from tables import PAGES, filled  # when what they are made of is there

        for page in PAGES:
            (DOCS / page).write_text(filled((DOCS / page).read_text()))
