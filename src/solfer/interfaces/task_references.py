"""What others request of references: services, topics, and the action `reach`."""

from dataclasses import dataclass, field

from solfer.interfaces.geometry import Header, Pose, Turn, Vector


@dataclass(frozen=True)
class PositionReference:
    """A `geometry_msgs/PointStamped`."""

    header: Header = field(default_factory=Header)
    point: Vector = field(default_factory=Vector)

    @property
    def numbers(self) -> tuple[float, ...]:
        """The position [m]."""
        return (self.point.x, self.point.y, self.point.z)


@dataclass(frozen=True)
class OrientationReference:
    """A `geometry_msgs/QuaternionStamped`."""

    header: Header = field(default_factory=Header)
    quaternion: Turn = field(default_factory=lambda: Turn(w=0.0))

    @property
    def numbers(self) -> tuple[float, ...]:
        """The quaternion (x, y, z, w)."""
        turn = self.quaternion
        return (turn.x, turn.y, turn.z, turn.w)


@dataclass(frozen=True)
class PoseReference:
    """A `geometry_msgs/PoseStamped`."""

    header: Header = field(default_factory=Header)
    pose: Pose = field(default_factory=Pose)

    @property
    def numbers(self) -> tuple[float, ...]:
        """The position [m], then the quaternion (x, y, z, w)."""
        return numbers_of(self.pose)


REFERENCE_MESSAGES = {
    "position": ("geometry_msgs/PointStamped", PositionReference),
    "orientation": ("geometry_msgs/QuaternionStamped", OrientationReference),
    "pose": ("geometry_msgs/PoseStamped", PoseReference),
}
"""Message of a reference by its quantity."""


@dataclass(frozen=True)
class SetReference:
    """A reference, or a change of it.

    Attributes:
        task: Name of the task.
        values: Position [m], quaternion (x, y, z, w), or both, as the task has it.
        relative: Whether the values are added to the present reference; a quaternion turns it, in the same axes.
    """

    task: str = ""
    values: tuple[float, ...] = ()
    relative: bool = False


@dataclass(frozen=True)
class GetReference:
    """A question for a reference.

    Attributes:
        task: Name of the task.
    """

    task: str = ""


@dataclass(frozen=True)
class ReferenceReply:
    """Where a reference is to be.

    Attributes:
        success: Whether there is one.
        message: Why not, or why the task has come to rest away from it.
        values: Position [m], quaternion (x, y, z, w), or both, as the task has it.
    """

    success: bool = True
    message: str = ""
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class MovePoint:
    """A change of a position, with the fields of the original's service.

    Attributes:
        x, y, z: What is added to the reference position [m].
        nr: Number of the task among those with a position, from 0.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    nr: int = 0


@dataclass(frozen=True)
class ReachGoal:
    """Poses that tasks are to reach; of a pose counts what the task has.

    Attributes:
        tasks: Names of the tasks.
        poses: Their poses, one a task.
    """

    tasks: tuple[str, ...] = ()
    poses: tuple[Pose, ...] = ()


@dataclass(frozen=True)
class ReachFeedback:
    """How far the points of a goal are from it.

    Attributes:
        distances: Distances, one a task [m].
        angles: Angles, one a task [rad].
    """

    distances: tuple[float, ...] = ()
    angles: tuple[float, ...] = ()


@dataclass(frozen=True)
class ReachResult(ReachFeedback):
    """How far they were from it at the end."""


@dataclass(frozen=True)
class TaskReferences:
    """A `solfer/TaskReferences`: the references of tasks, one element for each task.

    Attributes:
        names: Names of the tasks.
        quantities: 'position', 'orientation' or 'pose': what a task has of its poses.
        frames: Frames of the poses: 'world', or a link; empty: none that has a name.
        links: Links that follow; empty: no single one.
        references: Where the references are.
        desired: Where they go.
    """

    names: tuple[str, ...] = ()
    quantities: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    references: tuple[Pose, ...] = ()
    desired: tuple[Pose, ...] = ()


def pose_of(quantity: str, numbers: tuple[float, ...]) -> Pose:
    """Make the pose of a position [m], a quaternion (x, y, z, w), or both; what it lacks is zero, and no turn."""
    place = Vector() if quantity == "orientation" else Vector(*numbers[:3])
    return Pose(place, Turn() if quantity == "position" else Turn(*numbers[-4:]))


def numbers_of(pose: Pose) -> tuple[float, ...]:
    """Return position [m] and quaternion (x, y, z, w) of a pose."""
    place = pose.position
    turn = pose.orientation
    return (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
