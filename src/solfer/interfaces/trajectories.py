"""Messages of joint-space trajectories, with the fields of trajectory_msgs and control_msgs."""

from dataclasses import dataclass, field

TRAJECTORY = "trajectory_msgs/JointTrajectory"
FOLLOW = "control_msgs/FollowJointTrajectory"

# codes of a FollowResult
SUCCESSFUL = 0
INVALID_GOAL = -1
INVALID_JOINTS = -2
OLD_HEADER_TIMESTAMP = -3
PATH_TOLERANCE_VIOLATED = -4
GOAL_TOLERANCE_VIOLATED = -5


@dataclass(frozen=True)
class TrajectoryHeader:
    """When a trajectory begins [s]; 0: at once."""

    stamp: float = 0.0


@dataclass(frozen=True)
class TrajectoryPoint:
    """One point: positions [rad, m], and perhaps velocities and accelerations, one for each joint.

    Attributes:
        time_from_start: When the joints are there, after the begin of the trajectory [s].
        effort: Not followed: has to be empty, or zero.
    """

    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    time_from_start: float = 0.0


@dataclass(frozen=True)
class JointTrajectory:
    """Points that joints go through; without points: the motion is cancelled."""

    header: TrajectoryHeader = field(default_factory=TrajectoryHeader)
    joint_names: tuple[str, ...] = ()
    points: tuple[TrajectoryPoint, ...] = ()


@dataclass(frozen=True)
class JointTolerance:
    """How far a joint may be from its trajectory [rad, rad/s, rad/s2]; 0 and -1: as far as it likes."""

    name: str = ""
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True)
class FollowGoal:
    """A trajectory with tolerances.

    Attributes:
        trajectory: The trajectory.
        path_tolerance: Tolerances on the way.
        goal_tolerance: Tolerances at the end.
        goal_time_tolerance: Time after the end of the trajectory until which `goal_tolerance` has to hold [s].
    """

    trajectory: JointTrajectory = field(default_factory=JointTrajectory)
    path_tolerance: tuple[JointTolerance, ...] = ()
    goal_tolerance: tuple[JointTolerance, ...] = ()
    goal_time_tolerance: float = 0.0


@dataclass(frozen=True)
class FollowFeedback:
    """Where the joints are desired, where they are, and the difference."""

    joint_names: tuple[str, ...] = ()
    desired: TrajectoryPoint = field(default_factory=TrajectoryPoint)
    actual: TrajectoryPoint = field(default_factory=TrajectoryPoint)
    error: TrajectoryPoint = field(default_factory=TrajectoryPoint)


@dataclass(frozen=True)
class FollowResult:
    """How a trajectory ended: a code, and one sentence."""

    error_code: int = SUCCESSFUL
    error_string: str = ""
