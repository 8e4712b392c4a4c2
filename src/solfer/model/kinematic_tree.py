"""The kinematic tree of a robot as live arrays, and places of links on it, without Pinocchio."""

from dataclasses import dataclass

import numpy as np

from solfer.model.followers import Followers


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """Joints of a robot with n DoFs, one a joint. DoF k belongs to joint k + 1; joint 0 is the world.

    The first three arrays are live: they contain the result of the last update of the kinematics.

    Attributes:
        jacobian: Row k is the spatial velocity, linear first, of the world's origin as moved along with joint k + 1 at
            unit speed, world axes, shape (n, 6).
        placements: Poses of the joints in the world: the three columns of the rotation, then the translation [m],
            shape (n + 1, 12).
        velocity: Velocities of the DoFs [rad/s, m/s], shape (n,).
        parents: The joint that carries each joint, shape (n + 1,).
        inertial: What the next four are views of, with nine numbers a joint of work space for kernels before the last
            of them, shape (23 (n + 1),). It is live: who writes other masses to it changes all that is computed later.
        masses: Mass of what is fixed to each joint [kg], zero for the world, shape (n + 1,).
        levers: Centre of that mass in the joint's frame [m], shape (n + 1, 3).
        inertias: Rotational inertia of that mass about its centre, axes of the joint's frame, shape (n + 1, 3, 3)
            [kg m^2].
        subtrees: Mass of each joint and all that it carries [kg], shape (n + 1,).
        armature: Inertia of the rotors that count in the inertia matrix, as seen at the joints, shape (n,) [kg m^2].
        followers: DoFs that follow others.
    """

    jacobian: np.ndarray
    placements: np.ndarray
    velocity: np.ndarray
    parents: np.ndarray
    inertial: np.ndarray
    masses: np.ndarray
    levers: np.ndarray
    inertias: np.ndarray
    subtrees: np.ndarray
    armature: np.ndarray
    followers: Followers


@dataclass(frozen=True, eq=False)
class Attachment:
    """Place of a link on its joint.

    Attributes:
        joint: The joint's number; 0 if the link does not move.
        rotation: From the link to the joint's frame, shape (3, 3).
        translation: The link's origin in the joint's frame, shape (3,) [m].
        columns: DoFs whose joints carry the link, in their order, shape (m,).
        moved: DoFs that move the link: the same with the leaders of followers, shape (l,).
    """

    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    columns: np.ndarray
    moved: np.ndarray
