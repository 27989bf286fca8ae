"""The rows of one log as noise of its torques and positions reaches them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
import numpy.typing as npt

from idbench.identify.arrays import Array
from idbench.identify.noise.band_matrix import BandMatrix
from idbench.identify.noise.covariance import BandedCovariance, Whitening
from idbench.identify.noise.linearization import Linearization
from idbench.identify.noise.propagation import NoiseLevels, Paths, position_paths, torque_paths
from idbench.identify.rows.row_map import RowMap, in_order


@dataclass(frozen=True, eq=False)
class NoisyRows:
    """The rows of one log as noise reaches them; each part is made when it is first asked for."""

    to_rows: RowMap
    """How samples become rows."""
    linear: Linearization
    """Of the explicit model, about the signals of the log."""

    @cached_property
    def torque(self) -> Paths:
        """How noise of the torques reaches the rows."""
        return torque_paths(self.to_rows)

    @cached_property
    def position(self) -> Paths:
        """How noise of the positions reaches the rows."""
        return position_paths(self.to_rows, self.linear)

    @cached_property
    def kept(self) -> npt.NDArray[np.bool_]:
        """Which rows are not void, shape (..., r)."""
        return in_order(self.to_rows.outside) > 0

    def covariance(self, levels: NoiseLevels) -> BandedCovariance:
        """Return the covariance that noise of these levels gives the rows."""
        found = self.torque.covariance(levels.in_rows)
        if levels.position.any():
            found = found + self.position.covariance(levels.effective_position)
        return found

    def variance(self, levels: NoiseLevels) -> Array:
        """Return the variance that noise of these levels gives the rows, shape (..., r)."""
        found = self.torque.variance(levels.in_rows)
        if levels.position.any():
            found = found + self.position.variance(levels.effective_position)
        return found

    @property
    def unmasked(self) -> "NoisyRows":
        """The rows as if nothing were masked."""
        to_rows = self.to_rows.unmasked()
        return self if to_rows is self.to_rows else NoisyRows(to_rows, self.linear)

    def whitening(self, levels: NoiseLevels) -> Whitening:
        """Whitening of the kept rows by noise of these levels; of `units` where they are there."""
        if "units" in self.__dict__:
            position = np.broadcast_to(levels.effective_position, levels.torque.shape)
            squares = np.concatenate([levels.in_rows, position], axis=-1) ** 2
            return Whitening(BandMatrix.weighted(self.units, squares), self.kept)
        return self.whitening_by([self.covariance(levels)], np.ones(1))

    def whitening_by(self, parts: Sequence[BandedCovariance], shares: Array) -> Whitening:
        """Whitening of the kept rows by shares of each covariance, shape (..., part)."""
        return Whitening(BandMatrix.weighted(self.matrices(parts), shares), self.kept)

    @cached_property
    def units(self) -> list[BandMatrix]:
        """Covariances that unit noise of torques, and of positions, gives the rows that are kept, joint by joint."""
        return self.matrices(chain(self.torque.each(), self.position.each()))

    def forget(self) -> None:
        """Drop what is large, and needed again by few: paths and units."""
        for name in ("torque", "position", "units"):
            self.__dict__.pop(name, None)

    def matrices(self, parts: Iterable[BandedCovariance]) -> list[BandMatrix]:
        """Return parts of the covariance of the rows that are kept."""
        return [C.kept(self.kept).matrix for C in parts]
