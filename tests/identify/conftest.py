"""Arms of other people, as pinocchio and this package see them."""

from dataclasses import dataclass
from importlib.metadata import files

import numpy as np
import pinocchio as pin
import pytest

from idbench.identify import Joint, KinematicTree

URDF = {"UR5": "ur_description/urdf/ur5_robot.urdf", "Panda with its hand": "panda_description/urdf/panda.urdf"}
"""Six hinges; seven hinges and, on two branches, two slides."""

AXES = {"X": [1, 0, 0], "Y": [0, 1, 0], "Z": [0, 0, 1]}


@dataclass(frozen=True)
class Peer:
    """A robot in pinocchio, and the same tree here."""

    model: pin.Model
    tree: KinematicTree


def tree_of(model):
    """Return the tree of a pinocchio model: placements and axes, read off its own kinematics."""
    joints = []
    for i in range(1, model.njoints):
        subspace = model.joints[i].createData().S
        slide = np.linalg.norm(subspace[:3]) > 0.5
        at, axis = model.jointPlacements[i], np.ravel(subspace[:3] if slide else subspace[3:])
        kind = "slide" if slide else "hinge"
        joints.append(Joint(model.names[i], kind, model.parents[i] - 1, at.translation, at.rotation, axis, np.zeros(3)))
    return KinematicTree(model.name, tuple(joints), model.gravity.linear)


@pytest.fixture(scope="session", params=URDF)
def peer(request):
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith(URDF[request.param])]
    model = pin.buildModelFromUrdf(str(path))
    return Peer(model, tree_of(model))
