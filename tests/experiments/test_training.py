"""What leaves an identification is one robot: in every file, in what training frameworks draw, and beside its truth."""

import ctypes
import importlib.util
import shutil
import subprocess
import sys
import tomllib
import warnings
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import mujoco
import numpy as np
import pytest
import yaml
from noisy_logs import noisy_log

import idbench
from idbench.experiments.exports.ensemble import Ensemble
from idbench.experiments.exports.ranges import table_of
from idbench.experiments.identification.consistent_robot import WrittenRobot
from idbench.identify import IdentificationError
from idbench.identify.data.kinematics import INERTIAL
from idbench.sim.robot.inverse_dynamics import inverse_dynamics
from idbench.sim.robot.rewrite import rewritten
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import standard_parameters
from idbench.sim.trajectories import RandomMoves

ENVIRONMENTS = 100


class Tensor(np.ndarray):
    """What the written code asks of torch's tensors, of NumPy's arrays."""

    mT = property(lambda self: np.swapaxes(self, -1, -2))  # noqa: N815

    def cpu(self):
        return self

    def to(self, device):
        return self

    def clone(self):
        return self.copy()

    def clamp(self, min):  # noqa: A002
        return np.maximum(self, min)

    def flatten(self, start):
        return self.reshape(*self.shape[:start], -1)

    def expand(self, *shape):
        return np.broadcast_to(self, shape)


def tensor(values, device=None):
    return np.asarray(values, dtype=np.float32 if np.asarray(values).dtype.kind == "f" else np.intp).view(Tensor)


def matrix_from_quat(quat):
    """Rotation matrices of w x y z, by MuJoCo."""
    matrices = np.empty((*quat.shape[:-1], 9))
    for place in np.ndindex(quat.shape[:-1]):
        mujoco.mju_quat2Mat(matrices[place], np.asarray(quat[place], dtype=np.float64))
    return matrices.reshape(*quat.shape[:-1], 3, 3).view(Tensor)


@pytest.fixture
def frameworks(monkeypatch):
    """Stand-ins for what the written code imports of torch, mjlab, Isaac Lab and JAX."""
    draws = np.random.default_rng(0)

    def module(name, **members):
        made = ModuleType(name)
        made.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, made)
        return made

    torch = {
        "arange": lambda n, device=None: tensor(np.arange(n)),
        "randint": lambda n, shape, device=None: tensor(draws.integers(n, size=shape)),
        "tensor": tensor,
        "cat": np.concatenate,
    }
    module("torch", **torch)
    event = {
        "EventTermCfg": SimpleNamespace,
        "RecomputeLevel": SimpleNamespace(set_const=3),
        "requires_model_fields": lambda *fields, recompute: lambda function: function,
    }
    for name in ("mjlab", "mjlab.managers", "isaaclab", "isaaclab.utils"):
        module(name)
    module("mjlab.managers.event_manager", **event)
    module("isaaclab.managers", EventTermCfg=SimpleNamespace)
    module("isaaclab.utils.math", matrix_from_quat=matrix_from_quat)
    random = SimpleNamespace(randint=lambda key, shape, low, high: key.integers(low, high))
    vmap = lambda function: lambda keys: np.array([function(key) for key in keys])  # noqa: E731
    tree = SimpleNamespace(tree_map=lambda function, model: model)
    module("jax", numpy=module("jax.numpy", asarray=np.asarray), random=random, vmap=vmap, tree_util=tree)


def code(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def of_mjlab(path, robot):
    names = [robot.model.body(k).name for k in range(1, robot.model.nbody)]
    fields = {name: tensor(np.stack([getattr(robot.model, name)] * ENVIRONMENTS)) for name in FIELDS}
    indexing = SimpleNamespace(joint_v_adr=tensor(robot.model.jnt_dofadr), body_ids=tensor(np.arange(1, robot.model.nbody)))
    asset = SimpleNamespace(indexing=indexing, joint_names=list(robot.joints), body_names=names)
    model = SimpleNamespace(**fields)
    (term,) = code(path).events().values()
    world = SimpleNamespace(scene={"robot": asset}, num_envs=ENVIRONMENTS, device="cpu", sim=SimpleNamespace(model=model))
    term.func(world, None, **term.params)
    return {name: np.asarray(getattr(model, name), dtype=np.float64) for name in FIELDS}


def of_isaaclab(path, robot):
    model = robot.model
    names = [model.body(k).name for k in range(1, model.nbody)]
    found, count = {}, ENVIRONMENTS
    held = {"masses": tensor(np.ones((count, len(names)))), "coms": tensor(np.ones((count, len(names), 7)))}
    held["inertias"] = tensor(np.ones((count, len(names), 9)))
    view = SimpleNamespace(**{f"get_{name}": (lambda x=x: x) for name, x in held.items()})
    view.__dict__.update({f"set_{name}": (lambda x, _, name=name: found.update({name: x})) for name in held})
    joints = {}
    asset = SimpleNamespace(
        joint_names=list(robot.joints),
        body_names=names,
        root_physx_view=view,
        write_joint_armature_to_sim=lambda x, joint_ids, env_ids: joints.update(armature=x),
        write_joint_friction_coefficient_to_sim=lambda x, joint_dynamic_friction_coeff, joint_viscous_friction_coeff, **_: (
            joints.update(friction=x, damping=joint_viscous_friction_coeff)
        ),
    )

    class Scene(dict):
        num_envs = count

    (term,) = code(path).events().values()
    term.func(SimpleNamespace(scene=Scene(robot=asset), device="cpu"), None, **term.params)
    fields = {name: np.stack([getattr(model, name)] * count) for name in FIELDS}
    fields |= {"dof_armature": joints["armature"], "dof_damping": joints["damping"], "dof_frictionloss": joints["friction"]}
    fields["body_mass"][:, 1:], fields["body_ipos"][:, 1:] = found["masses"], found["coms"][..., :3]
    np.testing.assert_array_equal(found["coms"][:, -robot.n :, 3:], np.broadcast_to([0, 0, 0, 1], (count, robot.n, 4)))
    moments, axes = np.linalg.eigh(np.asarray(found["inertias"], dtype=np.float64).reshape(count, -1, 3, 3))
    axes[..., 0] *= np.linalg.det(axes)[..., None]
    fields["body_inertia"][:, 1:] = moments
    for place in np.ndindex(moments.shape[:2]):
        mujoco.mju_mat2Quat(fields["body_iquat"][place[0], 1 + place[1]], axes[place].ravel())
    return {name: np.asarray(x, dtype=np.float64) for name, x in fields.items()}


def of_playground(path, robot):
    class Model:
        def tree_replace(self, values):
            return values

    keys = np.random.default_rng(0).spawn(ENVIRONMENTS)
    values, axes = code(path).randomizer(robot.model)(Model(), keys)
    assert axes == dict.fromkeys(values, 0)
    return values


FIELDS = ("dof_armature", "dof_damping", "dof_frictionloss", "body_mass", "body_ipos", "body_inertia", "body_iquat")
FRAMEWORKS = {"mjlab": of_mjlab, "isaaclab": of_isaaclab, "playground": of_playground}


def cad(folder, seed=0):
    """Write a PUMA 560 as CAD has it: links up to a fifth too heavy or light, neither rotors nor friction."""
    values, rng = standard_parameters(Robot.load("puma560")), np.random.default_rng(seed)
    for j in range(6):
        factor = rng.uniform(0.8, 1.2)
        values |= {f"{x}{j + 1}": factor * values[f"{x}{j + 1}"] for x in INERTIAL}
        values |= {f"{x}{j + 1}": 0.0 for x in ("Ia", "Fv", "Fs")}
    (folder / "cad.xml").write_text(rewritten("puma560", values, folder))
    return folder / "cad.xml"


def identified(folder, seed=1):
    """Return an identification of the PUMA 560 that begins with its CAD file."""
    log, other = noisy_log("puma560", seed), noisy_log("puma560", seed + 100)
    return idbench.fit(log, str(cad(folder, seed)), validate=other, model="explicit", armature="all")


@pytest.fixture(scope="module")
def puma(tmp_path_factory):
    folder = tmp_path_factory.mktemp("puma")
    found = identified(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of what readers of a URDF leave out
        found.write(*(str(folder / name) for name in ("arm.xml", "arm.urdf", "arm.yaml", "ranges.toml", "r.ensemble")))
    return found, folder


@pytest.fixture(scope="module")
def motion():
    """Positions, velocities and accelerations that no fit saw."""
    robot = Robot.load("puma560")
    made = RandomMoves(moves=6, durations=(0.8, 1.2), velocity=(2.0,), seed=50).sample(robot, 50.0)
    return made.q, made.qd, made.qdd


def torques(robot, motion):
    """Return torques with Coulomb friction, which MuJoCo's inverse dynamics leave out."""
    return inverse_dynamics(robot, *motion) + robot.model.dof_frictionloss * np.sign(motion[1])


def masses(path):
    values = standard_parameters(Robot.load(str(path)))
    return np.array([[values[f"{x}{j + 1}"] for x in ("M", "Ia")] for j in range(6)])


@pytest.mark.thorough
def test_every_file_has_the_same_robot(puma, motion):
    """One split, in which a mass is nearer to the file's than CAD is, and rotors, of which CAD has none, are the truth's."""
    found, folder = puma
    truth = standard_parameters(Robot.load("puma560"))
    arm = masses(folder / "arm.xml")
    np.testing.assert_allclose(masses(folder / "arm.urdf"), arm, rtol=1e-6)
    table = tomllib.loads((folder / "ranges.toml").read_text())
    np.testing.assert_allclose([body["mass"]["value"] for body in table["bodies"].values()], arm[:, 0], rtol=1e-6)
    np.testing.assert_allclose([joint["armature"]["value"] for joint in table["joints"].values()], arm[:, 1], rtol=1e-6)
    of_file = masses(folder / "cad.xml")[:, 0]
    np.testing.assert_allclose(arm[:, 0], of_file, rtol=0.2)
    np.testing.assert_allclose(arm[:, 1], [truth[f"Ia{j + 1}"] for j in range(6)], rtol=0.15)
    drawn = np.array([masses(folder / "r.ensemble" / f"robot{k:03}.xml") for k in range(0, 200, 20)])
    np.testing.assert_allclose(np.median(drawn, axis=0)[:, 1], arm[:, 1], rtol=0.05)
    actuators = yaml.safe_load((folder / "arm.yaml").read_text())["joints"].values()
    assert [joint["armature_from"] for joint in actuators] == ["sum", "sum", *["log"] * 4]
    assert all((joint["armature_sigma"] is None) == (joint["armature_from"] != "log") for joint in actuators)
    tau = torques(Robot.load(str(folder / "arm.xml")), motion)
    np.testing.assert_allclose(tau, found.predict(*motion), atol=0.002 * np.abs(tau).max())


@pytest.mark.thorough
def test_a_hundred_drawn_robots_err_by_what_intervals_say(puma, motion, frameworks):
    """Mass without its centre and inertia, and each value by itself, would be off by up to 38 % of a torque."""
    found, folder = puma
    tau, half = found.predict(*motion, interval=0.95)
    for name, draw in FRAMEWORKS.items():
        robot, inside, size = Robot.load(str(folder / "arm.xml")), [], np.sqrt(np.mean(tau**2, axis=0))
        fields = draw(folder / f"ranges_{name}.py", robot)
        for k in range(ENVIRONMENTS):
            for field in FIELDS:
                getattr(robot.model, field)[:] = fields[field][k]
            off = torques(robot, motion) - tau
            inside.append(np.abs(off) <= half)
            assert np.all(np.sqrt(np.mean(off**2, axis=0)) < 0.02 * size)
        assert np.mean(inside) > 0.95
        assert np.ptp(fields["body_mass"], axis=0).max() > 0  # they differ


def tracking(torque):
    """Rms errors of the true PUMA in MuJoCo [rad], shape (joint,): tau = ID(q, qd, qdd_d + 2 w (qd_d - qd) + w^2 (q_d - q))."""
    robot, w = Robot.load("puma560"), 20.0
    planned = RandomMoves(moves=4, durations=(0.8, 1.2), velocity=(2.0,), seed=51).sample(robot, 1000.0)
    model = robot.model
    model.opt.timestep, model.opt.integrator = 0.001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data, off = mujoco.MjData(model), []
    data.qpos[:] = planned.q[0]
    for q, qd, qdd in zip(planned.q, planned.qd, planned.qdd, strict=True):
        off.append(q - data.qpos)
        data.qfrc_applied[:] = torque(data.qpos, data.qvel, qdd + 2 * w * (qd - data.qvel) + w**2 * off[-1])
        mujoco.mj_step(model, data)
    return np.sqrt(np.mean(np.square(off), axis=0))


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
@pytest.mark.thorough
def test_a_loop_with_the_identified_c_tracks_as_with_the_true_model(puma):
    """Computed torque at 1 kHz, with torques of the written C, of the true robot, and of the CAD."""
    found, folder = puma
    found.write(str(folder / "arm.c"))
    code = """#include "arm.h"
void torque(const double *q, const double *qd, const double *qdd, double *tau)
{
    const struct arm_parameters p = ARM_IDENTIFIED;
    arm_inverse_dynamics(q, qd, qdd, &p, tau);
}
"""
    (folder / "shim.c").write_text(code)
    given = "-shared", "-fPIC", folder / "shim.c", folder / "arm.c", "-lm", "-o", folder / "arm.so"
    subprocess.run(["cc", "-std=c99", "-O2", *given], check=True)
    call = ctypes.CDLL(str(folder / "arm.so")).torque

    def of_c(*motion):
        own, tau = [np.ascontiguousarray(x) for x in motion], np.empty(6)
        call(*(x.ctypes.data_as(ctypes.c_void_p) for x in (*own, tau)))
        return tau

    def of_file(path):
        robot = Robot.load(path)
        return lambda *motion: torques(robot, [x[None] for x in motion])[0]

    true, c, nominal = map(tracking, (of_file("puma560"), of_c, of_file(str(folder / "cad.xml"))))
    assert np.all(c < 1.5 * true)  # sigma of the estimate, and Coulomb friction that turns over where it rests
    assert np.all(nominal > 10 * true)


@pytest.mark.thorough
def test_ranges_hold_the_truth_and_what_no_log_shows_has_none(tmp_path):
    """20 simulated logs with viscous friction alone: with Coulomb friction beside it neither has a range of its own."""
    truth = standard_parameters(Robot.load("puma560"))
    held, sources = [], set()
    for seed in range(20):
        log = noisy_log("puma560", seed)
        moved = np.gradient(log.q, 1 / log.fs, axis=0)
        coulomb = np.array([truth[f"Fs{j + 1}"] for j in range(6)]) * np.sign(moved)
        smooth, options = replace(log, tau=log.tau - coulomb), {"armature": "all", "friction": ("viscous",)}
        found = idbench.fit(smooth, str(cad(tmp_path, seed)), model="explicit", **options)
        ensemble = Ensemble(found.fit, "explicit")
        ensemble.__dict__["calibrated"] = 1.0  # the standard errors alone, which free runs may only widen
        table = table_of(ensemble)
        for j, joint in enumerate(table["joints"].values()):
            for what, letters in (("armature", "Ia"), ("damping", "Fv")):
                value = joint[what]
                sources.add((what, j, value["from"]))
                if "low" in value:
                    held.append(value["low"] <= truth[f"{letters}{j + 1}"] <= value["high"])
    assert ("armature", 0, "sum") in sources
    assert ("armature", 3, "log") in sources
    assert len(held) > 50
    assert np.mean(held) > 0.9


def test_a_link_that_leaves_its_file_is_named_and_one_that_cannot_be_takes_nothing(monkeypatch):
    """A file whose last link has a fifth of the mass; where no robot is consistent, the verdict stands without the line."""
    found = idbench.fit(noisy_log("puma560", 1), "puma560", validate=noisy_log("puma560", 2), model="explicit")
    written = WrittenRobot(found.fit, "explicit")
    assert written.strayed == []
    given = written.consistent.given.copy()
    given[written.consistent.names.index("M3")] /= 5
    written.__dict__["consistent"] = replace(written.consistent, given=given)
    assert written.strayed == []  # a body whose size is assumed is none of the file's
    written.fit.robot_model.__dict__["filed"] = given
    (line,) = written.strayed
    assert line.startswith("the link of joint3 has 4.8")

    def impossible(*_, **__):
        raise IdentificationError("no such bodies")

    monkeypatch.setattr("idbench.experiments.identification.consistent_estimate.consistent_parameters", impossible)
    assert WrittenRobot(found.fit, "explicit").strayed == []
