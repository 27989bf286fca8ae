"""A robot: a compiled MuJoCo model of one arm and what the bench asks of it."""

import re
import shlex
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Self
from xml.etree import ElementTree

import mujoco
import numpy as np
import numpy.typing as npt

from idbench import models
from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import BenchError, RobotError
from idbench.sim.robot.dh import TABLE, from_table
from idbench.sim.robot.motors import Array, Motors
from idbench.sim.robot.mounting import drop_ties, hold_bases
from idbench.sim.robot.payload import without_missing_meshes
from idbench.sim.robot.urdf import SMALL, from_urdf

_log = mujoco.MjLogConfig.get()
_log.logto_console = _log.logto_file = False  # what it warns of is checked and reported by the bench
_log.set()

FILES = (".xml", ".urdf", TABLE)  # What names of files end with


@dataclass(frozen=True, eq=False)
class Robot:
    """An arm whose every joint is a hinge or a slide."""

    name: str
    """Name of the robot."""
    model: mujoco.MjModel
    """The compiled model."""
    notes: tuple[str, ...] = ()
    """What was mended in its file to compile it."""

    def __post_init__(self) -> None:
        model, simple = self.model, (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        if other := [model.joint(j) for j in range(model.njnt) if model.jnt_type[j] not in simple]:
            called = ", ".join(f"{joint.name!r} of body {model.body(model.jnt_bodyid[joint.id]).name!r}" for joint in other)
            hold = " ".join(shlex.quote(f"{joint.name}=0") for joint in other)
            raise RobotError(
                f"robot {self.name!r}: a joint must turn about or slide along one axis, which {called} does not (its body "
                f"turns freely): --lock {hold} holds it where the file has it"
            )
        if not model.njnt:
            raise RobotError(f"robot {self.name!r} has no joints")

    @classmethod
    def load(cls, name: str, *edits: Callable[[mujoco.MjSpec], None]) -> Self:
        """Return the robot that ships as `name`, or that of an MJCF or URDF file, changed by `edits` before it is compiled.

        Raises
        ------
        RobotError
            If there is no such robot or file, or MuJoCo cannot compile it.

        Examples
        --------
        >>> from idbench.sim import load_robot
        >>> load_robot("scara").joints
        ('joint1', 'joint2')
        """
        spec, notes = cls.described(name)
        try:
            for edit in edits:
                edit(spec)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # what it warns of ends a simulation, by name
                notes = (*notes, *hold_bases(spec), *drop_ties(spec))
                robot = cls(Path(name).stem, spec.compile(), notes)
            robot.require_possible()
            return robot
        except BenchError:
            raise
        except ValueError as error:
            raise RobotError(f"MuJoCo cannot compile {name!r}: {' '.join(str(error).split())}{_way_out(str(error))}") from error

    @staticmethod
    def path(name: str) -> Path:
        """Return the file of a robot; raise RobotError if `name` is neither one that ships nor that of a file."""
        try:
            return Path(name) if Path(name).suffix in FILES else models.path(name)
        except KeyError as error:
            hint = did_you_mean(name, [*models.names(), *(str(x) for x in Path(name).parent.glob("*") if x.suffix in FILES)])
            raise RobotError(f"{error.args[0]}{hint}, or give the path of an MJCF or URDF file ({', '.join(FILES)})") from None

    @staticmethod
    def described(name: str) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
        """Return the description of a robot, to be edited and compiled, and what was mended in its file.

        Of a URDF only what moves is read, not the shapes: their meshes are mostly in formats that MuJoCo does not read.

        Raises
        ------
        RobotError
            If there is no such robot or file, or MuJoCo cannot read it.
        """
        path = Robot.path(name)
        try:
            spec, notes = _read(path)
            spec.compiler.fusestatic = False  # bodies stay those of the file
            taken = {joint.name for joint in spec.joints}
            for number, joint in enumerate(spec.joints, start=1):
                if not joint.name:  # it gets one that can be said
                    joint.name = next(free for i in count() if (free := f"joint{number}" + "_" * i) not in taken)
            return spec, tuple(notes)
        except RobotError as error:
            raise RobotError(f"robot {name!r}: {error}") from None
        except OSError as error:
            raise RobotError(f"cannot read robot {name!r}: {error.strerror}") from error
        except (ValueError, ElementTree.ParseError) as error:
            raise RobotError(f"MuJoCo cannot read {name!r}: {' '.join(str(error).split())}") from error

    def require_possible(self) -> None:
        """Raise RobotError if a number of the file is none, larger than any of a robot, or lets a joint drive itself."""
        model = self.model
        bodies = {"mass": (model.body_mass, 1e6), "inertia": (model.body_inertia, 1e9)}
        drives = {"armature": model.dof_armature, "damping": model.dof_damping, "frictionloss": model.dof_frictionloss}
        for name, (values, most) in bodies.items():
            if (wrong := ~(np.abs(values) <= most)).any():
                b = int(np.argwhere(wrong)[0][0])
                raise RobotError(
                    f"robot {self.name!r}: {name} of body {model.body(b).name!r} is {np.ravel(values[b])[0]:g}, more than "
                    f"{most:g} in SI units: correct the file"
                )
        for name, values in drives.items():
            if (wrong := ~(np.abs(values) <= 1e9)).any():
                j = int(np.argmax(wrong))
                raise RobotError(f"robot {self.name!r}: joint {self.joints[j]} has {name} = {values[j]:g}: correct the file")
        if not (np.abs(model.opt.gravity) <= 1e3).all():
            raise RobotError(f"robot {self.name!r}: gravity = {model.opt.gravity.tolist()} must be numbers up to 1000 m/s^2")
        for name in ("damping", "frictionloss", "armature"):  # with which a joint would drive itself
            if (drives[name] < 0).any():
                j = int(np.argmin(drives[name]))
                raise RobotError(
                    f"robot {self.name!r}: joint {self.joints[j]} has {name} = {drives[name][j]:g}, which must be 0 or above: "
                    "correct the file"
                )

    @property
    def weightless(self) -> bool:
        """Whether its file says nothing of its masses."""
        return float(self.model.body_mass.sum()) <= 1.01 * SMALL * self.n

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.model.njnt)

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(self.model.joint(j).name for j in range(self.n))

    @cached_property
    def motors(self) -> Motors:
        """The DC motors of the joints; RobotError if a joint has none."""
        return Motors.of(self.model)

    @property
    def ranges(self) -> Array:
        """Lowest and highest position of every joint [rad], shape (joint, 2), infinite where the model has no limits."""
        unlimited = np.tile([-np.inf, np.inf], (self.n, 1))
        return np.where(self.model.jnt_limited[:, None].astype(bool), self.model.jnt_range, unlimited)

    def most(self, rate: str) -> Array:
        """Return the largest velocity, acceleration or jerk of every joint, shape (joint,), infinite where the file has none.

        MJCF has no word for them: they are numbers of its own, as `<custom><numeric name="max_velocity" data="2 2"/></custom>`.
        Of a URDF they are the limits of its joints.
        """
        name, found = f"max_{rate}", np.full(self.n, np.inf)
        custom = {self.model.numeric(i).name: self.model.numeric(i).data for i in range(self.model.nnumeric)}
        if name in custom and len(custom[name]) != self.n:
            raise RobotError(f"robot {self.name!r}: {name} has {len(custom[name])} values for {self.n} joints")
        for j, joint in enumerate(self.joints):
            found[j] = custom[name][j] if name in custom else custom.get(f"{name} {joint}", [np.inf])[0]
            if not found[j] > 0:
                raise RobotError(
                    f"robot {self.name!r}: {name} of {joint} is {found[j]:g}, which must be above 0: correct the file"
                )
        return found

    @property
    def slides(self) -> npt.NDArray[np.bool_]:
        """Whether each joint slides, shape (joint,); the others are hinges."""
        return np.asarray(self.model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE))

    @property
    def torque_limits(self) -> Array:
        """Largest torque of every joint's actuator [N m], shape (joint,), infinite where the model has no limits.

        From the range of forces, and from that of controls where the control is a force, as in `motor`; of a URDF its efforts.
        """
        model = self.model
        of_joints = [_smaller_side(range_) for range_ in model.jnt_actfrcrange]
        limits = np.where(model.jnt_actfrclimited.astype(bool), of_joints, np.inf)
        for a in range(model.nu):
            if model.actuator_trntype[a] != int(mujoco.mjtTrn.mjTRN_JOINT):
                continue
            joint, gear = model.actuator_trnid[a, 0], abs(model.actuator_gear[a, 0])
            if model.actuator_forcelimited[a]:
                limits[joint] = min(limits[joint], gear * _smaller_side(model.actuator_forcerange[a]))
            is_force = model.actuator_biastype[a] == int(mujoco.mjtBias.mjBIAS_NONE)
            if model.actuator_ctrllimited[a] and is_force:
                scale = gear * model.actuator_gainprm[a, 0]
                limits[joint] = min(limits[joint], scale * _smaller_side(model.actuator_ctrlrange[a]))
        return limits


def _read(path: Path) -> tuple[mujoco.MjSpec, list[str]]:
    """Return the description of a robot's file, and what was mended in it."""
    if path.suffix == TABLE:
        return from_table(path)
    text = path.read_text(encoding="utf-8")
    if "<robot" in text:
        return from_urdf(text)
    if "<mujocoinclude" in text:
        others = [other for other in sorted(path.parent.glob("*.xml")) if other != path and _includes(other, path.name)]
        named = f": give {' or '.join(map(str, others))}" if others else ", which is the one to give"
        raise RobotError(f"this file is a part that another includes{named}")
    spec = mujoco.MjSpec.from_file(str(path))
    return spec, without_missing_meshes(spec, path.parent)


def _includes(other: Path, name: str) -> bool:
    try:
        return bool(re.search(rf"""<include[^>]*["'](\./)?{re.escape(name)}["']""", other.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return False


def _smaller_side(limits: Array) -> float:
    """Distance of the nearer end of a range from 0; of a range that lies to one side of it, of the farther one."""
    low, high = (float(x) for x in limits)
    return min(-low, high) if low < 0 < high else max(abs(low), abs(high))


def _way_out(reason: str) -> str:
    """Way out of a reason why MuJoCo does not compile a model."""
    if "mass and inertia" in reason:
        return "; give every body that a joint moves a mass and an inertia"
    if "eigenvalues" in reason or "A + B" in reason or "inertia must satisfy" in reason:
        return "; correct the inertia of that body: it must be physically consistent"
    if "file" in reason.lower():
        return "; put the file there, or take what needs it out: identification needs the inertials alone"
    return ""
