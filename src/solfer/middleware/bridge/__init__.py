"""Hands topics and services on between two middlewares, such as the real-time layer's and ROS."""

from solfer.middleware.bridge.bridge import Bridge
from solfer.middleware.bridge.forwarding import Offer
from solfer.middleware.bridge.routes import Route, routes

__all__ = ["Bridge", "Offer", "Route", "routes"]
