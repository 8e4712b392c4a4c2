"""The stand-in for XBotCore: shared memory between processes, without ROS."""

from solfer.middleware.xbot.middleware import XbotMiddleware
from solfer.middleware.xbot.namespace import Namespace

__all__ = ["Namespace", "XbotMiddleware"]
