"""Parts of a Robot, read from files or from their texts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from solfer.model import Actuators, Description, Kinematics, Semantics
from solfer.model.contacts import ContactRecord, read_contacts
from solfer.model.urdf.fixed_base import warn_of_fixed_base
from solfer.model.urdf.unfit import warn_of_unfit


@dataclass(frozen=True)
class Parts:
    """The arguments of a Robot."""

    kinematics: Kinematics
    semantics: Semantics | None
    actuators: Actuators | None
    name: str
    contacts: tuple[ContactRecord, ...]
    others: Sequence[Description]


def read_parts(
    urdf: str | Path,
    srdf: str | Path | None,
    floating_base: bool | None,
    actuators: str | Path | None,
    name: str | None,
    *,
    others: Sequence[str | Path],
    contacts: str | Path | None,
) -> Parts:
    """Read all descriptions of a Robot; see `Robot.load`."""
    description = _describe(urdf)
    elsewhere = [_describe(other) for other in others]
    warn_of_fixed_base(description, floating_base)
    kinematics = Kinematics(description, floating_base)
    warn_of_unfit(description, kinematics.base is not None)
    name = name or description.name
    semantics = None
    table = None
    if srdf is not None:
        read = Semantics.from_text if _is_text(srdf) else Semantics.from_file
        semantics = read(srdf, description, others=elsewhere)
    if actuators is not None:
        joints = {joint for other in elsewhere for joint in other.joints}
        table = Actuators.from_file(actuators, name, kinematics.dofs, joints)
    records = () if contacts is None else own_contacts(read_contacts(contacts, name), description, elsewhere)
    return Parts(kinematics, semantics, table, name=name, contacts=records, others=elsewhere)


def own_contacts(
    records: Iterable[ContactRecord], description: Description, others: Iterable[Description]
) -> tuple[ContactRecord, ...]:
    """Return the contacts without those on links that only `others` have: other parts of the robot."""
    elsewhere = {link for other in others for link in other.links} - set(description.links)
    return tuple(record for record in records if record.end_frame not in elsewhere)


def _is_text(source: str | Path) -> bool:
    """Return whether it is the XML itself; no path begins with `<`."""
    return isinstance(source, str) and source.lstrip()[:1] == "<"


def _describe(urdf: str | Path) -> Description:
    return Description.from_text(urdf) if _is_text(urdf) else Description.from_file(urdf)
