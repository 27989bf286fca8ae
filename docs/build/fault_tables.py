"""Which faults are named, by their size and the noise of the torques."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from results import cells, table

STUDY = "faults"


def picture(place: Path) -> None:
    """Draw the share of the runs of each fault that is named: a row a kind, a column a noise and a severity."""
    from idbench.experiments.study.figures import matrix
    from idbench.experiments.study.study_file import load_study
    from idbench.sim.scenario.faults import FAULTS

    found, (kinds, *_) = cells(STUDY), load_study(STUDY).axes
    columns = list(dict.fromkeys((cell["settings"]["noise"], cell["settings"]["severity"]) for cell in found))
    shares = np.full((len(kinds.cases), len(columns)), np.nan)
    for cell in found:
        s = cell["settings"]
        shares[list(kinds.cases).index(s["kind"]), columns.index((s["noise"], s["severity"]))] = 100 * cell["named"]
    sizes = {kind: case["fault"][0]["size"] for kind, case in kinds.cases.items()}
    rows = [f"{kind} {size:g} {FAULTS[kind].unit.removeprefix('1')}".strip() for kind, size in sizes.items()]
    heads = [f"{noise}, times {severity:g}" for noise, severity in columns]
    matrix(rows, heads, shares, "runs whose fault is named [%]", log=False).savefig(place, dpi=80)


def cogging() -> Iterator[str]:
    """Yield the least cogging that is named in most runs, over encoders and pace."""
    groups: dict[tuple[float, str], list[tuple[float, float]]] = {}
    for cell in cells("ripple-named"):
        s = cell["settings"]
        groups.setdefault((s["encoder.lines"], s["pace"]), []).append((s["severity"], cell["named"]))
    paces = list(dict.fromkeys(pace for _, pace in groups))
    rows = ((f"{np.log2(4 * lines):.0f} bits", *(_least(groups[lines, pace]) for pace in paces)) for lines, _ in groups)
    yield from table(("encoder", *paces), iter(dict.fromkeys(rows)))


def _least(shares: list[tuple[float, float]]) -> str:
    seen = [size for size, _ in shares if all(named > 0.5 for other, named in shares if other >= size)]
    return f"{0.4 * min(seen):.2g} N m" if seen else "none"
