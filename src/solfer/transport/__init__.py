"""The interface of a middleware: messages, endpoints, services, and the inbox of calls."""

from solfer.transport.endpoints import MessageStatus, Queue, Reader, Writer
from solfer.transport.inbox import Inbox
from solfer.transport.messages import BodyMessage, ImuMessage, JointMessage, WrenchMessage, canonical
from solfer.transport.middleware import Middleware

__all__ = [
    "BodyMessage",
    "ImuMessage",
    "Inbox",
    "JointMessage",
    "MessageStatus",
    "Middleware",
    "Queue",
    "Reader",
    "WrenchMessage",
    "Writer",
    "canonical",
]
