"""What makes the errors of the paper's own steps? Each suspect is taken out, alone and together with the others.

Expected: the 2-point difference makes those of the inertias, and all of the power model; the friction of the dynamic models
suffers from it, from the prefilter and from the reversals, partly with opposite signs; without all three nothing is left.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from idbench.experiments.paper.attribution import COMPARED
from idbench.experiments.paper.table1 import Table1
from idbench.identify import (
    CentralDifference,
    Chain,
    Estimate,
    NoPrefilter,
    OrdinaryLeastSquares,
    ReversalMask,
    identify_each,
    paper_chain,
    scara,
)
from idbench.identify.rows.chain import SCHOOL


def _finer(chain: Chain) -> Chain:
    return replace(chain, differentiator=CentralDifference(6))


def _unfiltered(chain: Chain) -> Chain:
    return replace(chain, prefilter=NoPrefilter())


def _masked(chain: Chain) -> Chain:
    return replace(chain, mask=ReversalMask(SCHOOL))


CHANGES: dict[str, tuple[Callable[[Chain], Chain], ...]] = {
    "the paper's steps": (),
    "6th-order differences": (_finer,),
    "no prefilter": (_unfiltered,),
    "reversals masked": (_masked,),
    "6th order, no prefilter": (_finer, _unfiltered),
    "6th order, masked": (_finer, _masked),
    "no prefilter, masked": (_unfiltered, _masked),
    "all three": (_finer, _unfiltered, _masked),
}
"""Every combination of the three suspects taken out of chain `paper`."""


@dataclass(frozen=True)
class Worst:
    """Largest errors [%] of a model: of its inertial and of its friction parameters."""

    inertia: float
    friction: float


def causes(table: Table1) -> Iterator[tuple[str, dict[str, Worst]]]:
    """Yield, for every combination, the worst errors of each model on the data of `table`."""
    for name, changes in CHANGES.items():
        chain = replace(paper_chain(), trim=table.scenario.quintic().rest)
        for change in changes:
            chain = change(chain)
        estimates = identify_each(table.log, scara(), COMPARED, chain, OrdinaryLeastSquares())
        yield name, {form: _worst(table, estimate) for form, estimate in estimates.items()}


def _worst(table: Table1, estimate: Estimate) -> Worst:
    errors = dict(zip(estimate.names, estimate.relative_error_percent(list(table.truth.values())), strict=True))
    friction = [float(error) for name, error in errors.items() if name.startswith("F")]
    inertia = [float(error) for name, error in errors.items() if not name.startswith("F")]
    return Worst(max(inertia), max(friction))
