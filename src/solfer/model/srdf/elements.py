"""Elements of an SRDF, read against the models that it describes; what is wrong or not there is collected."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from solfer.errors import ModelError, SolferError, UnknownName
from solfer.model.urdf.description import Description

Models = Sequence[Description]
"""The robot itself, then other models of it: names that only these have are left out."""


@dataclass(frozen=True)
class Group:
    """Part of a robot.

    Attributes:
        name: Name of the group.
        joints: Names of its joints that move, the floating one included; each once, in the order of the SRDF, those of
            a chain from base to tip.
        links: Names of the links that its joints carry, fixed joints included, and of its `<link>` members, likewise.
    """

    name: str
    joints: tuple[str, ...] = ()
    links: tuple[str, ...] = ()


@dataclass(frozen=True)
class Findings:
    """What is not as it should be in an SRDF.

    Attributes:
        faults: What contradicts the grammar.
        left_out: What names something that the models do not have; collections of robots have many of these, and
            MoveIt and Pinocchio leave it out as well.
    """

    faults: list[SolferError] = field(default_factory=list)
    left_out: list[SolferError] = field(default_factory=list)

    def unknown(self, kind: str, name: str, known: Iterable[str], place: str) -> None:
        """Note an unknown name, once for all places that use it."""
        noted = (fault for fault in self.left_out if isinstance(fault, UnknownName))
        if not any((fault.kind, fault.name) == (kind, name) for fault in noted):
            self.left_out.append(UnknownName(kind, name, known, where=place))


def read_groups(robot: Element, models: Models, where: str, findings: Findings) -> dict[str, Group]:
    """Read all groups in the order of the file."""
    reader = _GroupReader(robot, models, where, findings=findings)
    return {name: reader.group(name) for name in reader.elements}


def read_states(robot: Element, models: Models, where: str, findings: Findings) -> dict[str, dict[str, float]]:
    """Read all named states: by name, and by group and name where groups contradict each other; see `Semantics`."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    faults = findings.faults
    groups = [element.get("name", "") for element in robot.findall("group")]
    virtual = _virtual_joints(robot)
    for element in robot.findall("group_state"):
        name = element.get("name", "")
        group = element.get("group", "")
        place = f"{where}: group_state '{name}'"
        if not name:
            faults.append(
                ModelError("a group_state has no name", where=where, expected='<group_state name="..." group="...">')
            )
        if group not in groups:
            findings.unknown("group", group, groups, place)
        if group in found.setdefault(name, {}):
            faults.append(ModelError("the state stands twice", where=place, expected="a name that its group has once"))
        values = found[name][group] = {}
        for joint in element.findall("joint"):
            if joint.get("name") not in virtual:
                _read_value(joint, models, values, place=place, findings=findings)
    states: dict[str, dict[str, float]] = {}
    for name, by_group in found.items():
        states[name] = {joint: value for values in reversed(by_group.values()) for joint, value in values.items()}
        if any(states[name][joint] != value for values in by_group.values() for joint, value in values.items()):
            states |= {f"{group}/{name}": values for group, values in by_group.items()}
    return states


def read_apart(robot: Element, links: Iterable[str]) -> set[frozenset[str]]:
    """Read the pairs of links whose collisions do not count.

    A default of a link is weaker than `<enable_collisions>`, and that is weaker than `<disable_collisions>`, as in
    MoveIt.
    """
    links = set(links)
    coarse = {element.get("link", "") for element in robot.iter("disable_default_collisions")} & links
    apart = {frozenset((link, other)) for link in coarse for other in links if other != link}
    return (apart - _pairs(robot, "enable_collisions", links)) | _pairs(robot, "disable_collisions", links)


def _pairs(robot: Element, tag: str, links: set[str]) -> set[frozenset[str]]:
    pairs = (frozenset(pair.get(key, "") for key in ("link1", "link2")) for pair in robot.iter(tag))
    return {pair for pair in pairs if pair <= links}


def note_unknown_elements(robot: Element, where: str, findings: Findings) -> None:
    """Note elements of a robot that no SRDF has."""
    known = (
        "group",
        "group_state",
        "end_effector",
        "virtual_joint",
        "passive_joint",
        "joint_property",
        "disable_collisions",
        "enable_collisions",
        "disable_default_collisions",
        "link_sphere_approximation",
    )
    for element in robot:
        if element.tag not in known:
            findings.unknown("element", element.tag, known, f"{where}: robot")


def _read_value(joint: Element, models: Models, values: dict[str, float], place: str, findings: Findings) -> None:
    name = joint.get("name", "")
    text = joint.get("value", "")
    value = _number(text)
    faults = findings.faults
    if _places_robot(name, text, models):
        what = f"joint '{name}' has {len(text.split())} values, which place the robot in the world"
        findings.left_out.append(ModelError(what, where=place, expected="one value, of a joint that moves"))
    elif not any(name in model.joints for model in models):
        findings.unknown("joint", name, models[0].joints, place)
    elif name in values:
        faults.append(ModelError(f"joint '{name}' stands twice", where=place, expected="each joint once in a state"))
    elif value is None:
        faults.append(ModelError(f"value \"{text}\" of joint '{name}'", where=place, expected="a finite number"))
    elif name in models[0].joints:
        values[name] = value


def _places_robot(name: str, text: str, models: Models) -> bool:
    """Return whether it is the pose of a base: several numbers for a joint that is unknown or has not one DoF."""
    moving = any(name in model.joints and model.joints[name].moving for model in models)
    words = text.split()
    return len(words) > 1 and not moving and all(_number(word) is not None for word in words)


class _GroupReader:
    """Reads groups one by one, since a group may contain groups that follow it."""

    def __init__(self, robot: Element, models: Models, where: str, findings: Findings):
        self._models = models
        self._where = where
        self._findings = findings
        self._virtual = _virtual_joints(robot)
        self._groups: dict[str, Group] = {}
        self.elements: dict[str, Element] = {}
        for element in robot.findall("group"):
            name = element.get("name", "")
            if not name:
                findings.faults.append(ModelError("a group has no name", where=where, expected='<group name="...">'))
            elif name in self.elements:
                self._fault("the group stands twice", name)
            else:
                self.elements[name] = element

    def group(self, name: str, above: tuple[str, ...] = ()) -> Group:
        """Read the group `name`; `above` are the groups that are being read."""
        if name in self._groups:
            return self._groups[name]
        if name in above:
            self._fault(f"the group contains itself: {' > '.join((*above[above.index(name) :], name))}", name)
            return Group(name)
        joints: dict[str, None] = {}
        links: dict[str, None] = {}
        robot = self._models[0]
        for member in self.elements[name]:
            for joint, link in self._member(member, name, above):
                if joint in robot.joints and robot.joints[joint].type != "fixed":
                    joints[joint] = None
                if link in robot.links:
                    links[link] = None
        self._groups[name] = Group(name, tuple(joints), tuple(links))
        return self._groups[name]

    def _member(self, member: Element, group: str, above: tuple[str, ...]) -> Iterator[tuple[str | None, str | None]]:
        """Yield joints with the links that they carry, of one member of a group."""
        name = member.get("name", "")
        if member.tag == "joint":
            if name not in self._virtual and (model := self._model("joint", name, group)):
                yield name, model.joints[name].child
        elif member.tag == "link":
            if model := self._model("link", name, group):
                yield model.links[name].parent, name
        elif member.tag == "chain":
            yield from self._chain(member, group)
        elif member.tag != "group":
            what = f"unknown member <{member.tag}>"
            expected = "<joint>, <link>, <chain> or <group>"
            self._findings.left_out.append(ModelError(what, where=self._place(group), expected=expected))
        elif name not in self.elements:
            self._unknown("group", name, self.elements, group=group)
        else:
            nested = self.group(name, (*above, group))
            yield from ((joint, None) for joint in nested.joints)
            yield from ((None, link) for link in nested.links)

    def _chain(self, member: Element, group: str) -> list[tuple[str, str]]:
        """List joints from `base_link` to `tip_link` and the links that they carry, from the first model with both."""
        base, tip = (member.get(end, "") for end in ("base_link", "tip_link"))
        if not all([self._model("link", end, group) for end in (base, tip)]):
            return []
        candidates = [model for model in self._models if base in model.links and tip in model.links]
        if not candidates:
            return []
        path = _path(candidates[0], base, tip)
        if path is None:
            what = f"no chain leads from link '{base}' out to link '{tip}'"
            expected = "a tip that the base carries"
            self._findings.left_out.append(ModelError(what, where=self._place(group), expected=expected))
        return path or []

    def _model(self, kind: str, name: str, group: str) -> Description | None:
        """Find the first model that has the link or joint; None, and a note, if no model has it."""
        for model in self._models:
            if name in (model.links if kind == "link" else model.joints):
                return model
        robot = self._models[0]
        self._unknown(kind, name, robot.links if kind == "link" else robot.joints, group=group)
        return None

    def _fault(self, what: str, group: str, expected: str = "") -> None:
        self._findings.faults.append(ModelError(what, where=self._place(group), expected=expected))

    def _unknown(self, kind: str, name: str, known: dict, group: str) -> None:
        self._findings.unknown(kind, name, known, self._place(group))

    def _place(self, group: str) -> str:
        return f"{self._where}: group '{group}'"


def _path(model: Description, base: str, tip: str) -> list[tuple[str, str]] | None:
    """List joints from `base` to `tip` with the links that they carry; None if the base does not carry the tip."""
    path: list[tuple[str, str]] = []
    link = tip
    while link != base:
        joint = model.links[link].parent
        if joint is None:
            return None
        path.append((joint, link))
        link = model.joints[joint].parent
    return path[::-1]


def _virtual_joints(robot: Element) -> set[str | None]:
    return {joint.get("name") for joint in robot.findall("virtual_joint")}


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
