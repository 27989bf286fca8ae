"""URDFs as they are in the wild: without meshes, with links that have no inertia, with what MuJoCo does not read."""

from collections.abc import Iterator, Mapping
from xml.etree import ElementTree
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from idbench.sim.errors import RobotError
from idbench.sim.robot.motors import Array

SMALL = 1e-3  # Mass [kg] of a moving link to which its file gives none: identification needs its place alone
SIZE = 0.05  # Radius of gyration [m] of links whose inertia is made up
TINY = 1e-12  # Second moment [kg m^2] below which MuJoCo takes it for none

ROTOR_INERTIA, GEAR_RATIO = "drake:rotor_inertia", "drake:gear_ratio"
"""What Drake reads of a motor: inertia of its rotor [kg m^2], and turns of it for one of the joint."""

ONCE = ("origin", "inertial", "mass", "inertia", "parent", "child", "axis", "limit", "dynamics")
"""What a link, a joint or an inertia has once."""

SIX = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""What the numbers of an inertia matrix are called."""

ROUND, LEAST = 1e-9, 1e-3
"""Share of the largest second moment above which the least is one that a body has; and to which others are raised."""


def from_urdf(text: str) -> tuple[mujoco.MjSpec, list[str]]:
    """Return the description of a URDF without its shapes, with the velocities that it allows, and what was mended in it.

    Raises
    ------
    RobotError
        If it is a xacro.
    """
    root, lines = parsed(text)
    for link in root.iter("link"):
        for shape in [child for child in link if child.tag in ("visual", "collision")]:
            link.remove(shape)
    rotors = dict(_rotors(root))
    for other in [child for child in root if child.tag in ("gazebo", "transmission", "ros2_control", "mujoco")]:
        root.remove(other)
    computed = any(mark in value for element in root.iter() for value in element.attrib.values() for mark in ("${", "$("))
    if computed or any(str(element.tag).startswith(("xacro:", "{http://www.ros.org/wiki/xacro}")) for element in root.iter()):
        raise RobotError("this is a xacro, from which a URDF is made first: xacro arm.urdf.xacro > arm.urdf")
    mended = [*_tidied(root), *_mend(root)]
    spec = mujoco.MjSpec.from_string(_written(root, lines))
    for joint in root.iter("joint"):
        limit = joint.find("limit")
        if limit is not None and float(limit.get("velocity", 0)) > 0:
            spec.add_numeric(name=f"max_velocity {joint.get('name')}", data=[float(limit.get("velocity", 0))], size=1)
    for joint in spec.joints:
        joint.armature = rotors.get(joint.name, joint.armature)
    return spec, mended


def _tidied(root: ElementTree.Element) -> Iterator[str]:
    """Take out what other readers of URDF pass over, and declare a parent that they add; yield what was done."""
    for owner in [*root.iter("link"), *root.iter("joint")]:
        for element in (owner, *owner.findall("inertial")):
            tags = [child.tag for child in element]
            for k, child in reversed([*enumerate(element)]):
                if child.tag in ONCE and child.tag in tags[:k]:
                    element.remove(child)
                    yield f"a second {child.tag} of {owner.get('name')}: the first one is taken"
    known, moved = {link.get("name") for link in root.iter("link")}, {link_of(joint, "child") for joint in root.iter("joint")}
    unknown = {link_of(joint, "parent") for joint in root.iter("joint")} - known
    if len(unknown) == 1 and known <= moved:  # else a name is wrong, and the robot would be cut in two
        root.insert(0, ElementTree.Element("link", name=(name := unknown.pop())))
        yield f"no link {name}, the parent of a joint: it is taken as the ground"


def _rotors(root: ElementTree.Element) -> Iterator[tuple[str, float]]:
    """Yield the joints whose motors have rotors, and their inertias as seen at the joint [kg m^2]."""
    for transmission in root.findall("transmission"):
        every = (x for actuator in transmission.findall("actuator") for x in actuator.iter())
        stated = {x.tag: _stated(x, transmission) for x in every if x.tag in (ROTOR_INERTIA, GEAR_RATIO)}
        if ROTOR_INERTIA in stated:
            for joint in transmission.findall("joint"):
                yield joint.get("name", ""), stated[ROTOR_INERTIA] * stated.get(GEAR_RATIO, 1.0) ** 2


def _stated(element: ElementTree.Element, transmission: ElementTree.Element) -> float:
    try:
        return float(element.get("value", ""))
    except ValueError as error:
        name, value = transmission.get("name", ""), element.get("value")
        raise RobotError(f"transmission {name!r}: {element.tag} has the value {value!r}, which is no number") from error


Lines = dict[ElementTree.Element, int]
"""Lines of a file at which its elements begin."""


def parsed(text: str, *, comments: bool = False) -> tuple[ElementTree.Element, Lines]:
    """Return the elements of a file, also those with prefixes that nothing declares, and their lines.

    Raises
    ------
    RobotError
        If it is no XML.
    """
    builder, parser = ElementTree.TreeBuilder(insert_comments=comments), expat.ParserCreate()
    lines = Lines()

    def start(tag: str, attributes: dict[str, str]) -> None:
        lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.CommentHandler = builder.comment
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        raise RobotError(f"it is no XML: {error}") from error
    return builder.close(), lines


def _written(root: ElementTree.Element, lines: Lines) -> str:
    """Return elements as text, each at its line of the file, so that what MuJoCo says of a line holds there."""
    written, names = list[str](), list[str]()
    at, open_ = 1, [iter((root,))]
    while open_:
        if (element := next(open_[-1], None)) is None:
            open_.pop()
            written += [f"</{names.pop()}>"] if names else []
            continue
        down = max(0, lines.get(element, 0) - at)
        attributes = "".join(f" {name}={quoteattr(value)}" for name, value in element.attrib.items())
        written.append("\n" * down + f"<{element.tag}{attributes}>")
        at += down
        names.append(element.tag)
        open_.append(iter(list(element)))
    return "".join(written)


def _mend(root: ElementTree.Element) -> Iterator[str]:
    """Give links inertias that can exist; yield what was done."""
    links = {link.get("name", ""): link for link in root.iter("link")}
    moving = {link_of(joint, "child") for joint in root.iter("joint") if joint.get("type") != "fixed"}
    missing, impossible = list[str](), list[str]()
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is not None and _mass(inertial) < 0:
            raise RobotError(
                f"link {name} has a mass of {_mass(inertial):g} kg: a mass is above 0, or leave its <inertial> out"
            )
        if inertial is not None and _mass(inertial) <= 0:
            link.remove(inertial)
            inertial = None
        if inertial is None:
            if name in moving and not _carries(name, links, root):
                give_inertial(link, SMALL, {}, np.eye(3) * SMALL * SIZE**2)
                missing.append(name)
            continue
        given = _inertia(inertial)
        if (possible := _possible(given, _mass(inertial))) is not given:
            origin = inertial.find("origin")
            link.remove(inertial)
            give_inertial(link, _mass(inertial), {} if origin is None else origin.attrib, possible)
            impossible.append(name)
    if missing:
        yield f"no inertia of {', '.join(missing)}: 1 g is assumed, which matters only for simulation"
    if impossible:
        yield f"an inertia of {', '.join(impossible)} that is impossible: a physically consistent one is assumed"


def _carries(name: str, links: dict[str, ElementTree.Element], root: ElementTree.Element) -> bool:
    """True if something with mass is welded to a link."""
    welded = [link_of(j, "child") for j in root.iter("joint") if j.get("type") == "fixed" and link_of(j, "parent") == name]
    for child in welded:
        inertial = links[child].find("inertial") if child in links else None
        if (inertial is not None and _mass(inertial) > 0) or _carries(child, links, root):
            return True
    return False


def link_of(joint: ElementTree.Element, end: str) -> str:
    """Name of the parent or child of a joint; empty without one."""
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _mass(inertial: ElementTree.Element) -> float:
    mass = inertial.find("mass")
    return 0.0 if mass is None else float(mass.get("value", 0))


def _inertia(inertial: ElementTree.Element) -> Array:
    """Return the matrix of inertia, in the axes of its origin."""
    found = inertial.find("inertia")
    values = {} if found is None else found.attrib
    xx, xy, xz, yy, yz, zz = (float(values.get(x, 0)) for x in SIX)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _possible(inertia: Array, mass: float) -> Array:
    """Return an inertia if a body can have it, else one that a body can have: second moments below zero are raised."""
    moments = np.trace(inertia) / 2 * np.eye(3) - inertia
    values, vectors = np.linalg.eigh(moments)
    if values[0] > max(ROUND * values[2], TINY):
        return inertia
    raised = np.maximum(values, LEAST * values[2] if values[2] > TINY else mass * SIZE**2 / 2)
    made = (vectors * raised) @ vectors.T
    return np.asarray(np.trace(made) * np.eye(3) - made)


def give_inertial(link: ElementTree.Element, mass: float, origin: Mapping[str, str], inertia: Array) -> None:
    """Give a link a mass, the place of its centre, and an inertia matrix about it, shape (3, 3)."""
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", {"xyz": "0 0 0", "rpy": "0 0 0", **origin})
    ElementTree.SubElement(inertial, "mass", {"value": repr(float(mass))})
    values = zip(SIX, inertia[np.triu_indices(3)], strict=True)
    ElementTree.SubElement(inertial, "inertia", {name: repr(float(value)) for name, value in values})
