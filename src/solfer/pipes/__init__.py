"""States to named numbers and back; what a middleware has to offer. No transport."""

from solfer.pipes.controller import Controller
from solfer.pipes.endpoints import Queue, Reader, Status, Writer
from solfer.pipes.feedback import Feedback, StateFeedback
from solfer.pipes.inbox import Inbox
from solfer.pipes.joint import JointController, JointFeedback
from solfer.pipes.messages import BodyMessage, ImuMessage, JointMessage, WrenchMessage, canonical
from solfer.pipes.middleware import Middleware
from solfer.pipes.surroundings import Surroundings

__all__ = [
    "BodyMessage",
    "ImuMessage",
    "Controller",
    "Feedback",
    "Inbox",
    "JointController",
    "JointFeedback",
    "JointMessage",
    "Middleware",
    "Queue",
    "Reader",
    "StateFeedback",
    "Status",
    "Surroundings",
    "WrenchMessage",
    "Writer",
    "canonical",
]
