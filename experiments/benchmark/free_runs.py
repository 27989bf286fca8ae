"""The identified robot, simulated from the torques of held-out logs alone."""

from typing import Any

import numpy as np

from idbench.experiments.judgement.held_out import HeldOut
from idbench.experiments.results.writing import finite
from idbench.sim.engine.driven import free_run


def free_runs(held_out: HeldOut, model: str, length: float) -> dict[str, Any]:
    """Return what a summary says of positions that are simulated, from where the log is, for some time.

    NRMSE is the rms of the error over the range of the joint in the log. A simulation that diverges is counted, and has no
    other part in it.
    """
    robot, log, qd = held_out.driven(model)
    measured, simulated = free_run(robot, log, qd, length)
    kept = np.asarray(np.isfinite(simulated).all(axis=(1, 2)))
    squares = (measured[kept] - simulated[kept]) ** 2
    whole = np.ptp(log.q, axis=0)
    nrmse = np.sqrt(squares.mean(axis=(0, 1))) / np.where(whole > 0, whole, np.nan) if kept.any() else np.full(log.n, np.nan)
    return {"length": length, "stretches": len(kept), "diverged": int((~kept).sum()), "nrmse": [finite(x) for x in nrmse]}
