"""The scene of a robot, kept up to date by topics."""

from collections.abc import Iterator

import numpy as np

from solfer.interfaces.geometry import Pose, bare_frame
from solfer.interfaces.support import SupportMargins
from solfer.interfaces.task_references import TaskReferences, numbers_of
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.robot import Robot
from solfer.transport import JointMessage, Middleware, Reader
from solfer.transport.declared.fields import value_of
from solfer_tools.scene.discovery import STALE_AGE, DiscoveredTopics
from solfer_tools.scene.polygon import hull, shrunk
from solfer_tools.scene.state import ContactForce, ScenePose, SceneState, ShownReference

WORLD = "world"

FRICTION = 0.8
"""Coefficient of friction of the ground, unless another one is given."""


class LiveScene:
    """Reads what a robot, its lower level and its plugins publish, and makes the poses of all that is drawn of it.

    Args:
        robot: The robot, for this scene alone.
        middleware: Carries the topics.
        friction: Coefficient of friction of the ground.
    """

    def __init__(self, robot: Robot, middleware: Middleware, friction: float = FRICTION):
        self._robot = robot
        self._desired = robot.twin()
        self._friction = friction
        self._places = {name: index for index, name in enumerate(robot.dofs)}
        # of plugins and controllers, by the last part of the names of topics
        messages = {
            "command": "solfer/JointCommand",
            "references": "solfer/TaskReferences",
            "support_margins": "solfer/SupportMargins",
        }
        self._discovered = DiscoveredTopics(middleware, messages)
        self._joints = middleware.reader("joint_states", "sensor_msgs/JointState")
        floats = robot.kinematics.base is not None
        bases = ("floating_base", "odometry/odom") if floats else ()  # the first with a message counts
        self._bases = [middleware.reader(topic, "nav_msgs/Odometry") for topic in bases]
        self._wrenches = {
            record.name: middleware.reader(record.topic, "geometry_msgs/WrenchStamped")
            for record in robot.contact_records
            if record.topic
        }
        self._estimates = middleware.reader("ground_forces", "solfer/RobotPoints")
        self._path = _Path()
        self._estimated_path = _Path()
        self._frame = WORLD

    def update(self) -> SceneState | None:
        """Read what is new; None while joints, or the base of a robot that floats, are not known."""
        self._discovered.update()
        if not _is_fresh(self._joints) or not self._read_base():
            return None
        robot = self._robot
        self._write(self._joints.message, robot.state.position)
        robot.update()
        measured = _poses(robot)
        forces = tuple(self._forces(measured))
        polygon, inner = self._polygon(forces)
        center = robot.kinematics.center_of_mass.copy()
        ground = polygon[:, 2].min() if len(polygon) else 0.0
        return SceneState(
            self._frame,
            measured,
            self._desired_poses(),
            center=center,
            projection=np.array((*center[:2], ground)),
            polygon=polygon,
            inner=inner,
            forces=forces,
            friction=self._friction,
            references=tuple(self._references(measured)),
            path=self._base_path(),
            estimated_path=self._estimated(),
        )

    def _read_base(self) -> bool:
        if not self._bases:
            return True
        kinematics = self._robot.kinematics
        for reader in self._bases:
            if _is_fresh(reader) and bare_frame(reader.message.child) == kinematics.base_link:
                message = reader.message
                frame = bare_frame(message.frame)
                kinematics.base.from_pose(message.position, message.orientation, self._robot.state.position[:6])
                if frame != self._frame:
                    self._path = _Path()
                self._frame = frame
                return True
        return False

    def _write(self, message: JointMessage, position: np.ndarray) -> None:
        """Write the positions of a message that belong to the robot."""
        if message.position is None:
            return
        for name, value in zip(message.names, message.position.tolist(), strict=True):
            place = self._places.get(name)
            if place is not None and np.isfinite(value):
                position[place] = value

    def _desired_poses(self) -> dict[str, ScenePose]:
        commands = [reader.message for reader in self._discovered.newest("command").values()]
        if not commands:
            return {}
        self._desired.state.position[:] = self._robot.state.position
        for message in commands:
            self._write(message, self._desired.state.position)
        self._desired.update()
        return _poses(self._desired)

    def _forces(self, measured: dict[str, ScenePose]) -> Iterator[ContactForce]:
        """Yield the forces that are measured, else those that are estimated."""
        estimates = self._estimates.message if _is_fresh(self._estimates) else None
        for name, contact in zip(self._robot.contacts.names, self._robot.contacts, strict=True):
            reader = self._wrenches.get(name)
            if reader is not None and _is_fresh(reader):
                wrench = reader.message
                axes = measured.get(bare_frame(wrench.frame))
                force = wrench.force.copy() if axes is None else axes.rotation @ wrench.force
            elif estimates is not None and name in estimates.names:
                force = estimates.values[estimates.names.index(name), :3].copy()
            else:
                continue
            carries = bool(force[2] >= 5.0)  # [N]
            yield ContactForce(name, contact.value.copy(), force, touches=carries)

    def _polygon(self, forces: tuple[ContactForce, ...]) -> tuple[np.ndarray, np.ndarray]:
        nothing = np.zeros((0, 3))
        contacts = self._robot.contacts
        records = self._robot.contact_records
        if not records:
            return nothing, nothing
        known = {force.contact: force.touches for force in forces}
        # up to here one without a known force is on the ground
        ground = contacts.positions[:, 2].min() + 0.05
        touching = [each for each in records if known.get(each.name, contacts[each.name].value[2] <= ground)]
        points = np.array([contacts[record.name].value for record in touching]).reshape(-1, 3)
        corners = hull(points)
        if len(corners) < 3:
            return nothing, nothing
        polygon = points[corners]
        limits = self._margins()
        links = [touching[index].end_frame for index in corners]
        edges = [frozenset(edge) for edge in zip(links, links[1:] + links[:1], strict=True)]
        if not any(edge in limits for edge in edges):
            return polygon, nothing
        return polygon, shrunk(polygon, [limits.get(edge, 0.0) for edge in edges])

    def _margins(self) -> dict[frozenset[str], float]:
        """Return the margins of edges between two links [m]."""
        limits: dict[frozenset[str], float] = {}
        for reader in self._discovered.newest("support_margins").values():
            message: SupportMargins = value_of(SupportMargins, reader.message)
            for name, limit in zip(message.names, message.limits, strict=False):
                kind, _, edge = name.partition(" ")
                if kind == "margin":
                    limits[frozenset(edge.split("-"))] = limit
        return limits

    def _references(self, measured: dict[str, ScenePose]) -> Iterator[ShownReference]:
        origin = ScenePose(np.zeros(3), np.eye(3))
        frames = {**measured, WORLD: origin}
        for module, reader in self._discovered.newest("references").items():
            message: TaskReferences = value_of(TaskReferences, reader.message)
            parts = (message.names, message.quantities, message.frames, message.links)
            for task, quantity, frame, link, own, desired in zip(
                *parts, message.references, message.desired, strict=False
            ):
                if frame not in frames:
                    continue
                poses = [_pose(own), _pose(desired)]
                if quantity == "orientation" and link in measured:  # it is shown where its link is
                    place = frames[frame].seen(measured[link].position)
                    poses = [ScenePose(place, pose.rotation) for pose in poses]
                placed = [frames[frame].of(pose) for pose in poses]
                yield ShownReference(module, task, quantity, frame, poses[0], *placed)

    def _base_path(self) -> np.ndarray:
        link = self._robot.kinematics.base_link
        if link is not None:
            self._path.add(self._robot.kinematics.position(link))
        return self._path.points

    def _estimated(self) -> np.ndarray:
        """Return the path that is estimated, where another topic has the pose of the base."""
        reader = self._bases[-1] if self._bases else None
        if reader is not None and _is_fresh(reader) and bare_frame(reader.message.frame) != self._frame:
            self._estimated_path.add(reader.message.position)
        return self._estimated_path.points


class _Path:
    """Where something has been.

    Attributes:
        points: Shape (m, 3) [m].
    """

    def __init__(self) -> None:
        self.points = np.zeros((0, 3))

    def add(self, position: np.ndarray) -> None:
        """Add a position, if it is not near the last one."""
        if not len(self.points) or np.linalg.norm(position - self.points[-1]) >= 0.02:  # [m]
            self.points = np.concatenate((self.points[1 - 2000 :], position[None]))


def _is_fresh(reader: Reader) -> bool:
    """Read the newest message, and return whether it counts."""
    reader.read()
    return reader.age() <= STALE_AGE


def _poses(robot: Robot) -> dict[str, ScenePose]:
    kinematics = robot.kinematics
    return {
        link: ScenePose(kinematics.position(link).copy(), kinematics.rotation(link).copy())
        for link in robot.description.links
    }


def _pose(pose: Pose) -> ScenePose:
    numbers = numbers_of(pose)
    return ScenePose(np.array(numbers[:3]), rotation_from_quaternion(numbers[3:]))
