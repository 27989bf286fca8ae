"""Functions for a controller, in C and in Python: against MuJoCo, pinocchio and the columns of the identification."""

import ctypes
import runpy
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from importlib.metadata import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from idbench.experiments.errors import ExperimentError
from idbench.experiments.exports.c_code import OF_INTERVAL, c_texts
from idbench.experiments.exports.code import Content
from idbench.experiments.exports.functions import RobotFunctions, require_formulas
from idbench.experiments.exports.python_code import python_text
from idbench.experiments.identification.robot_model import RobotModel
from idbench.experiments.requests.shared import Parameters
from idbench.identify import AbstractFriction, State, tree_basis
from idbench.identify.basis.block import named
from idbench.identify.basis.loads import DriveGains
from idbench.identify.basis.newton_euler import torques
from idbench.sim.robot.inverse_dynamics import coulomb_torque, inverse_dynamics

STRICT = "-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Wdouble-promotion", "-Werror"
COMPILER = shutil.which("cc")
TYPES = {"double": ctypes.c_double, "float": ctypes.c_float}


def content_of(basis, tree, values, half=None):
    """Return what a file has of a basis with values, in the order of its parameters."""
    nothing = [float("nan")] * basis.n
    interval = dict.fromkeys(OF_INTERVAL, half or nothing) | {"band": [10.0]}
    return Content(RobotFunctions(basis, tree), list(map(float, values)), [0.0] * len(values), interval, "by hand")


def module_of(content, folder):
    """Return what the Python module has."""
    (folder / "arm.py").write_text(python_text(content))
    return runpy.run_path(str(folder / "arm.py"))


class Compiled:
    """The functions of arm.c, of one sample."""

    def __init__(self, content, folder, real="double"):
        for ending, text in c_texts(content, folder / "arm.c").items():
            (folder / f"arm{ending}").write_text(text)
        library = folder / f"arm-{real}.so"
        given = "-shared", "-fPIC", f"-DARM_REAL={real}", "-o", library, folder / "arm.c", "-lm"
        done = subprocess.run([COMPILER, *STRICT, *given], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self.library, self.type, self.functions = ctypes.CDLL(str(library)), TYPES[real], content.functions.functions
        fields = [*content.values, *(x for part in OF_INTERVAL for x in content.interval[part])]
        self.p = self._array([*fields, *[0.0] * (content.functions.n * len(content.functions.used))])

    def _array(self, values):
        return (self.type * max(len(values), 1))(*map(float, values))

    def call(self, name, *motion):
        """Return what a function computes, an array."""
        function = next(x for x in self.functions if x.name == name)
        found = self._array(np.zeros(int(np.prod(function.shape))))
        getattr(self.library, f"arm_{name}")(*map(self._array, motion), self.p, found)
        return np.array(found[: int(np.prod(function.shape))]).reshape(function.shape)


needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
EXACT = 1e-12
"""Of sums of some hundred products of doubles, each rounded to 1e-16."""

LAWS = "stribeck-free", "tanh", "arctan", "power", "load", "temperature", "cogging:12", "smooth:0.1", "asymmetric-viscous"


def values_of(robot_model, rng):
    """Return the file's parameters, and some of laws that the file does not have."""
    truth, basis = robot_model.truth(robot_model.robot), robot_model.basis
    shapes = {p.name: 1.1 * x for block in basis.blocks for p, x in block.operating_point(basis.n).items()}
    return [shapes.get(name, truth[name]) or rng.uniform(0.05, 0.3) for name in basis.names]


def largest(a, b):
    return np.abs(np.asarray(a) - b).max() / max(np.abs(b).max(), 1e-300)


@pytest.mark.parametrize("name", ["scara", "puma560", "panda", "servo_arm"])
def test_python_is_mujoco(name, tmp_path, rng):
    robot_model = RobotModel(name)
    arm, basis = robot_model.robot, robot_model.basis
    truth = robot_model.truth(arm)
    arm_py = module_of(content_of(basis, robot_model.tree, truth.values()), tmp_path)
    q, qd, qdd = rng.normal(size=(3, 30, arm.n))
    still = np.zeros_like(q)
    tau = inverse_dynamics(arm, q, qd, qdd) + coulomb_torque(arm, qd)
    assert largest(arm_py["inverse_dynamics"](q, qd, qdd), tau) < EXACT
    assert largest(arm_py["gravity"](q), inverse_dynamics(arm, q, still, still)) < EXACT or not arm.model.opt.gravity.any()
    M = arm_py["mass_matrix"](q)
    inertia = inverse_dynamics(arm, q, still, qdd) - inverse_dynamics(arm, q, still, still)
    assert largest(np.einsum("tij,tj->ti", M, qdd), inertia) < EXACT
    assert largest(arm_py["forward_dynamics"](q, qd, tau), qdd) < 1e4 * EXACT  # condition numbers of M of up to 1e3
    one = arm_py["inverse_dynamics"](*(x[0].tolist() for x in (q, qd, qdd)))
    assert isinstance(one, list)
    assert largest(one, tau[0]) < EXACT
    assert largest(arm_py["inverse_dynamics"](q[0], qd[0], qdd[0]), tau[0]) < EXACT


@pytest.mark.parametrize("law", LAWS)
def test_regressors_are_the_columns_of_the_identification(law, tmp_path, rng):
    """Every law: D X is the torque, and columns are those that the estimates were made with."""
    robot_model = RobotModel("puma560", Parameters(friction=(f"standard+{law}",)))
    basis = robot_model.basis
    X = np.array(values_of(robot_model, rng))
    arm = module_of(content_of(basis, robot_model.tree, X), tmp_path)
    q, qd, qdd, above = rng.normal(size=(4, 20, basis.n))
    p = arm["IDENTIFIED"]
    if law == "temperature":
        p = p._replace(temperature=[x + 25.0 for x in above.T])
    state = State(q.T, qd.T, lambda _: qdd.T, {"temperature": above.T + 25.0})
    about = basis.linearized_at(X)
    for what in ("explicit", "momentum", "remainder", "energy", "dissipation"):
        columns = getattr(about, what)(state)
        taken = (q, qd, qdd)[: 2 if what in ("momentum", "energy") else 3]
        found = arm["regressor" if what == "explicit" else f"regressor_{what}"](*taken, p)
        found = found if found.ndim == 3 else found[:, None]
        expected = np.zeros(found.shape)
        for (row, place), column in columns.items():
            if place >= 0:
                expected[:, row, place] = column
        assert largest(found, expected) < 1e3 * EXACT, what  # slopes of shapes are differences over 1e-4 of themselves
    linear = [k for k, parameter in enumerate(basis.parameters) if parameter.kind != "shape of friction"]
    tau = arm["inverse_dynamics"](q, qd, qdd, p)
    assert largest(arm["regressor"](q, qd, qdd, p)[..., linear] @ X[linear], tau) < EXACT
    assert largest(arm["forward_dynamics"](q, qd, tau, p), qdd) < 1e4 * EXACT


@needs_compiler
@pytest.mark.parametrize(
    "laws", ["standard", pytest.param("standard+stribeck-free+load+smooth:0.1", marks=pytest.mark.thorough)]
)
def test_c_is_python(laws, tmp_path, rng):
    robot_model = RobotModel("scara" if laws == "standard" else "panda", Parameters(friction=(laws,)))
    content = content_of(robot_model.basis, robot_model.tree, values_of(robot_model, rng), [0.5] * robot_model.basis.n)
    arm = module_of(content, tmp_path)
    for real, exact in (("double", EXACT), ("float", 1e-4)):
        compiled = Compiled(content, tmp_path, real)
        for function in content.functions.functions:
            given = rng.normal(size=(len(function.takes), robot_model.basis.n)).tolist()
            expected = np.reshape(arm[function.name](*given), function.shape)
            assert largest(compiled.call(function.name, *given), expected) < exact, (real, function.name)


@needs_compiler
def test_a_loop_of_1_khz_that_calls_c(tmp_path, rng):
    """What a user writes: one file that includes the header, with the parameters as they were identified."""
    robot_model = RobotModel("puma560")
    arm = robot_model.robot
    content = content_of(robot_model.basis, robot_model.tree, robot_model.truth(arm).values(), [0.25] * 6)
    Compiled(content, tmp_path)
    (tmp_path / "loop.c").write_text(
        """#include "arm.h"
#include <stdio.h>
int main(void)
{
    const struct arm_parameters p = ARM_IDENTIFIED;
    double q[ARM_JOINTS], qd[ARM_JOINTS], qdd[ARM_JOINTS], tau[ARM_JOINTS], half[ARM_JOINTS];
    for (int k = 0; k < 1000; k++) {
        for (int j = 0; j < ARM_JOINTS; j++) {
            q[j] = sin(1e-3 * k + j), qd[j] = cos(1e-3 * k + j), qdd[j] = -q[j];
        }
        arm_inverse_dynamics(q, qd, qdd, &p, tau);
        for (int j = 0; j < ARM_JOINTS; j++) printf("%.17g ", tau[j]);
        puts("");
    }
    arm_torque_interval(&p, half);
    printf("%g %d\\n", half[5], arm_outside_fit(q, qd, qdd, &p));
    return 0;
}
"""
    )
    given = [tmp_path / "loop.c", tmp_path / "arm.c", "-lm", "-o", tmp_path / "loop"]
    subprocess.run([COMPILER, *STRICT, *given], check=True)
    *lines, last = subprocess.run([tmp_path / "loop"], capture_output=True, text=True, check=True).stdout.splitlines()
    at = 1e-3 * np.arange(1000)[:, None] + np.arange(6)
    q, qd = np.sin(at), np.cos(at)
    expected = inverse_dynamics(arm, q, qd, -q) + coulomb_torque(arm, qd)
    assert largest([[float(x) for x in line.split()] for line in lines], expected) < EXACT
    half, outside = last.split()
    assert float(half) == 0.25
    assert int(outside) == np.sum((np.abs(qd[-1]) > 0.25) | (np.abs(expected[-1]) > 0.25))


def test_it_takes_symbols_of_other_packages(tmp_path, rng):
    import sympy

    robot_model = RobotModel("scara")
    arm = module_of(content_of(robot_model.basis, robot_model.tree, values_of(robot_model, rng)), tmp_path)
    symbols = [sympy.symbols(f"{x}1 {x}2") for x in ("q", "v", "a")]
    tau = arm["inverse_dynamics"](*symbols)
    motion = rng.normal(size=(3, 2))
    at = {s: x for pair, own in zip(symbols, motion, strict=True) for s, x in zip(pair, own, strict=True)}
    assert largest([float(x.subs(at)) for x in tau], arm["inverse_dynamics"](*motion.tolist())) < EXACT


COUPLED = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body><joint name="a b" axis="0 1 0" damping="0.1" stiffness="2"
ref="0.3"/><geom size="0.1" pos="0.3 0 0" mass="2"/><body pos="0.6 0 0"><joint name="class" axis="0 1 0" frictionloss="0.2"/>
<geom size="0.1" pos="0.2 0.1 0" mass="1"/><body pos="0.3 0 0"><joint name="t1" type="slide" axis="1 0 0" damping="3"/><geom
size="0.1" mass="1"/></body></body></body></worldbody><tendon><fixed name="m" armature="0.1" damping="0.2"
frictionloss="0.3"><joint joint="a b" coef="1"/><joint joint="class" coef="1"/></fixed></tendon></mujoco>"""


@needs_compiler
def test_coupled_drives_slides_springs_and_odd_names(tmp_path, rng):
    (tmp_path / "robot.xml").write_text(COUPLED)
    robot_model = RobotModel(str(tmp_path / "robot.xml"))
    arm, X = robot_model.robot, list(robot_model.truth(robot_model.robot).values())
    content = content_of(robot_model.basis, robot_model.tree, X)
    python, compiled = module_of(content, tmp_path), Compiled(content, tmp_path)
    q, qd, qdd = rng.normal(size=(3, 3))
    tau = python["inverse_dynamics"](q, qd, qdd)
    assert largest(compiled.call("inverse_dynamics", q, qd, qdd), tau) < EXACT
    assert largest(python["regressor"](q, qd, qdd) @ X, tau) < EXACT
    assert largest(python["forward_dynamics"](q, qd, tau), qdd) < 1e3 * EXACT
    state = State(q[:, None], qd[:, None], lambda _: qdd[:, None])
    assert largest(tau, torques(robot_model.basis, state, np.array(X))[:, 0]) < EXACT
    smooth = inverse_dynamics(arm, q[None], qd[None], qdd[None])[0]
    others = {p.name: 0.0 for p in robot_model.basis.parameters if p.symbol in ("Fs", "Fsx")}
    assert largest(python["inverse_dynamics"](q, qd, qdd, python["IDENTIFIED"]._replace(**others)), smooth) < EXACT


@dataclass(frozen=True)
class Odd(AbstractFriction):
    """A law whose letters the code needs for itself."""

    symbol, unit = "t", "N m"

    def force(self, q, qd):
        return np.sinh(np.clip(qd, None, 1.0)) * (qd >= 0) + np.hypot(q, qd)


def test_letters_of_a_law_meet_no_names_of_the_code(tmp_path, rng):
    robot_model = RobotModel("puma560")
    basis = robot_model.basis + Odd()
    X = rng.normal(size=len(basis.names))
    arm = module_of(content_of(basis, robot_model.tree, X), tmp_path)
    q, qd, qdd = rng.normal(size=(3, 5, 6))
    state = State(q.T, qd.T, lambda _: qdd.T)
    assert largest(arm["inverse_dynamics"](q, qd, qdd), torques(basis, state, X).T) < EXACT
    assert largest(arm["inverse_dynamics"](list(q[0]), list(qd[0]), list(qdd[0])), torques(basis, state, X)[:, 0]) < EXACT


@needs_compiler
def test_a_file_of_any_name_includes_its_header(tmp_path):
    robot_model = RobotModel("scara")
    content = content_of(robot_model.basis, robot_model.tree, robot_model.truth(robot_model.robot).values())
    for ending, text in c_texts(content, tmp_path / "my-arm.v2.c").items():
        (tmp_path / f"my-arm.v2{ending}").write_text(text)
    subprocess.run([COMPILER, *STRICT, "-c", "my-arm.v2.c"], cwd=tmp_path, check=True)


def test_it_needs_nothing_but_python(tmp_path, rng):
    robot_model = RobotModel("puma560")
    module_of(content_of(robot_model.basis, robot_model.tree, values_of(robot_model, rng)), tmp_path)
    words = "import arm, sys; arm.inverse_dynamics([0] * 6, [1] * 6, [0] * 6); assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, '.'); {words}"], cwd=tmp_path, check=True)


def test_what_cannot_be_written_is_named():
    @dataclass(frozen=True)
    class Table(AbstractFriction):
        symbol, unit = "Fi", "N m"

        def force(self, q, qd):
            return np.interp(qd, [-1.0, 1.0], [-1.0, 1.0])

    robot_model = RobotModel("scara")
    with pytest.raises(ExperimentError, match=r"arm.c: .*interp"):
        require_formulas(robot_model.basis + Table(), robot_model.tree, "arm.c")
    with pytest.raises(ExperimentError, match=r"arm.c: gains of drives"):
        require_formulas(robot_model.basis + DriveGains(), robot_model.tree, "arm.c")


def urdfs():
    """Return the files of robots of other people, one for each folder and number of joints."""
    found = {}
    for file in files("example-robot-data") or ():
        path = Path(file.locate())
        if path.suffix == ".urdf":
            try:
                model = pin.buildModelFromUrdf(str(path))
            except ValueError:
                continue
            if 2 <= model.nv <= 25:
                found.setdefault((file.parts[-3], model.nv), path)
    return sorted(found.values())


@needs_compiler
@pytest.mark.thorough
def test_c_is_pinocchio_on_the_robots_of_others(tmp_path, rng, subtests):
    tree_of = runpy.run_path(str(Path(__file__).parent.parent / "identify" / "conftest.py"))["tree_of"]
    paths = urdfs()
    assert len(paths) >= 30
    for number, path in enumerate(paths):
        with subtests.test(path.stem):
            model = pin.buildModelFromUrdf(str(path))
            tree, data = tree_of(model), model.createData()
            basis = tree_basis(tree, ())
            X = {}
            for j, inertia in enumerate(list(model.inertias)[1:]):
                letters = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")
                X |= {named(x, j): value for x, value in zip(letters, inertia.toDynamicParameters(), strict=True)}
            content = content_of(basis, tree, [X.get(name, 0.0) for name in basis.names])
            whole = content.functions
            first = [whole.function("inverse_dynamics")]
            inverse = SimpleNamespace(functions=first, used=set(), tape=whole.tape, tree=tree, basis=basis, n=tree.n)
            (folder := tmp_path / str(number)).mkdir()  # a library that is loaded must not be written over
            compiled = Compiled(replace(content, functions=inverse), folder)
            for _ in range(5):
                angles, v, a = rng.normal(size=(3, model.nv))
                q = pin.integrate(model, pin.neutral(model), angles)
                tau = pin.rnea(model, data, q, v, a)
                assert largest(compiled.call("inverse_dynamics", angles, v, a), tau) < EXACT
