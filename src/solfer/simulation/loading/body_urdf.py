"""The URDF that an engine gets: links that cannot move against each other are one link.

PyBullet gives a link without `<inertial>` the mass 1 kg, and engines simulate fixed links at the price of moving ones.
"""

import copy
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from solfer.model.documents import parse
from solfer.model.urdf.description import Description, JointInfo, LinkInfo
from solfer.numerics.rotations import rotation_from_rpy
from solfer.simulation.loading.inertia import Inertias
from solfer.simulation.loading.meshes import Meshes, MeshReader


@dataclass(frozen=True)
class Transform:
    """A frame in another one: `rotation` (3, 3) and `translation` (3,) [m] map its coordinates to the other's."""

    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def from_rpy(cls, xyz: tuple[float, ...], rpy: tuple[float, ...]) -> "Transform":
        """Make the placement of a URDF origin: roll, pitch, yaw about fixed axes [rad]."""
        return cls(rotation_from_rpy(rpy), np.array(xyz, dtype=float))

    def __matmul__(self, inner: "Transform") -> "Transform":
        return Transform(self.rotation @ inner.rotation, self.translation + self.rotation @ inner.translation)

    def origin(self) -> dict[str, str]:
        """Format the attributes of a URDF `<origin>`."""
        return {"xyz": text_of(self.translation), "rpy": text_of(_rpy(self.rotation))}


@dataclass(frozen=True)
class BodyUrdf:
    """A URDF for an engine.

    Attributes:
        text: The URDF.
        base: Link that is the engine's base.
        owner: For each link of the description, the link of the text that it became part of.
    """

    text: str
    base: str
    owner: dict[str, str]


def body_urdf(description: Description, floating: bool, folder: Path, reader: MeshReader) -> BodyUrdf:
    """Lump all fixed links of a robot, with exact inertia; one that no body has is repaired with a warning.

    Args:
        description: The robot.
        floating: Whether its base floats: a floating joint and what lies above it are dropped. Else a floating joint
            counts as fixed.
        folder: Folder for meshes that have to be written in another format; the URDF names them there.
        reader: The engine that reads the meshes.

    Raises:
        SimulationError: A collision shape's mesh is missing.
    """
    base = description.floating.child if floating and description.floating else description.root
    members = _members(description, base)
    owner = {link: own for own, links in members.items() for link in links}
    robot = Element("robot", name=description.name)
    robot.extend(parse(description.text).findall("material"))
    meshes = Meshes(description.where, folder, reader)
    inertias = Inertias(description.where)
    for own, links in members.items():
        link = _link(description, own, links, inertias=inertias)
        for name, place in links.items():
            where = f"{description.where}: link '{name}'"
            shapes = [each for each in description.links[name].shapes if reader.draws or each.tag == "collision"]
            moved = (_shape(shape, place) for shape in shapes)
            link.extend(
                [shape for shape in moved if meshes.resolve(shape, where)]
            )  # `extend` hides errors of iterators
        robot.append(link)
    meshes.warn()
    inertias.warn()
    for joint in description.moving_joints:
        if joint.parent in owner:
            parent = owner[joint.parent]
            robot.append(_joint(joint, parent, members[parent][joint.parent]))
    ElementTree.indent(robot)  # PyBullet loses characters of lines that are longer than 8 kB
    return BodyUrdf(ElementTree.tostring(robot, encoding="unicode"), base, owner)


def _members(description: Description, base: str) -> dict[str, dict[str, Transform]]:
    """Find the links fixed to the base and to each link behind a moving joint (itself first), and where they are."""
    members: dict[str, dict[str, Transform]] = {base: {base: Transform()}}
    owner = {base: base}
    for name in description.subtree(base)[1:]:
        joint = description.joints[description.links[name].parent]
        if joint.moving:
            owner[name], members[name] = name, {name: Transform()}
        else:
            own = owner[name] = owner[joint.parent]
            members[own][name] = members[own][joint.parent] @ Transform.from_rpy(joint.xyz, joint.rpy)
    return members


def _link(description: Description, own: str, members: dict[str, Transform], inertias: Inertias) -> Element:
    """Make a link with the inertia of all its members, without shapes."""
    link = Element("link", name=own)
    mass, com, inertia = _lump([(description.links[name], place) for name, place in members.items()])
    link.append(inertial(mass, com, inertias.physical(own, mass, inertia) if mass > 0.0 else inertia))
    return link


def _lump(parts: list[tuple[LinkInfo, Transform]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Lump links: mass [kg], centre of mass [m] and inertia about it [kg m^2], in the axes of the first.

    Source: parallel axis theorem, I = sum R I_k R^T + m_k (d^T d 1 - d d^T), with d from the common centre of mass.
    """
    bodies = [(link, place) for link, place in parts if link.mass]
    mass = sum(link.mass for link, _ in bodies)
    coms = [place.translation + place.rotation @ np.array(link.com) for link, place in bodies]
    com = sum((link.mass * c for (link, _), c in zip(bodies, coms, strict=True)), np.zeros(3)) / (mass or 1.0)
    inertia = np.zeros((3, 3))
    for (link, place), centre in zip(bodies, coms, strict=True):
        rotation = place.rotation @ rotation_from_rpy(link.inertia_rpy)
        away = centre - com
        ixx, ixy, ixz, iyy, iyz, izz = link.inertia
        inertia += rotation @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ rotation.T
        inertia += link.mass * (away @ away * np.eye(3) - np.outer(away, away))
    return mass, com, inertia


def inertial(mass: float, com: np.ndarray, inertia: np.ndarray) -> Element:
    """Make an `<inertial>`: mass [kg], centre (3,) [m], inertia about it (3, 3) [kg m^2] in the axes of the link."""
    element = Element("inertial")
    SubElement(element, "origin", xyz=text_of(com), rpy="0 0 0")
    SubElement(element, "mass", value=repr(float(mass)))
    upper = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    SubElement(element, "inertia", {name: repr(float(inertia[at])) for name, at in zip(names, upper, strict=True)})
    return element


def _shape(shape: Element, place: Transform) -> Element:
    """Move a visual or collision element into the frame of the link that it becomes part of."""
    moved = copy.deepcopy(shape)
    origin = moved.find("origin")
    if origin is None:
        origin = SubElement(moved, "origin")
    inner = Transform.from_rpy(_numbers(origin.get("xyz")), _numbers(origin.get("rpy")))
    for key, value in (place @ inner).origin().items():
        origin.set(key, value)
    for material in moved.iter("material"):
        if not material.get("name"):  # for PyBullet an error; equal names are of equal colours
            colour = material.find("color")
            material.set("name", "nameless" if colour is None else f"rgba {colour.get('rgba')}")
    return moved


def _joint(joint: JointInfo, parent: str, place: Transform) -> Element:
    element = Element("joint", name=joint.name, type=joint.type)
    SubElement(element, "parent", link=parent)
    SubElement(element, "child", link=joint.child)
    SubElement(element, "origin", (place @ Transform.from_rpy(joint.xyz, joint.rpy)).origin())
    SubElement(element, "axis", xyz=text_of(joint.axis))
    limits = {name: getattr(joint, name) for name in ("lower", "upper", "effort", "velocity")}
    SubElement(element, "limit", {name: repr(float(value)) for name, value in limits.items() if value is not None})
    return element


def _rpy(rotation: np.ndarray) -> tuple[float, float, float]:
    """Compute roll, pitch, yaw [rad] of Rz(yaw) Ry(pitch) Rx(roll); yaw is 0 if only its sum with roll is defined.

    Roll is what the yaw leaves, so that both are exact together where each of them is not, near a pitch of 90 degrees.
    """
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    yaw = math.atan2(rotation[1, 0], rotation[0, 0]) if cosine >= 1e-9 else 0.0
    across = math.cos(yaw) * rotation[1] - math.sin(yaw) * rotation[0]
    return math.atan2(-across[2], across[1]), math.atan2(-rotation[2, 0], cosine), yaw


def _numbers(text: str | None) -> tuple[float, ...]:
    return tuple(float(word) for word in text.split()) if text else (0.0, 0.0, 0.0)


def text_of(values: Iterable[float]) -> str:
    """Format numbers as an attribute of XML, exactly."""
    return " ".join(repr(float(value) + 0.0) for value in values)  # no -0.0
