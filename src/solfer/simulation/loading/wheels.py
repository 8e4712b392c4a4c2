"""Wheels in the form of a torus, as the controllers take them."""

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from solfer.model.contacts import ContactRecord, Place


class TorusWheel(NamedTuple):
    """A tube bent around a ring.

    Attributes:
        center: Its centre in the frame of its link [m].
        axis: Its axis there, of any length.
        ring: Radius of the circle that the tube's centre runs along [m].
        tube: Radius of the tube [m].
    """

    center: Place
    axis: Place
    ring: float
    tube: float

    @property
    def half_axes(self) -> tuple[float, float, float]:
        """Half axes of the ellipsoid with its radius and its curvatures where it stands upright, along x, y and z [m].

        Source: an ellipse with the half axes a and c has the radius of curvature c^2 / a at the end of a: the tube's.
        """
        radius = self.ring + self.tube
        return radius, radius, math.sqrt(radius * self.tube)


NO_WHEELS: Mapping[str, TorusWheel] = MappingProxyType({})
"""Of a robot that has none."""


def wheels_of(contacts: Iterable[ContactRecord]) -> dict[str, TorusWheel]:
    """Return the wheels of contacts by their links, without those that have no radii or no axis."""
    wheels = {}
    for contact in contacts:
        axis = contact.reference_axis
        if contact.type == "wheel" and contact.minor_axis and contact.major_axis is not None and axis is not None:
            direction = axis.x, axis.y, axis.z
            wheels[contact.end_frame] = TorusWheel(
                contact.position, direction, contact.major_axis, tube=contact.minor_axis
            )
    return wheels
