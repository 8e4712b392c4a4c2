"""Algorithms: a Robot in, a Robot out. No pipes, no ROS, no shared memory."""

from solfer.components.base import Component
from solfer.interfaces.declaration import Action, LiveParameter, Outcome, Parameter, Service, TopicIn, TopicOut
from solfer.interfaces.port import Port

__all__ = ["Action", "Component", "LiveParameter", "Outcome", "Parameter", "Port", "Service", "TopicIn", "TopicOut"]
