"""A robot's file with other parameters."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import mujoco
import numpy as np
import numpy.typing as npt

from idbench.identify.basis.block import named
from idbench.sim.errors import RobotError
from idbench.sim.robot.dh import TABLE
from idbench.sim.robot.motors import Array
from idbench.sim.robot.mounting import PLAIN, Mounting, drop_ties, hold_bases
from idbench.sim.robot.payload import without_missing_meshes
from idbench.sim.robot.placed import Body
from idbench.sim.robot.robot import Robot
from idbench.sim.robot.tree import kinematic_tree, standard_parameters

ROUNDING = 1e-9  # Share of the largest parameter by which those of the compiled file may differ from what was written into it

Values = Mapping[str, float]

DRIVE = {"Ia": "armature", "Fv": "damping", "Fs": "frictionloss", "K": "stiffness"}
"""Letters of the parameters of a drive, and the attributes of MJCF for them."""


def rewritten(name: str, standard: Values, folder: Path | None = None, mounting: Mounting = PLAIN) -> str:
    """Return the file of a robot as MJCF, with other standard parameters.

    The inertia of a link stands at the body that its joint moves; bodies that are welded to it become massless. Everything
    else, comments included, stays as it is; files that the file includes are put in their places.

    Parameters
    ----------
    name : str
        Name of a robot that ships, or path of its file.
    standard : mapping of str to float
        Values by the names that `idbench.sim.robot.tree.standard_parameters` gives; those that it leaves out stay.
    folder : Path, optional
        Where it will be written, so that it finds its meshes; by default where the file of the robot is.
    mounting : Mounting, optional
        How it is mounted, and which of its joints move: the others are welded in what is written.

    Raises
    ------
    RobotError
        If a link with these parameters cannot exist, or the model does not compile to them.
    """
    robot = Robot.load(name, mounting.edit)
    known = standard_parameters(robot)
    wanted = {**known, **{key: value for key, value in standard.items() if key in known}}
    root = _document(name, mounting)
    _require_alike(robot, root)
    for compiler in root.iter("compiler"):
        compiler.attrib.pop("inertiafromgeom", None)  # bodies keep what they are given
    bodies, joints = _elements(root)
    _set_tendons(robot, root, wanted)
    for j, joint in enumerate(joints):
        for letters, attribute in DRIVE.items():
            if named(letters, j) in wanted:
                joint.set(attribute, repr(float(wanted[named(letters, j)])))
        if (body := Body.of(wanted, j)) is not None:
            _set_link(robot, bodies, j, body)
    text, made = _finished(name, root, folder)
    _require_same(name, made, wanted)
    return text


def with_body(name: str, body: str, values: Array, folder: Path | None = None, mounting: Mounting = PLAIN) -> str:
    """Return the file of a robot as MJCF, with one more body, bolted to the link of its last joint.

    Parameters
    ----------
    name : str
        Name of a robot that ships, or path of its file.
    body : str
        What to call it.
    values : Array, shape (10,)
        Its inertia matrix XX XY XZ YY YZ ZZ about the origin of the link's frame, first moments and mass.
    folder, mounting
        As for `rewritten`.

    Raises
    ------
    RobotError
        If the robot has a body of this name, or the file does not compile.
    """
    robot, root = Robot.load(name, mounting.edit), _document(name, mounting)
    _require_alike(robot, root)
    if any(element.get("name") == body for element in root.iter("body")):
        raise RobotError(f"the file of robot {robot.name!r} has a body {body!r} already")
    link = _elements(root)[0][int(robot.model.jnt_bodyid[robot.n - 1])]
    _give(ElementTree.SubElement(link, "body", {"name": body}), Body.with_values(values.tolist()))
    return _finished(name, root, folder)[0]


def _finished(name: str, root: ElementTree.Element, folder: Path | None) -> tuple[str, Robot]:
    """Return the text of a robot's file that was changed, for a folder, and the robot that it compiles to."""
    home = Robot.path(name).absolute().parent
    if folder is not None:
        _relocate(root, home, folder)
    text = ElementTree.tostring(root, encoding="unicode")
    text = text if _made(Robot.path(name)) else _around(name, text)
    return text, compiled(name, text, folder or home)


def compiled(name: str, text: str, folder: Path | None = None) -> Robot:
    """Return the robot of a text that stands for the file of a robot; raise RobotError if it does not compile.

    Meshes are looked for from `folder`, by default that of the robot's file.
    """
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.modelfiledir = str(folder or Robot.path(name).parent)
        without_missing_meshes(spec, Path(spec.modelfiledir))
        _ = list(hold_bases(spec))
        return Robot(Path(name).stem, spec.compile())
    except ValueError as error:
        raise RobotError(f"MuJoCo cannot compile {name!r} with these parameters: {' '.join(str(error).split())}") from error


def _around(name: str, text: str) -> str:
    """Return a text with what stands before and after the element of the robot in its file: licences, as a rule."""
    raw = Robot.path(name).read_bytes()
    parser = expat.ParserCreate()
    starts, ends = list[int](), [0]
    parser.StartElementHandler = lambda *_: starts.append(parser.CurrentByteIndex)
    parser.EndElementHandler = lambda *_: ends.append(parser.CurrentByteIndex)
    parser.Parse(raw, True)
    before, after = raw[: starts[0]], raw[raw.index(b">", ends[-1]) + 1 :]
    return before.decode() + text + (after.decode() or "\n")


def _relocate(root: ElementTree.Element, old: Path, new: Path) -> None:
    """Let a file in another folder find the meshes and textures of this one."""
    assets = [asset for assets in root.iter("asset") for asset in assets if any(key.startswith("file") for key in asset.attrib)]
    if not assets or old == new:
        return
    if not (compilers := root.findall("compiler")):
        compilers = [ElementTree.Element("compiler")]
        root.insert(0, compilers[0])
    settings: dict[str, str] = {}
    for compiler in compilers:  # the last that says it holds
        settings |= {key: compiler.attrib.pop(key) for key in ("assetdir", "meshdir", "texturedir") if key in compiler.attrib}
    for attribute in ("meshdir", "texturedir"):
        compilers[0].set(attribute, os.path.relpath(old / settings.get(attribute, settings.get("assetdir", "")), new))


def _document(name: str, mounting: Mounting) -> ElementTree.Element:
    """Return a robot's file as MJCF, its inclusions in their places."""
    path = Robot.path(name)
    if _made(path) or not mounting.plain:
        spec, _ = Robot.described(name)
        mounting.edit(spec)
        _ = list(drop_ties(spec))
        spec.compile()
        return ElementTree.fromstring(spec.to_xml())
    root = _parsed(path)
    while any(child.tag == "include" for parent in root.iter() for child in parent):
        for parent in list(root.iter()):
            for child in [child for child in parent if child.tag == "include"]:
                place = list(parent).index(child)
                parent.remove(child)
                for k, included in enumerate(_parsed(path.parent / child.get("file", ""))):
                    parent.insert(place + k, included)
    return root


def _made(path: Path) -> bool:
    """True if a file is none of MJCF, which is made of it."""
    return path.suffix == TABLE or "<robot" in path.read_text(encoding="utf-8")


def _parsed(path: Path) -> ElementTree.Element:
    try:
        builder = ElementTree.TreeBuilder(insert_comments=True)
        return ElementTree.fromstring(path.read_text(encoding="utf-8"), ElementTree.XMLParser(target=builder))
    except (OSError, ElementTree.ParseError) as error:
        raise RobotError(f"cannot read {path}: {error}") from error


def _elements(root: ElementTree.Element) -> tuple[list[ElementTree.Element], list[ElementTree.Element]]:
    """Return the elements of bodies, with the world's at 0, and of joints, by their numbers in the model."""
    worlds = [world for world in root if world.tag == "worldbody"]
    bodies = [body for world in worlds for body in world.iter("body")]
    joints = (joint for world in worlds for joint in world.iter("joint"))
    return [worlds[0], *bodies], [joint for joint in joints if joint.get("type") != "free"]


def _require_alike(robot: Robot, root: ElementTree.Element) -> None:
    """Raise RobotError unless the elements of a file are the bodies and joints of the model, one by one."""
    model, (bodies, joints) = robot.model, _elements(root)
    written = [body.get("name", "") for body in bodies[1:]], [joint.get("name", "") for joint in joints]
    compiled = [model.body(b).name for b in range(1, model.nbody)], [model.joint(j).name for j in range(robot.n)]
    if written != compiled:
        raise RobotError(
            f"the file of robot {robot.name!r} makes its bodies by replicate, attach or composite: write it out flat first "
            "(mujoco.MjSpec.from_file(...).to_xml() does)"
        )


def _set_tendons(robot: Robot, root: ElementTree.Element, wanted: Values) -> None:
    """Give drives that turn with several joints their rotors, frictions and springs."""
    known = {f"{letters}_{coupling.name}" for coupling in kinematic_tree(robot).couplings for letters in DRIVE}
    for tendon in [fixed for tendons in root.iter("tendon") for fixed in tendons if fixed.tag == "fixed"]:
        for letters, attribute in DRIVE.items():
            name = f"{letters}_{tendon.get('name', '')}"
            if name in wanted and (name in known or wanted[name]):
                tendon.set(attribute, repr(float(wanted[name])))


def _set_link(robot: Robot, bodies: list[ElementTree.Element], joint: int, whole: Body) -> None:
    """Give a link its mass, centre of mass and inertia, and the bodies welded to it none."""
    model, link = robot.model, int(robot.model.jnt_bodyid[joint])
    inertia = whole.inertia
    if whole.mass <= 0 or np.linalg.eigvalsh(np.trace(inertia) / 2 * np.eye(3) - inertia)[0] < 0:
        raise RobotError(f"link {joint + 1} with a mass of {whole.mass:.4g} kg and this inertia is not physically consistent")
    for body in range(link, model.nbody):
        if model.body_weldid[body] == link:
            _give(bodies[body], whole if body == link else replace(whole, mass=0.0))


def _give(element: ElementTree.Element, body: Body) -> None:
    for old in element.findall("inertial"):
        element.remove(old)
    I = body.inertia  # noqa: E741
    kind = {"fullinertia": _numbers([*np.diagonal(I), I[0, 1], I[0, 2], I[1, 2]])} if body.mass else {"diaginertia": "0 0 0"}
    made = ElementTree.Element("inertial", {"pos": _numbers(body.centre), "mass": repr(body.mass), **kind})
    made.tail = element.text
    element.insert(0, made)


def _numbers(values: npt.ArrayLike) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values))


def _require_same(name: str, made: Robot, wanted: Values) -> None:
    """Raise RobotError if a robot does not have the parameters that were written into its file."""
    found = standard_parameters(made)
    largest = max(abs(value) for value in wanted.values())
    for key, value in wanted.items():
        if not abs(found[key] - value) <= ROUNDING * largest:
            raise RobotError(
                f"robot {name!r} compiles to {key} = {found[key]:.6g} instead of {value:.6g}: does its file bound or balance "
                "inertias (boundmass, boundinertia, balanceinertia, settotalmass)?"
            )
