"""Places of points and frames on links: set in the frame of the link, of another link, or in the world.

A place in the world or on another link is converted at the state of the last update of the Robot, and is fixed to the
link from then on. The next update of the point uses it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, SizeMismatch, SolferError, UnknownName
from solfer.model.kinematic_tree import Attachment
from solfer.model.view import RobotView
from solfer.numerics.rotations import (
    QUATERNION_KINDS,
    QUATERNION_ORDERS,
    QuaternionConvention,
    quaternion_from_rotation,
    rotation_from_quaternion,
)


class PositionOffset:
    """Place of a point on a link.

    Args:
        robot: The Robot.
        link: Name of the link.
        attachment: Place of the link on its joint.
        numbers: The point in the frame of the joint, shape (3,) [m]; written to.
    """

    size = 3

    def __init__(self, robot: RobotView, link: str, attachment: Attachment, numbers: np.ndarray):
        self._kinematics = robot.kinematics
        self._link = link
        self._attachment = attachment
        self._numbers = numbers
        self.set_fixed((0.0, 0.0, 0.0))

    def share(self, numbers: np.ndarray) -> None:
        """Read and write other numbers from now on, which another point has, too."""
        self._numbers = numbers

    @property
    def fixed(self) -> np.ndarray:
        """The point in the frame of the link, shape (3,) [m]; a new array."""
        return self._attachment.rotation.T @ (self._numbers - self._attachment.translation)

    def set_fixed(self, position: ArrayLike) -> None:
        """Put the point to `position` in the frame of the link, shape (3,) [m].

        Raises:
            SizeMismatch, NotFinite: These are not three finite numbers.
        """
        self._numbers[:] = self._attachment.rotation @ self._checked(position) + self._attachment.translation

    def set_world(self, position: ArrayLike) -> None:
        """Put the point to `position` in the world, shape (3,) [m].

        Raises:
            SizeMismatch, NotFinite: These are not three finite numbers.
        """
        origin = self._kinematics.position(self._link)
        rotation = self._kinematics.rotation(self._link)
        self.set_fixed(rotation.T @ (self._checked(position) - origin))

    def set_reference(self, position: ArrayLike, link: str) -> None:
        """Put the point to `position` in the frame of another link, shape (3,) [m].

        Raises:
            UnknownName: There is no such link.
            SizeMismatch, NotFinite: These are not three finite numbers.
        """
        origin = self._kinematics.position(link)
        rotation = self._kinematics.rotation(link)
        self.set_world(origin + rotation @ self._checked(position))

    def _checked(self, position: ArrayLike) -> np.ndarray:
        return finite(position, self.size, f"position on link '{self._link}'")


class OrientationOffset:
    """Orientation of a frame on a link. Quaternions are (x, y, z, w), Hamilton, unless another convention is named.

    Args:
        robot: The Robot.
        link: Name of the link.
        attachment: Place of the link on its joint.
        numbers: Quaternion that rotates from the frame to that of the joint, shape (4,); written to.
    """

    size = 4

    def __init__(self, robot: RobotView, link: str, attachment: Attachment, numbers: np.ndarray):
        self._kinematics = robot.kinematics
        self._link = link
        self._attachment = attachment
        self._numbers = numbers
        self._rotate(np.eye(3))

    def share(self, numbers: np.ndarray) -> None:
        """Read and write other numbers from now on, which another point has, too."""
        self._numbers = numbers

    @property
    def fixed(self) -> np.ndarray:
        """Quaternion (x, y, z, w) that rotates from the frame to the link, shape (4,); a new array."""
        return quaternion_from_rotation(self._attachment.rotation.T @ rotation_from_quaternion(self._numbers))

    def set_fixed(self, quaternion: ArrayLike, order: str = "xyzw", kind: str = "HAMILTONIAN") -> None:
        """Turn the frame so that `quaternion`, shape (4,), rotates from it to the link.

        Args:
            quaternion: The quaternion.
            order: Order of its numbers, `xyzw` or `wxyz`.
            kind: `HAMILTONIAN` or `JPL`.

        Raises:
            UnknownName: There is no such convention.
            SizeMismatch, NotFinite: It is not a quaternion.
        """
        self._rotate(self._rotation(quaternion, order, kind))

    def set_world(self, quaternion: ArrayLike, order: str = "xyzw", kind: str = "HAMILTONIAN") -> None:
        """Turn the frame so that `quaternion` rotates from it to the world; as `set_fixed`."""
        self._rotate(self._kinematics.rotation(self._link).T @ self._rotation(quaternion, order, kind))

    def set_reference(self, quaternion: ArrayLike, link: str, order: str = "xyzw", kind: str = "HAMILTONIAN") -> None:
        """Turn the frame so that `quaternion` rotates from it to another link; as `set_fixed`.

        Raises:
            UnknownName: There is no such link, or no such convention.
            SizeMismatch, NotFinite: It is not a quaternion.
        """
        rotation_to_world = self._kinematics.rotation(link) @ self._rotation(quaternion, order, kind)
        self._rotate(self._kinematics.rotation(self._link).T @ rotation_to_world)

    def _rotation(self, quaternion: ArrayLike, order: str, kind: str) -> np.ndarray:
        values = finite(quaternion, self.size, f"orientation on link '{self._link}'")
        return rotation_from_quaternion(quaternion_convention(order, kind).read(values, np.empty(4)))

    def _rotate(self, rotation_to_link: np.ndarray) -> None:
        self._numbers[:] = quaternion_from_rotation(self._attachment.rotation @ rotation_to_link)


def quaternion_convention(order: str, kind: str) -> QuaternionConvention:
    """Return the convention of these names.

    Raises:
        UnknownName: There is no such order or kind.
    """
    if order not in QUATERNION_ORDERS:
        raise UnknownName("order of a quaternion", order, QUATERNION_ORDERS)
    if kind not in QUATERNION_KINDS:
        raise UnknownName("kind of quaternions", kind, QUATERNION_KINDS)
    return QuaternionConvention(order, kind)


def finite(values: ArrayLike, size: int, what: str) -> np.ndarray:
    """Return the values as an array of `size` finite numbers; errors call them `what`.

    Raises:
        SizeMismatch: There are more or fewer values.
        NotFinite: A value is NaN or infinite.
    """
    array = np.asarray(values, dtype=float)
    if array.shape != (size,):
        raise SizeMismatch(f"{what}: {size} numbers are needed, got shape {array.shape}")
    if not np.isfinite(array).all():
        raise NotFinite(f"{what}: {array.tolist()}", expected=f"{size} finite numbers")
    return array


def chosen(
    kind: str,
    selected: Sequence[str | int] | None,
    count: int,
    names: Sequence[str],
    where: str,
    *,
    error: type[SolferError],
) -> np.ndarray:
    """Convert desired rows or DoFs to their indices, shape (m,), in the order in which they are desired.

    Args:
        kind: `row` or `DoF`, for errors.
        selected: Names or numbers, or a single one; None for all.
        count: How many there are.
        names: Their names, if they have any.
        where: Place of errors.
        error: Kind of error where a number does not fit.

    Raises:
        UnknownName: There is no such name.
    """
    if selected is None:
        return np.arange(count, dtype=np.int64)
    item: Any
    indices = []
    expected = "" if names else f"a number of a {kind}"
    for item in [selected] if np.isscalar(selected) else selected:
        if isinstance(item, str) and item not in names:
            raise UnknownName(kind, item, names, where=where, expected=expected)
        index = names.index(item) if isinstance(item, str) else item
        if not isinstance(index, int | np.integer) or isinstance(index, bool) or not 0 <= index < count:
            raise error(f"{kind} {index}", where=where, expected=f"0 to {count - 1}")
        indices.append(index)
    if not indices or len(set(indices)) < len(indices):
        raise error(f"{kind}s {indices}", where=where, expected=f"at least one {kind}, each once")
    return np.array(indices, dtype=np.int64)


def direction(values: ArrayLike, what: str) -> np.ndarray:
    """Normalise a vector to length one.

    Raises:
        SizeMismatch, NotFinite: These are not three finite numbers, or all of them are zero.
    """
    array = finite(values, 3, what)
    length = float(np.linalg.norm(array))
    if length == 0.0:
        raise NotFinite(f"{what}: a vector of zeros has no direction", expected="a vector that is not zero")
    return array / length
