"""What components declare besides services, on any middleware: topics, actions and parameters."""

from solfer.transport.declared.action_client import ActionClient, Goal
from solfer.transport.declared.binding import Bindings, bind
from solfer.transport.declared.goals import GoalStatus

__all__ = ["ActionClient", "Bindings", "Goal", "GoalStatus", "bind"]
