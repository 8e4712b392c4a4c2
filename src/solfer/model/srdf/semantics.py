"""Groups and named states of a robot, from its SRDF."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from solfer.errors import ModelError, raise_all
from solfer.model.srdf.elements import Group, read_groups, read_states
from solfer.model.urdf.description import Description

__all__ = ["Group", "Semantics"]


class Semantics:
    """Groups and named states of a robot.

    A link that is a member of a group stands for itself and the joint that carries it. Values of a `<virtual_joint>`
    place the robot in the world and are not joint values: they are left out.

    Attributes:
        groups: Groups by name, in the order of the SRDF.
        states: Values [rad, m] by joint, by name of the state; states that have their name in common but not their
            group are one state.
    """

    def __init__(self, groups: dict[str, Group] | None = None, states: dict[str, dict[str, float]] | None = None):
        self.groups, self.states = groups or {}, states or {}

    @classmethod
    def from_file(cls, path: str | Path, description: Description, others: Sequence[Description] = ()) -> "Semantics":
        """Read an SRDF file.

        Raises:
            ModelError: The file cannot be read, or see `from_text`.
        """
        try:
            text = Path(path).read_text(encoding="utf-8")
        except OSError as error:
            raise ModelError(f"the SRDF cannot be read: {error.strerror}", where=str(path)) from error
        except UnicodeDecodeError as error:
            raise ModelError("the SRDF is not UTF-8 text", where=str(path)) from error
        return cls.from_text(text, description, str(path), others)

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
            ModelError: It is not an SRDF, a group or state stands twice, a group contains itself, a chain has no path,
                or a value is not a number. Several faults are reported at once.
            UnknownName: A link, joint or group does not exist.
        """
        try:
            element = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            line, column = error.position
            what = f"not XML: {str(error).split(':')[0]}" if text.strip() else "the SRDF is empty"
            raise ModelError(what, where=f"{where}:{line}:{column + 1}") from error
        if element.tag != "robot":
            raise ModelError(
                f"not an SRDF: the outermost element is <{element.tag}>", where=where, expected='<robot name="...">'
            )
        models = (description, *others)
        groups, faults = read_groups(element, models, where)
        states, more = read_states(element, models, where)
        raise_all(faults + more)
        return cls(groups, states)

    def __repr__(self) -> str:
        return f"Semantics({len(self.groups)} groups, {len(self.states)} states)"
