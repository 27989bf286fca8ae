"""All three models from one log, against pinocchio computing the explicit regressor alone.

    uv run --group benchmark python tests/benchmarks/identification.py

Both work on the same 4000 samples of 2 joints; runs are interleaved, so that the ratio holds when the machine's speed drifts.
"""

import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from idbench.experiments.paper.table1 import SCENARIO, Table1
from idbench.identify import CHAINS, ESTIMATORS, MODELS, Chain, MotionLog, identify_each, scara
from idbench.sim.scenario.scenario_file import load

SAMPLES, RUNS = 4000, 60


def planar_arm() -> pin.Model:
    """Return two revolute joints about z, the second 0.5 m from the first; the regressor does not depend on the inertias."""
    model = pin.Model()
    placement = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    elbow = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "joint1")
    model.addJoint(elbow, pin.JointModelRZ(), placement, "joint2")
    return model


def seconds(function: Callable[[], object]) -> float:
    """Return how long one call takes."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def main() -> None:
    """Print medians and the ratio for each chain."""
    table = Table1(load(SCENARIO), ())
    part = slice(300, 300 + SAMPLES)
    log = MotionLog(100.0, table.log.q[part], table.log.tau[part], table.log.torque)
    q, qd, qdd = (getattr(table.reference, name)[part] for name in ("q", "qd", "qdd"))
    model = planar_arm()
    data, basis, models = model.createData(), scara(), {name: MODELS.create(name) for name in MODELS}

    def peer() -> None:
        W = np.empty((SAMPLES, model.nv, 10 * model.nv))
        for k in range(SAMPLES):
            W[k] = pin.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k])

    def ours(chain: Chain, estimator: str, sigma: str) -> None:
        for estimate in identify_each(log, basis, models, chain, ESTIMATORS.create(estimator)).values():
            assert np.isfinite(getattr(estimate, sigma)).all()
            assert np.isfinite(estimate.condition_number)

    for name in CHAINS:
        chain = CHAINS.create(name)
        for estimator, sigma in (("WLS", "own_sigma"), ("WLS", "calibrated_sigma"), ("GLS", "own_sigma")):
            ours(chain, estimator, sigma)
            pairs = np.array(
                [(seconds(lambda c=chain, e=estimator, s=sigma: ours(c, e, s)), seconds(peer)) for _ in range(RUNS)]
            )
            mine, theirs, ratio = *np.median(pairs, axis=0), np.median(pairs[:, 0] / pairs[:, 1])
            what = f"chain {name:12} 3 models {estimator} with {sigma:15} {1e3 * mine:6.2f} ms"
            print(f"{what}, pinocchio's regressor {1e3 * theirs:6.2f} ms, ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
