"""Makes pipes that carry Robot Points to and from the ports of a component."""

from collections.abc import Mapping

from solfer.config.kinds.point import PointControllerRecord, PointFeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.interfaces.port import Port
from solfer.pipes.context import PipeContext, message_of
from solfer.pipes.point.notation import PointNotation
from solfer.pipes.point.pipes import PointCommandPipe, PointFeedbackPipe, PointFormat


def feedback(record: PointFeedbackRecord, context: PipeContext) -> PointFeedbackPipe:
    """Make a pipe from a topic to an input of the component; see `factory.feedback`."""
    port = _port(record, context, "input", ports=context.inputs)
    reader = context.middleware.reader(record.source, _message(record))
    notation = None if record.convention is None else PointNotation(record.convention, record.output_angles)
    received = PointFormat(record.frame, record.names, notation)
    return PointFeedbackPipe(record.name, reader, port, received=received, required=record.initialize)


def controller(record: PointControllerRecord, context: PipeContext) -> PointCommandPipe:
    """Make a pipe from an output of the component to a topic; see `factory.controller`."""
    port = _port(record, context, "output", ports=context.outputs)
    writer = context.writer(record.sink, _message(record))
    notation = None if record.convention is None else PointNotation(record.convention)
    return PointCommandPipe(record.name, writer, port, published=PointFormat(record.frame, record.names, notation))


def _message(record: PointFeedbackRecord | PointControllerRecord) -> str:
    return message_of(record, (record.default_message,), f"Point of the quantity '{record.quantity}'")


def _port(
    record: PointFeedbackRecord | PointControllerRecord, context: PipeContext, kind: str, ports: Mapping[str, Port]
) -> Port:
    """Look up the component's port of the pipe's name, and check that the pipe fits it."""
    links = context.robot.description.links
    if record.link is not None and record.link not in links:
        raise UnknownName("link", record.link, links, where=record.where("link"))
    if record.name not in ports:
        raise UnknownName(f"{kind} of the component", record.name, ports, where=record.where())
    port = ports[record.name]
    if port.quantity != record.quantity:
        raise PipeError(
            f"the {kind} '{record.name}' is not of the quantity '{record.quantity}'",
            where=record.where("quantity"),
            expected=f"quantity: {port.quantity}",
        )
    if port.count != record.size:
        raise PipeError(
            f"the {kind} '{record.name}' does not hold {record.size or 'a single one'}",
            where=record.where("names" if record.names else "count"),
            expected="space: POINT" if port.count is None else f"space: POINTS, {port.count} of them",
        )
    return port
