"""Description of a robot by its URDF: its links, its joints, and the tree that they make."""

import logging
from collections import Counter
from collections.abc import Callable, Container, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from solfer.errors import ModelError, SolferError, UnknownName, raise_all
from solfer.model.documents import parse, parse_robot, read_text
from solfer.model.urdf.elements import JOINT_TYPES, ElementReader, JointInfo, LinkInfo, Mimic, read_joint, read_link

logger = logging.getLogger(__name__)

__all__ = ["JOINT_TYPES", "Description", "JointInfo", "LinkInfo"]


class Description:
    """A robot's URDF, read and checked. Links and joints keep the order of the file; the two have separate names.

    Attributes:
        name: Name of the robot.
        text: The URDF itself.
        where: Origin of the text, for errors.
        links: Links by name.
        joints: Joints by name.
        root: Name of the link that no joint carries.
        floating: The joint of type `floating`, None on a robot with a fixed base.
        mimics: Joints that follow others by name, each with the joint at the end of the chain, which does not.
    """

    def __init__(self, text: str, where: str, element: ElementTree.Element):
        faults: list[SolferError] = []
        self.name = element.get("name", "")
        self.text = text
        self.where = where
        if not self.name:
            faults.append(ModelError("the robot has no name", where=where, expected='<robot name="...">'))
        self.links: dict[str, LinkInfo] = _read_all(element, "link", read_link, where=where, faults=faults)
        self.joints: dict[str, JointInfo] = _read_all(element, "joint", read_joint, where=where, faults=faults)
        if element.find("link") is None:
            faults.append(ModelError("the robot has no link", where=where, expected="at least one <link>"))
        wrong = list(self._wrong_links())
        faults += wrong or (self._wrong_tree() if self._complete(element) else [])
        raise_all(faults)
        self.root = next(name for name, link in self.links.items() if link.parent is None)
        self.floating = next((joint for joint in self.joints.values() if joint.type == "floating"), None)
        self.mimics: dict[str, Mimic] = {}
        for name, joint in self.joints.items():
            if joint.mimic is not None:
                faults += self._lead(name, joint.mimic)
        raise_all(faults)

    @classmethod
    def from_file(cls, path: str | Path) -> "Description":
        """Read a URDF file.

        Raises:
            ModelError: The file cannot be read, or see `from_text`.
        """
        return cls.from_text(read_text(path, "URDF"), where=str(path))

    @classmethod
    def from_text(cls, text: str, where: str = "URDF") -> "Description":
        """Read the text of a URDF; `where` names it in errors.

        Raises:
            ModelError: It is not XML, not a robot, or its links and joints contradict the URDF specification, are not a
                tree, or are of a kind that is not supported (planar). Several faults are reported at once.
            UnknownName: A joint names a type or a link that does not exist.
        """
        text, element = parse_robot(text, where, "URDF")
        return cls(text, where, element)

    def with_base(self, floating: bool | None) -> "Description":
        """Return the robot with a base that floats or is fixed; None: as it is."""
        if floating is None or floating == (self.floating is not None):
            return self
        robot = parse(self.text)
        if self.floating is not None:
            next(each for each in robot.findall("joint") if each.get("name") == self.floating.name).set("type", "fixed")
        else:
            world = _free("world", self.links)
            ElementTree.SubElement(robot, "link", name=world)
            joint = ElementTree.SubElement(robot, "joint", name=_free("floating_base", self.joints), type="floating")
            ElementTree.SubElement(joint, "parent", link=world)
            ElementTree.SubElement(joint, "child", link=self.root)
        return Description.from_text(ElementTree.tostring(robot, encoding="unicode"), self.where)

    @property
    def moving_joints(self) -> tuple[JointInfo, ...]:
        """Joints of one DoF, in the order of the file."""
        return tuple(joint for joint in self.joints.values() if joint.moving)

    def link(self, name: str, where: str = "") -> LinkInfo:
        """Return the link `name`; an UnknownName at `where` (default: this description) if there is none."""
        if name not in self.links:
            raise UnknownName("link", name, self.links, where=where or self.where)
        return self.links[name]

    def joint(self, name: str, where: str = "") -> JointInfo:
        """Return the joint `name`; an UnknownName at `where` (default: this description) if there is none."""
        if name not in self.joints:
            raise UnknownName("joint", name, self.joints, where=where or self.where)
        return self.joints[name]

    def subtree(self, link: str) -> tuple[str, ...]:
        """Return `link` and all links that it carries, parents before children.

        Raises:
            UnknownName: There is no such link.
        """
        self.link(link)
        found = [link]
        for name in found:  # grows while it is walked
            found += [self.joints[joint].child for joint in self.links[name].children]
        return tuple(found)

    def _lead(self, name: str, mimic: Mimic) -> list[SolferError]:
        """Find the joint at the end of the chain that a joint follows; return the reason why it cannot move so."""
        where = self.joints[name].where
        followed = [name]
        while mimic is not None:
            if mimic.joint not in self.joints:
                if len(followed) == 1:
                    logger.warning("%s follows '%s', which is no joint here: it moves on its own", where, mimic.joint)
                return []
            if mimic.joint in followed:
                return [
                    ModelError(
                        f"the joint follows itself: {', '.join((*followed, mimic.joint))}",
                        where=where,
                        expected="a leader that follows none of them",
                    )
                ]
            if not self.joints[mimic.joint].moving:
                return [
                    ModelError(
                        f"the joint follows '{mimic.joint}', which does not move",
                        where=where,
                        expected="a moving joint",
                    )
                ]
            self.mimics[name] = mimic
            followed.append(mimic.joint)
            above = self.joints[mimic.joint].mimic
            if above is None:
                return []
            ratio = mimic.multiplier
            offset = mimic.offset
            mimic = Mimic(above.joint, ratio * above.multiplier, ratio * above.offset + offset)
        return []

    def _wrong_links(self) -> Iterator[SolferError]:
        """Yield errors for joints with a missing link, and for links with two parents."""
        for joint in self.joints.values():
            for end in (joint.parent, joint.child):
                if end and end not in self.links:
                    yield UnknownName("link", end, self.links, where=joint.where)
        for link, count in Counter(joint.child for joint in self.joints.values()).items():
            if link in self.links and count > 1:
                joints = ", ".join(joint.name for joint in self.joints.values() if joint.child == link)
                yield ModelError(
                    f"{count} joints carry the link: {joints}",
                    where=self.links[link].where,
                    expected="one joint",
                )

    def _complete(self, element: ElementTree.Element) -> bool:
        """Return whether all joints and their links were found; without one of them the tree would seem wrong, too."""
        found = (len(self.links), len(self.joints)) == (len(element.findall("link")), len(element.findall("joint")))
        return found and all(joint.parent in self.links and joint.child in self.links for joint in self.joints.values())

    def _connect(self) -> None:
        children: dict[str, list[str]] = {name: [] for name in self.links}
        parent: dict[str, str] = {}
        for joint in self.joints.values():
            children[joint.parent].append(joint.name)
            parent[joint.child] = joint.name
        self.links = {
            name: replace(link, parent=parent.get(name), children=tuple(children[name]))
            for name, link in self.links.items()
        }

    def _wrong_tree(self) -> list[SolferError]:
        """Connect links and joints; return what keeps them from being one tree with at most one floating base."""
        self._connect()
        roots = [name for name, link in self.links.items() if link.parent is None]
        faults: list[SolferError] = []
        if len(roots) > 1:
            faults.append(
                ModelError(
                    f"{len(roots)} links have no parent: {', '.join(roots)}", where=self.where, expected="one root"
                )
            )
        reached = {name for root in roots for name in self.subtree(root)}
        loop = [name for name in self.links if name not in reached]
        if loop:
            faults.append(
                ModelError(
                    f"the joints make a loop through the links {', '.join(loop)}", where=self.where, expected="a tree"
                )
            )
        return faults if faults else self._wrong_base()

    def _wrong_base(self) -> list[SolferError]:
        floating = [joint for joint in self.joints.values() if joint.type == "floating"]
        if len(floating) > 1:
            return [
                ModelError(
                    f"{len(floating)} floating joints: {', '.join(joint.name for joint in floating)}",
                    where=self.where,
                    expected="at most one",
                )
            ]
        above = self.links[floating[0].parent].parent if floating else None
        while above is not None:
            if self.joints[above].moving:
                return [
                    ModelError(
                        f"the floating joint hangs on the moving joint '{above}'",
                        where=floating[0].where,
                        expected="a base that floats",
                    )
                ]
            above = self.links[self.joints[above].parent].parent
        return []


def _free(name: str, used: Container[str]) -> str:
    while name in used:
        name += "_"
    return name


def _read_all(
    robot: ElementTree.Element, tag: str, read: Callable[..., Any], where: str, faults: list[SolferError]
) -> dict[str, Any]:
    """Read all elements `tag` by name."""
    found: dict[str, Any] = {}
    for count, element in enumerate(robot.findall(tag), start=1):
        name = element.get("name")
        reader = ElementReader(element, where, f"{tag} '{name}'" if name else tag, faults=faults)
        if not name:
            faults.append(
                ModelError(f"<{tag}> number {count} has no name", where=reader.where(), expected=f'<{tag} name="...">')
            )
        elif name in found:
            faults.append(
                ModelError(
                    f"the name stands at two {tag}s",
                    where=reader.where(),
                    expected=f"a name of its own for each {tag}",
                )
            )
        else:
            found[name] = read(reader)
    return found
