"""Makes the pipes of a configuration from their records and a context."""

from solfer.config.records.pipes import ControllerRecord, FeedbackRecord
from solfer.errors import PipeError
from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.context import PipeContext
from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.pipes.kinds import PIPE_KINDS


def feedback(record: FeedbackRecord, context: PipeContext) -> FeedbackPipe:
    """Make a feedback pipe.

    Raises:
        SolferError: The record requires something that the pipe, the Robot or the middleware does not support.
    """
    if record.source is None:
        raise PipeError(f"feedback '{record.name}' has no source", where=record.where(), expected="source: a topic")
    return PIPE_KINDS[record.space].feedback(record, context)


def controller(record: ControllerRecord, context: PipeContext) -> CommandPipe:
    """Make a command pipe.

    Raises:
        SolferError: The record requires something that the pipe, the Robot or the middleware does not support.
    """
    if record.sink is None and not record.lower_level:
        raise PipeError(f"controller '{record.name}' has no sink", where=record.where(), expected="sink: a topic")
    return PIPE_KINDS[record.space].controller(record, context)
