"""A robot's file with servos at its joints, and what plain MuJoCo makes of it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.identify.basis.block import named
from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.mounting import FIELDS, PLAIN, Mounting
from idbench.sim.robot.payload import HARD, Payload
from idbench.sim.robot.rewrite import compiled, rewritten
from idbench.sim.robot.robot import Robot

STEP = 5e-4
"""Physics step of a written file [s]. Implicit damping makes inertias b STEP larger: 3 % of the armature of a small servo."""

EARLY = 1.3
"""Steps by which a command acts early: force acts from half a step before, the rate limit moves on before that. Measured."""

NO_DRIVE = ("armature", "damping", "frictionloss", "stiffness", "margin", "ref", "springref")
"""What a joint that is free play has none of, whatever the defaults of the file are."""

GROUPS = 31  # Groups of actuators that MuJoCo can disable
PLAY = "_play"  # What the name of a joint's free play ends with

SHARP_FRICTION = (1e-4, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""MuJoCo's solref and solimp of dry friction that is as sharp as any step allows: its own lets a joint creep under its load."""


@dataclass(frozen=True)
class ServoValues:
    """A servo as MuJoCo has it."""

    a: float
    """kt/R [N m/V]."""
    b: float
    """kt^2/R [N m s/rad]."""
    gain: float
    """Duty per rad, firmware gain included."""
    supply: float
    """Supply voltage [V]."""
    duty_limit: float
    """Largest duty, torque or current; infinite if there is none."""
    armature: float
    """Ia of the joint [kg m^2]."""
    damping: float
    """Fv of the joint [N m s/rad]."""
    frictionloss: float
    """Fs of the joint [N m]."""
    rate: float
    """Rate limit of the target [rad/s]; infinite if there is none."""
    delay: float
    """Of the command [s]."""
    backlash: float = 0.0
    """Free play between rotor and link [rad]."""
    kd: float = 0.0
    """Duty, torque or current per speed [rad/s], within the limit."""
    time_constant: float = 0.0
    """Of a low-pass of the command [s]."""
    motor: bool = True
    """Whether a duty drives a DC motor; a torque, or a current, is what `position` and `velocity` of MuJoCo command."""
    bias: float = 0.0
    """Constant torque beside a loop of torque or current [N m]."""


def links(name: str, mounting: Mounting = PLAIN, payload: Payload = Payload()) -> Robot:  # noqa: B008  # frozen
    """Return a robot without what belongs to its drives: armature, damping and friction of the file."""
    return Robot.load(name, mounting.edit, payload.edit, _without_drives)


def _without_drives(spec: mujoco.MjSpec) -> None:
    for joint in spec.joints:
        joint.armature = joint.frictionloss = 0.0
        joint.damping = [0.0] * len(joint.damping)


def with_servos(
    name: str, servos: Mapping[int, ServoValues], folder: Path | None = None, mounting: Mounting = PLAIN, position: bool = False
) -> str:
    """Return the file of a robot as MJCF, with servos in the place of the actuators of some joints.

    MuJoCo's `dcmotor` with input="pos" drives V = clip((R/K) kp (u - q), Vmax): the servo's law, with kp = g kp V a,
    kd = K^2/R, which cancels its compensation of the back-EMF, slewmax the rate limit, and a delayed command. `position` writes
    `<position>` instead, for older versions: stiffness, damping and a force range, without rate limit and delay, and without
    the fall of the torque with speed at full duty. `servos` are by the number of the joint; the rest is as for `rewritten`.

    Raises
    ------
    RobotError
        If the file does not compile.
    """
    robot = Robot.load(name, mounting.edit)
    letters = {named(x, j): getattr(servo, field) for j, servo in servos.items() for x, field in FIELDS.items()}
    root = ElementTree.fromstring(rewritten(name, letters, folder, mounting))
    for joint in root.iter("joint"):
        if joint.get("name") in [robot.joints[j] for j in servos]:
            for attribute, values in zip(("solreffriction", "solimpfriction"), SHARP_FRICTION, strict=True):
                joint.set(attribute, _words(values))
    _set_play(root, {robot.joints[j]: servo.backlash for j, servo in servos.items() if servo.backlash > 0})
    for actuators in root.findall("actuator"):
        for old in [old for old in actuators if old.get("joint") in [robot.joints[j] for j in servos]]:
            actuators.remove(old)
    option = root.find("option")
    option = ElementTree.SubElement(root, "option") if option is None else option
    if any(servo.motor for servo in servos.values()):
        option.set("timestep", repr(STEP))
        option.set("integrator", "implicitfast")  # RK4 holds the state of a dcmotor over its whole step
    step = float(option.get("timestep", robot.model.opt.timestep))
    block = ElementTree.SubElement(root, "actuator")
    for j, servo in servos.items():
        tag, attributes = _plain(servo, step) if position or not servo.motor else ("dcmotor", _dcmotor(servo))
        ElementTree.SubElement(block, tag, {"name": f"{robot.joints[j]}_servo", "joint": robot.joints[j], **attributes})
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode") + "\n"
    compiled(name, text, folder)
    return text


def _set_play(root: ElementTree.Element, plays: Mapping[str, float]) -> None:
    """Give joints free play [rad]: a second joint behind each, which moves within it."""
    for body in root.iter("body"):
        joints = body.findall("joint")
        for joint in [joint for joint in joints if joint.get("name") in plays]:
            if len(joints) > 1:
                raise RobotError(f"backlash of {joint.get('name')} needs a body of its own; its body moves in several joints")
            half, limits = plays[str(joint.get("name"))] / 2, {"solreflimit": f"{2 * STEP:g} 1", "solimplimit": _words(HARD)}
            alike = {key: str(joint.get(key)) for key in ("class", "type", "axis", "pos") if joint.get(key) is not None}
            own = {"range": f"{-half!r} {half!r}", "limited": "true", **dict.fromkeys(NO_DRIVE, "0")}
            gap = ElementTree.Element("joint", {"name": f"{joint.get('name')}{PLAY}", **alike, **own, **limits})
            body.insert(list(body).index(joint) + 1, gap)


def _words(numbers: Iterable[float]) -> str:
    return " ".join(f"{x:g}" for x in numbers)


def _dcmotor(servo: ServoValues) -> dict[str, str]:
    K = servo.b / servo.a
    rate = servo.rate if np.isfinite(servo.rate) else 0.0
    kp, most = servo.gain * servo.supply * servo.a, servo.duty_limit * servo.supply
    kd = servo.b + servo.kd * servo.supply * servo.a
    samples = round(servo.delay / STEP + EARLY)
    return {
        "motorconst": repr(K),
        "resistance": repr(K / servo.a),
        "input": "pos",
        "controller": " ".join(repr(float(x)) for x in (kp, 0.0, kd, rate, 0.0, most)),
        "nsample": str(samples),
        "delay": repr(samples * STEP),
    }


def _plain(servo: ServoValues, step: float) -> tuple[str, dict[str, str]]:
    """Return `position`, or `velocity` of a loop without kp; of a DC motor without rate limit and delay, for older versions."""
    scale = servo.a * servo.supply
    kp, most = scale * servo.gain, scale * servo.duty_limit
    kv = scale * servo.kd + servo.b
    found = {"kv": repr(float(kv))} | ({"forcerange": f"{-most!r} {most!r}"} if np.isfinite(most) else {})
    if not servo.motor:
        samples = max(0, round(servo.delay / step + 0.5))  # a force acts from half a step before
        found |= {"nsample": str(samples), "delay": repr(samples * step)} if samples else {}
        found |= {"timeconst": repr(servo.time_constant)} if servo.time_constant and kp else {}
    if servo.bias and not servo.motor:  # tau = kp u + (bias - kp q - kv qd)
        del found["kv"]
        biasprm = " ".join(repr(float(x)) for x in (servo.bias, -kp, -kv))
        found |= {"dyntype": "filterexact", "dynprm": found.pop("timeconst")} if "timeconst" in found else {}
        return "general", {"gainprm": repr(float(kp or kv)), "biastype": "affine", "biasprm": biasprm, **found}
    return ("position", {"kp": repr(float(kp)), **found}) if kp else ("velocity", found)


@dataclass(frozen=True, eq=False)
class Commands:
    """What servos are sent."""

    t: Array
    """Shape (time,) [s]."""
    command: Array
    """Angles of the file, held from each sample on [rad], shape (time, servo)."""
    joints: Sequence[int]
    """Joint of each servo."""
    on: npt.NDArray[np.bool_] | None = None
    """Whether torque is enabled; by default always, shape (time, servo)."""


def replay(name: str, text: str, folder: Path, sent: Commands, q0: Array) -> Array:
    """Positions that plain MuJoCo gives for commands [rad], shape (time, joint), from q0 on, shape (joint,).

    `text` is the file of the robot with servos, `folder` where that finds its meshes.

    Raises
    ------
    RobotError
        If MuJoCo cannot go on.
    """
    model = compiled(name, text, folder).model
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = mujoco.MjData(model)
    own = [j for j in range(model.njnt) if not model.joint(j).name.endswith(PLAY)]
    at = model.jnt_qposadr[own]
    gaps = {k: model.jnt_qposadr[j + 1] for k, j in enumerate(own) if j + 1 < model.njnt and j + 1 not in own}
    data.qpos[at] = q0
    place = [model.actuator(f"{model.joint(own[j]).name}_servo").id for j in sent.joints]
    model.actuator_group[place] = groups = np.arange(len(place)) % GROUPS
    _begin(model, data, place, sent.command[0])
    q = np.empty((len(sent.t), len(own)))
    for k, instant in enumerate(sent.t - sent.t[0]):
        while data.time < instant - model.opt.timestep / 2:
            mujoco.mj_step(model, data)
        q[k] = data.qpos[at]
        for joint, gap in gaps.items():
            q[k, joint] += data.qpos[gap]
        data.ctrl[place] = sent.command[k]
        if sent.on is not None:  # a group that is disabled gives no torque, as an open winding, and its target stands still
            model.opt.disableactuator = sum({1 << int(g) for g in groups[~sent.on[k]]})
            _aim(model, data, [a for a, on in zip(place, sent.on[k], strict=True) if not on])
        if not np.isfinite(q[k]).all():
            raise RobotError(f"the servos written for {name!r} make MuJoCo diverge at {instant:.3g} s")
    return q


def _begin(model: mujoco.MjModel, data: mujoco.MjData, place: Sequence[int], command: Array) -> None:
    """Let servos have held a command before the beginning: their rate limits and delays know no other."""
    data.ctrl[place] = command
    _aim(model, data, place)
    for actuator, value in zip(place, command, strict=True):
        if (kept := int(model.actuator_history[actuator, 0])) > 0:
            mujoco.mj_initCtrlHistory(model, data, actuator, None, np.full((kept, 1), value))


def _aim(model: mujoco.MjModel, data: mujoco.MjData, place: Sequence[int]) -> None:
    """Let the targets of servos have arrived at their commands."""
    for actuator in place:
        if model.actuator_actnum[actuator]:
            data.act[model.actuator_actadr[actuator]] = data.ctrl[actuator]
