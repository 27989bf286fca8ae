"""The robot's file with the parameters that were identified."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np

from experiments.identified import Identified
from experiments.results import write_whole
from identify import Array, BaseParameters, Consistent, consistent_parameters, transfer, tree_basis
from sim.rewrite import compiled, rewritten
from sim.robot import Robot
from sim.tree import standard_parameters

SIGMAS = 3.0
"""Departures from the estimate beyond this many sigma are told."""


@final
@dataclass(frozen=True, eq=False)
class Written:
    """The physically consistent robot that agrees best with an estimate, as a file.

    Parameters
    ----------
    found : Identified
        The identification.
    model : str
        Name of the model whose estimate is taken.
    """

    found: Identified
    model: str

    @cached_property
    def consistent(self) -> Consistent:
        """Its standard parameters."""
        subject = self.found.subject
        given = standard_parameters(subject.robot)
        grouping, T = self._grouping
        values = np.array([given.get(name, 0.0) for name in grouping.standard.parameters])
        estimate = self.found.estimates[self.model]
        C = estimate.corrected_covariance
        C = C if np.isfinite(C).all() else estimate.covariance
        return consistent_parameters(grouping, T @ estimate.X, T @ C @ T.T, values)

    @property
    def _grouping(self) -> tuple[BaseParameters, Array]:
        """The grouping of the standard parameters, and what turns those that were identified into its base parameters."""
        subject = self.found.subject
        if subject.base is not None:
            kept = subject.base.only(subject.basis.parameters)
            return kept, np.eye(len(kept.names))
        grouping = BaseParameters.of(subject.tree, tree_basis(subject.tree))
        return grouping, transfer(subject.tree, subject.basis, grouping.basis)

    @cached_property
    def text(self) -> str:
        """The file."""
        return rewritten(self.found.subject.name, self._values())

    @cached_property
    def robot(self) -> Robot:
        """The robot of the file."""
        return compiled(self.found.subject.name, self.text)

    def _values(self) -> dict[str, float]:
        found = self.consistent
        return dict(zip(found.names, map(float, found.standard), strict=True))

    def write(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        write_whole(path, rewritten(self.found.subject.name, self._values(), path.absolute().parent))

    @property
    def doubts(self) -> list[str]:
        """What is wrong about it."""
        found, names = self.consistent, self._grouping[0].names
        told = []
        if not found.agrees:
            far = [f"{n} by {abs(d):.1f}" for n, d in zip(names, found.departure, strict=True) if abs(d) > SIGMAS]
            told.append(
                f"no bodies that can exist have the estimate of the {self.model} model: the nearest are {found.distance:.1f} "
                f"sigma off{', ' + ', '.join(far) + ' sigma' if far else ''}"
            )
        lost = [name for name in found.names if name not in standard_parameters(self.robot)]
        if lost:
            told.append(f"{', '.join(lost)} have no place in an MJCF file and are left out")
        return told
