"""The covariance that an estimate from a planned motion will have."""

import numpy as np

from idbench.identify.arrays import Array
from idbench.identify.basis.basis import Basis
from idbench.identify.data.motion_log import MotionLog
from idbench.identify.models.explicit import ExplicitModel
from idbench.identify.noise.linearization import Linearization
from idbench.identify.noise.noisy_rows import NoisyRows
from idbench.identify.noise.propagation import NoiseLevels
from idbench.identify.rows.chain import Chain


def predicted_information(log: MotionLog, basis: Basis, X: Array, levels: NoiseLevels, chain: Chain) -> Array:
    """Return W' C^-1 W of the explicit model's rows, with the covariance C that noise will give them, shape (..., p, p).

    As generalized least squares has it, but for the noise levels, which are given here and estimated there.

    Parameters
    ----------
    log : MotionLog
        The motion without noise; of its torques only the meaning counts. Leading axes are motions.
    basis : Basis
        The robot.
    X : Array, shape (p,)
        Its parameters as far as they are known: they make the inertias by which noise of positions counts.
    levels : NoiseLevels
        Standard deviations of the noise, shape (joint,) each.
    chain : Chain
        Signal processing.

    Raises
    ------
    IdentificationError
        If the log is too short for the chain.
    """
    signals = chain.signals(log)
    linear = Linearization(signals, basis, np.broadcast_to(X, (*log.q.shape[:-2], len(X))))
    rows = chain.rows(signals, basis, ExplicitModel())
    noisy, lead = NoisyRows(rows.maps[0], linear), (*log.q.shape[:-2], log.n)
    each = NoiseLevels(np.broadcast_to(levels.torque, lead), np.broadcast_to(levels.position, lead))
    white = noisy.whitening(each).whiten(rows.W)
    return np.matmul(np.swapaxes(white, -1, -2), white)
