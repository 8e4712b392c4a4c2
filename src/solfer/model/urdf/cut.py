"""A robot cut in two at a link, so that each part can be controlled as a robot of its own."""

from collections.abc import Callable
from xml.etree import ElementTree

from solfer.errors import ModelError
from solfer.model.documents import parse
from solfer.model.urdf.description import Description


def cut(description: Description, link: str, keep: str) -> str:
    """Write the URDF of one part of a robot that is cut at the joint that carries `link`.

    Args:
        description: The whole robot.
        link: The link above the cut.
        keep: "upper" keeps `link` and all that it carries, on the parent link of its joint, which becomes the fixed
            root and has neither mass nor shape; "lower" keeps everything else, floating base included.

    Returns:
        A URDF. Elements other than links and joints stay if they name nothing that was cut off. A joint that follows
        one that was cut off moves on its own.

    Raises:
        UnknownName: There is no such link.
        ModelError: The link is the root of the robot, or `keep` is neither "upper" nor "lower".
    """
    if keep not in ("upper", "lower"):
        raise ModelError(f"no part is called '{keep}'", expected="upper or lower")
    joint = description.link(link).parent
    if joint is None:
        raise ModelError(
            "no joint carries the root of the robot, so it cannot be cut there",
            where=f"{description.where}: link '{link}'",
            expected="a link below the root",
        )
    upper = set(description.subtree(link))
    root = description.joints[joint].parent
    robot = parse(description.text)
    kept = upper | {root} if keep == "upper" else set(description.links) - upper
    _remove(robot, description, kept)
    _free_followers(robot)
    if keep == "upper":
        # without mass and shapes
        element = next(element for element in robot.findall("link") if element.get("name") == root)
        element.clear()
        element.set("name", root)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode") + "\n"


def _remove(robot: ElementTree.Element, description: Description, kept: set[str]) -> None:
    """Remove every element that belongs to a link or joint that is not kept."""
    links = set(description.links) - kept
    joints = {joint.name for joint in description.joints.values() if not kept.issuperset((joint.parent, joint.child))}
    belongs: dict[str, Callable[[ElementTree.Element], bool]] = {
        "link": lambda element: element.get("name") in links,
        "joint": lambda element: element.get("name") in joints,
    }
    for element in list(robot):
        gone = belongs.get(element.tag, lambda element: _names_any(element, links | joints))
        if gone(element):
            robot.remove(element)


def _names_any(element: ElementTree.Element, names: set[str]) -> bool:
    """Return whether an extension (`<gazebo reference>`, `<transmission>` with its joints) names one of `names`."""
    if element.get("reference") in names:
        return True
    return any(child.get("name") in names for child in element.iter() if child.tag in ("link", "joint"))


def _free_followers(robot: ElementTree.Element) -> None:
    """Let joints whose leader was cut off move on their own."""
    joints = {joint.get("name") for joint in robot.findall("joint")}
    for joint in robot.findall("joint"):
        for mimic in joint.findall("mimic"):
            if mimic.get("joint") not in joints:
                joint.remove(mimic)
