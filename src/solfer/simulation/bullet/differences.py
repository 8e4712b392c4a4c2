"""What PyBullet made of a URDF: what differs from the text is named, not left out in silence."""

import logging
import math
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from solfer.simulation.bullet.client import BulletClient

logger = logging.getLogger(__name__)


def warn_of_differences(client: BulletClient, body: int, text: str, where: str) -> None:
    """Log by which masses, collision shapes, joints and limits a body differs from its URDF, in one message.

    Args:
        client: The world.
        body: Number of the body.
        text: The URDF that PyBullet was given.
        where: The robot's own URDF, for the message.
    """
    found = list(differences(client, body, text))
    if found:
        more = f"; and {len(found) - 8} more" if len(found) > 8 else ""
        logger.warning("%s: the simulation differs from it: %s%s", where, "; ".join(found[:8]), more)


def differences(client: BulletClient, body: int, text: str) -> Iterator[str]:
    """Yield what differs between a body and the URDF that PyBullet was given, one link or joint each."""
    bullet = client.bullet
    robot = ElementTree.fromstring(text)
    infos = [bullet.getJointInfo(body, index) for index in range(bullet.getNumJoints(body))]
    numbers = {bullet.getBodyInfo(body)[0].decode(): -1} | {info[12].decode(): info[0] for info in infos}
    for link in robot.findall("link"):
        name = link.get("name", "")
        if name not in numbers:
            yield f"link '{name}' is not there"
            continue
        mass = float(link.find("inertial/mass").get("value"))  # type: ignore[union-attr, arg-type]
        has = bullet.getDynamicsInfo(body, numbers[name])[0]
        # a fixed base weighs nothing for PyBullet
        if not _equal(mass, has) and not (numbers[name] == -1 and has == 0.0):
            yield f"link '{name}': mass {has:g} instead of {mass:g} kg"
        yield from _shapes(name, link, bullet.getCollisionShapeData(body, numbers[name]))
    by_name = {info[1].decode(): info for info in infos}
    for joint in robot.findall("joint"):
        yield from _joint(joint, by_name)


def _shapes(name: str, link: Element, made: tuple[Any, ...]) -> Iterator[str]:
    shapes = [shape.find("geometry/*") for shape in link.findall("collision")]
    if len(made) != len(shapes):
        files = [shape.get("filename") for shape in shapes if shape is not None and shape.tag == "mesh"]
        meshes = f", of the meshes {', '.join(map(str, files))}" if files else ""
        yield f"link '{name}': {len(made)} of {len(shapes)} collision shapes{meshes}"
        return
    # attributes of shapes, in PyBullet's order
    attributes = {"box": "size", "sphere": "radius", "cylinder": "length radius", "capsule": "length radius"}
    for shape, one in zip(shapes, made, strict=True):
        if shape is not None and shape.tag in attributes:
            sizes = [float(word) for key in attributes[shape.tag].split() for word in shape.get(key, "").split()]
            if not all(map(_equal, sizes, one[3])):
                yield f"link '{name}': {shape.tag} of the size {_listed(one[3])} instead of {_listed(sizes)}"


def _joint(joint: Element, infos: dict[str, tuple[Any, ...]]) -> Iterator[str]:
    name = joint.get("name", "")
    limit = joint.find("limit")
    if name not in infos:
        yield f"joint '{name}' is not there"
    elif limit is not None and joint.get("type") != "continuous":
        for key, has in zip(("lower", "upper", "effort", "velocity"), infos[name][8:12], strict=True):
            if key in limit.keys() and not _equal(float(limit.get(key, "")), has):
                yield f"joint '{name}': {key} limit {has:g} instead of {limit.get(key)}"


def _equal(one: float, other: float) -> bool:
    # PyBullet keeps some numbers with single precision
    return math.isclose(one, other, rel_tol=1e-4, abs_tol=1e-9)


def _listed(values: Any) -> str:
    return " ".join(f"{value:g}" for value in values)
