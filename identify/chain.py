"""From a log to a linear system: every choice of signal processing, in Hz, s and rad/s."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import final

import numpy as np

from identify.arrays import Array, require_not_negative
from identify.basis import Basis
from identify.blame import expect
from identify.differentiators import AbstractDifferentiator, CentralDifference
from identify.errors import LogError, SettingError
from identify.grid import Grid
from identify.masks import AbstractMask, NoMask, ReversalMask
from identify.models import AbstractModel
from identify.motion_log import MotionLog, TorqueChannel
from identify.operators import AbstractOperator, FirLowPass, IirLowPass
from identify.plugins import PluginTable
from identify.prefilters import AbstractPrefilter, ButterworthPrefilter, NoPrefilter
from identify.signals import Signals
from identify.state import State
from identify.system import System
from identify.torques import AbstractAlignment, AsLogged, ByChannel


@final
@dataclass(frozen=True)
class Chain:
    """The stages between a log and Y = W X + rho; the same chain serves every sampling frequency.

    Parameters
    ----------
    prefilter : AbstractPrefilter
        Applied to positions and torques.
    differentiator : AbstractDifferentiator
        The operator s, for velocities, accelerations and the columns e.
    alignment : AbstractAlignment
        Puts the torque on the time of the columns.
    mask : AbstractMask
        Weights of the instants.
    operator : AbstractOperator
        Makes the rows.
    trim : float, optional
        Time [s] at either end of a log that makes no rows, only feeds the filters. By default as much as the stages look
        to either side; less than that is refused.
    """

    prefilter: AbstractPrefilter
    differentiator: AbstractDifferentiator
    alignment: AbstractAlignment
    mask: AbstractMask
    operator: AbstractOperator
    trim: float | None = None

    def __post_init__(self) -> None:
        if self.trim is not None:
            require_not_negative(trim=self.trim)

    def build(self, log: MotionLog | Sequence[MotionLog], basis: Basis, model: AbstractModel) -> System:
        """Return the linear system of a model, for one log, or for several as one fit.

        Raises
        ------
        LogError
            If a log does not have the joints of the basis, or is too short.
        SettingError
            If a setting does not fit a log's sampling frequency.
        """
        (system,) = self.build_each(log, basis, [model])
        return system

    def build_each(self, log: MotionLog | Sequence[MotionLog], basis: Basis, models: Sequence[AbstractModel]) -> list[System]:
        """Return the linear system of each model, otherwise as `build`.

        What the models have in common, filtered positions and their derivatives, is computed once.
        """
        if not isinstance(log, MotionLog):
            each = [self.build_each(one, basis, models) for one in log]
            return [System.stack(systems) for systems in zip(*each, strict=True)] if each else [System.stack([])]
        if log.n != basis.n:
            hint = "; its axes are (time, joint), is it transposed?" if log.samples == basis.n else ""
            raise LogError(f"the log has {log.n} joints, the basis {basis.n}{hint}")
        grid, signals = self.rows(log), self.signals(log)
        return [self.operator.system(model.balance(basis, signals), grid) for model in models]

    def rows(self, log: MotionLog) -> Grid:
        """Return where the rows of `log` lie; raise LogError if it leaves none."""
        return self.operator.grid(log.samples, log.fs, self.margin(log))

    def signals(self, log: MotionLog) -> Signals:
        """Return what the models see of `log`: prefiltered, differentiated, aligned, weighted."""
        fs, s = log.fs, partial(self.differentiator.derivative, fs=log.fs)
        q, tau = (
            expect(self.prefilter, "apply", self.prefilter.apply(_time_last(x), fs), _time_last(x).shape)
            for x in (log.q, log.tau * np.asarray(log.torque.gain))
        )
        state = State(q, expect(self.differentiator, "derivative", s(q), q.shape), s)
        torque = self.alignment.align(tau, log.torque, fs)
        weight = expect(self.mask, "weight", self.mask.weight(state.qd, fs), q.shape)
        reach = ceil((self.prefilter.halo(fs) + torque.halo()) * fs - 1e-9)
        return Signals(state, torque, weight, fs, reach, partial(self._transposed, channel=log.torque, fs=fs))

    def _transposed(self, x: Array, channel: TorqueChannel, fs: float) -> Array:
        """Return prefilter and alignment transposed: both are the same at all times, so it is they in reversed time."""
        return self.alignment.align(self.prefilter.apply(x[..., ::-1], fs), channel, fs).mean()[..., ::-1]

    def halo(self, fs: float, channel: TorqueChannel) -> float:
        """Return how far [s] a row looks to either side of its instant, in a log at `fs` [Hz] with this torque channel."""
        torque = self.alignment.align(np.empty((0, 0)), channel, fs)  # how far it looks does not depend on the values
        derivatives = 2 * self.differentiator.halo(fs)  # of q, and of qd or e
        stages = self.prefilter.halo(fs), derivatives, self.mask.halo(fs), torque.halo(), self.operator.halo(fs)
        return sum(stages)

    def margin(self, log: MotionLog) -> float:
        """Return the time at either end of `log` that makes no rows [s]; raise SettingError if `trim` is too short."""
        halo = self.halo(log.fs, log.torque)
        if self.trim is None:
            return halo
        if self.trim < halo:
            raise SettingError(
                f"trim = {self.trim:g} s is shorter than the {halo:.3g} s that this chain looks: raise it, or leave it out"
            )
        return self.trim


def _time_last(x: Array) -> Array:
    return np.ascontiguousarray(np.swapaxes(x, -1, -2))


def paper_chain() -> Chain:
    """The paper's own steps: Butterworth on q and tau, 2-point differences, Matlab's IIR decimate (sections 6.2, 7.2)."""
    return Chain(ButterworthPrefilter(8.0), CentralDifference(2), AsLogged(), NoMask(), IirLowPass(4.0))


def idbench_chain() -> Chain:
    """No prefilter, 6th-order differences, torque aligned by its channel, reversals masked, FIR low-pass."""
    return Chain(NoPrefilter(), CentralDifference(6), ByChannel(), ReversalMask(), FirLowPass())


def paper_masked_chain() -> Chain:
    """The paper's own steps, with the instants near reversals and standstill left out, as its school does."""
    return replace(paper_chain(), mask=ReversalMask())


CHAINS: PluginTable[Chain] = PluginTable(
    "chains",
    Chain,
    {
        "paper": paper_chain,
        "paper_masked": paper_masked_chain,
        "idbench": idbench_chain,
    },
)
