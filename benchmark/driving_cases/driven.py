"""Robots that are driven: CENTAURO, or one of a folder with `robot.yaml` and a configuration beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from solfer.model import Description
from solfer.model.contacts import ContactRecord, read_contacts
from solfer.model.kinematics import Kinematics
from solfer.simulation import read_bundle

CONFIG = Path(__file__).resolve().parents[2] / "config"
CENTAURO = CONFIG / "robots" / "centauro" / "robot.yaml"
PLUGINS = "plugins.yaml"
"""Main configuration beside the file of another robot."""


@dataclass(frozen=True)
class Wheel:
    """A wheel of the simulated robot, which rolls as a ball.

    Attributes:
        link: Its link.
        contact: Name of its contact.
        axle: Its axle in the frame of the link, shape (3,).
        ring, tube: Radii of its torus [m].
    """

    link: str
    contact: str
    axle: np.ndarray
    ring: float
    tube: float


@dataclass(frozen=True)
class Driven:
    """A robot that is driven.

    Attributes:
        bundle: Its file.
        configuration: Its main configuration.
        urdf, srdf: Texts of its model and groups.
        base: Link of its base.
        wheels: Its wheels, in the order of the file of contacts.
    """

    bundle: Path
    configuration: Path
    urdf: str
    srdf: str
    base: str
    wheels: tuple[Wheel, ...]

    @property
    def is_centauro(self) -> bool:
        """Whether it is CENTAURO, with its parts and its estimators."""
        return self.bundle == CENTAURO

    @property
    def links(self) -> tuple[str, ...]:
        """Links of the wheels."""
        return tuple(wheel.link for wheel in self.wheels)


class Links(Protocol):
    """Where links are: a model's kinematics, or what a simulation is like now."""

    def position(self, link: str) -> np.ndarray:
        """Return where a link is, shape (3,) [m]."""

    def rotation(self, link: str) -> np.ndarray:
        """Return how it is turned, shape (3, 3)."""


def lowest_points(links: Links, wheels: Sequence[Wheel]) -> np.ndarray:
    """Return the lowest points of wheels in the world, shape (m, 3) [m]."""
    found = []
    for wheel in wheels:
        axle = links.rotation(wheel.link) @ wheel.axle
        down = np.array((0.0, 0.0, 1.0)) - axle * axle[2]
        found.append(links.position(wheel.link) - wheel.ring * down / np.linalg.norm(down) - (0.0, 0.0, wheel.tube))
    return np.array(found)


def driven(bundle: Path | None = None) -> Driven:
    """Read a robot; None: CENTAURO.

    Raises:
        SolferError: A file is missing or wrong.
    """
    bundle = (bundle or CENTAURO).resolve()
    record = read_bundle(bundle)
    assert record.srdf is not None and record.contacts is not None
    urdf, srdf = (Path(file.location).read_text() for file in (record.urdf, record.srdf))
    is_shipped = bundle == CENTAURO
    contacts = read_contacts(record.contacts.location, record.name)
    return Driven(
        bundle,
        CONFIG / "centauro.yaml" if is_shipped else bundle.parent / PLUGINS,
        urdf,
        srdf,
        str(Kinematics(Description.from_text(urdf), None).base_link),
        tuple(_wheel(contact) for contact in contacts if contact.type == "wheel"),
    )


def _wheel(contact: ContactRecord) -> Wheel:
    axis = contact.reference_axis
    assert axis is not None and contact.major_axis is not None and contact.minor_axis is not None
    axle = np.array((axis.x, axis.y, axis.z), dtype=float)
    return Wheel(contact.end_frame, contact.name, axle / np.linalg.norm(axle), contact.major_axis, contact.minor_axis)
