"""Makes pipes that carry Robot Points to and from the ports of a component."""

from collections.abc import Mapping

from solfer.components.port import Port
from solfer.config.points import PointControllerRecord, PointFeedbackRecord, PointTags
from solfer.errors import PipeError, UnknownName
from solfer.pipes.messages import POINTS
from solfer.pipes.point import PointController, PointFeedback
from solfer.pipes.surroundings import Surroundings, message_of

MESSAGES = {
    "position": "geometry_msgs/PointStamped",
    "orientation": "geometry_msgs/QuaternionStamped",
    "pose": "geometry_msgs/PoseStamped",
    "twist": "geometry_msgs/TwistStamped",
    "wrench": "geometry_msgs/WrenchStamped",
    "velocity": "geometry_msgs/Vector3Stamped",
    "acceleration": "geometry_msgs/Vector3Stamped",
    "force": "geometry_msgs/Vector3Stamped",
    "torque": "geometry_msgs/Vector3Stamped",
}
"""Message of a single Point by its quantity."""


def feedback(record: PointFeedbackRecord, surroundings: Surroundings) -> PointFeedback:
    """Points from a topic to an input of the component; see `factory.feedback`."""
    port = _port(record, surroundings, "input", surroundings.inputs)
    reader = surroundings.middleware.reader(record.source, _message(record))
    return PointFeedback(record.name, reader, port, record.frame, record.names, record.initialize)


def controller(record: PointControllerRecord, surroundings: Surroundings) -> PointController:
    """Points from an output of the component to a topic; see `factory.controller`."""
    port = _port(record, surroundings, "output", surroundings.outputs)
    writer = surroundings.writer(record.sink, _message(record))
    return PointController(record.name, writer, port, record.frame, record.names)


def _message(record: PointTags) -> str:
    message = MESSAGES[record.quantity] if record.size is None else POINTS
    return message_of(record, message, (message,), f"Point of the quantity '{record.quantity}'")


def _port(record: PointTags, surroundings: Surroundings, kind: str, ports: Mapping[str, Port]) -> Port:
    """The component's port of the pipe's name, if it is what the pipe carries."""
    links = surroundings.robot.description.links
    if record.link is not None and record.link not in links:
        raise UnknownName("link", record.link, links, where=record.where("link"))
    if record.name not in ports:
        raise UnknownName(f"{kind} of the component", record.name, ports, where=record.where())
    port = ports[record.name]
    if port.quantity != record.quantity:
        raise PipeError(f"the {kind} '{record.name}' is no {record.quantity}", where=record.where("quantity"),
                        expected=f"quantity: {port.quantity}")
    if port.count != record.size:
        raise PipeError(f"the {kind} '{record.name}' does not hold {record.size or 'a single one'}",
                        where=record.where("names" if record.names else "count"),
                        expected="space: POINT" if port.count is None else f"space: POINTS, {port.count} of them")
    return port
