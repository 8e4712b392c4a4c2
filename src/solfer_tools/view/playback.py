"""A recording that is played: what was published once is published again."""

from collections.abc import Iterable, Iterator

import numpy as np

from solfer.errors import RecordingError, SolferError, UnknownName
from solfer.recording.kinds import part_of, topic_of
from solfer.recording.model import JOINTS_KIND, Channel, Event
from solfer.recording.reading.pieces import RecordingPieces
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
        pieces: The recording.
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

    def __init__(self, pieces: RecordingPieces, middleware: Middleware, robot: Robot):
        self._pieces = pieces
        self._robot = robot
        self._joints = _widest_first(pieces.channels)
        if not self._joints:
            raise RecordingError("no plugin measures joints", expected="a recording with <plugin>/measured/position")
        self.begin = pieces.begin
        self.end = pieces.end
        self.time = self.begin
        self.speed = 1.0
        self.plays = True
        self._topics = PlayedTopics(middleware)
        self._commands: list[tuple[Channel, Writer]] = []
        channels = pieces.channels
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

    def next_events(self) -> list[Event]:
        """See `RecordingPieces.next_events`."""
        return self._pieces.next_events()

    def names(self) -> list[str]:
        """See `PlottedColumns`."""
        return [f"{each.name}/{name}" for each in self._pieces.channels for name in each.columns]

    def value(self, name: str) -> float:
        """See `PlottedColumns`."""
        channel = next((each for each in self._pieces.channels if name.startswith(f"{each.name}/")), None)
        column = name.removeprefix(f"{channel.name}/") if channel is not None else ""
        if channel is None or column not in channel.columns:
            return float("nan")
        row = self._row(channel)
        return float("nan") if row is None else float(row[channel.columns.index(column)])

    def _row(self, channel: Channel) -> np.ndarray | None:
        """Return the newest row of a channel at the present time, shape (columns,); None: it has none around it."""
        found = self._pieces.at(self.time).get(channel.name)
        if found is None:
            return None
        row: np.ndarray = found.values[max(int(np.searchsorted(found.times, self.time, side="right")) - 1, 0)]
        return row

    def _rows(self, channels: Iterable[Channel]) -> Iterator[tuple[Channel, np.ndarray]]:
        """Yield the channels that have a row, with it."""
        for channel in channels:
            row = self._row(channel)
            if row is not None:
                yield channel, row

    def _publish(self) -> None:
        known: dict[str, float] = {}
        for channel, row in self._rows(reversed(self._joints)):
            known |= dict(zip(channel.columns, row.tolist(), strict=True))
        joints = tuple(name for name in known if name not in self._chart)
        if not joints:
            return
        self._topics.states.write(JointMessage(joints, position=np.array([known[name] for name in joints])))
        self._publish_base(known)
        for channel, writer in self._commands:
            for _, row in self._rows((channel,)):
                writer.write(JointMessage(channel.columns, position=row.copy()))
        forces = {name: row for name, channel in self._forces.items() for _, row in self._rows((channel,))}
        if forces:
            self._topics.wrenches.write(PointsMessage("world", tuple(forces), np.array(list(forces.values()))))

    def _publish_base(self, known: dict[str, float]) -> None:
        chart = self._robot.kinematics.base
        link = self._robot.kinematics.base_link
        if chart is None or link is None:
            return
        for channel, row in self._rows(self._truths[:1]):
            if np.isfinite(row[:7]).all():
                self._topics.base.write(BodyMessage(channel.frame, link, row[:3].copy(), orientation=row[3:7].copy()))
        for channel, row in self._rows(self._estimates[:1]):
            self._topics.odometry.write(
                BodyMessage(channel.frame, channel.child, row[:3].copy(), orientation=row[3:7].copy())
            )
        if not self._truths and not self._estimates:
            numbers = np.array([known.get(name, 0.0) for name in self._chart])
            position, orientation = chart.to_pose(numbers)
            self._topics.base.write(BodyMessage("world", link, np.array(position), orientation=np.array(orientation)))


def robot_of_recording(pieces: RecordingPieces) -> Robot:
    """Load the robot that a recording describes, with the contacts of the shipped robot of its name.

    Raises:
        RecordingError: It describes none.
    """
    widest = next(iter(_widest_first(pieces.channels)), None)
    plugin = widest.name.partition("/")[0] if widest is not None else ""
    texts = [pieces.attachments.get(f"{plugin}/robot.{kind}") for kind in ("urdf", "srdf")]
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
