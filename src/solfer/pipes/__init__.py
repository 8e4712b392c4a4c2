"""Pipes: from States to messages of named numbers and back. No transport."""

from solfer.pipes.command_pipe import CommandPipe
from solfer.pipes.context import PipeContext
from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.pipes.joint.pipes import JointCommandPipe, JointFeedbackPipe
from solfer.pipes.state_feedback_pipe import StateFeedbackPipe

__all__ = [
    "CommandPipe",
    "FeedbackPipe",
    "JointCommandPipe",
    "JointFeedbackPipe",
    "StateFeedbackPipe",
    "PipeContext",
]
