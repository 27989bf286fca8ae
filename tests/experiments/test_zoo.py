"""Robots of other people: logs made by pinocchio, with inertias that the file does not have, and every way to identify them."""

import re
from importlib.metadata import files

import numpy as np
import pinocchio as pin
import pytest
import scipy

from experiments.cli import main
from experiments.identification.fit import fit
from experiments.identification.logs import Logs
from experiments.identification.request import Request
from experiments.identification.subject import Subject
from identify import MotionLog, TorqueChannel
from identify.data.kinematics import INERTIAL
from identify.files.log_file import write_log

pytestmark = pytest.mark.thorough

ROBOTS = {
    "two continuous joints": "double_pendulum_description/urdf/double_pendulum_continuous.urdf",
    "a finger": "finger_edu_description/robots/finger_edu.urdf",
    "a flying arm": "hextilt_description/urdf/hextilt_flying_arm_5.urdf",
    "a servo arm": "so_arm_description/urdf/so101.urdf",
    "UR5": "ur_description/urdf/ur5_robot.urdf",
    "rounded angles": "xarm_description/urdf/xarm7.urdf",
    "continuous and rounded": "kinova_description/robots/kinova.urdf",
    "two legs in the air": "bolt_description/robots/bolt.urdf",
    "four legs in the air": "solo_description/robots/solo12.urdf",
}
"""From 2 to 12 joints."""

ORDER = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")
"""Of pinocchio's dynamic parameters."""

FS, SECONDS, NOISE, COUNT = 250.0, 24.0, 0.01, 2 * np.pi / 2**17


def path_of(name):
    (path,) = [f.locate() for f in files("example-robot-data") or () if str(f).endswith(ROBOTS[name])]
    return str(path)


class Real:
    """A robot whose inertias differ from its file by up to 30 %, moving, with friction of a tenth of each torque."""

    def __init__(self, name):
        self.subject, self.model = Subject(path_of(name)), pin.buildModelFromUrdf(path_of(name))
        self.rng = np.random.default_rng(len(name))
        for inertia in list(self.model.inertias)[1:]:
            share = 1 + 0.3 * self.rng.uniform(-1, 1)
            inertia.mass, inertia.inertia = inertia.mass * share, inertia.inertia * share * (1 + 0.1 * self.rng.uniform(-1, 1))
        self.data = self.model.createData()
        joints = self.subject.robot.joints
        self.joints = [self.model.joints[self.model.getJointId(joint)] for joint in joints]
        self.q, self.qd, self.qdd = self._motion()
        bare = self._torques()
        level = np.maximum(np.sqrt(np.mean(bare**2, axis=0)), 1e-3 * np.sqrt(np.mean(bare**2)))
        self.Fs, self.Fv = 0.1 * level, 0.1 * level / np.sqrt(np.mean(self.qd**2, axis=0))
        self.tau = bare + self.Fs * np.sign(self.qd) + self.Fv * self.qd
        tau = self.tau + NOISE * level * self.rng.standard_normal(self.tau.shape)
        self.log = MotionLog(FS, COUNT * np.round(self.q / COUNT), tau, TorqueChannel("instantaneous"))

    def _motion(self):
        t, n = np.arange(0, SECONDS, 1 / FS), len(self.joints)
        low, high, fast = np.full(n, -np.pi), np.full(n, np.pi), np.full(n, 2.0)
        for j, joint in enumerate(self.joints):
            limits = self.model.lowerPositionLimit[joint.idx_q], self.model.upperPositionLimit[joint.idx_q]
            if joint.nq == 1 and 1e-3 < limits[1] - limits[0] < 10:
                low[j], high[j] = limits
            fast[j] = min(self.model.velocityLimit[joint.idx_v] or 2.0, 4.0)
        w = 2 * np.pi * 0.1 * np.arange(1, 7) + self.rng.uniform(0, 0.05, (n, 6))
        sine, cosine = self.rng.normal(size=(2, n, 6))
        x, waves = np.zeros((3, len(t), n)), [w[:, :, None] * t, w[..., None]]
        s, c = np.sin(waves[0]), np.cos(waves[0])
        a, b, w = sine[..., None], cosine[..., None], waves[1]
        for k, terms in enumerate((a * s + b * c, w * (a * c - b * s), -w * w * (a * s + b * c))):
            x[k] = terms.sum(axis=1).T
        middle, half = (x[0].max(axis=0) + x[0].min(axis=0)) / 2, np.ptp(x[0], axis=0) / 2
        size = np.minimum(0.8 * (high - low) / 2 / half, 0.8 * fast / np.abs(x[1]).max(axis=0))
        return (low + high) / 2 + size * (x[0] - middle), size * x[1], size * x[2]

    def _torques(self):
        found = np.zeros_like(self.q)
        for k in range(len(found)):
            q, v, a = pin.neutral(self.model), np.zeros(self.model.nv), np.zeros(self.model.nv)
            for j, joint in enumerate(self.joints):
                angle = self.q[k, j]
                q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(angle), np.sin(angle)] if joint.nq == 2 else [angle]
                v[joint.idx_v], a[joint.idx_v] = self.qd[k, j], self.qdd[k, j]
            tau = pin.rnea(self.model, self.data, q, v, a)
            found[k] = [tau[joint.idx_v] for joint in self.joints]
        return found

    @property
    def truth(self):
        """The base parameters that are true."""
        standard = {}
        for j, joint in enumerate(self.joints):
            values = dict(zip(ORDER, self.model.inertias[joint.id].toDynamicParameters(), strict=True))
            standard |= {f"{letters}{j + 1}": values[letters] for letters in INERTIAL}
            standard |= {f"Fs{j + 1}": self.Fs[j], f"Fv{j + 1}": self.Fv[j]}
        grouping = self.subject.grouping
        base = grouping.base(np.array([standard.get(name, 0.0) for name in grouping.standard.names]))
        return base[[grouping.basis.places[parameter] for parameter in self.subject.basis.parameters]]


@pytest.fixture(scope="module", params=ROBOTS)
def real(request):
    return Real(request.param)


def test_torques_of_others_are_explained_and_sigma_holds_the_truth(real):
    """Of p parameters: their squares, by sigma and correlation, are chi^2; the test of lack of fit finds nothing."""
    found = fit(Request(real.subject, models=("explicit",)), Logs((real.log,)))
    estimate = found.estimates["explicit"]
    assert not found.hidden
    assert found.explained["explicit"].min() > 0.999
    off = (estimate.X - real.truth) / estimate.best_sigma
    inside = np.count_nonzero(np.abs(off) < 2)

    assert inside >= scipy.stats.binom.ppf(1e-4, len(off), 0.9545)
    assert np.abs(off).max() < 5


WAYS = {
    "default": ["--write", "a.urdf", "b.json", "c.py", "--write-mjcf", "d.xml"],
    "rotors": ["--armature", "all", "--estimator", "WLS"],
    "stribeck": ["--friction", "standard+stribeck", "--model", "explicit"],
    "auto": ["--friction", "auto", "--model", "explicit", "--estimator", "WLS"],
    "consistent": ["--consistent", "entropic", "--model", "explicit", "--estimator", "WLS"],
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_ends_with_a_result(real, way, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_log(real.log, tmp_path / "log.csv")
    code = main(["identify", "log.csv", "--robot", real.subject.name, "--torque", "instantaneous", "--no-rerun", *WAYS[way]])
    assert not code, capsys.readouterr().err
    shown = capsys.readouterr().out
    word = re.search(r"explicit: (good|fair|unsure|poor): ", shown)
    assert word
    # A law that the robot does not have, on all joints, may cost a joint its verdict; the verdict says so.
    assert word[1] == "good" or way == "stribeck"
