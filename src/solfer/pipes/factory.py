"""Makes the pipes of a configuration from their records and a context."""

from collections.abc import Callable
from typing import Any

from solfer.config.records.pipes import ControllerRecord, FeedbackRecord
from solfer.errors import PipeError
from solfer.pipes.body import factory as factory_body
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.contact import factory as factory_contact
from solfer.pipes.context import PipeContext
from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.pipes.joint import factory as factory_joint
from solfer.pipes.point import factory as factory_point

FEEDBACKS: dict[str, Callable[[Any, PipeContext], FeedbackPipe]] = {
    "JOINT": factory_joint.feedback,
    "OPERATIONAL": factory_body.feedback,
    "POINT": factory_point.feedback,
    "POINTS": factory_point.feedback,
    "CONTACT": factory_contact.feedback,
    "CONTACTS": factory_contact.feedback,
}
"""Factories of feedback pipes, by space."""

CONTROLLERS: dict[str, Callable[[Any, PipeContext], CommandPipe]] = {
    "JOINT": factory_joint.controller,
    "OPERATIONAL": factory_body.controller,
    "POINT": factory_point.controller,
    "POINTS": factory_point.controller,
    "CONTACT": factory_contact.controller,
    "CONTACTS": factory_contact.controller,
}
"""Factories of command pipes, by space."""


def feedback(record: FeedbackRecord, context: PipeContext) -> FeedbackPipe:
    """Make a feedback pipe.

    Raises:
        SolferError: The record requires something that the pipe, the Robot or the middleware does not support.
    """
    if record.source is None:
        raise PipeError(f"feedback '{record.name}' has no source", where=record.where(), expected="source: a topic")
    return FEEDBACKS[record.space](record, context)


def controller(record: ControllerRecord, context: PipeContext) -> CommandPipe:
    """Make a command pipe.

    Raises:
        SolferError: The record requires something that the pipe, the Robot or the middleware does not support.
    """
    if record.sink is None and not record.lower_level:
        raise PipeError(f"controller '{record.name}' has no sink", where=record.where(), expected="sink: a topic")
    return CONTROLLERS[record.space](record, context)
