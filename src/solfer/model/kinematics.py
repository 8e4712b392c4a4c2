"""Kinematics and dynamics of a robot. With its working data the only place that knows Pinocchio."""

import copy
import math
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided

from solfer.errors import ModelError, UnknownName
from solfer.model.actuators import Actuators
from solfer.model.followers import Followers
from solfer.model.kinematic_tree import Attachment, KinematicTree
from solfer.model.urdf.description import Description
from solfer.model.urdf.scalar_joints import BASE_DOFS, scalar_joints
from solfer.model.working_data import working_data
from solfer.numerics import BaseChart

MAX_DOFS = 1000
"""Most DoFs of a robot, and most joints from its root to a link: Pinocchio follows them by calls in calls, and more of
them end the process."""

_WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Kinematics:
    """Positions, Jacobians and dynamics of a robot with one number a DoF (n of them).

    All vectors are in world axes, spatial ones linear first, then angular; a link's velocity is that of its origin.
    Links are those of the URDF. Arrays that are returned belong to this object: they hold until the next `update`, and
    are requested again after it (`inertia`, `bias`: until the next call of the same). They must not be written to.

    Args:
        description: The robot.
        floating_base: Whether the base moves; None follows the URDF, see `scalar_joints`.

    Attributes:
        description: The robot.
        dofs: Names of the DoFs: `x y z rx ry rz` of a floating base, then the joints in Pinocchio's order.
        tree: Joints as live arrays, the input of Points.
        followers: DoFs that follow others. Their columns of all Jacobians are zero, and those of their leaders contain
            them; positions and velocities have to be theirs.
        base: The chart of the floating base, None on a fixed one.
        base_link: The link that the base moves, None on a fixed one.
        mass: Mass of all links that a DoF moves [kg].
        gravity: Acceleration of gravity, shape (3,) [m/s^2].
        lower_position: Lower limits [rad, m], shape (n,); -inf where there is none. As all limits, those of followers
            bound their leaders instead.
        upper_position: Upper limits [rad, m], shape (n,); inf where there is none.
        velocity_limit: Largest speeds [rad/s, m/s], shape (n,); inf where there is none.
        effort_limit: Largest efforts [Nm, N], shape (n,); inf where there is none.
        revolutions: Angle after which a joint is where it was: 2 pi if it is continuous, else 0, shape (n,) [rad].

    Raises:
        ModelError: Pinocchio cannot read the robot, or it has no DoF, or more than MAX_DOFS.
    """

    def __init__(self, description: Description, floating_base: bool | None = None):
        self.description = description
        self._model = _build(description, floating_base)
        self.dofs = tuple(self._model.names[1:])
        self.mass = float(pin.computeTotalMass(self._model))
        self.gravity = np.array(self._model.gravity.linear)
        self._find_base(floating_base)
        self.followers = Followers(self.dofs, description.mimics)
        self._folds = bool(self.followers)
        self._read_limits()
        self._bound_leaders()
        self._frames = {link: self._model.getFrameId(link, pin.FrameType.BODY) for link in description.links}
        self._make_data()

    def _make_data(self) -> None:
        """Make the memory of one position and velocity: what `update` computes."""
        self._data = working_data(self._model)
        poses = [(link, self._data.oMf[frame]) for link, frame in self._frames.items()]
        self._positions = {link: read_only(pose.translation) for link, pose in poses}
        self._rotations = {link: read_only(pose.rotation) for link, pose in poses}
        self._com = self._data.com[0]
        self._com_jacobian = self._data.Jcom.reshape(3, self.size)
        self._com_is_current = self._frames_are_current = False
        self.tree = _tree(self._model, self._data, self.followers)
        self._velocity = self.tree.velocity
        self._velocity_memory = memoryview(self._velocity)
        if self._folds:  # Pinocchio's own array is not folded: it does not write all of it again
            self._com_jacobian = np.zeros((3, self.size))
        self._rest = np.zeros(self.size)
        self.update(self._rest)

    def twin(self) -> "Kinematics":
        """Make another Kinematics of the same robot, which has a position and a velocity of its own.

        It costs little, as both have the model in common. Neither may be given actuators (`drive`) after that.
        """
        twin = copy.copy(self)
        twin.__dict__.pop("_dynamics", None)
        twin._make_data()
        twin.tree.armature[:] = self.tree.armature
        return twin

    @property
    def size(self) -> int:
        """Number of DoFs n."""
        return self._model.nv

    def drive(self, actuators: Actuators, rotors: bool = True) -> None:
        """Take over what actuators change, once, before anything is computed.

        Their limits bound the efforts, and rotors that are reflected count in the inertia matrix.

        Args:
            actuators: Actuators of DoFs; those of other DoFs stay as they are.
            rotors: Whether rotors count; not where the links of a simulation move without them.

        Raises:
            ModelError: A joint that follows another one has an actuator.
        """
        for name in self.followers.names:
            if name in actuators.dofs and actuators[name] is not None:
                leader = self.dofs[self.followers.leaders[self.followers.names.index(name)]]
                raise ModelError(f"joint '{name}' follows '{leader}'", expected="no actuator of its own")
        dofs = [self.dofs.index(name) for name in actuators.dofs]
        self.effort_limit[dofs] = actuators.bound(self.effort_limit[dofs])
        if rotors:
            self.tree.armature[dofs] = self._model.armature[dofs] = actuators.reflected_inertia

    def update(self, position: np.ndarray, velocity: np.ndarray | None = None) -> None:
        """Compute joints and their Jacobians at `position` [rad, m] and `velocity` [rad/s, m/s], shape (n,) each.

        Without `velocity` the robot is assumed to be at rest. Frames and the centre of mass follow at their first use.
        """
        pin.computeJointJacobians(self._model, self._data, position)
        # needs half the time of an assignment to the array
        self._velocity_memory[:] = self._rest if velocity is None else velocity
        self._com_is_current = self._frames_are_current = False

    @property
    def pinocchio(self) -> tuple[pin.Model, pin.Data]:
        """Pinocchio's model, and its data as of the last `update`, for this room."""
        return self._model, self._data

    def frame(self, link: str, where: str = "") -> int:
        """Look up Pinocchio's number of a link's frame; an UnknownName at `where` if there is no such link."""
        if link not in self._frames:
            raise UnknownName("link", link, self._frames, where=where or self.description.where)
        return self._frames[link]

    def position(self, link: str) -> np.ndarray:
        """Return the position of a link's origin in the world, shape (3,) [m]."""
        if not self._frames_are_current or link not in self._frames:
            self._update_frames(link)
        return self._positions[link]

    def rotation(self, link: str) -> np.ndarray:
        """Return the rotation from a link to the world, shape (3, 3)."""
        if not self._frames_are_current or link not in self._frames:
            self._update_frames(link)
        return self._rotations[link]

    def jacobian(self, link: str, out: np.ndarray | None = None) -> np.ndarray:
        """Compute the Jacobian of a link's origin, shape (6, n): linear, then angular rows; in `out` or a new array."""
        jacobian = pin.getFrameJacobian(self._model, self._data, self.frame(link), _WORLD_AXES)
        jacobian = jacobian.reshape(6, self.size)  # Pinocchio makes one column a vector
        if self._folds:
            self.followers.fold(jacobian)
        if out is None:
            return jacobian
        out[:] = jacobian
        return out

    def velocity(self, link: str) -> np.ndarray:
        """Compute the velocity of a link's origin, then its angular velocity, shape (6,) [m/s, rad/s]; a new array."""
        return self.jacobian(link) @ self._velocity

    @property
    def center_of_mass(self) -> np.ndarray:
        """Centre of mass of all links that a DoF moves, in the world, shape (3,) [m]."""
        self._update_com()
        return self._com

    @property
    def center_of_mass_jacobian(self) -> np.ndarray:
        """Jacobian of the centre of mass, shape (3, n)."""
        self._update_com()
        return self._com_jacobian

    def inertia(self, position: np.ndarray) -> np.ndarray:
        """Compute the inertia matrix M(q), shape (n, n), both triangles."""
        data, inertia, _ = self._dynamics
        pin.crba(self._model, data, position, pin.Convention.WORLD)
        if self._folds:
            inertia[:] = data.M
            self.followers.fold_inertia(inertia)
        return inertia

    def bias(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Compute the bias force h of M(q) a + h(q, v) = effort [Nm, N]: Coriolis, centrifugal, gravity; shape (n,)."""
        data, _, bias = self._dynamics
        pin.nonLinearEffects(self._model, data, position, velocity)
        if self._folds:
            bias[:] = data.nle
            self.followers.fold(bias)
        return bias

    @cached_property
    def _dynamics(self) -> tuple[pin.Data, np.ndarray, np.ndarray]:
        """Data of the dynamics with M and h, which are not at the state of the kinematics.

        M and h are views; where joints follow others, copies, as Pinocchio does not write all of its own again.
        """
        data = working_data(self._model)
        if self._folds:
            return data, np.zeros((self.size, self.size)), np.zeros(self.size)
        return data, data.M, data.nle

    def attachment(self, link: str, where: str = "") -> Attachment:
        """Find the place of a link on the joint that carries it; an UnknownName at `where` if there is no such link."""
        frame = self._model.frames[self.frame(link, where)]
        # the first entry of the supporting joints is the world
        columns = np.array([joint - 1 for joint in self._model.supports[frame.parentJoint]][1:], dtype=np.int64)
        return Attachment(
            frame.parentJoint,
            frame.placement.rotation.copy(),
            frame.placement.translation.copy(),
            columns=columns,
            moved=self._moved(columns),
        )

    @property
    def carried(self) -> np.ndarray:
        """What moves each joint: 1 where a DoF's joint carries it, else 0, shape (n + 1, n); joint 0 is the world."""
        carried = np.zeros((self.size + 1, self.size))
        for joint in range(1, self.size + 1):
            carried[joint, [above - 1 for above in list(self._model.supports[joint])[1:]]] = 1.0
        return carried

    def _moved(self, columns: np.ndarray) -> np.ndarray:
        """Return columns with the leaders of the followers among them."""
        if not self._folds:
            return columns
        return np.union1d(columns, self.followers.leaders[np.isin(self.followers.dofs, columns)])

    def _update_frames(self, link: str) -> None:
        if link not in self._frames:
            self.frame(link)  # refuses it
        if not self._frames_are_current:
            pin.updateFramePlacements(self._model, self._data)
            self._frames_are_current = True

    def _update_com(self) -> None:
        if not self._com_is_current:
            pin.jacobianCenterOfMass(self._model, self._data, False)
            if self._folds:
                self._com_jacobian[:] = self._data.Jcom
                self.followers.fold(self._com_jacobian)
            self._com_is_current = True

    def _find_base(self, floating_base: bool | None) -> None:
        floating = self.description.floating
        self.base = None
        self.base_link = None
        if floating_base or (floating is not None and floating_base is not False):
            origin = self._model.jointPlacements[1]
            self.base = BaseChart(origin.translation, origin.rotation)
            self.base_link = self.description.root if floating is None else floating.child

    def _read_limits(self) -> None:
        joints = [None if name in BASE_DOFS and self.base else self.description.joints[name] for name in self.dofs]
        self.lower_position = _limits([joint.lower if joint else None for joint in joints], -np.inf)
        self.upper_position = _limits([joint.upper if joint else None for joint in joints], np.inf)
        self.velocity_limit = _limits([joint.velocity if joint else None for joint in joints], np.inf)
        self.effort_limit = _limits([joint.effort if joint else None for joint in joints], np.inf)
        self.revolutions = np.array([math.tau if joint and joint.type == "continuous" else 0.0 for joint in joints])

    def _bound_leaders(self) -> None:
        """Give the limits of followers to their leaders; efforts of followers do not exist."""
        lower = self.lower_position
        upper = self.upper_position
        velocity = self.velocity_limit
        followers = self.followers
        for dof, leader, ratio, offset in zip(
            followers.dofs, followers.leaders, followers.ratios, followers.offsets, strict=True
        ):
            if ratio:
                low, high = sorted(((lower[dof] - offset) / ratio, (upper[dof] - offset) / ratio))
                lower[leader] = max(lower[leader], low)
                upper[leader] = min(upper[leader], high)
                velocity[leader] = min(velocity[leader], velocity[dof] / abs(ratio))
            if lower[leader] > upper[leader]:
                name = self.dofs[dof]
                other = self.dofs[leader]
                raise ModelError(
                    f"joint '{name}' follows '{other}', and no position is within the limits of both",
                    where=f"{self.description.where}: joint '{name}'",
                    expected="limits that fit the multiplier and the offset",
                )
            lower[dof], upper[dof], velocity[dof], self.effort_limit[dof] = -np.inf, np.inf, np.inf, np.inf


def _check_size(description: Description) -> None:
    """Check that the tree is no larger and no deeper than MAX_DOFS."""
    depth = {description.root: 0}
    for link in description.subtree(description.root):
        depth |= dict.fromkeys(
            (description.joints[name].child for name in description.links[link].children), depth[link] + 1
        )
    for count, what in ((len(description.moving_joints), "moving joints"), (max(depth.values()), "joints in a row")):
        if count > MAX_DOFS:
            raise ModelError(f"the robot has {count} {what}", where=description.where, expected=f"at most {MAX_DOFS}")


def _build(description: Description, floating_base: bool | None) -> pin.Model:
    _check_size(description)
    urdf = scalar_joints(description, floating_base)
    try:
        model = pin.buildModelFromXML(urdf)
    except (ValueError, RuntimeError) as error:
        raise ModelError(
            f"Pinocchio cannot read it: {error}", where=description.where, expected="a URDF that Pinocchio can read"
        ) from error
    if model.nv == 0:
        raise ModelError(
            "the robot has no moving joint",
            where=description.where,
            expected="at least one joint that is not fixed, or a floating base",
        )
    return model


def _tree(model: pin.Model, data: pin.Data, followers: Followers) -> KinematicTree:
    """Return views of Pinocchio's own arrays, which contain one DoF a joint: joint k + 1 moves DoF k."""
    first = data.oMi[0].rotation
    bodies = model.nv + 1
    placements = as_strided(first, (bodies, 12), (12 * first.itemsize, first.itemsize))
    addresses = [data.oMi[joint].rotation.ctypes.data for joint in range(bodies)]
    if model.njoints != bodies or addresses != [placements[joint].ctypes.data for joint in range(bodies)]:
        raise ModelError(
            "Pinocchio does not keep the placements of joints in one block of memory",
            expected="the version of `pin` that requirements.txt names",
        )
    inertias = list(model.inertias)
    inertial = np.zeros(23 * bodies)
    masses, levers, rotational, _, subtrees = np.split(inertial, np.array((1, 4, 13, 22)) * bodies)
    masses[1:] = [inertia.mass for inertia in inertias[1:]]
    levers[:] = np.concatenate([inertia.lever for inertia in inertias])
    rotational[:] = np.concatenate([inertia.inertia.ravel() for inertia in inertias])
    parents = np.array(list(model.parents), dtype=np.int64)
    subtrees[:] = masses
    for joint in range(bodies - 1, 0, -1):
        subtrees[parents[joint]] += subtrees[joint]
    return KinematicTree(
        jacobian=data.J.T,
        placements=placements,
        velocity=np.zeros(model.nv),
        parents=parents,
        inertial=inertial,
        masses=masses,
        levers=levers.reshape(bodies, 3),
        inertias=rotational.reshape(bodies, 3, 3),
        subtrees=subtrees,
        armature=np.zeros(model.nv),
        followers=followers,
    )


def _limits(values: list[float | None], absent: float) -> np.ndarray:
    return np.array([absent if value is None else value for value in values])


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a live view of an array that cannot be written to."""
    view = array.view()
    view.flags.writeable = False
    return view
