"""The stand-in for XBotCore: shared memory between processes, without ROS."""

from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.segments.namespace import Namespace

__all__ = ["Namespace", "XbotMiddleware"]
