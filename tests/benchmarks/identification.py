"""All three models from one log, and explicit columns of six joints, against pinocchio computing the regressor alone.

    uv run --group benchmark python tests/benchmarks/identification.py

Both work on the same 4000 samples; runs are interleaved, so that the ratio holds when the machine's speed drifts.
"""

import numpy as np
import pinocchio as pin
from timing import seconds, ur5

from idbench.experiments.paper.table1 import SCENARIO, Table1
from idbench.identify import (
    CHAINS,
    ESTIMATORS,
    MODELS,
    BaseParameters,
    Chain,
    Joint,
    KinematicTree,
    MotionLog,
    State,
    TreeLinks,
    identify_each,
    scara,
    tree_basis,
)
from idbench.identify.models import THREE
from idbench.sim.scenario.scenario_file import load

SAMPLES, RUNS = 4000, 60


def planar_arm() -> pin.Model:
    """Return two revolute joints about z, the second 0.5 m from the first; the regressor does not depend on the inertias."""
    model = pin.Model()
    placement = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    elbow = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "joint1")
    model.addJoint(elbow, pin.JointModelRZ(), placement, "joint2")
    return model


def main() -> None:
    """Print medians and the ratio for each chain."""
    table = Table1(load(SCENARIO), ())
    part = slice(300, 300 + SAMPLES)
    log = MotionLog(100.0, table.log.q[part], table.log.tau[part], table.log.torque)
    q, qd, qdd = (getattr(table.reference, name)[part] for name in ("q", "qd", "qdd"))
    model = planar_arm()
    data, basis, models = model.createData(), scara(), {name: MODELS.create(name) for name in THREE}

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


def six_joints() -> None:
    """Print the time of the explicit columns of a UR5 against pinocchio's in a loop."""
    model = ur5()
    data, places = model.createData(), model.jointPlacements
    axes = [np.ravel(model.joints[i].createData().S[3:]) for i in range(1, model.njoints)]
    joints = [
        Joint(model.names[i], "hinge", model.parents[i] - 1, places[i].translation, places[i].rotation, axes[i - 1], [0, 0, 0])
        for i in range(1, model.njoints)
    ]
    tree = KinematicTree("ur5", tuple(joints), model.gravity.linear)
    q, qd, qdd = np.random.default_rng(0).uniform(-2, 2, (3, tree.n, SAMPLES))

    def theirs() -> None:
        for k in range(SAMPLES):
            pin.computeJointTorqueRegressor(model, data, q[:, k], qd[:, k], qdd[:, k])

    blocks = {"60 standard": TreeLinks(tree), "52 base": BaseParameters.of(tree, tree_basis(tree)).basis}
    for name, block in blocks.items():
        columns = block.explicit
        pairs = [(seconds(lambda c=columns: c(State(q, qd, lambda _: qdd))), seconds(theirs)) for _ in range(7)]
        mine, loop = np.min(pairs, axis=0)
        what = f"explicit columns, 6 joints, {SAMPLES} samples, {name} parameters: {1e3 * mine:.1f} ms"
        print(f"{what}, pinocchio's regressor {1e3 * loop:.1f} ms, ratio {mine / loop:.2f}")


if __name__ == "__main__":
    six_joints()
    main()
