"""The noise of the torques, as the residuals of the explicit model tell it."""

import numpy as np

from identify.arrays import Array
from identify.estimators import Problem, WeightedLeastSquares
from identify.system import System


def torque_noise(explicit: System) -> Array:
    """Return the rms of the noise of each joint's torque [N m], shape (..., joint), as far as the rows see it.

    White noise of variance sigma_j^2 gives row i of joint j the variance sigma_j^2 v_i, of which the fit takes the share l_i,
    its leverage. So sigma_j^2 = sum of the squared residuals / sum of v_i (1 - l_i), over the rows of the joint. The joints are
    fitted with weights of their own, so that the noise of one does not show in the residuals of another.

    Parameters
    ----------
    explicit : System
        Rows of the explicit model, one kind a joint, of one log or several.

    Returns
    -------
    Array
        Whatever it is that the model does not explain counts as noise; NaN where the system cannot be solved.
    """
    estimate = WeightedLeastSquares().fit(Problem(explicit))
    Q = np.linalg.qr((estimate.solved or explicit).W)[0]
    free = np.concatenate([c.variance() for c in explicit.carriers], axis=-1) * (1 - np.sum(Q**2, axis=-1))
    joints = np.unique(explicit.group)[:, None] == explicit.group
    squares, expected = (np.sum(x[..., None, :] * joints, axis=-1) for x in (estimate.residual**2, free))
    return np.sqrt(np.divide(squares, expected, out=np.full(squares.shape, np.nan), where=expected > 0))
