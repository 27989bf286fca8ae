"""What the actuators of a robot's file state of the loops that drive its joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot

LOW_PASSES = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))
"""Dynamics of actuators that are low-passes of their control."""

PLACES = {"R": 0, "K": 1, "kp": 4, "ki": 5, "kd": 6, "V": 7}  # Places of the parameters of a `dcmotor` among those of its gain


@dataclass(frozen=True)
class PositionLoop:
    """The loop of a joint, as the actuator of a file closes it: `position`, `velocity`, an affine `general`, or `dcmotor`."""

    actuator: str
    """Name of the actuator."""
    stated: Mapping[str, Any]
    """What a servo.toml states of it."""
    angle: tuple[float, float]
    """Factor and constant that make the angle [rad] of a control."""
    torque: tuple[float, float] = (0.0, 0.0)
    """Factor and constant that make a torque [N m] of a control, of actuators that control no position."""

    def commanded(self, u: Array) -> tuple[Array, Array]:
        """Return the angles [rad] and the torques [N m] that controls command, both of their shape."""
        return u * self.angle[0] + self.angle[1], u * self.torque[0] + self.torque[1]


def position_loops(robot: Robot) -> dict[str, PositionLoop]:
    """Return the loops of the joints that have one, by their names; those of motors and tendons are none."""
    model, found = robot.model, dict[str, PositionLoop]()
    for k in range(model.nu):
        if model.actuator_trntype[k] == int(mujoco.mjtTrn.mjTRN_JOINT):
            joint = int(model.actuator_trnid[k, 0])
            is_dc = model.actuator_gaintype[k] == int(mujoco.mjtGain.mjGAIN_DCMOTOR)
            if (made := _dcmotor(model, k) if is_dc else _affine(model, k, joint)) is not None:
                found[model.joint(joint).name] = made
    return found


def _affine(model: mujoco.MjModel, k: int, joint: int) -> PositionLoop | None:
    """Return tau = r clip(g u + b0 + b1 r q + b2 r qd) as a loop, r being the gear."""
    affine = model.actuator_biastype[k] == int(mujoco.mjtBias.mjBIAS_AFFINE)
    if not affine or model.actuator_gaintype[k] != int(mujoco.mjtGain.mjGAIN_FIXED):
        return None
    if model.actuator_dyntype[k] not in (int(mujoco.mjtDyn.mjDYN_NONE), *LOW_PASSES):
        return None
    r, g = float(model.actuator_gear[k, 0]), float(model.actuator_gainprm[k, 0])
    b0, b1, b2 = (float(x) for x in model.actuator_biasprm[k, :3])
    kp, kd = 0.0 - b1 * r**2, 0.0 - b2 * r**2
    if kp < 0 or (kp == 0 and kd <= 0):
        return None
    stated: dict[str, Any] = {"kind": "torque", "kp": kp, "kd": kd}
    if model.actuator_dyntype[k] in LOW_PASSES:
        stated["time_constant"] = float(model.actuator_dynprm[k, 0])
    limits = [abs(r) * _smaller(model.actuator_forcerange[k])] if model.actuator_forcelimited[k] else []
    limits += [_smaller(model.jnt_actfrcrange[joint])] if model.jnt_actfrclimited[joint] else []
    stated |= {"torque_limit": min(limits)} if limits else {}
    name = str(model.actuator(k).name)
    if kp > 0:
        return PositionLoop(name, stated, (-g / (b1 * r), -b0 / (b1 * r)))
    return PositionLoop(name, stated, (0.0, 0.0), (r * g, r * b0))


def _smaller(limits: Array) -> float:
    return float(np.abs(limits).min())


def _dcmotor(model: mujoco.MjModel, k: int) -> PositionLoop | None:
    """Return V = clip((R/K) (kp (u - r q) - kd r qd) + K r qd), tau = r (K/R) (V - K r qd) as a loop."""
    gain, r = model.actuator_gainprm[k], float(model.actuator_gear[k, 0])
    R, K, kp, ki, kd, V = (float(gain[place]) for place in PLACES.values())
    if kp <= 0 or ki != 0 or V <= 0:
        return None
    volts = R / K / V  # duty for each N m
    stated = {"kind": "duty", "supply": V, "gain": 1.0, "kp": volts * kp * r, "kd": r * (volts * kd - K / V)}
    return PositionLoop(str(model.actuator(k).name), stated, (1 / r, 0.0))
