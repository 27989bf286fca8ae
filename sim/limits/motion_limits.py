"""What a robot may do: from its file, and from limits.toml."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import mujoco
import numpy as np
from pydantic import Field

from idbench.identify.data.kinematics import Limits
from idbench.identify.plugins import did_you_mean
from idbench.sim.errors import ScenarioError
from idbench.sim.robot.motors import Array
from idbench.sim.robot.robot import Robot
from idbench.sim.settings import EachPositiveOrNone, Number, Positive, Share, make, per_joint, read_toml, settings

Point = tuple[Number, Number, Number]

RATES = ("velocity", "acceleration", "jerk")
"""Limits that MJCF has no word for: a robot's file gives them as `<custom><numeric name="max_velocity" data="..."/>`."""

DEGREES = 5.0  # Times the range of a file beyond which one that is asked for is taken for degrees
FLOOR = "the floor"  # What the floor is called beside the shapes of a file
CLEARANCE = 0.01  # Least distance between shapes by default [m]; pairs that never get so far apart are made so
BOX = "keep_out {}"  # What a box is called beside them


@settings
class KeepOut:
    """A box that no part of the robot may enter, its edges along the axes of the world."""

    name: Annotated[str, Field(min_length=1)]
    """What stands there."""
    lowest: Point
    """Corner with the least x, y and z [m]."""
    highest: Point
    """Corner with the largest x, y and z [m]."""

    def __post_init__(self) -> None:
        if not all(a < b for a, b in zip(self.lowest, self.highest, strict=True)):
            raise ScenarioError(
                f"keep_out {self.name}: lowest = {list(self.lowest)} is not below highest = {list(self.highest)}"
            )


@settings
class MotionLimits:
    """What a motion must keep; what is not given is taken from the robot's file."""

    position: Mapping[str, tuple[Number, Number]] = Field(default_factory=dict)
    """Lowest and highest position of joints, by their names [rad]."""
    velocity: EachPositiveOrNone = None
    """Largest speed [rad/s], of all joints or of each."""
    acceleration: EachPositiveOrNone = None
    """Largest acceleration [rad/s^2], of all joints or of each."""
    jerk: EachPositiveOrNone = None
    """Largest jerk [rad/s^3], of all joints or of each."""
    torque: EachPositiveOrNone = None
    """Largest torque of the motors [N m], of all joints or of each."""
    rms_torque: EachPositiveOrNone = None
    """Largest torque on average over the motion, by which motors get hot [N m], of all joints or of each."""
    torque_share: Annotated[Share, Field(gt=0)] = 0.8
    """Share of the largest torque that the motion takes; the controller needs the rest."""
    prior_error: Annotated[Number, Field(ge=0, le=1)] = 0.3
    """Share by which every base parameter of the robot may be off, with torques still below the largest."""
    clearance: Positive = CLEARANCE
    """Least distance between shapes of the robot, and from what stands around it [m]."""
    floor: Number | Literal["none"] | None = None
    """Height of the floor [m], or "none"; by default the lowest point of what is fixed to the world."""
    keep_out: tuple[KeepOut, ...] = ()
    """Boxes that no part of the robot may enter."""
    home: tuple[Number, ...] = ()
    """Positions from which the arm comes, and to which it returns [rad]; the robot's own by default."""

    def __post_init__(self) -> None:
        names = [box.name for box in self.keep_out]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ScenarioError(f"two boxes of keep_out are called {', '.join(twice)}")

    @classmethod
    def read(cls, path: Path | None) -> "MotionLimits":
        """Return the limits of a TOML file, or none of one's own.

        Raises
        ------
        ScenarioError
            If it cannot be read, or a key is unknown or out of its range.
        """
        if path is None:
            return cls()
        content = read_toml(path, "limits")
        if isinstance(content.get("keep_out"), dict):
            raise ScenarioError(f"limits {path}: write [[keep_out]], with double brackets, for each box")
        return make(cls, content, "")


def limits_of(robot: Robot, asked: MotionLimits) -> Limits:
    """Return the limits of a robot's joints, from its file and from what is asked.

    Raises
    ------
    ScenarioError
        If a joint has no range or no largest velocity, or one is not of the robot; the message says what to write.
    """
    position = _positions(robot, asked.position)
    velocity, acceleration, jerk = (_each(robot, name, getattr(asked, name), robot.most(name)) for name in RATES)
    torque = _each(robot, "torque", asked.torque, robot.torque_limits)
    rms = _each(robot, "rms_torque", asked.rms_torque, np.full(robot.n, np.inf))
    if unlimited := _names(robot, ~np.isfinite(velocity)):
        raise ScenarioError(
            f"{unlimited} has no velocity limit: add --velocity with rad/s of all joints or of each, such as "
            "--velocity 1.5, or write velocity = ... into a file of --limits"
        )
    if unlimited := _names(robot, ~np.isfinite(acceleration) & ~np.isfinite(torque)):
        raise ScenarioError(
            f"{unlimited} has no limit of acceleration or torque: add --acceleration with rad/s^2 of all joints "
            "or of each, such as --acceleration 5, or write torque = ... [N m] into a file of --limits"
        )
    return Limits(position, velocity, acceleration, jerk, torque, rms)


def home_position(robot: Robot, asked: MotionLimits, limits: Limits) -> Array:
    """Home position of the arm [rad], shape (joint,): as asked, the keyframe `home`, or where the file puts it.

    Raises
    ------
    ScenarioError
        If what is asked for lies outside a range.
    """
    low, high = limits.position.T
    if asked.home:
        home = np.array(asked.home)
        if len(home) != robot.n:
            raise ScenarioError(f"limits: home has {len(home)} values for {robot.n} joints")
        if outside := _names(robot, (home < low) | (home > high)):
            raise ScenarioError(f"limits: home = {list(asked.home)} puts {outside} outside its range")
        return home
    keys = [k for k in range(robot.model.nkey) if robot.model.key(k).name == "home"]
    own = np.clip(robot.model.key_qpos[keys[0]] if keys else robot.model.qpos0, *robot.ranges.T)
    if outside := _names(robot, (own < low) | (own > high)):
        raise ScenarioError(f"limits: position puts the robot's own home outside, by {outside}: give a home = [...], too")
    return own


def looser(robot: Robot, asked: MotionLimits) -> list[str]:
    """Limits that go beyond those of the robot's file, in words."""
    known = {name: robot.most(name) for name in RATES} | {"torque": robot.torque_limits}
    found = [
        f"position.{joint} may go from {low:g} to {high:g}, its file says {own[0]:.4g} to {own[1]:.4g}, which holds"
        for joint, own in zip(robot.joints, robot.ranges, strict=True)
        if joint in asked.position
        for low, high in [asked.position[joint]]
        if low < own[0] or high > own[1]
    ]
    for name, own in known.items():
        if (values := getattr(asked, name)) is not None:
            found += [
                f"{name} of {joint} may be {x:g}, its file says {most:g}"
                for joint, x, most in zip(robot.joints, per_joint(values, robot.n, f"limits: {name}"), own, strict=True)
                if x > most
            ]
    return found


def surroundings(name: str, asked: MotionLimits) -> Robot:
    """Return a robot, by its name or file, with the floor and the boxes around it as shapes of the world."""
    floor = floor_of(Robot.load(name), asked)

    def edit(spec: mujoco.MjSpec) -> None:
        if floor is not None:
            spec.worldbody.add_geom(name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, floor])
        for box in asked.keep_out:
            low, high = np.array(box.lowest), np.array(box.highest)
            place = {"size": (high - low) / 2, "pos": (high + low) / 2}
            spec.worldbody.add_geom(name=BOX.format(box.name), type=mujoco.mjtGeom.mjGEOM_BOX, **place)

    return Robot.load(name, edit)


def floor_of(robot: Robot, asked: MotionLimits) -> float | None:
    """Return the height of the floor [m], as asked, or of the lowest point of what is fixed to the world; None without one.

    Where a plane is fixed to the world, that is the floor.
    """
    if asked.floor is not None:
        return asked.floor if isinstance(asked.floor, float) else None
    model, data = robot.model, mujoco.MjData(robot.model)
    mujoco.mj_kinematics(model, data)
    fixed = np.flatnonzero(model.body_weldid[model.geom_bodyid] == 0)
    if not len(fixed) or (model.geom_type[fixed] == int(mujoco.mjtGeom.mjGEOM_PLANE)).any():
        return None
    up = data.geom_xmat[fixed].reshape(-1, 3, 3)[:, 2]
    middle, half = np.split(model.geom_aabb[fixed], 2, axis=1)
    return float(np.min(data.geom_xpos[fixed, 2] + np.sum(up * middle - np.abs(up) * half, axis=1)))


def _positions(robot: Robot, asked: Mapping[str, tuple[float, float]]) -> Array:
    """Return the ranges of the joints, narrowed."""
    ranges = robot.ranges.copy()
    for name, (low, high) in asked.items():
        if name not in robot.joints:
            hint = did_you_mean(name, robot.joints)
            raise ScenarioError(f"limits: position.{name}: no such joint{hint}; there are {', '.join(robot.joints)}")
        j = robot.joints.index(name)
        if not low < high:
            raise ScenarioError(f"limits: position.{name} = [{low:g}, {high:g}]: the lowest is not below the highest")
        ranges[j] = max(ranges[j, 0], low), min(ranges[j, 1], high)
        span, own = high - low, float(np.ptp(robot.ranges[j]))
        if not robot.slides[j] and np.isfinite(own) and span > DEGREES * own:
            a, b = np.radians([low, high])
            raise ScenarioError(
                f"limits: position.{name} = [{low:g}, {high:g}] rad is {span / own:.0f} times the range of its file, "
                f"{robot.ranges[j, 0]:.4g} to {robot.ranges[j, 1]:.4g}: are these degrees? Then write [{a:.4g}, "
                f"{b:.4g}]; a range here can only narrow that of the file"
            )
        if not ranges[j, 0] < ranges[j, 1]:
            raise ScenarioError(f"limits: position.{name} = [{low:g}, {high:g}] lies outside the range of its file")
    if free := _names(robot, ~np.isfinite(ranges).all(axis=1)):
        raise ScenarioError(
            f"without range: {free}; write [position] and {robot.joints[int(np.argmax(~np.isfinite(ranges).all(axis=1)))]} = "
            "[lowest, highest] into a file and give --limits FILE; leave room for the cables"
        )
    return ranges


def _each(robot: Robot, name: str, asked: tuple[float, ...] | None, known: Array) -> Array:
    return known if asked is None else per_joint(asked, robot.n, f"limits: {name}")


def _names(robot: Robot, chosen: Any) -> str:
    return ", ".join(robot.joints[j] for j in np.flatnonzero(chosen))
