"""The stand-in for XBotCore: shared memory between processes, without ROS."""

from solfer.middleware.shared_memory.memory.namespace import Namespace
from solfer.middleware.shared_memory.middleware import XbotMiddleware

__all__ = ["Namespace", "XbotMiddleware"]
