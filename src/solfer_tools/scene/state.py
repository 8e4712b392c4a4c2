"""What is seen of a robot at one moment."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ScenePose:
    """Where something is.

    Attributes:
        position: Shape (3,) [m].
        rotation: From its axes to those that it is seen in, shape (3, 3).
    """

    position: np.ndarray
    rotation: np.ndarray

    def of(self, other: "ScenePose") -> "ScenePose":
        """Return a pose that is given in this one's axes, in the axes that this one is seen in."""
        return ScenePose(self.position + self.rotation @ other.position, self.rotation @ other.rotation)

    def seen(self, position: np.ndarray) -> np.ndarray:
        """Return a position that is given as this pose is in this pose's own axes, shape (3,) [m]."""
        seen: np.ndarray = self.rotation.T @ (position - self.position)
        return seen


@dataclass(frozen=True, eq=False)
class ContactForce:
    """Force of the ground at a contact.

    Attributes:
        contact: Name of the contact.
        position: Where it acts, shape (3,) [m].
        force: Shape (3,) [N].
        touches: Whether the contact carries a part of the robot.
    """

    contact: str
    position: np.ndarray
    force: np.ndarray
    touches: bool


@dataclass(frozen=True, eq=False)
class ShownReference:
    """The reference of a task.

    Attributes:
        module: Topic of the component, such as '/hands'.
        task: Name of the task.
        quantity: 'position', 'orientation' or 'pose'.
        frame: Frame that the component has it in: 'world', or a link.
        own: The reference in that frame; an orientation has the place of its link.
        reference: Where it is.
        desired: Where it goes.
    """

    module: str
    task: str
    quantity: str
    frame: str
    own: ScenePose
    reference: ScenePose
    desired: ScenePose


@dataclass(frozen=True, eq=False)
class SceneState:
    """A robot with its measured and desired state; all in the axes of `frame`, unless noted otherwise.

    Attributes:
        frame: Frame of reference: that of the messages with the pose of the base.
        measured: Poses of the links, by name.
        desired: Poses of the links as joints are commanded on the measured base; empty: no joints are.
        center: Centre of mass, shape (3,) [m].
        projection: Centre of mass on the ground, shape (3,) [m].
        polygon: Corners of the support polygon, seen from above against the clock, shape (k, 3) [m].
        inner: What the margins leave of it, shape (l, 3) [m]; empty: there are none, or they leave nothing.
        forces: Forces at the contacts that are known.
        friction: Coefficient of friction, for cones of friction about the vertical.
        references: References of tasks.
        path: Where the base has been, shape (m, 3) [m].
        estimated_path: Where the odometry has estimated it, in its own frame, beside a simulation that has the true
            pose, shape (n, 3) [m].
    """

    frame: str
    measured: Mapping[str, ScenePose]
    desired: Mapping[str, ScenePose]
    center: np.ndarray
    projection: np.ndarray
    polygon: np.ndarray
    inner: np.ndarray
    forces: tuple[ContactForce, ...]
    friction: float
    references: tuple[ShownReference, ...]
    path: np.ndarray
    estimated_path: np.ndarray
