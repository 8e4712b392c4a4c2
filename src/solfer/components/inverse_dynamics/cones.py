"""Friction cones of contacts, which turn with the ground where its normal is felt."""

import math
from collections.abc import Mapping

import numpy as np

from solfer.components.felt_ground import FeltGround
from solfer.components.inverse_dynamics.cones_kernel import CONES, turn, write_cones
from solfer.components.inverse_dynamics.tags import InverseDynamicsTags
from solfer.errors import ComponentError
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.planar_move import PlanarMove
from solfer.points.contact.contacts import Contact, RollingContact, across
from solfer.points.contact.support_vertex import UP

TURNING_TIME = 0.2
"""Time constant with which contacts follow the normals that are felt [s]: torques do not jump."""


class FrictionCones:
    """Bounds G f <= 0 of the forces f of contacts, and their normal forces N f.

    Where a normal is felt, wheels and balls touch the ground where it does, and forces in world axes have their pyramid
    about it. A flat foot is as the ground is, and so is its pyramid.

    Args:
        contacts: The contacts by name; their normals are written.
        starts: First force of each contact, and the end of the last one, shape (c + 1,).
        tags: Tags of the component.
        name: Name of the component, for messages.

    Attributes:
        matrix: G, shape (g, k); live.
        owners: Contact of each row of G, shape (g,).
        normals: N, shape (c, k); live.
        felt: The normals that are felt; None: those of the robot's file count.

    Raises:
        ComponentError: A flat foot has no sole.
    """

    def __init__(self, contacts: Mapping[str, Contact], starts: np.ndarray, tags: InverseDynamicsTags, name: str):
        count = len(contacts)
        size = int(starts[-1])
        self._contacts = contacts
        bounded = [_bounded(each, contact, tags) for each, contact in contacts.items()]
        self.owners = np.repeat(np.arange(count), [len(ratios) for _, ratios in bounded])
        self._ratios = self.ratios_of(tags)
        self.normals = np.zeros((count, size))
        sides = np.zeros((len(self.owners), size))
        for index, contact in enumerate(contacts.values()):
            columns = slice(starts[index], starts[index + 1])
            self.normals[index, columns] = _local(contact)[2]
            sides[self.owners == index, columns] = bounded[index][0]
        self.matrix = sides - self._ratios[:, np.newaxis] * self.normals[self.owners]
        present = np.array([_normal(contact) for contact in contacts.values()]).reshape(-1, 3)
        self.felt = None if tags.ground is None else FeltGround(name, tags.ground, tuple(contacts), present)
        self._turned = [
            (contact.normal, normal)
            for contact, normal in zip(contacts.values(), present, strict=True)
            if isinstance(contact, RollingContact)
        ]
        self._block = MemoryBlock(
            CONES,
            count=count,
            force_count=size,
            cone_count=len(self.owners),
            starts=starts,
            turns=np.array([contact.holds_a_point for contact in contacts.values()], dtype=bool),
            present=present,
            goals=present if self.felt is None else self.felt.normals,
            owners=self.owners,
            sides=sides,
            ratios=self._ratios,
            normals=self.normals,
            cones=self.matrix,
        )

    def ratios_of(self, tags: InverseDynamicsTags) -> np.ndarray:
        """Compute the ratios to the normal force for the friction and the torsion of `tags`, shape (g,)."""
        return np.array([ratio for name, each in self._contacts.items() for ratio in _bounded(name, each, tags)[1]])

    def take_ratios(self, ratios: np.ndarray) -> None:
        """Go on with other ratios, of `ratios_of`."""
        self._ratios[:] = ratios
        write_cones(self._block.address)

    def start(self) -> None:
        """Begin on the ground of the robot's file."""
        if self.felt is not None:
            self.felt.start()
            self._turn(1.0)

    def update(self, step: float) -> None:
        """Follow the ground that is felt for a time [s]."""
        if self.felt is not None:
            self.felt.update(step)
            self._turn(step / (TURNING_TIME + step))

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        if self.felt is not None:
            self.felt.move_world(move)
            self._turn(1.0)

    def _turn(self, share: float) -> None:
        """Bring normals nearer to those that are felt, by a share of what is left."""
        if turn(self._block.address, share):
            for own, normal in self._turned:
                own[:] = normal


def _normal(contact: Contact) -> np.ndarray:
    """Return the normal of the ground below a contact, shape (3,)."""
    return contact.normal if isinstance(contact, RollingContact) else np.array(UP)


def _local(contact: Contact) -> np.ndarray:
    """Return the map from forces along the rows to force and torque in the contact's frame, shape (6, rows)."""
    if not contact.holds_a_point:
        return contact.constraint.T
    normal = _normal(contact)
    side = np.array(across(*normal.tolist()))
    whole = np.zeros((6, 3))
    whole[:3] = np.cross(side, normal), side, normal
    return whole


def _bounded(name: str, contact: Contact, tags: InverseDynamicsTags) -> tuple[np.ndarray, list[float]]:
    """Return what a contact's normal force bounds, shape (g, rows), and the ratios to it."""
    local = _local(contact)
    if local[3:5].any() and tags.sole is None:
        raise ComponentError(f"contact '{name}' holds moments, and has no sole", where=tags.where(), expected="`sole`")
    friction = math.sqrt(0.5) * tags.friction  # a pyramid of four sides within the cone
    length, width = tags.sole or (0.0, 0.0)
    ratios = {0: friction, 1: friction, 3: width, 4: length, 5: tags.torsion}
    # a contact need not have a force along each side
    sides = [row for row in ratios if local[row].any()]
    rows = [sign * local[row] for row in sides for sign in (1.0, -1.0)]
    return np.array(rows).reshape(-1, local.shape[1]), [ratios[row] for row in sides for _ in range(2)]
