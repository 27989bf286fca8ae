"""The chains that ship, and their table."""

from dataclasses import replace

from idbench.identify.plugins import Table
from idbench.identify.rows.chain import Chain
from idbench.identify.rows.operators import FirLowPass, IirLowPass, Samples
from idbench.identify.signals.differentiators import CentralDifference
from idbench.identify.signals.masks import NoMask, ReversalMask
from idbench.identify.signals.prefilters import ButterworthPrefilter, NoPrefilter
from idbench.identify.signals.torques import AsLogged, ByChannel

SCHOOL = 0.1
"""Speed [rad/s] up to which the paper's school leaves the SCARA's instants out."""


def paper_chain() -> Chain:
    """The paper's own steps: Butterworth on q and tau, 2-point differences, Matlab's IIR decimate (sections 6.2, 7.2)."""
    return Chain(ButterworthPrefilter(8.0), CentralDifference(2), AsLogged(), NoMask(), IirLowPass(4.0))


def idbench_chain() -> Chain:
    """No prefilter, 6th-order differences, torque aligned by its channel, reversals masked, FIR low-pass."""
    return Chain(NoPrefilter(), CentralDifference(6), ByChannel(), ReversalMask(), FirLowPass())


def paper_masked_chain() -> Chain:
    """The paper's own steps, with the instants near reversals and standstill left out, as its school does."""
    return replace(paper_chain(), mask=ReversalMask(SCHOOL))


def unfiltered_chain() -> Chain:
    """As idbench, without a filter: every sample is a row."""
    return replace(idbench_chain(), operator=Samples())


CHAINS: Table[Chain] = Table(
    "chains",
    Chain,
    {
        "paper": paper_chain,
        "paper_masked": paper_masked_chain,
        "idbench": idbench_chain,
        "unfiltered": unfiltered_chain,
    },
)
