"""Contacts: links of a robot that are meant to touch the ground."""

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from solfer.config import Record, read
from solfer.config.records.bounds import DIRECTION, LENGTH, OFFSET, Name

_Coordinate = Annotated[float, Field(**OFFSET)]
Place = tuple[_Coordinate, _Coordinate, _Coordinate]
_Entry = Annotated[float, Field(**DIRECTION)]
Row = tuple[_Entry, _Entry, _Entry, _Entry, _Entry, _Entry]


class AxisRecord(Record):
    """An axis in a link's frame."""

    x: float = Field(**DIRECTION, description="first component")
    y: float = Field(**DIRECTION, description="second component")
    z: float = Field(**DIRECTION, description="third component")


class ConstraintRecord(Record):
    """Directions that a contact constrains, in its own frame; columns are three moments, then three forces.

    A row of zeros, or one that is left out, constrains nothing.
    """

    force_1: Row | None = Field(default=None, description="row of the first force")
    force_2: Row | None = Field(default=None, description="row of the second force")
    force_3: Row | None = Field(default=None, description="row of the third force")
    momentum_1: Row | None = Field(default=None, description="row of the first moment")
    momentum_2: Row | None = Field(default=None, description="row of the second moment")
    momentum_3: Row | None = Field(default=None, description="row of the third moment")

    def matrix(self) -> np.ndarray:
        """Return the rows that constrain something; columns are three forces, then three moments; shape (k, 6)."""
        rows = [getattr(self, name) for name in type(self).model_fields]
        held = np.array([row for row in rows if row is not None and any(row)]).reshape(-1, 6)
        return np.concatenate((held[:, 3:], held[:, :3]), axis=1)

    @model_validator(mode="after")
    def _complete(self) -> "ConstraintRecord":
        if not len(self.matrix()):
            raise ValueError("expected at least one row that is not zero: a contact constrains something")
        return self


class ContactRecord(Record):
    """A contact in a file."""

    name: Name = Field(description="name of the contact")
    end_frame: Name = Field(description="link that touches the ground")
    type: Literal["contact_point", "wheel"] = Field(description="`contact_point` or `wheel`")
    position: Place = Field(description="the point in the link's frame [m]")
    offset: Place | None = Field(
        default=None,
        description="from there to the ground, world axes [m], against the ground's normal; a `contact_point` with an "
        "offset rolls as a ball of this radius",
    )
    constraint_matrix: ConstraintRecord = Field(description="directions that the contact constrains")
    topic: str | None = Field(default=None, description="topic of its wrench")
    message: str | None = Field(default=None, description="message of its wrench")
    active: bool = Field(default=True, description="whether it touches the ground at the start")
    initialize: bool = Field(default=True, description="whether its wrench is waited for at the start")
    interface: Literal["fixed", "world"] = Field(default="fixed", description="axes of its wrench: link's or world's")
    minor_axis: float | None = Field(default=None, **LENGTH, description="radius of a wheel's tube [m]")
    major_axis: float | None = Field(default=None, ge=0.0, le=LENGTH["le"], description="radius of a wheel's ring [m]")
    reference_axis: AxisRecord | None = Field(default=None, description="axle of a wheel in the link's frame")

    @model_validator(mode="after")
    def _reaches_the_ground(self) -> "ContactRecord":
        if self.type != "wheel" or self.minor_axis is None or self.major_axis is None or self.offset is None:
            return self
        if not any(self.offset):
            return self
        length = math.hypot(*self.offset)
        radius = self.minor_axis + self.major_axis
        if abs(length - radius) > 0.02 * radius:  # files have rounded numbers
            raise ValueError(
                f"an 'offset' of {length:g} m from a wheel's centre to the ground; expected the sum of its radii, "
                f"{radius:g} m"
            )
        return self


class ContactsRecord(Record):
    """Contacts by their key in the file, `contact0`, `contact1`, and so on."""

    contacts: dict[str, ContactRecord] = Field(default_factory=dict, description="contacts")


def read_contacts(path: str | Path, robot: str) -> tuple[ContactRecord, ...]:
    """Read the contacts of the robot called `robot`, `<robot>.contacts.contact0...` in a YAML file.

    Raises:
        ConfigError: The file is missing, or a value does not fit.
        UnknownName: A key is not known.
        SolferErrors: Several of these.
    """
    return tuple(read(path, ContactsRecord, (robot,)).contacts.values())
