"""From a log to a linear system: every choice of signal processing, in Hz, s and rad/s."""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog, TorqueChannel
from idbench.identify.errors import LogError, SettingError, require_not_negative
from idbench.identify.models import AbstractModel, Equations
from idbench.identify.plugins import Table
from idbench.identify.rows.operators import FirLowPass, IirLowPass, Samples, Windows
from idbench.identify.rows.operators.low_pass import AbstractOperator
from idbench.identify.rows.operators.windows import AbstractWeakForm
from idbench.identify.rows.row_map import Grid, RowMap
from idbench.identify.rows.rows import Rows
from idbench.identify.signals.filters import AbstractDifferentiator, CentralDifference
from idbench.identify.signals.masks import AbstractMask, NoMask, ReversalMask
from idbench.identify.signals.prefilters import AbstractPrefilter, ButterworthPrefilter, NoisePrefilter, NoPrefilter
from idbench.identify.signals.signals import Signals
from idbench.identify.signals.torques import AbstractAlignment, AsLogged, ByChannel

PIECE = 6e5  # Samples times joints squared of a piece: columns grow with the joints squared, and take some 100 MB


@dataclass(frozen=True)
class Chain:
    """The stages between a log and Y = W X + rho; the same chain serves every sampling frequency."""

    prefilter: AbstractPrefilter
    """Applied to positions and torques."""
    differentiator: AbstractDifferentiator
    """The operator s, for velocities, accelerations and the columns e."""
    alignment: AbstractAlignment
    """Puts the torque on the time of the columns."""
    mask: AbstractMask
    """Weights of the instants."""
    operator: AbstractOperator
    """Makes the rows."""
    trim: float | None = None
    """Time [s] at either end of a log that makes no rows, only feeds the filters. By default as much as the stages look to
    either side; less than that is refused."""

    def __post_init__(self) -> None:
        if self.trim is not None:
            require_not_negative(trim=self.trim)

    def signals(self, log: MotionLog, weights_of: Signals | None = None) -> Signals:
        """Return the signals of `log`, with prefilter and mask's weights of other signals if they are given."""
        prefilter = self.suited_prefilter(log) if weights_of is None else weights_of.prefilter
        return Signals(log, prefilter, self.differentiator, self.alignment, self.mask, weights_of)

    def suited_prefilter(self, log: MotionLog) -> AbstractPrefilter:
        """The prefilter, suited to the noise of a log."""
        if log.poses:
            return self.prefilter

        def velocities() -> Array:
            return self.differentiator.derivative(np.ascontiguousarray(np.swapaxes(log.q, -1, -2)), log.fs)

        return self.prefilter.suited(velocities)

    def grid(self, log: MotionLog) -> Grid:
        """Instants of the rows of `log`; raise LogError if it leaves none, SettingError if a setting does not fit it."""
        return Grid.inside(log.samples, log.fs, self.margin(log), self.operator.step(log.fs))

    def rows(self, signals: Signals, basis: Basis, model: AbstractModel) -> Rows:
        """Return the rows of a model from the signals of one log.

        Raises
        ------
        LogError
            If the log does not have the joints of the basis, or is too short.
        SettingError
            If a setting does not fit the log's sampling frequency.
        """
        log = signals.log
        if log.n != basis.n:
            hint = "; its axes are (time, joint), is it transposed?" if log.samples == basis.n else ""
            raise LogError(f"the log has {log.n} joints, the basis {basis.n}{hint}")
        self._grid_of(signals)  # too short a log is refused before it is differentiated
        equations = model.equations(basis, signals)
        return Rows.of(equations, self.map(equations))

    def map(self, equations: Equations) -> RowMap:
        """Linear map from samples to the rows of a model's equations."""
        return self.operator.map(equations, equations.weight, self._grid_of(equations.signals))

    def _grid_of(self, signals: Signals) -> Grid:
        return replace(self, prefilter=signals.prefilter).grid(signals.log)

    def pieces(self, log: MotionLog) -> list[tuple[int, int]]:
        """Return first sample and end of pieces of a log, each with the samples that its rows look at.

        The rows of all pieces are those of the log, to what a recursive filter forgets; each piece has those of `PIECE`.
        """
        grid, reach = self.grid(log), ceil(self.margin(log) * log.fs - 1e-9)
        rows = max(1, int(PIECE / log.n**2) // grid.step)
        starts = [(grid.first + row * grid.step - reach, min(rows, grid.count - row)) for row in range(0, grid.count, rows)]
        return [(start, start + 2 * reach + count * grid.step) for start, count in starts]

    def of_model(self, model: AbstractModel) -> "Chain":
        """Return the chain whose operator makes the rows of a model: windows, where a model is integrated and this has none."""
        if not model.integrated or isinstance(self.operator, AbstractWeakForm):
            return self
        return replace(self, operator=Windows())

    @property
    def cutoff(self) -> float | None:
        """Band of the rows [Hz]; None of an operator that states none."""
        return getattr(self.operator, "cutoff", None)

    def halo(self, fs: float, channel: TorqueChannel) -> float:
        """Reach of a row to either side of its instant [s], in a log at `fs` [Hz] with this torque channel."""
        torque = self.alignment.align(np.empty((0, 0)), channel, fs)  # how far it looks does not depend on the values
        derivatives = 2 * self.differentiator.halo(fs)  # of q, and of qd or e
        stages = self.prefilter.halo(fs), derivatives, self.mask.halo(fs), torque.halo(), self.operator.halo(fs)
        return sum(stages)

    def margin(self, log: MotionLog) -> float:
        """Return the time at either end of `log` that makes no rows [s]; raise SettingError if `trim` is too short."""
        if log.poses:
            return 0.0
        halo = replace(self, prefilter=self.suited_prefilter(log)).halo(log.fs, log.torque)
        if self.trim is None:
            return halo
        if self.trim < halo:
            raise SettingError(
                f"trim = {self.trim:g} s is shorter than the {halo:.3g} s that this chain looks: raise it, or leave it out"
            )
        return self.trim


SCHOOL = 0.1  # Speed [rad/s] up to which the paper's school leaves the SCARA's instants out


def paper_chain() -> Chain:
    """The paper's own steps: Butterworth on q and tau, 2-point differences, Matlab's IIR decimate (sections 6.2, 7.2)."""
    return Chain(ButterworthPrefilter(8.0), CentralDifference(2), AsLogged(), NoMask(), IirLowPass(4.0))


def idbench_chain() -> Chain:
    """Noisy positions low-passed, 6th-order differences, torque aligned by its channel, reversals masked, FIR low-pass."""
    return Chain(NoisePrefilter(), CentralDifference(6), ByChannel(), ReversalMask(), FirLowPass())


def paper_masked_chain() -> Chain:
    """The paper's own steps, with the instants near reversals and standstill left out, as its school does."""
    return replace(paper_chain(), mask=ReversalMask(SCHOOL, 0.03, 0.1))


def unfiltered_chain() -> Chain:
    """As idbench, without a filter: every sample is a row."""
    return replace(idbench_chain(), prefilter=NoPrefilter(), operator=Samples())


def poses_chain() -> Chain:
    """For logs of poses at rest: every sample is a row, and nothing is masked or differentiated."""
    return Chain(NoPrefilter(), CentralDifference(2), AsLogged(), NoMask(), Samples())


CHAINS: Table[Chain] = Table(
    "chains",
    Chain,
    {"paper": paper_chain, "paper_masked": paper_masked_chain, "idbench": idbench_chain, "unfiltered": unfiltered_chain},
)
