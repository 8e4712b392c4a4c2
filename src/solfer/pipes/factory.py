"""Makes the pipes of a configuration: a record and its surroundings in, a pipe out."""

from collections.abc import Callable

from solfer.config.pipes import ControllerRecord, FeedbackRecord
from solfer.errors import PipeError
from solfer.pipes import factory_body, factory_contact, factory_joint, factory_point
from solfer.pipes.controller import Controller
from solfer.pipes.feedback import Feedback
from solfer.pipes.surroundings import Surroundings

FEEDBACKS: dict[str, Callable[[FeedbackRecord, Surroundings], Feedback]] = {
    "JOINT": factory_joint.feedback,
    "OPERATIONAL": factory_body.feedback,
    "POINT": factory_point.feedback,
    "POINTS": factory_point.feedback,
    "CONTACT": factory_contact.feedback,
    "CONTACTS": factory_contact.feedback,
}
"""What makes a pipe in, by its space."""

CONTROLLERS: dict[str, Callable[[ControllerRecord, Surroundings], Controller]] = {
    "JOINT": factory_joint.controller,
    "OPERATIONAL": factory_body.controller,
    "POINT": factory_point.controller,
    "POINTS": factory_point.controller,
    "CONTACT": factory_contact.controller,
    "CONTACTS": factory_contact.controller,
}
"""What makes a pipe out, by its space."""


def feedback(record: FeedbackRecord, surroundings: Surroundings) -> Feedback:
    """A pipe in.

    Raises:
        SolferError: The record asks for something that the pipe, the Robot or the middleware cannot give.
    """
    if record.source is None:
        raise PipeError(f"feedback '{record.name}' has no source", where=record.where(), expected="source: a topic")
    return FEEDBACKS[record.space](record, surroundings)


def controller(record: ControllerRecord, surroundings: Surroundings) -> Controller:
    """A pipe out.

    Raises:
        SolferError: The record asks for something that the pipe, the Robot or the middleware cannot give.
    """
    if record.sink is None and not record.lower_level:
        raise PipeError(f"controller '{record.name}' has no sink", where=record.where(), expected="sink: a topic")
    return CONTROLLERS[record.space](record, surroundings)
