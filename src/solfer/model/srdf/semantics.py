"""Groups and named states of a robot, from its SRDF."""

import logging
from collections.abc import Iterable, Sequence
from pathlib import Path

from solfer.errors import SolferError, raise_all
from solfer.model.documents import parse_robot, read_text
from solfer.model.srdf.elements import (
    Findings,
    Group,
    note_unknown_elements,
    read_apart,
    read_groups,
    read_states,
)
from solfer.model.urdf.description import Description

__all__ = ["Group", "Semantics"]

logger = logging.getLogger(__name__)


class Semantics:
    """Groups and named states of a robot.

    A link that is a member of a group stands for itself and the joint that carries it. Values of a `<virtual_joint>`
    place the robot in the world and are not joint values: they are left out. What names something that the robot does
    not have (a link, joint or group, or a chain) is left out with a warning, as in MoveIt and Pinocchio; so are unknown
    elements.

    Attributes:
        groups: Groups by name, in the order of the SRDF.
        states: Values [rad, m] by joint, by name of the state; states that have their name in common but not their
            group are one state. Where they have different values for a joint, the first one counts, and `GROUP/NAME`
            names each of them.
        apart: Pairs of links whose collisions do not count; those with links that the robot does not have are left out.
        text: The SRDF itself; empty: there is none.
    """

    def __init__(
        self,
        groups: dict[str, Group] | None = None,
        states: dict[str, dict[str, float]] | None = None,
        apart: Iterable[frozenset[str]] = (),
        text: str = "",
    ):
        self.groups = groups or {}
        self.states = states or {}
        self.apart = frozenset(apart)
        self.text = text

    @classmethod
    def from_file(cls, path: str | Path, description: Description, others: Sequence[Description] = ()) -> "Semantics":
        """Read an SRDF file.

        Raises:
            ModelError: The file cannot be read, or see `from_text`.
        """
        return cls.from_text(read_text(path, "SRDF"), description, str(path), others=others)

    @classmethod
    def from_text(
        cls, text: str, description: Description, where: str = "SRDF", others: Sequence[Description] = ()
    ) -> "Semantics":
        """Read the text of an SRDF.

        Args:
            text: The SRDF.
            description: The robot.
            where: Name of the text in errors.
            others: The whole robot, or its other parts, where `description` is a part of the robot of the SRDF: links
                and joints that only they have are left out.

        Raises:
            ModelError: It is not an SRDF, a group or state stands twice, a group contains itself, or a value is not a
                number. Several faults are reported at once.
            UnknownName: Nothing in it belongs to the robot.
        """
        text, element = parse_robot(text, where, "SRDF")
        models = (description, *others)
        findings = Findings()
        groups = read_groups(element, models, where, findings=findings)
        states = read_states(element, models, where, findings=findings)
        own = any(states.values()) or any(group.links or group.joints for group in groups.values())
        raise_all(findings.faults if own else findings.faults + findings.left_out)
        note_unknown_elements(element, where, findings)
        _warn(findings.left_out, where)
        return cls(groups, states, read_apart(element, description.links), text=text)

    def __repr__(self) -> str:
        return f"Semantics({len(self.groups)} groups, {len(self.states)} states)"


def _warn(left_out: Sequence[SolferError], where: str) -> None:
    """Log what was left out, in one message."""
    if not left_out:
        return
    listed = 8
    items = [  # with the nearest names, but without a list of all names
        f"{fault.where.removeprefix(where + ': ')}: {fault.line if fault.names else fault.what}"
        for fault in left_out[:listed]
    ]
    more = f"; and {len(left_out) - listed} more" if len(left_out) > listed else ""
    logger.warning("%s: left out: %s%s", where, "; ".join(items), more)
