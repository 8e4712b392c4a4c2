"""Pipes: from States to messages of named numbers and back. No transport."""

from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.context import PipeContext
from solfer.pipes.feedback_pipe import FeedbackPipe, StateFeedbackPipe
from solfer.pipes.joint.pipes import JointCommandPipe, JointFeedbackPipe

__all__ = [
    "CommandPipe",
    "FeedbackPipe",
    "JointCommandPipe",
    "JointFeedbackPipe",
    "StateFeedbackPipe",
    "PipeContext",
]
