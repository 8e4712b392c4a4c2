"""centauro.urdf: links, joints and shapes."""

from typing import Any
from xml.etree.ElementTree import Element, SubElement

from generator.entries import entries, opposite, text
from generator.shapes import add_shapes, mirror_shapes

INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def make_urdf(parameters: dict[str, Any], limits: str, right_shoulder: str) -> Element:
    """Make the URDF with one of the sets of limits and one of the right shoulders."""
    robot = Element("robot", name=parameters["name"])
    for name, colour in parameters["colours"].items():
        SubElement(SubElement(robot, "material", name=name), "color", rgba=text(colour))
    shapes = entries(parameters["shapes"], mirror_shapes)
    for name, link in entries(parameters["links"], _mirror_link).items():
        element = SubElement(robot, "link", name=name)
        if link:
            _add_inertial(element, link)
        add_shapes(element, shapes.get(name, []), parameters["wheel"])
    bounds, chosen = (entries(parameters["limits"][part]) for part in ("common", limits))
    shoulder = entries(parameters["right_shoulder"][right_shoulder])
    for name, joint in entries(parameters["joints"], _mirror_joint).items():
        limit = bounds.get(name, {}) | chosen.get(name, {})
        _add_joint(SubElement(robot, "joint", name=name), joint | shoulder.get(name, {}), limit)
    return robot


def _mirror_link(link: dict[str, Any]) -> dict[str, Any]:
    return {"mass": link["mass"], "com": opposite(link["com"], 1), "inertia": opposite(link["inertia"], 1, 4)}


def _mirror_joint(joint: dict[str, Any]) -> dict[str, Any]:
    mirrored = joint | {"xyz": opposite(joint["xyz"], 1)}
    return mirrored | {"rpy": opposite(joint["rpy"], 0, 2)} if "rpy" in joint else mirrored


def _add_inertial(element: Element, link: dict[str, Any]) -> None:
    inertial = SubElement(element, "inertial")
    SubElement(inertial, "origin", xyz=text(link["com"]))
    SubElement(inertial, "mass", value=text(link["mass"]))
    tensor = {name: text(value) for name, value in zip(INERTIA, link["inertia"], strict=True)}
    SubElement(inertial, "inertia", tensor)


def _add_joint(element: Element, joint: dict[str, Any], limit: dict[str, float]) -> None:
    element.set("type", joint["type"])
    SubElement(element, "parent", link=joint["parent"])
    SubElement(element, "child", link=joint["child"])
    zero = [0.0, 0.0, 0.0]
    SubElement(element, "origin", xyz=text(joint.get("xyz", zero)), rpy=text(joint.get("rpy", zero)))
    if "axis" in joint:
        SubElement(element, "axis", xyz=text(joint["axis"]))
        SubElement(element, "limit", {name: text(value) for name, value in limit.items()})
    if "dynamics" in joint:
        SubElement(element, "dynamics", {name: text(value) for name, value in joint["dynamics"].items()})
