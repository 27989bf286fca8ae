"""The paper's sentences, and what the studies find."""

import json
from collections.abc import Iterator
from typing import Any, TypeAlias

from conclusion_tables import Ratio, ratios
from results import RESULTS, cells, typical

from idbench.experiments.paper.table1 import over_explicit
from idbench.experiments.paper.table2 import PAPER
from idbench.experiments.study.ratios import interval

Finding: TypeAlias = tuple[str, str, str]
"""A sentence of the paper, what was found, and the command."""


def _typical_of(study: str, model: str, **settings: Any) -> str:
    """Return the typical error [%] of a cell with these settings, `chain` or `estimator`."""
    for cell in cells(study):
        at = {key.replace(".", "_"): x for key, x in cell["settings"].items()}
        at |= {key: cell[key] for key in ("chain", "estimator")}
        if cell["model"] == model and all(at[key] == x for key, x in settings.items()):
            return typical(cell)
    raise KeyError(f"{study}: no cell {model}, {settings}")


def _some(above: str, below: str, **given: Any) -> list[Ratio]:
    found = [r for r in ratios("models") if r["models"] == [above, below]]
    return [r for r in found if all({**r, **r["settings"]}[key] == x for key, x in given.items())]


def _span(above: str, below: str, **given: Any) -> str:
    values = [row["ratio"] for row in _some(above, below, **given)]
    return f"{min(values):.2g} to {max(values):.2g}"


def _power(noise: str, chain: str = "idbench") -> str:
    return interval(_some("power", "explicit", noise=noise, chain=chain, estimator="OLS")[0])


def _window(length: float, torque: str, estimator: str = "OLS", more: str = "") -> str:
    label = f"windows, length {length}{more}"
    return _typical_of("windows", "energy", chain_operator=label, torque=torque, estimator=estimator)


def _rule(**at: Any) -> str:
    usual = {"fs": 100.0, "chain_prefilter_cutoff": 10.0, "chain_operator_cutoff": 5.0}
    return _typical_of("rules", "explicit", **{**usual, **at})


def _order(prefilter: float, operator: float) -> str:
    return _typical_of("orders", "explicit", chain_prefilter_order=prefilter, chain_operator_order=operator)


def _grows(model: str) -> str:
    few, many = (_typical_of("quality", model, trajectory_moves=m, chain="idbench") for m in (5.0, 40.0))
    return f"{float(few) / float(many):.2g}"


def _on_models() -> Iterator[Finding]:
    """Yield the sentences on models and windows: the paper's in our words, what was found, the command."""
    yield (
        "The implicit model has no advantage over the explicit one.",
        f"**Holds.** Its errors are {_span('implicit', 'explicit')} times the explicit model's; "
        "below 1 with the paper's prefilter alone.",
        "study models",
    )
    yield (
        "The power model has the same accuracy with the same number of rows.",
        f"**Depends on the noise.** With ripple and least squares its errors are {_power('ripple')} times the explicit model's "
        f"in chain idbench, and {_power('ripple', 'paper')} times in the paper's, which is its own experiment; with white "
        f"torque noise {_power('torque')}, with a 14-bit encoder {_power('encoder')}. "
        f"With GLS {_span('power', 'explicit', estimator='GLS')}.",
        "study models",
    )
    yield (
        "The parallel filter improves on the energy model.",
        "**Holds without a prefilter**: the energy model's errors are "
        f"{_span('energy', 'power', chain='idbench')} times the power model's. With the paper's prefilter and reversals masked "
        f"they are {_span('energy', 'power', chain='paper_masked')} times as large.",
        "study models",
    )
    yield (
        "tb - ta must be bounded, because offsets are integrated.",
        f"**Holds.** Energy model: {_window(0.1, 'noise')} % at 0.1 s, {_window(2.6, 'noise')} % at 2.6 s; with an offset "
        f"{_window(0.1, 'offset')} and {_window(2.6, 'offset')} %.",
        "study windows",
    )
    spaced = ", spacing 0.02"
    yield (
        "The sampling times can be optimized for a well-conditioned W.",
        "**Not here.** "
        f"Windows of 1 s: consecutive {_window(1.0, 'noise')} %, selected {_window(1.0, 'noise', 'OLS-selected', spaced)} %; "
        f"all overlapping windows together {_window(1.0, 'noise', 'OLS', spaced)} %.",
        "study windows",
    )
    yield (
        "Power is less sensitive to the exciting trajectory than its integral.",
        "**Hardly, without a prefilter**: "
        f"from 40 moves to 5 the error of power grows {_grows('power')} times, of energy {_grows('energy')} times, of explicit "
        f"{_grows('explicit')} times.",
        "study quality",
    )


def _on_filters() -> Iterator[Finding]:
    """Yield the sentences on filters."""
    yield (
        "fs = 100 wdyn.",
        "**Half of it costs twice the error.** "
        f"Explicit: {_rule(fs=50.0)} % at 50, {_rule()} % at 100, {_rule(fs=200.0)} % at 200 wdyn.",
        "study rules",
    )
    cutoffs = [_rule(chain_prefilter_cutoff=x) for x in (5.0, 10.0, 20.0)]
    bands = [_rule(chain_operator_cutoff=x) for x in (2.5, 5.0, 10.0)]
    yield (
        "wfq above 10 wdyn, wfp about 5 wdyn.",
        f"**Safe, not critical.** wfq 5, 10, 20 wdyn: {', '.join(cutoffs)} %; wfp 2.5, 5, 10 wdyn: {', '.join(bands)} %.",
        "study rules",
    )
    yield (
        "The order of fq must be above 2, that of fp above 1.",
        "**Holds for fp.** "
        f"With a 12-bit encoder: fq of order 1, 2, 4: {_order(1.0, 8.0)}, {_order(2.0, 8.0)}, {_order(4.0, 8.0)} %; "
        f"fp of order 1, 8: {_order(4.0, 1.0)}, {_order(4.0, 8.0)} %.",
        "study orders",
    )
    yield (
        "Filtering both sides introduces no error (Eq. 15).",
        "**Holds**: without noise less than 0.00002 % is left in chain idbench.",
        "table1",
    )
    implicit = _span("implicit", "explicit", chain="paper", estimator="OLS")
    yield (
        "The second derivative of a filtered position can distort; the implicit model needs none.",
        f"**Up to 5 %**: with the paper's prefilter and least squares its errors are {implicit} times the explicit model's.",
        "study models",
    )


def _on_robots() -> Iterator[Finding]:
    """Yield the sentences on drives and burden."""
    yield (
        "The torque is perturbed by the loop's rejection of ripple.",
        "**Holds**: at wdyn = 2.4 Hz the loop commands four fifths of joint 1's ripple (1.9 % of its logged torque), and nine "
        "tenths of joint 2's (3.7 %).",
        "run ripple",
    )
    yield (
        "Torque constants must be known accurately (Eq. 13).",
        "**Holds**: torque constants that are 2 % off make every parameter 2 % off.",
        "table2",
    )
    yield (
        "The implicit model costs more to compute, energy functions are simple.",
        "**Holds on six and seven joints** (operations below); the SCARA's implicit columns take fewer operations.",
        "robot puma560",
    )


def _on_tables() -> Iterator[Finding]:
    """Yield the sentences that the paper's own numbers say or contradict."""
    motions = json.loads((RESULTS / "table1-motions.json").read_text())["chains"]
    count = motions["paper_masked"]["kept"]
    bare, masked = (motions[chain]["over_explicit"] for chain in ("paper", "paper_masked"))
    none = next(row for row in json.loads((RESULTS / "implicit-steps.json").read_text()) if row["step"] == MASKED)
    yield (
        "Without noise the errors of the three models are close, with a little advantage for the explicit one.",
        f"**Close here, but not in Table 1.** There the implicit model's errors are {masked['implicit']['paper']:.2g} times "
        f"the explicit one's, all eight larger. Here {bare['implicit']['median']:#.2g} times, with reversals masked "
        f"{masked['implicit']['median']:#.2g}; "
        f"all eight are larger in {100 * masked['implicit']['all_larger']:.0f} % of {count} motions. "
        f"[No step that we tried](appendix.md#the-implicit-column) gives both. With reversals masked the implicit errors are "
        "the paper's "
        f"({none['over_paper']:.2g} times); the paper's explicit ones are smaller.",
        "table1 --motions 2000",
    )
    yield (
        f"In Table 1 the power model's errors are {masked['power']['paper']:.2g} times the explicit one's.",
        f"**Reversals were masked.** {100 * bare['power']['reached']:.0f} % of the motions reach that without the mask, "
        f"{100 * masked['power']['reached']:.0f} % with it.",
        "table1 --motions 2000",
    )
    paper = over_explicit({model: column.two_sigma for model, column in PAPER.items()})["power"]
    twin = over_explicit(json.loads((RESULTS / "table2.json").read_text())["paper_sigma"])["power"]
    yield (
        f"In Table 2 the power model's sigmas are {paper:.2f} times the dynamic ones (geometric mean of 2 sigma).",
        f"**Holds for sigma**: {twin:.2f} times on the virtual robot. Its errors are not smaller there, so that sigma does not "
        "show which model is better; over many motions they are "
        f"{_power('ripple', 'paper')} times as large, with ripple and the paper's steps.",
        "table2",
    )
    unfiltered, filtered = (_bias(chain) for chain in ("unfiltered", "idbench"))
    yield (
        "Least squares of unfiltered rows is biased, because W and Y are dependent.",
        f"**Holds.** With a 14-bit encoder the bias is {unfiltered} % without a filter and {filtered} % with chain idbench.",
        "study estimators",
    )
    small, best = (_criterion(name) for name in ("condition", "sigma"))
    yield (
        "Cond(W) must be close to one.",
        f"**No.** The motion of least Cond(W) errs by {small} %, that of least sigma by {best} %.",
        "study excitation-criteria",
    )


MASKED = "none, chain paper_masked"  # The chain as it is, among the steps that were tried


def _bias(chain: str) -> str:
    at = {"encoder.lines": 4096.0, "torque.noise": "0.0"}
    found = [c for c in cells("estimators") if c["settings"] == at and (c["chain"], c["estimator"]) == (chain, "OLS")]
    return typical({"rmse_percent": [abs(x) for x in found[0]["bias_percent"]]})


def _criterion(name: str) -> str:
    return next(typical(c) for c in cells("excitation-criteria") if name in str(c["settings"]))


def sentences() -> Iterator[str]:
    """Yield the lines of the table."""
    yield "\n|the paper|idbench|command|\n|---|---|---|\n"
    yield from (f"|{a}|{b}|`idbench {c}`|\n" for a, b, c in (*_on_models(), *_on_filters(), *_on_robots(), *_on_tables()))
    yield "\n"
