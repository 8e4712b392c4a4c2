"""Forwards topics and services between two middlewares, such as the real-time layer's and ROS."""

from solfer.middleware.bridge.bridge import Bridge, BridgeSearch
from solfer.middleware.bridge.routes import Route, routes
from solfer.middleware.bridge.services import ServiceForward

__all__ = ["Bridge", "BridgeSearch", "ServiceForward", "Route", "routes"]
