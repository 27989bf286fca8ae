"""Robots as SDF, which Gazebo and Drake read."""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from idbench.identify.data.kinematics import KinematicTree
from idbench.sim.robot.placed import BASE, Body, PlacedLink, numbers, placed_links, without_rounding
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.urdf import GEAR_RATIO, ROTOR_INERTIA, SIX, SIZE, SMALL
from idbench.sim.robot.write_urdf import DRAKE

VERSION = "1.9"  # Of the format

BALL = Body(SMALL, np.zeros(3), np.eye(3) * SMALL * SIZE**2)  # What a link without mass gets


def sdf_text(robot: Robot, tree: KinematicTree, standard: Mapping[str, float]) -> str:
    """Return a robot as SDF with the standard parameters `standard`: links without shapes, joints with limits and friction.

    A link without mass gets a gram, which it must have there. Inertias of rotors stand where Drake reads them; Gazebo has none.
    """
    root = ElementTree.Element("sdf", {"version": VERSION, "xmlns:drake": DRAKE})
    model = ElementTree.SubElement(root, "model", {"name": tree.name})
    _text(ElementTree.SubElement(model, "link", {"name": BASE}), "pose", "0 0 0 0 0 0")
    held = ElementTree.SubElement(model, "joint", {"name": "base_is_held", "type": "fixed"})
    _text(held, "parent", "world")
    _text(held, "child", BASE)
    for link in placed_links(robot, tree, standard):
        _link(model, link)
        _joint(model, link)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _link(model: ElementTree.Element, link: PlacedLink) -> None:
    element = ElementTree.SubElement(model, "link", {"name": link.name})
    _text(element, "pose", numbers(np.concatenate([link.place, link.angles]))).set("relative_to", link.parent)
    body = link.body if link.body is not None and link.body.mass > 0 else BALL
    inertial = ElementTree.SubElement(element, "inertial")
    _text(inertial, "pose", numbers(np.concatenate([body.centre, np.zeros(3)])))
    _text(inertial, "mass", repr(body.mass))
    inertia = ElementTree.SubElement(inertial, "inertia")
    for name, x in zip(SIX, without_rounding(body.inertia)[np.triu_indices(3)], strict=True):
        _text(inertia, name, repr(float(x)))


def _joint(model: ElementTree.Element, link: PlacedLink) -> None:
    kind = "prismatic" if link.joint.kind == "slide" else "revolute"
    joint = ElementTree.SubElement(model, "joint", {"name": link.joint.name, "type": kind})
    _text(joint, "parent", link.parent)
    _text(joint, "child", link.name)
    axis = ElementTree.SubElement(joint, "axis")
    _text(axis, "xyz", numbers(link.joint.axis))
    limit = ElementTree.SubElement(axis, "limit")
    for name, x in link.limits.items():
        _text(limit, name, repr(x))
    dynamics = ElementTree.SubElement(axis, "dynamics")
    for letters, name in (("Fv", "damping"), ("Fs", "friction"), ("K", "spring_stiffness")):
        if letters in link.drive:
            _text(dynamics, name, repr(link.drive[letters]))
    if link.drive.get("K"):
        _text(dynamics, "spring_reference", repr(float(link.joint.spring or 0.0)))
    if link.drive.get("Ia"):
        _text(joint, ROTOR_INERTIA, repr(link.drive["Ia"]))
        _text(joint, GEAR_RATIO, "1.0")


def _text(element: ElementTree.Element, tag: str, text: str) -> ElementTree.Element:
    child = ElementTree.SubElement(element, tag)
    child.text = text
    return child
