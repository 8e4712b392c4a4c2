"""A recording that is played: what was published once is published again."""

from collections.abc import Iterable

import numpy as np

from solfer.errors import RecordingError, SolferError, UnknownName
from solfer.recording.kinds import part_of, topic_of
from solfer.recording.model import JOINTS_KIND, Channel, Recording
from solfer.robot import Robot
from solfer.robot.description.shipped import robot_of
from solfer.transport import BodyMessage, JointMessage, Middleware, Writer
from solfer.transport.messages import PointsMessage

MEASURED_CHANNEL = "measured/position"


class PlayedTopics:
    """Where a recording is published again.

    Args:
        middleware: Carries them.

    Attributes:
        states, base, odometry, wrenches: Of joints, true and estimated base, and forces of the ground.
    """

    def __init__(self, middleware: Middleware):
        self.states = middleware.writer("joint_states", "sensor_msgs/JointState")
        self.base = middleware.writer("floating_base", "nav_msgs/Odometry")
        self.odometry = middleware.writer("odometry/odom", "nav_msgs/Odometry")
        self.wrenches = middleware.writer("ground_forces", "solfer/RobotPoints")


class Playback:
    """Publishes the rows of a recording at a time, as the robot and its plugins did.

    Args:
        recording: The recording.
        middleware: Carries them.
        robot: The robot.

    Attributes:
        begin, end: First and last time of it [s].
        time: The present one [s].
        speed: Recorded seconds for each second.
        plays: Whether time goes on by itself.

    Raises:
        RecordingError: It has no measured joints.
    """

    def __init__(self, recording: Recording, middleware: Middleware, robot: Robot):
        self._recording = recording
        self._robot = robot
        self._joints = _widest_first(recording.filled)
        if not self._joints:
            raise RecordingError("no plugin measures joints", expected="a recording with <plugin>/measured/position")
        times = self._joints[0].times
        self.begin = float(times[0])
        self.end = float(times[-1])
        self.time = self.begin
        self.speed = 1.0
        self.plays = True
        self._topics = PlayedTopics(middleware)
        self._commands: list[tuple[Channel, Writer]] = []
        channels = recording.filled
        for channel in channels:
            plugin, _, rest = channel.name.partition("/")
            if channel.kind == JOINTS_KIND and rest.startswith("command/") and part_of(rest) == "position":
                topic = f"{plugin}_{topic_of(channel).rpartition('/')[2]}/command"
                self._commands.append((channel, middleware.writer(topic, "solfer/JointCommand")))
        poses = [each for each in channels if each.kind == "nav_msgs/Odometry"]
        self._truths = [each for each in poses if part_of(each.name) == "truth"]
        self._estimates = [each for each in poses if part_of(each.name) != "truth"]
        names = robot.contacts.names
        self._forces = {part_of(each.name): each for each in channels if part_of(each.name) in names}
        base = robot.kinematics.base
        self._chart = tuple(robot.dofs[:6]) if base is not None else ()

    def advance(self, step: float) -> None:
        """Let a time pass [s], and publish what was at that time."""
        if self.plays:
            self.seek(self.time + self.speed * step)
            self.plays = self.time < self.end
        self._publish()

    def seek(self, time: float) -> None:
        """Go to a time [s]."""
        self.time = min(max(time, self.begin), self.end)

    def names(self) -> list[str]:
        """See `PlottedColumns`."""
        return [f"{each.name}/{name}" for each in self._recording.filled for name in each.columns]

    def value(self, name: str) -> float:
        """See `PlottedColumns`."""
        channel = next((each for each in self._recording.channels.values() if name.startswith(f"{each.name}/")), None)
        column = name.removeprefix(f"{channel.name}/") if channel is not None else ""
        if channel is None or column not in channel.columns:
            return float("nan")
        return float(self._row(channel)[channel.columns.index(column)])

    def _row(self, channel: Channel) -> np.ndarray:
        """Return the newest row of a channel at the present time, shape (columns,)."""
        row: np.ndarray = channel.values[max(int(np.searchsorted(channel.times, self.time, side="right")) - 1, 0)]
        return row

    def _publish(self) -> None:
        known: dict[str, float] = {}
        for channel in reversed(self._joints):
            known |= dict(zip(channel.columns, self._row(channel).tolist(), strict=True))
        joints = tuple(name for name in known if name not in self._chart)
        self._topics.states.write(JointMessage(joints, position=np.array([known[name] for name in joints])))
        self._publish_base(known)
        for channel, writer in self._commands:
            writer.write(JointMessage(channel.columns, position=self._row(channel).copy()))
        if self._forces:
            values = np.array([self._row(each) for each in self._forces.values()])
            self._topics.wrenches.write(PointsMessage("world", tuple(self._forces), values))

    def _publish_base(self, known: dict[str, float]) -> None:
        chart = self._robot.kinematics.base
        link = self._robot.kinematics.base_link
        if chart is None or link is None:
            return
        for channel in self._truths[:1]:
            row = self._row(channel)
            if np.isfinite(row[:7]).all():
                self._topics.base.write(BodyMessage(channel.frame, link, row[:3].copy(), orientation=row[3:7].copy()))
        for channel in self._estimates[:1]:
            row = self._row(channel)
            self._topics.odometry.write(
                BodyMessage(channel.frame, channel.child, row[:3].copy(), orientation=row[3:7].copy())
            )
        if not self._truths and not self._estimates:
            numbers = np.array([known.get(name, 0.0) for name in self._chart])
            position, orientation = chart.to_pose(numbers)
            self._topics.base.write(BodyMessage("world", link, np.array(position), orientation=np.array(orientation)))


def robot_of_recording(recording: Recording) -> Robot:
    """Load the robot that a recording describes, with the contacts of the shipped robot of its name.

    Raises:
        RecordingError: It describes none.
    """
    widest = next(iter(_widest_first(recording.channels.values())), None)
    plugin = widest.name.partition("/")[0] if widest is not None else ""
    texts = [recording.attachments.get(f"{plugin}/robot.{kind}") for kind in ("urdf", "srdf")]
    if texts[0] is None:
        raise RecordingError("it has no robot", expected=f"an attachment '{plugin}/robot.urdf', or --robot")
    urdf, srdf = (None if each is None else each.decode() for each in texts)
    assert urdf is not None
    plain = Robot.load(urdf, srdf)
    try:
        contacts = robot_of(plain.name)[1].contacts
        return Robot.load(urdf, srdf, contacts=contacts)
    except (UnknownName, SolferError):  # a part of it, or another robot
        return plain


def _widest_first(channels: Iterable[Channel]) -> list[Channel]:
    """Return the channels of measured positions, those of most joints first."""
    found = [each for each in channels if each.name.partition("/")[2] == MEASURED_CHANNEL]
    return sorted(found, key=lambda channel: -len(channel.columns))
