"""A URDF in which every moving joint is one plain number, as Pinocchio has to read it."""

from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from solfer.errors import ModelError
from solfer.model.documents import parse
from solfer.model.urdf.description import Description

BASE_DOFS = ("x", "y", "z", "rx", "ry", "rz")
"""Names of the six DoFs of a floating base, in their order."""


def scalar_joints(description: Description, floating_base: bool | None = None) -> str:
    """Write the URDF with one number a DoF, without shapes.

    A floating base becomes three prismatic and three revolute joints, named BASE_DOFS, behind the origin of the
    floating joint; continuous joints become revolute ones (Pinocchio would store them as cosine and sine).

    Args:
        description: The robot.
        floating_base: Whether the base moves. True puts the six joints above the root if the URDF has no floating
            joint, False fixes a floating joint, None follows the URDF.

    Raises:
        ModelError: A joint of the URDF has the name of a base DoF.
    """
    robot = parse(description.text)
    for link in robot.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
    for joint in robot.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)  # what the followers move is folded into what the leader does
        if joint.get("type") == "continuous":
            _make_revolute(joint)
    floating = description.floating
    if floating is not None:
        element = next(joint for joint in robot.findall("joint") if joint.get("name") == floating.name)
        if floating_base is False:
            element.set("type", "fixed")
        else:
            robot.remove(element)
            _add_base(robot, description, floating.parent, child=floating.child, origin=element.find("origin"))
    elif floating_base:
        world = _free_name("world", description)
        SubElement(robot, "link", name=world)
        _add_base(robot, description, world, child=description.root, origin=None)
    return ElementTree.tostring(robot, encoding="unicode")


def _add_base(robot: Element, description: Description, parent: str, child: str, origin: Element | None) -> None:
    clashes = [name for name in BASE_DOFS if name in description.joints]
    if clashes:
        raise ModelError(
            f"joints with the name of a DoF of the base: {', '.join(clashes)}",
            where=description.where,
            expected=f"other names than {', '.join(BASE_DOFS)}",
        )
    axes = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    for name in BASE_DOFS:
        joint = SubElement(robot, "joint", name=name, type="revolute" if name.startswith("r") else "prismatic")
        SubElement(joint, "parent", link=parent)
        if name == BASE_DOFS[-1]:
            parent = child
        else:
            parent = _free_name(f"base_{name}", description)
            SubElement(robot, "link", name=parent)
        SubElement(joint, "child", link=parent)
        SubElement(joint, "axis", xyz=axes[name[-1]])
        _set_unlimited(joint)
        if origin is not None:
            joint.append(origin)
            origin = None


def _make_revolute(joint: Element) -> None:
    joint.set("type", "revolute")
    for limit in joint.findall("limit"):
        joint.remove(limit)
    _set_unlimited(joint)


def _set_unlimited(joint: Element) -> None:
    """Add wide limits that the parser requires; the true limits are the Description's."""
    SubElement(joint, "limit", lower="-1e12", upper="1e12", velocity="1e12", effort="1e12")


def _free_name(name: str, description: Description) -> str:
    while name in description.links:
        name += "_"
    return name
