"""Parts of a robot: joints, links, groups and named states."""

from collections.abc import Callable, Collection, Iterator, Sequence

from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.model.urdf.elements import JointInfo

Row = tuple[str, ...]


def joints(description: Description, semantics: Semantics) -> Iterator[Row]:
    """List type, links at both ends, and limits of position, velocity and effort."""
    for joint in description.joints.values():
        yield joint.name, joint.type, f"{joint.parent} > {joint.child}", *_limits(joint)


def links(description: Description, semantics: Semantics) -> Iterator[Row]:
    """List mass, the joint that carries the link, and the number of joints that it carries."""
    for link in description.links.values():
        mass = "no mass" if link.mass is None else f"{link.mass:.6g} kg"
        carrier = f"on {link.parent}" if link.parent else "root"
        yield link.name, mass, carrier, f"carries {_count(link.children, 'joint')}"


def groups(description: Description, semantics: Semantics) -> Iterator[Row]:
    """List the number of joints and links, and the first joints."""
    moving = tuple(joint.name for joint in description.joints.values() if joint.type != "fixed")
    yield "all", _count(moving, "joint"), _count(description.links, "link"), "always there"
    for group in semantics.groups.values():
        if group.name != "all":
            yield group.name, _count(group.joints, "joint"), _count(group.links, "link"), _first(group.joints)


def states(description: Description, semantics: Semantics) -> Iterator[Row]:
    """List the number of joints, and the first values [rad, m]."""
    for name, values in semantics.states.items():
        yield name, _count(values, "joint"), _first([f"{joint} {value:.4g}" for joint, value in values.items()])


TABLES: dict[str, Callable[[Description, Semantics], Iterator[Row]]] = {
    "joints": joints, "links": links, "groups": groups, "states": states,
}  # fmt: skip


def _limits(joint: JointInfo) -> Row:
    length, force = ("m", "N") if joint.type == "prismatic" else ("rad", "Nm")
    if not joint.moving:
        return ()
    free = joint.lower is None or joint.upper is None
    position = "no end" if free else f"{joint.lower:.4g} to {joint.upper:.4g} {length}"
    velocity = "" if joint.velocity is None else f"{joint.velocity:.4g} {length}/s"
    return position, velocity, "" if joint.effort is None else f"{joint.effort:.4g} {force}"


def _count(members: Collection[str], noun: str) -> str:
    return f"{len(members)} {noun}{'' if len(members) == 1 else 's'}"


def _first(members: Sequence[str]) -> str:
    more = ["..."] if len(members) > 4 else []
    return ", ".join([*members[:4], *more])
