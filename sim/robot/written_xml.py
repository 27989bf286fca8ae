"""Robots as URDF, the file's own with other parameters or one made of the compiled model, and as SDF (Gazebo, Drake)."""

from collections.abc import Mapping
from xml.etree import ElementTree

import numpy as np

from idbench.identify.basis.block import named
from idbench.identify.data.kinematics import KinematicTree
from idbench.sim.robot.mounting import Mounting
from idbench.sim.robot.placed import BASE, Body, PlacedLink, numbers, placed_links, without_rounding
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.urdf import GEAR_RATIO, ROTOR_INERTIA, SIX, SIZE, SMALL, give_inertial, link_of, parsed

UNLIMITED = 1e6  # What stands for no limit, where a URDF must have one
DRAKE = "http://drake.mit.edu"  # Namespace of the elements that Drake reads


def urdf_text(name: str, robot: Robot, tree: KinematicTree, standard: Mapping[str, float], mounting: Mounting) -> str:
    """Return a robot as URDF with the standard parameters `standard`, by their names.

    A URDF stays as it is, but for inertias, damping and friction: the inertia of a link stands at the link that its joint
    moves, what is welded to it has none. Other robots become links and joints without shapes. Inertias of rotors stand in
    transmissions, where Drake and idbench read them.
    """
    text = Robot.path(name).read_text(encoding="utf-8")
    if mounting.plain and "<robot" in text:
        root, _ = parsed(text, comments=True)
        _rewrite(root, tree, standard)
    else:
        root = _made(robot, tree, standard)
    for j, of in enumerate(tree.joints):
        if (rotor := standard.get(named("Ia", j))) is not None and (rotor or _has_rotor(root, of.name)):
            _drive(root, of.name, rotor)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _rewrite(root: ElementTree.Element, tree: KinematicTree, standard: Mapping[str, float]) -> None:
    links = {link.get("name", ""): link for link in root.iter("link")}
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    welded: dict[str, list[str]] = {}
    for joint in joints.values():
        if joint.get("type") == "fixed":
            welded.setdefault(link_of(joint, "parent"), []).append(link_of(joint, "child"))
    for j, of in enumerate(tree.joints):
        link = link_of(joints[of.name], "child")
        waiting = list(welded.get(link, ()))
        while waiting:
            other = waiting.pop()
            _bare(links[other])
            waiting += welded.get(other, ())
        _bare(links[link])
        _give(links[link], Body.of(standard, j))
        _resist(joints[of.name], {x: standard[named(x, j)] for x in ("Fv", "Fs") if named(x, j) in standard})


def _made(robot: Robot, tree: KinematicTree, standard: Mapping[str, float]) -> ElementTree.Element:
    """Return the robot as links and joints without shapes."""
    root = ElementTree.Element("robot", {"name": tree.name})
    ElementTree.SubElement(root, "link", {"name": BASE})
    for link in placed_links(robot, tree, standard):
        _give(ElementTree.SubElement(root, "link", {"name": link.name}), link.body)
        kind = "prismatic" if link.joint.kind == "slide" else "revolute" if _bounded(link) else "continuous"
        joint = ElementTree.SubElement(root, "joint", {"name": link.joint.name, "type": kind})
        ElementTree.SubElement(joint, "origin", {"xyz": numbers(link.place), "rpy": numbers(link.angles)})
        ElementTree.SubElement(joint, "parent", {"link": link.parent})
        ElementTree.SubElement(joint, "child", {"link": link.name})
        ElementTree.SubElement(joint, "axis", {"xyz": numbers(link.joint.axis)})
        if kind != "continuous":
            free = {"lower": -UNLIMITED, "upper": UNLIMITED, "effort": UNLIMITED, "velocity": UNLIMITED}
            stated = {**free, **{x: of for x, of in link.limits.items() if _bounded(link) or x in ("effort", "velocity")}}
            ElementTree.SubElement(joint, "limit", {x: repr(float(of)) for x, of in stated.items()})
        _resist(joint, link.drive)
    return root


def _bounded(link: PlacedLink) -> bool:
    return {"lower", "upper"} <= link.limits.keys()


def _transmission(root: ElementTree.Element, joint: str) -> ElementTree.Element | None:
    return next((x for x in root.findall("transmission") for of in x.findall("joint") if of.get("name") == joint), None)


def _has_rotor(root: ElementTree.Element, joint: str) -> bool:
    transmission = _transmission(root, joint)
    return transmission is not None and any(x.tag == ROTOR_INERTIA for x in transmission.iter())


def _drive(root: ElementTree.Element, joint: str, rotor: float) -> None:
    """Give a joint a motor with a rotor, as seen at the joint; in the transmission that it has, if it has one."""
    root.set("xmlns:drake", DRAKE)
    if (transmission := _transmission(root, joint)) is None:
        transmission = ElementTree.SubElement(root, "transmission", {"name": f"{joint}_transmission"})
        ElementTree.SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
        ElementTree.SubElement(transmission, "joint", {"name": joint})
    if (actuator := transmission.find("actuator")) is None:
        actuator = ElementTree.SubElement(transmission, "actuator", {"name": f"{joint}_motor"})
    for tag, value in ((ROTOR_INERTIA, rotor), (GEAR_RATIO, 1.0)):
        found = next((x for x in actuator if x.tag == tag), None)  # to find() a prefix is one that is declared
        (ElementTree.SubElement(actuator, tag) if found is None else found).set("value", repr(float(value)))


def _bare(link: ElementTree.Element) -> None:
    for inertial in link.findall("inertial"):
        link.remove(inertial)


def _give(link: ElementTree.Element, body: Body | None) -> None:
    """Give a link its mass, centre of mass and inertia."""
    if body is not None:
        give_inertial(link, body.mass, {"xyz": numbers(body.centre)}, without_rounding(body.inertia))


def _resist(joint: ElementTree.Element, drive: Mapping[str, float]) -> None:
    """Give a joint its viscous and Coulomb friction."""
    dynamics = joint.find("dynamics")
    dynamics = ElementTree.SubElement(joint, "dynamics") if dynamics is None else dynamics
    for letters, attribute in (("Fv", "damping"), ("Fs", "friction")):
        if letters in drive:
            dynamics.set(attribute, repr(float(drive[letters])))


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
