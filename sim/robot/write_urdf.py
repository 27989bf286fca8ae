"""Robots as URDF: the file's own with other parameters, or one made of the compiled model."""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import INERTIAL, KinematicTree
from idbench.sim.robot.motors import Array
from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.robot import Robot

UNLIMITED = 1e6
"""What stands for no limit, where a URDF must have one."""


def urdf_text(name: str, robot: Robot, tree: KinematicTree, standard: Mapping[str, float], mounting: Mounting) -> str:
    """Return a robot as URDF with the standard parameters `standard`, by their names.

    A URDF stays as it is, but for inertias, damping and friction: the inertia of a link stands at the link that its joint
    moves, what is welded to it has none. Other robots become links and joints without shapes. Rotors have no place in it.
    """
    path = Robot.path(name)
    text = path.read_text(encoding="utf-8")
    if mounting.plain and "<robot" in text:
        root = ElementTree.fromstring(text, ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True)))
        _rewrite(root, tree, standard)
    else:
        root = _made(robot, tree, standard)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _rewrite(root: ElementTree.Element, tree: KinematicTree, standard: Mapping[str, float]) -> None:
    links = {link.get("name", ""): link for link in root.iter("link")}
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    welded: dict[str, list[str]] = {}
    for joint in joints.values():
        if joint.get("type") == "fixed":
            welded.setdefault(_end(joint, "parent"), []).append(_end(joint, "child"))
    for j, of in enumerate(tree.joints):
        link = _end(joints[of.name], "child")
        waiting = list(welded.get(link, ()))
        while waiting:
            other = waiting.pop()
            _bare(links[other])
            waiting += welded.get(other, ())
        _bare(links[link])
        _give(links[link], standard, j)
        _resist(joints[of.name], standard, j)


def _made(robot: Robot, tree: KinematicTree, standard: Mapping[str, float]) -> ElementTree.Element:
    """Return the robot as links and joints without shapes; a link's frame is at its joint's axis, as URDF has it."""
    root = ElementTree.Element("robot", {"name": tree.name})
    ElementTree.SubElement(root, "link", {"name": "base"})
    anchors = [np.zeros(3) if joint.kind == "slide" else joint.anchor for joint in tree.joints]
    for j, of in enumerate(tree.joints):
        link = ElementTree.SubElement(root, "link", {"name": f"link_{of.name}"})
        _give(link, standard, j, anchors[j])
        slide = of.kind == "slide"
        bounded = bool(np.isfinite(of.range).all())
        kind = "prismatic" if slide else "revolute" if bounded else "continuous"
        joint = ElementTree.SubElement(root, "joint", {"name": of.name, "type": kind})
        parent = f"link_{tree.joints[of.parent].name}" if of.parent >= 0 else "base"
        before = anchors[of.parent] if of.parent >= 0 else np.zeros(3)
        # Positions count from 0 in a URDF: the frame is placed where the joint is 0.
        turned = of.rotation @ (np.eye(3) if slide else _turn(of.axis, -of.zero))
        place = of.position + of.rotation @ anchors[j] - before - (of.rotation @ of.axis * of.zero if slide else 0)
        ElementTree.SubElement(joint, "origin", {"xyz": _numbers(place), "rpy": _numbers(_angles(turned))})
        ElementTree.SubElement(joint, "parent", {"link": parent})
        ElementTree.SubElement(joint, "child", {"link": f"link_{of.name}"})
        ElementTree.SubElement(joint, "axis", {"xyz": _numbers(of.axis)})
        if kind != "continuous":
            low, high = of.range if bounded else (-UNLIMITED, UNLIMITED)
            limits = {"lower": low, "upper": high, "effort": robot.torque_limits[j], "velocity": robot.most("velocity")[j]}
            stated = {key: repr(float(x) if np.isfinite(x) else UNLIMITED) for key, x in limits.items()}
            ElementTree.SubElement(joint, "limit", stated)
        _resist(joint, standard, j)
    return root


def _end(joint: ElementTree.Element, tag: str) -> str:
    found = joint.find(tag)
    return "" if found is None else found.get("link", "")


def _bare(link: ElementTree.Element) -> None:
    for inertial in link.findall("inertial"):
        link.remove(inertial)


def _give(link: ElementTree.Element, standard: Mapping[str, float], j: int, origin: Array | None = None) -> None:
    """Give a link its mass, centre of mass and inertia, about an origin of its own."""
    if named("M", j) not in standard:
        return
    xx, xy, xz, yy, yz, zz, *first, mass = (standard[named(x, j)] for x in INERTIAL)
    centre = np.array(first) / mass if mass > 0 else np.zeros(3)
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    inertia = about - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    inertial = ElementTree.SubElement(link, "inertial")
    shown = centre if origin is None else centre - origin
    ElementTree.SubElement(inertial, "origin", {"xyz": _numbers(shown), "rpy": "0 0 0"})
    ElementTree.SubElement(inertial, "mass", {"value": repr(float(mass))})
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    values = zip(names, inertia[np.triu_indices(3)], strict=True)
    ElementTree.SubElement(inertial, "inertia", {name: repr(float(value)) for name, value in values})


def _resist(joint: ElementTree.Element, standard: Mapping[str, float], j: int) -> None:
    """Give a joint its viscous and Coulomb friction."""
    dynamics = joint.find("dynamics")
    dynamics = ElementTree.SubElement(joint, "dynamics") if dynamics is None else dynamics
    for letters, attribute in (("Fv", "damping"), ("Fs", "friction")):
        if named(letters, j) in standard:
            dynamics.set(attribute, repr(float(standard[named(letters, j)])))


def _turn(axis: Array, angle: float) -> Array:
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K))


def _angles(R: Array) -> Array:
    """Return roll, pitch and yaw of a rotation, Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < 1e-9:  # roll and yaw turn about one axis
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
